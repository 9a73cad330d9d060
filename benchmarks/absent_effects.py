"""What an effect costs that is not there: the burst of a scene without it against one that never knew the effect.

For an absent effect the burst is compiled without what belongs to it. Here the same sources are compiled once more with
every call that belongs to bonds, contacts and thermal motion struck out, and both are timed in turn (CPU time of the
thread) on scenes without any; they must also give the same bits. Then each part by itself.

    python benchmarks/absent_effects.py [--repeats 31] [--sub-steps 2000] [WHAT …]
"""

import argparse
import ast
import inspect
import statistics
import time
from collections.abc import Sequence
from typing import Any

import numba
import numpy as np

from mpad_core.numerics.compiled import compiled_where_present, is_present
from mpad_core.running import assembly, burst, march, moving, pace, pulling
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
PARTS = {  # functions that each bare burst does without
    "reactions": ("all_ready", "strays", "see_ahead", "look_ahead", "use_up", "let_happen", "_wait", "holds"),
    "loads of bonds": ("_add_bonds",),
    "contacts": ("_add_wall_contact", "_add_pair_contacts"),
    "thermal motion": ("draw", "shake", "longest_part"),
}
STRUCK = {"everything": tuple(name for names in PARTS.values() for name in names), **PARTS}
DECORATORS = ("compiled", "compiled_lean", "compiled_inline", "compiled_within")


class Striking(ast.NodeTransformer):
    """Strikes out statements and conditions that call what is gone, and has nothing ask what is present."""

    def __init__(self, gone: Sequence[str]) -> None:
        self.gone = gone
        self.struck = 0

    def _without(self, node: Any, asked: ast.AST) -> Any:
        calls = (part.func for part in ast.walk(asked) if isinstance(part, ast.Call))
        if any(ast.unparse(call) in self.gone for call in calls):
            self.struck += 1
            return ast.Pass()
        self.generic_visit(node)
        return node

    def visit_Expr(self, node: ast.Expr) -> Any:  # the name that ast wants
        return self._without(node, node)

    def visit_Assign(self, node: ast.Assign) -> Any:
        return self._without(node, node)

    def visit_If(self, node: ast.If) -> Any:
        return self._without(node, node.test)

    def visit_Call(self, node: ast.Call) -> Any:
        self.generic_visit(node)
        asks = self.gone and ast.unparse(node.func) == "is_present"
        return ast.Constant(value=False) if asks else node


def without(module: Any, gone: Sequence[str], others: dict[str, Any]) -> tuple[dict[str, Any], int]:
    """Compile a module's source anew without what is gone; `others` take the place of its imports."""
    striking = Striking(gone)
    tree = ast.parse(inspect.getsource(module))
    tree.body = [node for node in tree.body if not _imports(node, others)]
    for function in tree.body:
        if isinstance(function, ast.FunctionDef):
            striking.visit(function)
    space: dict[str, Any] = {**others, "__name__": f"{module.__name__}_bare", **dict.fromkeys(DECORATORS, plainly)}
    space |= {"compiled": counting, "compiled_within": within, "is_present": is_present}
    space["compiled_where_present"] = compiled_where_present
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
    pulling_names, in_pulling = without(pulling, gone, {})
    moving_names, in_moving = without(moving, gone, {"add_loads": pulling_names["add_loads"]})
    own = {name: moving_names[name] for name in ("advance", "commit", "refresh_turns", "step_explicitly")}
    burst_names, in_burst = without(burst, gone, own)
    assert in_pulling + in_moving + in_burst >= len(gone), f"not all of {gone} was found"
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
        room = assembly.room_for(machine.fixed, state.bonds, cells, assembly.neighbours_in(system))
        clocks = assembly.clocks_of(machine.fixed, state)
        course = Course(
            system, limits, Dice(machine.fixed.key, 0, 1), assembly.motion_of(state), np.empty((cells, 3, 3)),
            assembly.progress_of(len(coupling.groups), cells), assembly.trail_for(cells, sub_steps),
            assembly.adhesion_of(problem, room, clocks, np.zeros((cells, 2))),
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
