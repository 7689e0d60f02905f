"""Docs, texts and docstrings avoid the words that the glossary of CONTRIBUTING.md rules out."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

pytestmark = pytest.mark.xdist_group("test_glossary")  # it reads each module once

ROOT = Path(__file__).resolve().parents[2]
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
PAGES = sorted(
    [
        *ROOT.glob("*.md"),
        *ROOT.glob("docs/**/*.md"),
        *ROOT.glob("sitl/*.md"),
        *ROOT.glob("sitl/docs/*.md"),
        *ROOT.glob("src/*/*.md"),
    ]
)
SOURCES = sorted(
    path
    for folder in ("src", "sitl", "scripts", "tests")
    for path in (ROOT / folder).glob("**/*.py")
    if "build" not in path.relative_to(ROOT).parts
)
# Right in other meanings: these are left to the reader.
AMBIGUOUS = {
    "way", "waypoints", "place", "point", "tell", "say", "station", "wait", "stand", "lift",
    "command", "height", "direction", "hold up", "how near",
}  # fmt: skip
# A verb's other forms: the glossary has its first one.
FORMS = {"refuse": r"refus(?:e|es|ed|ing)", "refusal": r"refusals?", "go on": r"go(?:es|ing)? on"}


def _section() -> str:
    return CONTRIBUTING.split("## Words\n", 1)[1].split("\n## ", 1)[0]


@cache
def ruled_out() -> re.Pattern[str]:
    """Return a pattern of the words after *not* that have one meaning only."""
    lists = re.findall(r"not \*([^*]+)\*", _section())
    words = {word.strip() for words in lists for word in words.split(",")}
    assert words >= AMBIGUOUS, AMBIGUOUS - words
    forms = [FORMS.get(word, re.escape(word)) for word in sorted(words - AMBIGUOUS)]
    return re.compile(rf"(?<![\w-])(?:{'|'.join(forms)})(?![\w-])", re.IGNORECASE)


class Words(NamedTuple):
    """The words of a module.

    Attributes:
        docstring: of the module.
        strings: line and words of each docstring and of each string of three words.
        names_and_docstrings: of its tests, classes and functions.
    """

    docstring: str
    strings: list[tuple[int, str]]
    names_and_docstrings: list[str]


@cache
def words_of(path: Path) -> Words:
    tree = ast.parse(path.read_text("utf-8"))
    words = Words(ast.get_docstring(tree) or "", [], [])
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            named = re.sub(r"^ *\w+: ", "", node.value, flags=re.MULTILINE)  # an argument, a field
            text = re.sub(r"`[^`]*`|'[^']*'", "", named)
            if len(re.findall(r"[A-Za-z]{2,}", text)) >= 3:
                words.strings.append((node.lineno, text))
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            docstring = ast.get_docstring(node) or ""
            words.names_and_docstrings.append(re.sub(r"`[^`]*`|'[^']*'", "", docstring))
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            words.names_and_docstrings.append(node.name.replace("_", " "))
    return words


def test_the_glossary_is_read() -> None:
    assert ruled_out().search("it is planned anew")
    assert ruled_out().search("The goal was refused.")
    assert not ruled_out().search("MODE_REFUSED: the vehicle rejected the mode")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_goes_by_the_glossary(page: Path) -> None:
    text = page.read_text("utf-8").replace(_section(), "")
    text = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"`[^`]*`", "", text)
    assert ruled_out().findall(re.sub(r"\s+", " ", text)) == []


@pytest.mark.parametrize("folder", ["src", "sitl", "scripts"])
def test_texts_and_docstrings_go_by_the_glossary(folder: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {match[0]}"
        for path in SOURCES
        if path.is_relative_to(ROOT / folder)
        for line, text in words_of(path).strings
        for match in ruled_out().finditer(re.sub(r"\s+", " ", text))
    ]
    assert found == []


def test_names_and_docstrings_of_tests_go_by_the_glossary() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {match[0]}"
        for path in SOURCES
        if path.is_relative_to(ROOT / "tests") or path.is_relative_to(ROOT / "sitl/tests")
        for text in words_of(path).names_and_docstrings
        for match in ruled_out().finditer(re.sub(r"\s+", " ", text))
    ]
    assert found == []


def test_no_module_docstring_begins_with_a_question_word() -> None:
    for path in SOURCES:
        first = words_of(path).docstring.split(" ")[0]
        assert first not in {"What", "Who", "How", "Which"}, path.relative_to(ROOT)
