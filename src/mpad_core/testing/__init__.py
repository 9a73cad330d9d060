"""What a part can prove about itself: contracts that a plugin's author inherits, and strategies for Hypothesis.

A contract is a test class. Inherit it, say which part is meant, and pytest runs the rest::

    class TestMyBond(BondModelContract):
        model = MyBond(rest_length=0.03, stiffness=1e5, k_off=2.0)

Needs pytest and Hypothesis: ``python -m pip install "mpad-core[testing]"``.
"""

try:
    import hypothesis  # noqa: F401
    import pytest
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(f"{error}; install mpad-core[testing]", name=error.name) from error

_ROOMS = (
    "between", "bonds", "claims", "energy", "exact", "fluctuating", "forces", "honesty", "invariance", "mobility",
    "solving", "surfaces",
)  # fmt: skip
pytest.register_assert_rewrite(*(f"{__name__}.{room}" for room in _ROOMS))  # before they are imported

from mpad_core.testing.bonds import BondModelContract  # noqa: E402
from mpad_core.testing.claims import Claim  # noqa: E402
from mpad_core.testing.fluctuating import FluctuatingContract  # noqa: E402
from mpad_core.testing.forces import GapForceContract  # noqa: E402
from mpad_core.testing.mobility import MobilitySolverContract  # noqa: E402
from mpad_core.testing.samples import typical  # noqa: E402
from mpad_core.testing.strategies import configurations  # noqa: E402
from mpad_core.testing.surfaces import SurfaceContract  # noqa: E402

__all__ = [
    "BondModelContract",
    "Claim",
    "FluctuatingContract",
    "GapForceContract",
    "MobilitySolverContract",
    "SurfaceContract",
    "configurations",
    "typical",
]
