"""From a configuration to what solves it: refuse first, then matrix for few spheres, products for many."""

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.interfaces.errors import refuse_first
from mpad_core.interfaces.values import Configuration, Setting
from mpad_rpb.dense import Dense
from mpad_rpb.matrix_free import MatrixFree
from mpad_rpb.scene import Spheres

FEW = 24  # spheres; up to here forming and inverting the matrix beats the iteration for a block of right-hand sides


@frozen(kw_only=True)
class Plan:
    """The setting, and whether lone spheres are made exact."""

    setting: Setting
    exact: bool
    few: int = FEW

    def prepared(self, configuration: Configuration, guess: Array | None) -> Dense | MatrixFree:
        """Check the configuration and make ready."""
        refuse_bad(configuration, self.setting, self.exact)
        spheres = Spheres.of(configuration, self.setting, self.exact)
        if len(spheres.radii) <= self.few:
            return Dense.of(spheres)
        return MatrixFree.of(spheres, guess)


def refuse_bad(configuration: Configuration, setting: Setting, exact: bool) -> None:
    """Refuse what has no answer.

    Raises
    ------
    RefusedError
        Naming the first sphere at fault and its number.
    """
    centres, radii, gaps = configuration.centres, configuration.radii, configuration.wall_gaps
    heights = centres[:, 2]
    total = centres.sum() + radii.sum() + gaps.sum()
    above = (not setting.wall or heights.min() > 0) and (not exact or gaps.min() > 0)
    if total - total == 0 and radii.min() > 0 and above:  # one pass over the good; what follows names the bad
        return
    refuse_first("rpb", "centre {} is not finite", centres, ~np.isfinite(centres).all(axis=1))
    refuse_first("rpb", "radius {} µm is not positive", radii, ~((radii > 0) & np.isfinite(radii)))
    if setting.wall:
        refuse_first("rpb", "height {} µm of the centre is at or below the wall", heights, ~(heights > 0))
        refuse_first("rpb", "gap {} µm to the wall is not finite", gaps, ~np.isfinite(gaps))
    if exact:
        refuse_first(
            "rpb", "gap {} µm: it touches or cuts the wall, which needs lone_sphere = 'blake'", gaps, ~(gaps > 0)
        )
