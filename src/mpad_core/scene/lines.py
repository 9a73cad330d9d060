"""On which line of a TOML text a key stands, and whether the text may be parsed at all.

The standard parser gives no lines for what it has read, and takes seconds for a key of thousands of parts.
"""

import re
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from typing import Final

from attrs import define, field, frozen

from mpad_core.scene.faults import Path

LARGEST_TEXT: Final = 1_000_000  # bytes; tomllib takes 2 s for 10 MB
LONGEST_KEY: Final = 200  # characters outside quotes; tomllib takes 14 s for a key of 20,000 parts
DEEPEST: Final = 32  # tomllib raises RecursionError near 3,000

_TOKEN = re.compile(
    r"""
      (?P<comment>\#[^\n]*+)
    | (?P<text>\"{3}(?:[^\\]|\\.)*?\"{3,5} | '{3}.*?'{3,5} | "(?:[^"\\\n]|\\[^\n])*+" | '[^'\n]*+')
    | (?P<newline>\n)
    | (?P<space>[ \t\r]+)
    | (?P<mark>[\[\]{}=,.])
    | (?P<bare>[^\s\[\]{}=,.\#"']+)
    | (?P<stray>.)
    """,
    re.VERBOSE | re.DOTALL,
)


@frozen
class Token:
    """A piece of TOML text."""

    kind: str
    text: str
    line: int


def tokens(text: str) -> Iterator[Token]:
    """Cut a text into pieces, all of it, whether or not it is TOML."""
    line = 1
    for match in _TOKEN.finditer(text):
        yield Token(match.lastgroup or "", match[0], line)
        line += match[0].count("\n")


def refusal(text: str) -> tuple[int, str] | None:
    """Say why a text must not be parsed, with the line; None if it may be."""
    depth = run = dots = 0
    for token in tokens(text):
        if token.kind == "newline" or (token.kind == "mark" and token.text != "."):
            run = dots = 0
            depth = max(0, depth + (token.text in "[{") - (token.text in "]}"))
        elif token.kind not in ("comment", "space", "text"):
            run += len(token.text)
            dots += token.text == "."
        if run > LONGEST_KEY:
            return token.line, f"a key or number has more than {LONGEST_KEY} characters; shorten it"
        if depth + dots > DEEPEST:
            return token.line, f"nested deeper than {DEEPEST}; a scene needs no more than five levels"
    return None


@define
class _Reader:
    """Walks through valid TOML and notes the line of each path."""

    rest: list[Token]
    place: int = 0
    lines: dict[Path, int] = field(factory=dict)
    arrays: dict[Path, int] = field(factory=dict)  # index of the last table of each array of tables

    def peek(self) -> Token:
        return self.rest[self.place]

    def take(self) -> Token:
        self.place += 1
        return self.rest[self.place - 1]

    def took(self, *marks: str) -> bool:
        """Step over one of these, if it is next."""
        found = self.peek().text in marks and self.peek().kind in ("mark", "newline")
        self.place += found
        return found

    def note(self, path: Path, line: int) -> None:
        for size in range(1, len(path) + 1):
            self.lines.setdefault(path[:size], line)

    def key(self) -> tuple[str, ...]:
        """Read a dotted key."""
        parts = [_unquoted(self.take())]
        while self.took("."):
            parts.append(_unquoted(self.take()))
        return tuple(parts)

    def document(self) -> None:
        table: Path = ()
        while True:
            if self.took("\n"):
                continue
            if self.took("["):
                table = self.header()
            else:
                self.pair(table)

    def header(self) -> Path:
        line, many = self.peek().line, self.took("[")
        path: Path = ()
        names = self.key()
        for index, name in enumerate(names):
            path += (name,)
            if many and index == len(names) - 1:
                self.arrays[path] = self.arrays.get(path, -1) + 1
            if path in self.arrays:
                path += (self.arrays[path],)
        self.note(path, line)
        while self.took("]"):
            pass
        return path

    def pair(self, table: Path) -> None:
        line = self.peek().line
        path = table + self.key()
        self.note(path, line)
        self.place += 1  # the equals sign
        self.value(path)

    def value(self, path: Path) -> None:
        if self.took("["):
            self.array(path)
        elif self.took("{"):
            while not self.took("}"):
                if not self.took(",", "\n"):
                    self.pair(path)
        else:
            while self.peek().text not in (",", "]", "}", "\n"):
                self.take()

    def array(self, path: Path) -> None:
        index = 0
        while not self.took("]"):
            if not self.took(",", "\n"):
                self.note((*path, index), self.peek().line)
                self.value((*path, index))
                index += 1


def _unquoted(token: Token) -> str:
    return str(tomllib.loads(f"key = {token.text}")["key"]) if token.kind == "text" else token.text


def _reader(text: str) -> _Reader:
    kept = [token for token in tokens(text) if token.kind not in ("comment", "space")]
    return _Reader([*kept, Token("end", "", 0)])


def key_lines(text: str) -> dict[Path, int]:
    """Map the path of every key of a TOML text to its line, counted from 1."""
    reader = _reader(text)
    with suppress(IndexError):  # the end of the text
        reader.document()
    return reader.lines


def first_key(text: str) -> tuple[str, ...]:
    """Give the dotted key that a TOML text starts with; empty if it starts with none."""
    try:
        return _reader(text).key()
    except (IndexError, tomllib.TOMLDecodeError):
        return ()
