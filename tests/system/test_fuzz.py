"""Scene files mutated at random, through the command line: refused in clear lines, or good enough to run."""

import random
import subprocess
import sys
from pathlib import Path

import pytest

from mpad_core import cli

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
IN_PROCESS, IN_BATCHES, BATCH, RUN = 300, 40, 10, 6
ODDITIES = [
    "1", "-1", "0", "1e400", "nan", "inf", "true", "[]", "{}", '""', '"x"', '"1 um"', '"0 um"', '"-5 um"', '"1e30 um"',
    '"1e-30 um"', '"5 km^99"', '"5 degC"', '"rpb"', '"isolated"', '"bell"', '"free"', '"roller"', "1979-05-27",
    "{ name = 1 }", '{ name = "bell" }', '"\\u0000"', '["free"]', "9" * 60, '"1 s"', '"1e9 1/s"', '"0 1/um^2"',
    '"1e7 1/um^2"', "[[[]]]", '"on"', '"off"', '"pairs"', '"boltzmann_gap"', '"linear"',
]  # fmt: skip
VALUES = ["0 um", "1e300 km", "-1 s", "", "free", "2 1/um^2", "1e-9 um", "7 um", "100 1/s", "1 pN", "roller.caught"]


def mutate(text, dice):
    """Change a scene in one of the ways that people and accidents do."""
    lines = text.split("\n")
    with_values = [i for i, line in enumerate(lines) if " = " in line]
    kind = dice.randrange(9)
    place = dice.randrange(len(lines))
    if kind == 0 and with_values:
        chosen = dice.choice(with_values)
        lines[chosen] = lines[chosen].partition(" = ")[0] + " = " + dice.choice(ODDITIES)
    elif kind == 1:
        del lines[place]
    elif kind == 2:
        lines.insert(place, dice.choice(lines))
    elif kind == 3:
        pieces = text.split('"')
        pieces[dice.randrange(len(pieces))] = dice.choice(VALUES)
        return '"'.join(pieces)
    elif kind == 4:
        at = dice.randrange(len(text))
        return text[:at] + chr(ord(text[at]) ^ (1 << dice.randrange(7))) + text[at + 1 :]
    elif kind == 5:
        at, to = sorted(dice.randrange(len(text)) for _ in "ab")
        return text[:at] + text[min(to, at + 40) :]
    elif kind == 6:
        words = text.split(" ")
        one, other = dice.randrange(len(words)), dice.randrange(len(words))
        words[one], words[other] = words[other], words[one]
        return " ".join(words)
    elif kind == 7:
        digits = [i for i, letter in enumerate(text) if letter.isdigit()]
        if digits:
            at = dice.choice(digits)
            return text[:at] + dice.choice(["0", "9", "-", "e", ".", "99"]) + text[at + 1 :]
    else:
        at = dice.randrange(len(text))
        return text[:at] + dice.choice(['"', "'", "[", "]", "{", "}", "=", "\n", "#", ".", "\x00", "é"]) + text[at:]
    return "\n".join(lines)


def mutants(number, seed):
    dice = random.Random(seed)
    texts = [(ROOT / "examples" / f"{name}.toml").read_text() for name in ("recruitment", "capture")]
    for _ in range(number):
        text = dice.choice(texts)
        for _ in range(dice.choice([1, 1, 1, 2, 4])):
            text = mutate(text, dice) or " "
        yield text


def judged(code, out, err, path, text):
    """Allow two outcomes only; tell which."""
    assert "Traceback" not in err, text
    if code == 0:
        assert "effects:" in out, text
        assert err == "", text
        return True
    assert code == 2, (code, err, text)
    lines = err.splitlines()
    assert lines, text
    assert len(lines) <= 60, text
    for line in lines:
        assert len(line) <= 400, line
        assert line.isprintable(), line
        assert line.startswith((f"{path}:", "solver ", "groups.", "effects.")), line
    return False


@pytest.fixture
def check(monkeypatch, capsys):
    def call(*words):
        monkeypatch.setattr(sys, "argv", ["mpad", *map(str, words)])
        code = 0
        try:
            cli.main()
        except SystemExit as leaving:
            code = leaving.code or 0
        return code, *capsys.readouterr()

    return call


def test_in_this_process(check, tmp_path):
    path = tmp_path / "scene.toml"
    good = 0
    for text in mutants(IN_PROCESS, 8128):
        path.write_text(text)
        good += judged(*check("check", path), path, text)
    assert 20 < good < IN_PROCESS - 60


def test_in_processes_of_their_own(tmp_path):
    texts = list(mutants(IN_BATCHES, 496))
    for first in range(0, len(texts), BATCH):
        running = []
        for number, text in enumerate(texts[first : first + BATCH], first):
            path = tmp_path / f"{number}.toml"
            path.write_text(text)
            words = [sys.executable, "-m", "mpad_core", "check", str(path)]
            running.append((path, text, subprocess.Popen(words, stdout=-1, stderr=-1, text=True)))
        for path, text, process in running:
            out, err = process.communicate(timeout=60)
            judged(process.returncode, out, err, path, text)


def test_some_of_the_good_ones_run(check, tmp_path):
    """A scene that passes the check also begins; the numerics may refuse, in one line."""
    ran, path = 0, tmp_path / "scene.toml"
    short = ("--set", 'stop.time="0.2 ms"')
    for number, text in enumerate(mutants(IN_PROCESS, 33550336)):
        if ran == RUN:
            break
        path.write_text(text)
        quick = short
        if 'rolling_alone = "1 s"' in text:
            quick = (*short, "--set", 'cells.roller.start.rolling_alone="1 ms"')
        if check("check", path, *quick)[0]:
            continue
        code, out, err = check("run", path, "-o", tmp_path / f"run-{number}", *quick)
        assert code in (0, 70), (err, text)
        assert "Traceback" not in err
        assert ("written to" in out) == (code == 0)
        ran += 1
    assert ran == RUN
