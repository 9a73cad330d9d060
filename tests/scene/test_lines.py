"""The line of each key, and what is refused before it is parsed."""

import time

import pytest

from mpad_core.scene.lines import DEEPEST, LONGEST_KEY, first_key, key_lines, refusal

TEXT = '''\
# a comment with [brackets] and key = 1
title = "a # no comment, [no] table"
long = """
[not.a.table]
x = 1
"""
after = 'literal \\'

[stop]
when = [  # comment ]
  "a.dx > 1 um",

  "b.caught",
  { deep = [1,
     2] },
]
[kinds.bead.sites]
slex = { layout = "uniform", inner = { a = 1, "b.c" = 2 } }
dotted.key . here = 2020-01-01 10:00:00
"quoted.key" = 1
'' = +1.5e-3
[[parts]]
name = "first"
[parts.sub]
x = 1
[[parts]]
name = "second"
[[parts.leaves]]
y = 1
[[parts.leaves]]
y = 2
["a\\u0062c"]
z = 1
'''


def line_of(*path: str | int) -> int:
    return key_lines(TEXT)[path]


@pytest.mark.parametrize(
    ("path", "beginning"),
    [
        (("title",), "title"),
        (("long",), "long"),
        (("after",), "after"),
        (("stop",), "[stop]"),
        (("stop", "when"), "when"),
        (("stop", "when", 0), '  "a.dx'),
        (("stop", "when", 1), '  "b.caught'),
        (("stop", "when", 2), "  { deep"),
        (("stop", "when", 2, "deep", 0), "  { deep"),
        (("stop", "when", 2, "deep", 1), "     2]"),
        (("kinds",), "[kinds"),
        (("kinds", "bead", "sites", "slex"), "slex"),
        (("kinds", "bead", "sites", "slex", "inner", "b.c"), "slex"),
        (("kinds", "bead", "sites", "dotted", "key", "here"), "dotted"),
        (("kinds", "bead", "sites", "quoted.key"), '"quoted'),
        (("kinds", "bead", "sites", ""), "''"),
        (("parts", 0), "[[parts]]"),
        (("parts", 0, "name"), 'name = "first"'),
        (("parts", 0, "sub", "x"), "x = 1"),
        (("parts", 1, "name"), 'name = "second"'),
        (("parts", 1, "leaves", 1, "y"), "y = 2"),
        (("abc", "z"), "z = 1"),
    ],
)
def test_finds_the_line_of_a_key(path: tuple[str | int, ...], beginning: str) -> None:
    line = TEXT.split("\n")[line_of(*path) - 1]
    assert line.startswith(beginning)


def test_a_key_within_long_text_is_none() -> None:
    assert ("not",) not in key_lines(TEXT)


def test_windows_line_ends_count_once() -> None:
    assert key_lines("a = 1\r\nb = 2\r\n[t]\r\nc = 3\r\n")["t", "c"] == 4


@pytest.mark.parametrize("text", ["", "=", "[", "a", "a.", "a = [", "a = {", "[[a", "a = {b", ']]}}"', "\x00"])
def test_odd_text_ends_quietly(text: str) -> None:
    key_lines(text)
    first_key(text)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a = 1\n" + "a." * 20_000 + "a = 1", 2),
        ("a = 1\n\n" + '"".' * 20_000 + "a = 1", 3),
        ("a = " + "[" * 5_000 + "]" * 5_000, 1),
        ("a = " + "{a=" * 5_000 + "1" + "}" * 5_000, 1),
        ("a" * (LONGEST_KEY + 1) + " = 1", 1),
        ("a = " + "9" * 5_000, 1),
        ("a." * (DEEPEST + 1) + "a = 1", 1),
    ],
)
def test_refuses_what_would_make_the_parser_slow_or_deep(text: str, line: int) -> None:
    start = time.perf_counter()
    refused = refusal(text)
    assert refused is not None
    assert refused[0] == line
    assert time.perf_counter() - start < 1


@pytest.mark.parametrize(
    "text",
    [
        TEXT,
        'a = "' + "x" * 1000 + '"',
        "# " + "[" * 1000,
        "a = [" + "[1], " * 1000 + "]",
        'a = """' + "[.{" * 1000 + '"""',
        "a = '''" + "[.{" * 1000 + "'''",
        "a = 1.5\n" * 1000,
    ],
)
def test_lets_ordinary_text_pass(text: str) -> None:
    assert refusal(text) is None
