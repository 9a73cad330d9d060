"""What every mobility solver promises."""

from mpad_core.testing.energy import EnergyContract
from mpad_core.testing.exact import ExactContract, exact_alone, exact_pair
from mpad_core.testing.honesty import HonestyContract
from mpad_core.testing.invariance import InvarianceContract
from mpad_core.testing.solving import SolvingContract

__all__ = ["MobilitySolverContract", "exact_alone", "exact_pair"]


class MobilitySolverContract(InvarianceContract, EnergyContract, SolvingContract, HonestyContract, ExactContract):
    """A mobility solver obeys the laws of Stokes flow, keeps to its interface, and is as good as it claims.

    Attributes
    ----------
    solver
        The solver; give it in the class that inherits.
    claimed
        The error that it claims for its parameters, if it does, see `AccuracyLevel`.
    """
