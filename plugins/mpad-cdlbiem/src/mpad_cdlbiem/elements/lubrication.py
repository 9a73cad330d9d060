"""What elements miss of resistance near contact, without counting twice what they have.

For each near pair in unbounded fluid, and each sphere at the wall, both alone: the exact resistance and load less those
by elements (Durlofsky, Brady and Bossis, J. Fluid Mech. 180 (1987) 21, for multipoles). What elements give depends on
how the meshes lie, so it is solved for where the spheres are, by the operator of the whole problem. The load belongs to
it: without its part by strain, free spheres in shear near contact are wrong by their own size.
"""

import numpy as np

from mpad_cdlbiem.elements.friction import Friction, exact_pair, exact_wall, friction_alone, gathered
from mpad_cdlbiem.elements.mesh import Mesh
from mpad_cdlbiem.elements.system import System
from mpad_core.interfaces.values import Configuration, Setting

NEAR = 2.0  # gap, over the mean radius, below which pairs get help: 96 elements are good to 1e-3 there without it


def near_pairs(at: Configuration) -> list[list[int]]:
    """Give the pairs that need help, the larger sphere of each first."""
    apart = np.linalg.norm(at.centres[:, None] - at.centres[None], axis=2)
    sums = at.radii[:, None] + at.radii[None]
    pairs = np.argwhere(np.triu(apart < (1 + NEAR / 2) * sums, 1)).tolist()
    return [[i, j] if at.radii[i] >= at.radii[j] else [j, i] for i, j in pairs]


def missing_between(unbounded: System, mesh: Mesh, at: Configuration, setting: Setting) -> Friction:
    """Give what elements miss between near spheres, from the equations in unbounded fluid."""
    return gathered(
        len(at.radii),
        (
            (pair, exact_pair(at, pair, setting).less(friction_alone(unbounded.part(pair), mesh, at.radii[pair])))
            for pair in near_pairs(at)
        ),
    )


def missing_at_wall(bounded: System, mesh: Mesh, at: Configuration, setting: Setting) -> Friction:
    """Give what elements miss between the spheres and the wall, from the equations with the wall."""
    count = len(at.radii)
    return gathered(
        count,
        (
            ([i], exact_wall(at, i, setting).less(friction_alone(bounded.part([i]), mesh, at.radii[[i]])))
            for i in range(count)
        ),
    )
