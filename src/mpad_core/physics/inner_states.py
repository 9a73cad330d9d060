"""Inner states of a bond: how the exchange between them weighs one state against another.

At a fixed length the exchange alone leads to shares p_s with p_s X_st = p_t X_ts, if there is any such balance. What is
worked out here is w_s = p_s / p_0; a chain of states has it always, a ring of them only if the products of the rates
both ways round are equal (Kolmogorov, Math Ann 112:155, 1936).
"""

import numpy as np

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import PartError

_UNBALANCED = 1e-6  # of a flux: rates given in double precision are far better
_UNDERFLOW = 1e-250  # 1/s: a rate so small has lost its digits, and says nothing about balance


def links(at_rest: Array, who: str) -> list[tuple[int, int]]:
    """Give pairs of states (from, to) that lead from state 0 to every other, each both ways possible.

    Parameters
    ----------
    at_rest : (S, S)
        Exchange rates (1/s) of the unstressed bond, row = from, column = to.
    who
        The bond model, for errors.

    Raises
    ------
    PartError
        If an exchange goes one way only, or a state cannot be reached from state 0.
    """
    there = at_rest > 0
    if (there != there.T).any():
        raise PartError(f"{who}: an exchange goes one way only, so there is no detailed balance; give its own on_rate")
    found, pairs = [0], []
    for state in found:  # grows on the way
        new = [int(other) for other in np.flatnonzero(there[state]) if other not in found]
        found += new
        pairs += [(state, other) for other in new]
    if len(found) < len(at_rest):
        lost = sorted(set(range(len(at_rest))) - set(found))
        raise PartError(f"{who}: no exchange links inner states {lost} to state 0; give its own on_rate")
    return pairs


def log_weights(exchange: Array, pairs: list[tuple[int, int]]) -> Array:
    """Give ln w (S, ...) of the states, w_0 = 1, from exchange rates (S, S, ...) along the links."""
    logs = np.log(np.maximum(exchange, 1e-300))
    found = np.zeros(exchange.shape[1:])
    for here, there in pairs:
        found[there] = found[here] + logs[here, there] - logs[there, here]
    return found


def check_balance(exchange: Array, weights: Array, who: str) -> None:
    """Refuse exchange rates (S, S, ...) that drive a current round a ring of states.

    Raises
    ------
    PartError
        If w_s X_st and w_t X_ts differ for any two states at any length; `weights` are ln w (S, ...).
    """
    clear = (exchange > _UNDERFLOW) & (exchange.swapaxes(0, 1) > _UNDERFLOW)
    flux = np.log(np.where(clear, exchange, 1.0)) + np.where(clear, weights[:, None], 0.0)
    wrong = np.abs(flux - flux.swapaxes(0, 1))
    if wrong.max() > _UNBALANCED:
        s, t = (int(i) for i in np.unravel_index(np.argmax(wrong), wrong.shape)[:2])
        raise PartError(
            f"{who}: the exchange between inner states {s} and {t} is not balanced by that on the way round "
            "(Kolmogorov's criterion); give its own on_rate"
        )
