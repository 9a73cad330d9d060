"""What starting costs, and that nothing is imported which the work at hand does not need."""

import json
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.slow

ROOT_SCENE = """\
solver = "{solver}"
stop = {{ time = "0.1 ms" }}
fluid = {{ viscosity = "1 mPa s" }}
flow = {{ kind = "shear", rate = "80 1/s" }}
{head}
[kinds.bead]
radius = "5 um"
roughness = "175 nm"
{sites}
[cells.a]
kind = "bead"
height = "5.235 um"
[cells.b]
kind = "bead"
x = "12 um"
height = "6 um"
{bonds}
"""
WALL = 'wall = { roughness = "50 nm", sites = { p = { layout = "uniform", density = "180 1/um^2" } } }'
SITES = 'sites = { s = { density = "90 1/um^2" } }'
BONDS = """\
[bonds.tether]
between = ["s", "p"]
model = { name = "bell", off_rate = "2 1/s", reactive_compliance = "0.4 angstrom" }
on_rate = { value = "84 1/s", at_density = "180 1/um^2" }
length = "30 nm"
stiffness = "100 pN/nm"
"""
REPULSION = 'repulsion = { strength = "500 pN um", decay = "565 1/um" }'
SCENES = {
    "all": {"solver": "rpb", "head": f"{WALL}\n{REPULSION}", "sites": SITES, "bonds": BONDS},
    "no bonds": {"solver": "rpb", "head": f"wall = {{ roughness = '50 nm' }}\n{REPULSION}", "sites": "", "bonds": ""},
    "no repulsion": {"solver": "rpb", "head": WALL, "sites": SITES, "bonds": BONDS},
    "isolated": {"solver": "isolated", "head": f"{WALL}\n{REPULSION}", "sites": SITES, "bonds": BONDS},
    "no wall": {"solver": "rpb", "head": "", "sites": "", "bonds": ""},
}
TELLING = "import sys, json, atexit; atexit.register(lambda: print(json.dumps(sorted(sys.modules)), file=sys.stderr));"
CALL = TELLING + "from mpad_core.cli import main; sys.argv = ['mpad', *sys.argv[1:]]; main()"


def imported(*words):
    """Give the modules that a command has imported by its end."""
    done = subprocess.run([sys.executable, "-c", CALL, *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stderr.splitlines()[-1]))


def best_of(times, budget, *words):
    """Give the shortest time (s) that a command takes, over some tries, or the first within the budget."""
    taken = []
    while len(taken) < times and min(taken, default=budget) >= budget:
        began = time.perf_counter()
        subprocess.run([sys.executable, "-m", "mpad_core", *map(str, words)], capture_output=True, check=True)
        taken.append(time.perf_counter() - began)
    return min(taken)


@pytest.fixture
def scene(tmp_path):
    def write(name):
        path = tmp_path / "scene.toml"
        path.write_text(ROOT_SCENE.format(**SCENES[name]))
        return path

    return write


@pytest.mark.parametrize(("words", "budget"), [(("--help",), 0.5), (("--version",), 0.5), (("run", "--help"), 0.5),
                                               (("parts",), 1.5), (("check",), 1.5)])  # fmt: skip
def test_time_to_start(words, budget, scene):
    words = (*words, scene("all")) if words == ("check",) else words
    taken = best_of(5, budget, *words)
    print(f"mpad {words[0]}: {taken:.2f} s")
    assert taken < budget


@pytest.mark.parametrize("words", [("--help",), ("run", "--help"), ("parts",), ("check",)])
def test_none_of_these_imports_heavy_modules(words, scene):
    words = (*words, scene("all")) if words == ("check",) else words
    heavy = {"numba", "llvmlite", "h5py", "matplotlib", "MDAnalysis", "tqdm"}
    found = {name.partition(".")[0] for name in imported(*words)}
    assert not heavy & found
    if words[-1] == "--help":
        assert not {"numpy", "scipy", "pint", "cattrs", "mpad_rpb", "mpad_bell"} & found


def test_importing_the_package_costs_nothing():
    code = TELLING + "import mpad_core"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    found = set(json.loads(done.stderr))
    assert {name for name in found if name.startswith("mpad_core")} == {"mpad_core"}
    assert not {"numpy", "attrs", "pluggy", "click"} & found


@pytest.mark.parametrize(("name", "absent"), [
    ("no bonds", {"mpad_core.physics.reactions", "mpad_bell", "mpad_surfaces.uniform", "mpad_isolated"}),
    ("no repulsion", {"mpad_surfaces.electrostatic", "mpad_isolated"}),
    ("isolated", {"mpad_rpb", "mpad_core.numerics.stokeslets", "mpad_core.numerics.krylov"}),
    ("no wall", {"mpad_core.physics.reactions", "mpad_bell", "mpad_surfaces", "mpad_isolated"}),
    ("all", {"mpad_isolated", "MDAnalysis", "distributed", "mpad_core.testing", "hypothesis", "pytest"}),
    ("all", {"mpad_core.physics.fluctuations", "mpad_core.numerics.fluctuations", "mpad_rpb.fluctuating"}),
])  # fmt: skip
@pytest.mark.parametrize("command", ["check", "run"])
def test_what_a_scene_leaves_out_is_not_imported(command, name, absent, scene, tmp_path):
    more = ("-o", tmp_path / "run") if command == "run" else ()
    found = imported(command, scene(name), *more)
    loaded = {module for module in found if any(module == gone or module.startswith(f"{gone}.") for gone in absent)}
    assert not loaded
    if command == "run" and name != "isolated":
        assert "mpad_rpb.dense" in found


@pytest.mark.parametrize("name", SCENES)
def test_a_run_without_a_passage_draws_nothing(name, scene, tmp_path):
    assert "matplotlib" not in imported("run", scene(name), "-o", tmp_path / "run")
