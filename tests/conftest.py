"""Set-up of the whole test run: how slow and broad a test is, where it hangs, what it leaves.

The marks `wide` and `night` (pyproject.toml) stand at the tests. Of a test with wide sets of
parameters one is not left to the night: the first or the last, by the test's name.
"""

from __future__ import annotations

import faulthandler
import gc
import os
import re
from collections.abc import Generator, Sequence
from pathlib import Path
from zlib import crc32

import pytest
from _pytest.nodeid import coerce_node_id
from hypothesis import settings

# How long an example takes says how busy the machine is, and nothing about the code.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

_TESTS = Path(__file__).parent

_WIDE_FILE = re.compile(r"^pytestmark = \[?\s*pytest\.mark\.(wide|night)\b", re.MULTILINE)
_WIDE_TEST = re.compile(r"\bmark\.(wide|night)")

_STDERR = pytest.StashKey[int]()
"""The standard error that no test captures"""

_GRACE_S = 60.0


def pytest_addoption(parser: pytest.Parser) -> None:
    """Offer to update what recordings give."""
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="keep what tests/replay/test_golden.py finds now, instead of comparing it",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Keep the standard error, which is not captured yet."""
    config.stash[_STDERR] = os.dup(2)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """End the process of a test that does not end at its timeout, and show where it hangs.

    pytest-timeout raises in the main thread. That comes to nothing in a call of a C library that
    never returns, and where the exception is swallowed.
    """
    mark = item.get_closest_marker("timeout")
    limit_s = float(item.config.getini("timeout") if mark is None else mark.args[0])
    file = item.config.stash[_STDERR]
    faulthandler.dump_traceback_later(limit_s + _GRACE_S, exit=True, file=file)
    try:
        return (yield)
    finally:
        faulthandler.cancel_dump_traceback_later()


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out the files of which the run needs nothing: importing them costs each worker time."""
    if not collection_path.name.startswith("test_"):
        return None
    text = collection_path.read_text("utf-8")
    if config.option.markexpr == "not wide":
        return (
            bool(re.search(r"^pytestmark = \[?\s*pytest\.mark\.wide\b", text, re.MULTILINE)) or None
        )
    is_quick = re.search(r"\bmark\.(wide|night)", text) is None
    return (config.option.markexpr.startswith(("wide", "night")) and is_quick) or None


@pytest.hookimpl(tryfirst=True, specname="pytest_collection_modifyitems")
def pytest_mark_sets_of_parameters(items: list[pytest.Item]) -> None:
    """Mark the sets of parameters, before the marks select."""
    functions: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.path.is_relative_to(_TESTS):
            functions.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for tests in functions.values():
        _mark(tests)


def _mark(tests: Sequence[pytest.Item]) -> None:
    """Mark those of one function that differ in their parameters."""
    for mark in ("wide", "night"):
        for item in tests[1:]:
            if item.get_closest_marker(f"{mark}_but_first"):
                item.add_marker(mark)
    for item in tests:
        if item.get_closest_marker("night"):
            item.add_marker("wide")
    # Of some tests the one, of others the other: often they are an ArduPilot's and a PX4's.
    is_first = tests[0].get_closest_marker("night_but_first") is not None
    is_first = is_first or crc32(tests[0].name.partition("[")[0].encode()) % 2 == 0
    for item in tests[1:] if is_first else tests[:-1]:
        if item.get_closest_marker("wide") and not item.get_closest_marker("by_day"):
            item.add_marker("night")


def pytest_collection_finish() -> None:
    """Let the garbage collector pass by all that stays to the end of the run.

    Walking through some thousand tests and all modules again and again took a sixth of the time.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Free what the tests of a file have left: 30 MB for each flight of a simulated vehicle."""
    if nextitem is None or nextitem.path != item.path:
        gc.collect()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep the tests of a group in one process, and those of a file that share a fixture.

    pytest-xdist 3.8 writes the group to where pytest 9.2 no longer looks for a test's name, and
    `--dist loadgroup` does nothing.
    """
    if not config.getoption("loadgroup", False):
        return
    for item in items:
        mark = item.get_closest_marker("xdist_group")
        group = mark.args[0] if mark is not None else _shared(item)
        if group and "@" not in item.nodeid:
            item._id = coerce_node_id(f"{item.nodeid}@{group}")


def _shared(item: pytest.Item) -> str:
    """Return the file of a test that uses a fixture of the whole file, or nothing."""
    fixtures = getattr(item, "_fixtureinfo", None)
    if fixtures is None:
        return ""
    scopes = {each.scope for same in fixtures.name2fixturedefs.values() for each in same}
    return item.path.stem if "module" in scopes else ""
