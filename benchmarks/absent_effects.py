"""What an effect costs that is not there: the burst with empty tables against one that never knew the effect.

The burst treats an absent effect as tables and lists of length zero, and never asks. Here the same sources are compiled
once more with every call and loop that belongs to bonds, contacts and thermal motion struck out, and both are timed in
turn (CPU time of the thread) on scenes without any; they must also give the same bits. Then each part by itself.

    python benchmarks/absent_effects.py [--repeats 31] [--sub-steps 2000] [WHAT …]
"""

import argparse
import ast
import inspect
import re
import statistics
import time
from collections.abc import Sequence
from typing import Any

import numba
import numpy as np

from mpad_core.running import assembly, burst, march, moving, pace
from mpad_core.running.initial import at_rest
from mpad_core.running.layout import Course, Dice
from mpad_core.scene.compose import compose
from mpad_core.scene.files import parse_scene

SCENE = """\
solver = "rpb"
stop = { time = "1 s" }
fluid = { viscosity = "1 mPa s" }
flow = { kind = "shear", rate = "80 1/s" }
wall = {}
[kinds.bead]
radius = "5 um"
[cells.a]
kind = "bead"
height = "5.4 um"
"""
SECOND = """\
[cells.b]
kind = "bead"
x = "-14 um"
height = "6 um"
"""
STRUCK = {  # what each bare burst does without: calls, loops over what is absent, and conditions
    "everything": ("_all_ready", "_strays", "_see_ahead", "_look_ahead", "_use_up", "bonds.number", "holds",
                   "contacts.pair_first", "contacts.reach", "thermal.energy"),
    "reactions": ("_all_ready", "_strays", "_see_ahead", "_look_ahead", "_use_up"),
    "loads of bonds": ("bonds.number",),
    "contacts": ("contacts.pair_first", "contacts.reach"),
    "thermal motion": ("thermal.energy",),
}  # fmt: skip
DECORATORS = ("compiled", "compiled_lean", "compiled_inline", "compiled_within")


class Striking(ast.NodeTransformer):
    """Strikes out calls by name, loops over what is absent, and conditions that ask for it."""

    def __init__(self, gone: Sequence[str]) -> None:
        self.gone = gone
        self.struck = 0

    def _without(self, node: Any, text: str) -> Any:
        if any(re.search(rf"\b{re.escape(name)}\b", text) for name in self.gone):
            self.struck += 1
            return ast.Pass()
        self.generic_visit(node)
        return node

    def visit_Expr(self, node: ast.Expr) -> Any:  # the name that ast wants
        return self._without(node, ast.unparse(node.value.func) if isinstance(node.value, ast.Call) else "")

    def visit_For(self, node: ast.For) -> Any:
        return self._without(node, ast.unparse(node.iter))

    def visit_If(self, node: ast.If) -> Any:
        test = ast.unparse(node.test)  # that there is no heat is asked where there is none, and stays
        return self._without(node, "" if "thermal.energy" in test else test)

    def visit_IfExp(self, node: ast.IfExp) -> Any:
        """Leave what stands where nothing is asked for."""
        return node.body if isinstance(self._without(node, ast.unparse(node.orelse)), ast.Pass) else node


def without(module: Any, gone: Sequence[str], others: dict[str, Any]) -> tuple[dict[str, Any], int]:
    """Compile a module's source anew without what is gone; `others` take the place of its imports."""
    striking = Striking(gone)
    tree = ast.parse(inspect.getsource(module))
    tree.body = [node for node in tree.body if not _imports(node, others)]
    for function in tree.body:
        if isinstance(function, ast.FunctionDef):
            striking.visit(function)
    space: dict[str, Any] = {**others, "__name__": f"{module.__name__}_bare", **dict.fromkeys(DECORATORS, plainly)}
    space |= {"compiled": counting, "compiled_within": within}
    exec(compile(ast.fix_missing_locations(tree), f"<{module.__name__}, bare>", "exec"), space)
    return space, striking.struck


def _imports(node: ast.stmt, others: dict[str, Any]) -> bool:
    """Tell whether a statement imports something that has been replaced, or the decorator."""
    names = {alias.name for alias in node.names} if isinstance(node, ast.ImportFrom) else set()
    return bool(names & {*others, *DECORATORS})


def plainly(function: Any) -> Any:
    """Compile as the core does, but keep nothing on disk."""
    return numba.njit(error_model="numpy", nogil=True, _nrt=False)(function)  # type: ignore[call-overload]


def counting(function: Any) -> Any:
    """Do so for what makes arrays."""
    return numba.njit(error_model="numpy", nogil=True)(function)


def within(function: Any) -> Any:
    """Make it part of what calls it."""
    return numba.njit(error_model="numpy", inline="always")(function)


def bare_burst(gone: Sequence[str]) -> Any:
    """Give a burst that never knew what is gone."""
    moving_names, in_moving = without(moving, gone, {})
    own = {name: moving_names[name] for name in ("advance", "commit", "refresh_turns", "step_explicitly")}
    burst_names, in_burst = without(burst, gone, own)
    assert in_moving + in_burst >= len(gone), f"not all of {gone} was found"
    return burst_names["burst"]


def prepared(text: str, sub_steps: int) -> Any:
    """Give a function that runs a burst of so many sub-steps from the same state, and the motion it ends in."""
    problem = compose(parse_scene(text))
    machine = march.make_ready(problem)
    state = at_rest(machine)
    configuration = march.configuration_of(problem, state)
    coupling = machine.coupler.at(configuration, state.mean_loads, None)
    pairs = assembly.near_pairs(problem, state.centres, np.inf)
    moves = pace.pair_moves(problem, pairs, state.centres, machine.pace.share)
    stride = pace.Stride(grains=1, sub_steps=sub_steps)
    limits = pace.limits(problem, machine.pace, moves, state.centres, state.wall_gaps, stride)
    limits = limits._replace(sub_step=1e-6, pair_move=np.full(len(pairs), np.inf))
    system = assembly.system(problem, machine.fixed, state, coupling, 0.0, machine.rasters.at(state.centres))

    def once(kernel: Any) -> tuple[float, Any]:
        cells = len(state.wall_gaps)
        room = assembly.room_for(machine.fixed, state.bonds, cells, system.neighbours)
        course = Course(
            system, limits, Dice(machine.fixed.key, 0, 1), assembly.motion_of(state), np.empty((cells, 3, 3)),
            room.bonds, room.bound, room.candidates, assembly.clocks_of(state), np.zeros((cells, 2)),
            assembly.progress_of(len(coupling.groups), cells), assembly.trail_for(cells, sub_steps), room.events,
        )  # fmt: skip
        began = time.thread_time()
        kernel(course)
        taken = time.thread_time() - began
        assert course.progress.beats[0] == sub_steps, course.progress
        return taken / sub_steps, course.motion

    return once


def main() -> None:
    """Time both in turn, on one cell and on two; print their ratio."""
    asked = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    asked.add_argument("--repeats", type=int, default=31)
    asked.add_argument("--sub-steps", type=int, default=2000)
    asked.add_argument("what", nargs="*", default=["everything"], help=f"of {', '.join(STRUCK)}; each takes minutes")
    given = asked.parse_args()
    kernels = {"nothing (the same, compiled anew)": bare_burst(())}
    kernels |= {name: bare_burst(STRUCK[name]) for name in given.what}
    for cells, text in ((1, SCENE), (2, SCENE + SECOND)):
        once = prepared(text, given.sub_steps)
        whole = once(burst.burst)[1]
        for name, bare in kernels.items():
            for one, other in zip(whole, once(bare)[1], strict=True):
                assert np.array_equal(one, other), f"without {name} the motion differs"
        times: dict[str, list[float]] = {name: [] for name in ("whole", *kernels)}
        for _ in range(given.repeats):
            for name, kernel in {"whole": burst.burst, **kernels}.items():
                times[name].append(once(kernel)[0])
        print(f"{cells} cell(s): {1e6 * statistics.median(times['whole']):.3f} us a sub-step")
        for name in kernels:
            ratios = sorted(one / other for one, other in zip(times["whole"], times[name], strict=True))
            low, middle, high = (ratios[k * len(ratios) // 4] for k in (1, 2, 3))
            print(f"    by that without {name:<34} {middle:.3f} (quartiles {low:.3f} to {high:.3f})")


if __name__ == "__main__":
    main()
