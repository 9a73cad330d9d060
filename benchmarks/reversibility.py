"""Which discretisations fake a vertical drift? Prints the table of ``docs/reversibility.md``.

Run as ``python benchmarks/reversibility.py [FOLDER]``; with a folder it also writes ``reversibility.csv``,
``reversibility.json`` and ``reversibility.png`` there, and levels that the file in JSON has are not worked out again.
Some ten minutes, nearly all of them boundary elements.

The base collision of ``examples/recruitment.toml``, the first cell held, nothing but the flow: see
`mpad_core.studies.reversibility`. Boundary elements are shown twice: as the solver has them, on a mesh whose elements
lie symmetrically fore and aft, and on the same mesh turned by some angle, as that of a cell that rolls would be.
"""

import csv
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import attrs
import numpy as np
from attrs import evolve, frozen
from scipy.spatial.transform import Rotation

from mpad_cdlbiem.elements.friction import Friction
from mpad_cdlbiem.elements.mesh import Mesh, mesh_of
from mpad_cdlbiem.elements.plan import INNER
from mpad_cdlbiem.elements.solution import Iterating, solution
from mpad_core import load_scene, solver
from mpad_core.interfaces.errors import RefusedError
from mpad_core.interfaces.values import Array, Configuration, Motion, Report, Setting, SolverTraits
from mpad_core.scene.compose import compose
from mpad_core.studies.reversibility import Level, Meeting, Return, returned

SCENE = Path(__file__).parents[1] / "examples" / "recruitment.toml"
FLOOR = 1e-2  # nm: what the integrator leaves; less is drawn there
ELEMENTS = (24, 54, 96, 150)
COARSE, COARSER = 1e-7, 1e-6  # errors of the integrator where a solve takes a tenth of a second; where drift is large
BELOW = ("sd", "rpb", "elements 96, turned", "elements 54")  # labels that would lie on others
ANGLES = (0.3, 0.5, 0.7)  # rad about x, y and z, by which the turned meshes are turned
COLOURS = {"isolated": "#8d99ae", "rpb": "#c1121f", "sd": "#e09f3e", "cdl-biem": "#1b4965", "elements": "#3d8b8b",
           "turned": "#7b2d8b"}  # fmt: skip


def turned(mesh: Mesh, by: Array) -> Mesh:
    """Turn a mesh; `by` is a rotation matrix."""
    count = len(mesh.points)
    tiles, inner, _ = mesh.sources.shape
    sources = mesh.sources.reshape(tiles, inner, 4, -1).copy()
    sources[:, :, :3] = np.einsum("ij,tsjk->tsik", by, sources[:, :, :3])
    components = np.kron(by, np.eye(count))  # vectors on the mesh are ordered by components
    return evolve(
        mesh, points=mesh.points @ by.T, sources=np.ascontiguousarray(sources.reshape(tiles, inner, -1)),
        own=components @ mesh.own @ components.T, velocity=np.kron(np.eye(2), by) @ mesh.velocity @ components.T,
    )  # fmt: skip


@frozen(kw_only=True)
class TurnedElements:
    """The boundary elements of `cdl-biem` on a mesh that is turned; lubrication and all."""

    name: ClassVar[str] = "turned elements"
    traits: ClassVar[SolverTraits] = SolverTraits(lubrication=True)
    elements: int

    def plan(self, setting: Setting) -> tuple[Setting, Mesh]:
        """Turn the mesh."""
        by = Rotation.from_euler("xyz", ANGLES).as_matrix()
        return setting, turned(mesh_of(math.isqrt(self.elements // 6), INNER), by)

    def prepare(self, plan: tuple[Setting, Mesh], at: Configuration, guess: Array | None = None) -> Friction:
        """Solve for the resistance."""
        return solution(plan[1], at, plan[0], Iterating(name="gmres", tolerance=1e-10)).lubricated

    def solve(self, prepared: Friction, loads: Array) -> Motion:
        """Give velocities under loads (N, 6) or (N, 6, k)."""
        velocity = prepared.velocity(loads.reshape(6 * len(loads), -1))
        return Motion(velocity=velocity.reshape(loads.shape), report=Report(error=math.nan))


def levels() -> Iterator[tuple[str, Level]]:
    """Yield every solver at every level, with the family whose colour it is drawn in."""
    yield "isolated", Level(name="isolated", solver=solver("isolated"))
    yield "rpb", Level(name="rpb", solver=solver("rpb"))
    yield "rpb", Level(name="rpb, blake", solver=solver("rpb", lone_sphere="blake"))
    for name, how in {"sd": {}, "sd, reach 1.5": {"reach": 1.5}, "sd, no strain": {"strain": False}}.items():
        yield "sd", Level(name=name, solver=solver("sd", **how))
    for accuracy in ("1e-2", "1e-3", "1e-4", "1e-6"):
        yield "cdl-biem", Level(name=f"spectral {accuracy}", solver=solver("cdl-biem", accuracy=float(accuracy)))
    for degree in (2, 4, 8):
        bare = solver("cdl-biem", degree=degree, lubrication=False)
        yield "cdl-biem", Level(name=f"degree {degree}, bare", solver=bare)
    for n in ELEMENTS:
        plain = solver("cdl-biem", discretisation="elements", elements=n)
        yield "elements", Level(name=f"elements {n}", solver=plain, error=COARSE)
    for n in ELEMENTS:
        yield "turned", Level(name=f"elements {n}, turned", solver=TurnedElements(elements=n), error=COARSER)


def audited(known: dict[str, Return]) -> Iterator[tuple[str, Level, Return]]:
    """Yield what each level gives, or gave; print what it refuses."""
    meeting = Meeting.of(compose(load_scene(SCENE)), "roller", "free")
    for family, level in levels():
        try:
            yield family, level, known.get(level.name) or returned(meeting, level)
        except RefusedError as error:
            print(f"| {level.name} | refused: {error} |")


def written(folder: Path) -> dict[str, Return]:
    """Read what a folder has."""
    file = folder / "reversibility.json"
    found = json.loads(file.read_text()) if file.exists() else []
    return {one["name"]: Return(**one) for one in found}


def write(rows: list[tuple[str, Return]], folder: Path) -> None:
    """Write the table and the picture."""
    found = [attrs.asdict(item) for _, item in rows]
    (folder / "reversibility.json").write_text(json.dumps(found, indent=1) + "\n")
    with (folder / "reversibility.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(found[0]))
        writer.writeheader()
        writer.writerows(found)
    draw(rows, folder / "reversibility.png")


def row(level: Level, found: Return) -> str:
    return (
        f"| {found.name} | {found.drift:+.4f} | {found.lowest:.2f} | {found.highest:.1f} | {found.solve:.2g} | "
        f"{found.solves} | {level.error:.0e} |"
    )


def draw(rows: list[tuple[str, Return]], file: Path) -> None:
    """Draw what each level drifts by, and by how much its highest point is wrong, against the time of a solve."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    finest = next((found for _, found in rows if found.name == "spectral 1e-6"), rows[-1][1])
    others = [(f, r, abs(r.highest - finest.highest)) for f, r in rows if r is not finest and f != "turned"]
    _panel(left, [(f, r, abs(r.drift)) for f, r in rows], "|height at the end − at the start| (nm)")
    _panel(right, others, "|highest point − that of spectral 1e-6| (nm)")
    left.axhspan(FLOOR / 2, FLOOR, color="0.93", zorder=0)
    left.set_title("what a solver drifts by: nothing, if it is symmetric", fontsize=10)
    right.set_title("how wrong its path is in between", fontsize=10)
    figure.savefig(file, dpi=150)


def _panel(panel: Any, points: list[tuple[str, Return, float]], label: str) -> None:
    """Draw the points; those on the floor are labelled upright, side by side."""
    panel.set(xscale="log", yscale="log", xlabel="time of a solve (ms)", ylabel=label)
    beside = 0.0
    for family, found, size in sorted(points, key=lambda point: point[1].solve):
        colour = COLOURS[family]
        panel.plot(found.solve, max(size, FLOOR), "o", color=colour, ms=6)
        if size > FLOOR:
            offset = (6, -9) if found.name in BELOW else (6, 3)
            panel.annotate(found.name, (found.solve, size), xytext=offset, textcoords="offset points", fontsize=7.5,
                           color=colour)  # fmt: skip
            continue
        beside = max(found.solve, 1.35 * beside)
        panel.plot([found.solve, beside], [FLOOR, 1.7 * FLOOR], color=colour, lw=0.6)
        panel.text(beside, 1.9 * FLOOR, found.name, rotation=90, ha="center", va="bottom", fontsize=7.5, color=colour)
    panel.margins(x=0.4, y=0.1)
    panel.grid(color="0.92")


def main() -> None:
    """Print the table; write it, and the picture, into a folder if one is given."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    print("| level | end − start, nm | lowest, nm | highest, nm | solve, ms | solves | integrator |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    rows = []
    for family, level, found in audited(written(folder) if folder else {}):
        rows.append((family, found))
        print(row(level, found), flush=True)
        if folder:
            write(rows, folder)


if __name__ == "__main__":
    main()
