"""The documents are true where a machine can tell: code parses, scenes check, links resolve, names are documented."""

import ast
import inspect
import re
import tomllib
from pathlib import Path

import pytest

import mpad_core
from mpad_core.plugins.registry import KINDS, installed
from mpad_core.scene.files import parse_scene

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *ROOT.glob("plugins/*/README.md")])
BLOCK = re.compile(r"^```(?P<language>\w*)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?P<target>[^)\s]+)\)")
WIDEST = 125
# marketing, and what a page about a program need not talk about
FORBIDDEN = (
    "blazing",
    "cutting-edge",
    "state-of-the-art",
    "seamless",
    "world-class",
    "effortless",
    "revolution",
    "robustly",
)
STRANGERS = {"dembo-spring": "bell"}  # parts of the tutorial, which is not installed here, and what stands in for them


def blocks(*languages: str) -> list[tuple[str, str]]:
    """Give the code blocks of all pages in some languages, with where they stand."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for block in BLOCK.finditer(text):
            if block["language"] in languages:
                line = text.count("\n", 0, block.start()) + 1
                found.append((f"{page.relative_to(ROOT)}:{line}", block["text"]))
    return found


def anchors(page: Path) -> set[str]:
    """Give the anchors of a page's headings."""
    heads = re.findall(r"^#+ (.+)$", BLOCK.sub("", page.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).strip().replace(" ", "-") for head in heads}


@pytest.mark.parametrize(("where", "code"), blocks("python", "py"))
def test_python_parses(where: str, code: str) -> None:
    tree = ast.parse(code, where)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == "mpad_core":
            assert {name.name for name in node.names} <= set(mpad_core.__all__), where


@pytest.mark.parametrize(("where", "text"), blocks("toml"))
def test_toml_parses_and_scenes_are_scenes(where: str, text: str) -> None:
    data = tomllib.loads(text)
    if {"solver", "stop", "fluid"} <= set(data):
        check_scene(text, where)


def check_scene(text: str, where: str) -> None:
    """Check a scene; a part of the tutorial's gives its place to one with parameters of its own."""
    if any(name in text for name in STRANGERS):
        text = re.sub(r'model = \{ name = "dembo-spring".*\}', 'model = { name = "bell", off_rate = "2 1/s" }', text)
    parse_scene(text, where)


@pytest.mark.parametrize("file", [*sorted((ROOT / "examples").glob("*.toml")), ROOT / "docs/tutorial/rolling.toml"])
def test_scenes_that_are_shipped_are_scenes(file: Path) -> None:
    check_scene(file.read_text(encoding="utf-8"), file.name)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_resolve(page: Path) -> None:
    text = BLOCK.sub("", page.read_text(encoding="utf-8"))
    for target in LINK.findall(text):
        if re.match(r"[a-z]+:", target):
            assert target.startswith("https://"), target
            continue
        path, _, anchor = target.partition("#")
        aim = (page.parent / path).resolve() if path else page
        assert aim.exists(), f"{page.name}: {target}"
        assert aim.is_relative_to(ROOT), f"{page.name}: {target} leads out of the repository"
        if anchor and aim.suffix == ".md":
            assert anchor in anchors(aim), f"{page.name}: {target}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_pages_are_plain(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert not [word for word in FORBIDDEN if word in text.lower()]
    too_wide = [line for line in text.splitlines() if len(line) > WIDEST and not line.startswith("|")]
    assert not too_wide
    assert not re.search(r"(?<![\w/])/(?:home|root|work|tmp|Users)/", text), "a path of somebody's machine"


def test_every_page_is_reached_from_the_index() -> None:
    docs = ROOT / "docs"
    reached = {
        (docs / link.partition("#")[0]).resolve() for link in LINK.findall((docs / "index.md").read_text("utf-8"))
    }
    assert [page.name for page in docs.rglob("*.md") if page.name != "index.md" and page.resolve() not in reached] == []


def test_the_tutorial_shows_its_own_files() -> None:
    page = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    files = [f for f in (ROOT / "docs/tutorial").rglob("*") if f.suffix in (".py", ".toml")]
    texts = [file.read_text(encoding="utf-8") for file in files]
    shown = [found["text"] for found in BLOCK.finditer(page) if found["language"] in ("python", "toml")]
    assert len(shown) == len(files) == 4
    for block in shown:
        assert any(block in text for text in texts), block[:80]


def test_parts_page_names_every_hook() -> None:
    page = (ROOT / "docs/plugins.md").read_text(encoding="utf-8")
    for kind, entry in KINDS.items():
        assert f"| `{kind}.<name>` | `{entry.hook}` |" in page


def test_readme_names_every_part_that_is_shipped() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    own = {folder.name for folder in (ROOT / "plugins").iterdir()}
    for part in installed():
        if part.distribution in own:
            assert f"`{part.name}`" in text, part
            assert f"`{part.distribution}`" in text, part


@pytest.mark.parametrize("name", mpad_core.__all__)
def test_public_names_are_documented(name: str) -> None:
    found = getattr(mpad_core, name)
    if name in ("Array", "hookimpl"):
        return  # an alias of numpy's, and pluggy's own marker
    doc = inspect.getdoc(found)
    assert doc, name
    assert len(doc.splitlines()[0]) > 10, name
    if inspect.isfunction(found):
        parameters = [p for p in inspect.signature(found).parameters.values() if p.kind is not p.VAR_KEYWORD]
        if len(parameters) > 1:
            assert "Parameters\n----------" in doc, name


def test_public_names_are_those_that_resolve() -> None:
    assert sorted(mpad_core.__all__) == mpad_core.__all__
    assert set(dir(mpad_core)) == set(mpad_core.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        getattr(mpad_core, "nothing")  # noqa: B009  # a name that type checkers know is not there
