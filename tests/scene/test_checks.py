"""Checks of the scene as a whole: what is named must be there, and cells must not overlap."""

import pytest

from mpad_core.interfaces.errors import InputError
from mpad_core.scene.files import parse_scene

pytestmark = pytest.mark.usefixtures("fake_parts")


def refused(text: str, *changes: tuple[str, str]) -> tuple[str, ...]:
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    with pytest.raises(InputError) as caught:
        parse_scene(text, "s.toml")
    return tuple(line.partition(": ")[2] for line in caught.value.lines)


CHANGES = [
    ('height = "5.235 um"', 'height = "4 um"', "cells.roller.height: the wall cuts the cell: its centre is at 4 um"),
    ('overlap = "0 nm"', 'overlap = "-1 um"', "cells.free.overlap: the wall cuts the cell: its centre is at 4.255 um"),
    ('x = "-100 um"\ny = "10 um"', 'x = "-1 um"', "cells.free: overlaps cell 'roller' by 8.99"),
    ('overlap = "0 nm"', 'height = "6 um"\noverlap = "0 nm"', "cells.free.overlap: height is given too"),
    ('overlap = "0 nm"', "", "cells.free: height or overlap is missing"),
    (
        '["slex", "p-selectin"]',
        '["slx", "p-selectin"]',
        "bonds.tether.between[0]: no site of cells 'slx' in this scene",
    ),
    ('["slex", "p-selectin"]', '["slex", "p-selctin"]', "bonds.tether.between[1]: no site of the wall 'p-selctin'"),
    ('["slex", "p-selectin"]', '["slex"]', "bonds.tether.between: must be a list of 2, not of 1"),
    ('"free.dx > 60 um"', '"fre.dx > 60 um"', "stop.when[1]: no cell 'fre' in this scene; did you mean 'free'?"),
    ('"free.dx > 60 um"', '"free dx > 60 um"', "stop.when[1]: 'free dx > 60 um' is not a condition; write"),
    ('"free.dx > 60 um"', '"free.dx >= 60 um"', "stop.when[1]: '= 60 um' is not a number, a space and units"),
    ('"free.dx > 60 um"', '"free.dx > 60 s"', "stop.when[1]: '60 s' has the wrong dimension"),
    ('"free.dx > 60 um"', '"free.dx"', "stop.when[1]: 'free.dx': caught stands alone"),
    ('"free.dx > 60 um"', '"free.caught > 1 um"', "stop.when[1]: 'free.caught > 1 um': caught stands alone"),
    (
        '"free.dx > 60 um"',
        '"free.overlp < 1 um"',
        "stop.when[1]: 'overlp' cannot be asked for; did you mean 'overlap'?",
    ),
    ('past = "roller"', 'past = ["rolle"]', "passage.past[0]: no cell 'rolle' in this scene; did you mean 'roller'?"),
    ('density = "90 1/um^2"', 'density = "1e6 1/um^2"', "kinds.bead.sites.slex.density: makes 3.1e+08 sites on each"),
    (
        'overlap = "0 nm"',
        'overlap = "0 nm"\nbinds = false\nstart = { rolling_alone = "1 s" }',
        "cells.free.start.rolling",
    ),
    (
        'overlap = "0 nm"',
        'overlap = "0 nm"\nheld = true\nstart = { rolling_alone = "1 s" }',
        "cells.free.start.rolling",
    ),
]


@pytest.mark.parametrize(("old", "new", "line"), CHANGES)
def test_faults_of_the_whole(old: str, new: str, line: str, examples: dict[str, str]) -> None:
    lines = refused(examples["capture"], (old, new))
    assert any(found.startswith(line) for found in lines), lines


def test_bonds_need_a_wall(examples: dict[str, str]) -> None:
    start, _, rest = examples["capture"].partition("[wall]")
    lines = refused(start + rest[rest.index("[kinds") :])
    assert lines[0] == "cells.free.overlap: needs a wall; give height instead"
    assert lines[1].startswith("bonds: bonds need a wall")


def test_overlap_needs_a_bond_of_the_kind(examples: dict[str, str]) -> None:
    smooth = '[kinds.smooth]\nradius = "1 um"\n[cells.third]\nkind = "smooth"\nx = "50 um"\noverlap = "0 um"\n'
    lines = refused(examples["capture"] + smooth)
    assert lines == ("cells.third.overlap: needs a bond that cells of kind 'smooth' can form; give height instead",)


def test_a_cell_may_touch_neither_wall_nor_cell_but_come_near(examples: dict[str, str]) -> None:
    near = '[cells.third]\nkind = "bead"\nx = "10.001 um"\nheight = "5.235 um"\n'
    assert "third" in parse_scene(examples["capture"] + near).cells


def test_without_a_wall_any_height_will_do(small: str) -> None:
    assert parse_scene(small.replace('"0 um"', '"-7 um"')).height_of("a") == -7


GROUP = '[groups.crowd]\nkind = "bead"\nnumber = 10\nx = ["0 um", "1 mm"]\ny = ["-5 um", "5 um"]\nheight = "9 um"\n'


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("10", "0", "groups.crowd.number: must be at least 1 and at most 100000, not 0"),
        ('"1 mm"', '"-1 mm"', "groups.crowd.x: must go from the lower to the higher end, not from 0 to -1000"),
        ('"bead"', '"bed"', "groups.crowd.kind: no kind 'bed' in this scene; did you mean 'bead'?"),
        ("crowd", "a", "groups.a: a cell has this name too; rename one of them"),
        ("height", "minimum_gap", "groups.crowd: height or overlap is missing"),
    ],
)
def test_faults_of_groups(old: str, new: str, line: str, small: str) -> None:
    assert any(found.startswith(line) for found in refused(small + GROUP.replace(old, new)))


def test_a_group_may_not_be_cut_by_the_wall(small: str) -> None:
    text = "wall = { roughness = '0 um' }\n" + small.replace('"0 um"', '"9 um"') + GROUP.replace("9 um", "5 um")
    assert refused(text)[0].startswith("groups.crowd.height: the wall cuts the cell")
