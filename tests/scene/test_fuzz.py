"""Whatever is done to a scene file, reading it gives a scene or lines that say what is wrong."""

import random
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from mpad_core.interfaces.errors import InputError
from mpad_core.scene.files import load_scene
from mpad_core.scene.spec import Scene

CASES = 300
LIMIT = 2.0  # s

pytestmark = pytest.mark.usefixtures("fake_parts")

ODDITIES = [
    "1", "-1", "0", "1e400", "nan", "inf", "-inf", "true", "[]", "{}", '""', "''", '"x"', '"1 um"', '"1e999 um"',
    '"0 um"', '"-5 um"', '"5 km^99"', '"5 degC"', '"3 dB"', "9" * 190, "0x" + "f" * 190, "9" * 5000, "1979-05-27",
    '[["a"]]', "{ name = 1 }", '{ name = "bell" }', '"\\u0000"', '"\\uFFFF"', '"5 parsecs!!"', '"5 um um um"', "'''",
    "[" * 40 + "]" * 40, "[" * 9000, "{a=" * 3000, '"' + "9" * 5000 + ' um"', '"' + "1/" * 5000 + '"',
]  # fmt: skip


def flip(text: bytes, dice: random.Random) -> bytes:
    place = dice.randrange(len(text))
    return text[:place] + bytes([text[place] ^ (1 << dice.randrange(8))]) + text[place + 1 :]


def cut_line(text: bytes, dice: random.Random) -> bytes:
    lines = text.split(b"\n")
    del lines[dice.randrange(len(lines))]
    return b"\n".join(lines)


def double_line(text: bytes, dice: random.Random) -> bytes:
    lines = text.split(b"\n")
    lines.insert(dice.randrange(len(lines)), dice.choice(lines))
    return b"\n".join(lines)


def swap_words(text: bytes, dice: random.Random) -> bytes:
    words = text.split(b" ")
    one, other = dice.randrange(len(words)), dice.randrange(len(words))
    words[one], words[other] = words[other], words[one]
    return b" ".join(words)


def change_value(text: bytes, dice: random.Random) -> bytes:
    lines = text.split(b"\n")
    chosen = dice.choice([index for index, line in enumerate(lines) if b" = " in line] or [0])
    key = lines[chosen].partition(b" = ")[0]
    lines[chosen] = key + b" = " + dice.choice(ODDITIES).encode()
    return b"\n".join(lines)


def change_quantity(text: bytes, dice: random.Random) -> bytes:
    pieces = text.split(b'"')
    pieces[dice.randrange(len(pieces))] = dice.choice([b"0 um", b"1e300 km", b"-1 s", b"", b"free", b"2 1/um^2"])
    return b'"'.join(pieces)


def add_key(text: bytes, dice: random.Random) -> bytes:
    lines = text.split(b"\n")
    key = dice.choice([b"x", b"sheer", b"a." * 500 + b"a", b'"\\n\\u202e"', b"name", b"kind", b"[kinds]", b"[[cells]]"])
    lines.insert(dice.randrange(len(lines)), key + b" = " + dice.choice(ODDITIES).encode())
    return b"\n".join(lines)


def cut_end(text: bytes, dice: random.Random) -> bytes:
    return text[: dice.randrange(len(text))]


def insert_mark(text: bytes, dice: random.Random) -> bytes:
    place = dice.randrange(len(text))
    return (
        text[:place] + dice.choice([b'"', b"'", b"[", b"]", b"{", b"}", b"=", b"\n", b"\xff", b"\x00"]) + text[place:]
    )


MUTATIONS: list[Callable[[bytes, random.Random], bytes]] = [
    flip, cut_line, double_line, swap_words, change_value, change_quantity, add_key, cut_end, insert_mark
]  # fmt: skip


def outcome(path: Path) -> str:
    """Read a scene and say how that went; only two ways are allowed."""
    try:
        scene = load_scene(path)
    except InputError as error:
        lines = error.lines
    else:
        assert isinstance(scene, Scene)
        return "read"
    assert lines
    assert all(line.startswith(f"{path}:") and line.isprintable() and len(line) <= 400 for line in lines)
    return "refused"


@pytest.mark.parametrize("name", ["recruitment", "capture"])
def test_mutated_scenes_are_read_or_refused(name: str, examples: dict[str, str], tmp_path: Path) -> None:
    dice = random.Random(20010701)
    path = tmp_path / "scene.toml"
    outcomes = []
    for _ in range(CASES // 2):
        text = examples[name].encode()
        for _ in range(dice.choice([1, 1, 1, 2, 5])):
            text = dice.choice(MUTATIONS)(text, dice) or b" "
        path.write_bytes(text)
        start = time.perf_counter()
        outcomes.append(outcome(path))
        assert time.perf_counter() - start < LIMIT, text
    assert outcomes.count("refused") > 60
    assert outcomes.count("read") > 10
