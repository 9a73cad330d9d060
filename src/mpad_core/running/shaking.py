r"""Thermal motion of one group of cells over a sub-step: random loads and Fixman's midpoint, compiled.

Overdamped Langevin motion under the mobility M(x), dX = M F dt + kT ∇·M dt + (2kT)^½ M^½ dW, is had at the level of
resistance: with R = M⁻¹ = L Lᵀ at the sub-step's start x and w the increments of independent Brownian paths over dt,

    f_B = (2kT)^½ L w/dt,    U* = M(x) f_B,    ΔX = M(x + U* dt/2) (F + f_B) dt

(Fixman, J. Chem. Phys. 69 (1978) 1527; Banchio and Brady, J. Chem. Phys. 118 (2003) 10323). The random load has no
mean, and ⟨f_B f_Bᵀ⟩ = 2kT R/dt, so in the mean of the random part, to first order in dt and with ∂_k M at x,

    ⟨ΔX_i⟩ = ½ dt² ∂_k M_ij M_kl ⟨f_l f_j⟩ = kT dt ∂_k M_ij M_kl R_lj = kT dt ∂_j M_ij:

the drift kT ∇·M without a formula for it. M = (r(h) + C)⁻¹ changes within a burst through the heights alone, hence only
heights are moved to the midpoint; what the frozen C leaves out of ∇·M is a load that the coupling brings along (see
`mpad_core.physics.fluctuations`).

Paths are functions of (key, cell, component, sub-step): a sub-step that is split because it was too long goes on along
the same paths by dyadic Brownian bridges (Lévy's construction), since drawing anew would favour what makes short steps.
That is not enough: the drift stands in the squares of the increments, so splitting whatever came out large would lose
part of it. Parts are therefore chosen from the gaps at their start (`longest_part`), with which the noise has nothing
to do, and short enough that what comes out too large is a matter of five standard deviations.
"""

import math

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_lean, compiled_where_present
from mpad_core.numerics.streams import Stream, Word, mixed, normal_pair
from mpad_core.running.layout import Bodies, Groups, Thermal, Work
from mpad_core.running.resisting import is_positive_definite, resistance

TICKS = 1 << 30  # a sub-step is never split finer, and events fall on these: 1 ps of 1 ms
GAP_SHARE = 0.2  # of the gap to the wall that one sub-step may cross
SHAKEN_SHARE = 0.5  # the same where there is thermal motion
RMS_SHARE = 0.1  # of the gap that thermal motion crosses in one part, root mean square
_THERMAL = int(Stream.THERMAL)


@compiled_lean
def path(key: Word, owner: Word, pair: int, step: int, tick: int) -> tuple[float, float]:
    """Give two Brownian paths of variance t at t = tick/TICKS of sub-step `step`; pairs 0 to 2 are a cell's six."""
    if tick == 0:
        return 0.0, 0.0
    low, high, node = 0, TICKS, 1
    x_low, y_low = 0.0, 0.0
    x_high, y_high = normal_pair(key, _THERMAL, mixed(owner, pair), step)
    while tick < high:
        middle = (low + high) // 2
        deviation = math.sqrt((high - low) / (4 * TICKS))
        x, y = normal_pair(key, _THERMAL, mixed(owner, 4 * node + pair), step)
        x = 0.5 * (x_low + x_high) + deviation * x
        y = 0.5 * (y_low + y_high) + deviation * y
        if tick <= middle:
            high, x_high, y_high, node = middle, x, y, 2 * node
        else:
            low, x_low, y_low, node = middle, x, y, 2 * node + 1
    return x_high, y_high


@compiled_where_present()
def draw(
    thermal: Thermal, group: int, groups: Groups, key: Word, step: int, first: int, last: int, dt: float, noise: Array
) -> None:
    """Write the increments (s^½) of a group's paths from tick to tick of a sub-step of dt into the first 6n places."""
    start, end = groups.first[group], groups.first[group + 1]
    for k in range(3 * (end - start)):
        owner = thermal.owner[groups.cells[start + k // 3]]
        x_from, y_from = path(key, owner, k % 3, step, first)
        x_to, y_to = path(key, owner, k % 3, step, last)
        noise[2 * k] = math.sqrt(dt) * (x_to - x_from)
        noise[2 * k + 1] = math.sqrt(dt) * (y_to - y_from)


@compiled_where_present(otherwise=TICKS)
def longest_part(thermal: Thermal, group: int, dt: float, bodies: Bodies, groups: Groups, gaps: Array) -> int:
    """Give over how many ticks of a sub-step of dt heat may move a group at gaps (N,).

    A lone cell's mobility across the gap g is at most min(g/a, 1)/(6πηa).
    """
    ticks = TICKS
    for i in range(groups.first[group], groups.first[group + 1]):
        cell = groups.cells[i]
        radius, gap = bodies.radius[cell], gaps[cell] + bodies.wall_offset
        mobility = min(gap / radius, 1.0) / (6 * math.pi * bodies.viscosity * radius)
        square = 2 * thermal.energy * mobility * dt / TICKS
        while ticks > 1 and square * ticks > (RMS_SHARE * gap) ** 2:
            ticks //= 2
    return ticks


@compiled_where_present(otherwise=True)
def shake(thermal: Thermal, group: int, dt: float, bodies: Bodies, groups: Groups, gaps: Array, work: Work) -> bool:
    """Write a group's resistance at the midpoint, and the random load beside it; tell whether dt is short enough.

    Parameters
    ----------
    gaps : (N,)
        Of all cells to the wall, at the start.
    work
        Its noise is from `draw`, over dt; matrix and right are written.
    """
    matrix, right, noise, push, star, middle = work.matrix, work.right, work.noise, work.push, work.star, work.gaps
    resistance(group, bodies, groups, gaps, work.functions, matrix, right)
    m = matrix.shape[0]
    if not is_positive_definite(matrix):
        return False
    strength = math.sqrt(2 * thermal.energy) / dt
    for i in range(m):
        push[i] = 0.0
        for j in range(i + 1):
            push[i] += strength * matrix[i, j] * noise[j]
    for i in range(m - 1, -1, -1):  # U* = L⁻ᵀ w (2kT)^½/dt
        star[i] = strength * noise[i]
        for j in range(i + 1, m):
            star[i] -= matrix[j, i] * star[j]
        star[i] /= matrix[i, i]
    for place in range(m // 6):
        cell = groups.cells[groups.first[group] + place]
        change = 0.5 * dt * star[6 * place + 2]
        if not abs(change) <= SHAKEN_SHARE * (gaps[cell] + bodies.wall_offset):
            return False
        middle[cell] = gaps[cell] + change
    resistance(group, bodies, groups, middle, work.functions, matrix, right)
    for i in range(m):
        right[i] += push[i]
    return True
