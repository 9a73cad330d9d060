"""Molecules on the tips of microvilli only, as on leukocytes (Hammer & Apte, Biophys J 63:35, 1992)."""

import numpy as np
from attrs import frozen

from mpad_core.arrays import Array
from mpad_core.physics.layouts.around import around
from mpad_core.physics.layouts.layout import Draw
from mpad_core.physics.layouts.uniform import on_sphere

MOST_COVERED = 0.45  # of the shell; discs put down at random jam at 0.547 (Feder, J Theor Biol 87:237, 1980)
MOST_TIPS = 20_000  # on a cell; every tip is held against all others
_TRIES = 2000  # for one tip: at the largest coverage a try fits once in 200
_PLACES, _WHICH, _WHERE = 0, 1, 2  # sequences of draws
_BATCH = 1024


@frozen(kw_only=True)
class Microvilli:
    """Round tips that do not overlap; each molecule on one of them, anywhere within it.

    Tips are put down one after the other, uniformly at random; one that would overlap another is put down again.
    """

    tips: float  # 1/µm² of the smooth sphere
    tip_radius: float  # µm, along the shell

    def count(self, radius: float) -> int:
        """Give how many tips a cell of a radius (µm) has."""
        return round(self.tips * 4 * np.pi * radius**2)

    def refusal(self, radius: float, shell: float) -> str:
        """Say why tips cannot be put on a cell of this radius and shell (µm); empty if they may be tried."""
        count = self.count(radius)
        if not 1 <= count <= MOST_TIPS:
            return f"makes {count} tips on each cell, which must have from 1 to {MOST_TIPS}"
        covered = 0.5 * count * (1 - np.cos(min(self.tip_radius / shell, np.pi)))
        if covered > MOST_COVERED:
            return f"its {count} tips on each cell would cover {covered:.2f} of it, the most is {MOST_COVERED}"
        return ""

    def centres(self, radius: float, shell: float, draw: Draw) -> Array:
        """Give the tips' centres (tips, 3) as unit vectors, no two within two tip radii.

        Raises
        ------
        ValueError
            If a tip finds no place.
        """
        refused = self.refusal(radius, shell)
        if refused:
            raise ValueError(refused)
        count, closest = self.count(radius), np.cos(min(2 * self.tip_radius / shell, np.pi))
        placed, done, tried, last = np.empty((count, 3)), 0, 0, 0
        while done < count:
            for candidate in on_sphere(draw(_PLACES, tried, _BATCH)):
                tried += 1
                if done == count or (placed[:done] @ candidate > closest).any():
                    continue
                placed[done] = candidate
                done, last = done + 1, tried
            if tried - last > _TRIES:
                raise ValueError(f"no room for more than {done} of {count} tips of radius {self.tip_radius:g} um")
        return placed

    def directions(self, number: int, radius: float, shell: float, draw: Draw) -> Array:
        """Give unit vectors (number, 3); see `Layout`."""
        if not number:
            return np.zeros((0, 3))
        centres = self.centres(radius, shell, draw)
        chosen = (draw(_WHICH, 0, number)[:, 0] * len(centres)).astype(np.int64)
        within, azimuth = draw(_WHERE, 0, number).T
        chord = np.sqrt(within) * np.sin(0.5 * self.tip_radius / shell)  # equal areas of the cap, by Archimedes
        return around(centres[chosen], 2 * np.arcsin(chord), 2 * np.pi * azimuth)
