"""Make plugins/mpad-sd/tests/data/two_spheres.json, two spheres near each other and the wall, solved by `cdl-biem`.

Run it with ``python benchmarks/make_sd_reference.py``; it takes two minutes. The cases are the first of those that the
long test of the solver's accuracy draws, and after them its worst ones; `change` is what accuracy 1e-5 instead of
1e-4 does to the velocities and, in the energy norm, to the mobility.
"""

import json
import sys
from pathlib import Path

import numpy as np

from mpad_core import mobility_matrix, solver, velocities

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "tools"))

from spheres import energy_error, two_at_the_wall, upper, velocity_error  # noqa: E402

FIRST = 14
WORST = {2: (60, 140), 5: (155, 156)}
HEADER = (
    "the solver cdl-biem at accuracy 1e-5; viscosity and shear rate 1; centres x, radii a; M_upper: rows of the upper "
    "triangle of the mobility; V_shear: free spheres in u = z x; change: of velocities and mobility (energy norm) from "
    "accuracy 1e-4; made by benchmarks/make_sd_reference.py"
)


def rounded(values):
    """Give numbers with nine digits, far more than are certain."""
    return [float(f"{value:.9g}") for value in np.ravel(values)]


def case(ratio, number):
    """Solve one case at two accuracies."""
    centres, radii = two_at_the_wall(np.random.default_rng([ratio, number]), ratio)
    answers = []
    for accuracy in (1e-4, 1e-5):
        chosen = solver("cdl-biem", accuracy=accuracy)
        free = velocities(chosen, centres, radii, viscosity=1.0, shear_rate=1.0)
        answers.append((free, mobility_matrix(chosen, centres, radii, viscosity=1.0)))
    (coarse, rough), (free, mobility) = answers
    change = (velocity_error(coarse, free, radii), energy_error(rough, mobility))
    return {
        "id": f"ratio {ratio}, {number}",
        "x": centres.tolist(),
        "a": radii.tolist(),
        "change": [float(f"{each:.1e}") for each in change],
        "M_upper": rounded(upper(mobility)),
        "V_shear": rounded(free),
    }


def main():
    """Write the file, a case a line."""
    cases = [case(ratio, number) for ratio in WORST for number in (*range(FIRST), *WORST[ratio])]
    lines = ",\n".join(json.dumps(each) for each in cases)
    path = ROOT / "plugins" / "mpad-sd" / "tests" / "data" / "two_spheres.json"
    path.write_text(f'{{"source": {json.dumps(HEADER)},\n"cases": [\n{lines}\n]}}\n')


if __name__ == "__main__":
    main()
