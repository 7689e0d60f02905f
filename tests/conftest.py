"""Set-up of the whole test run."""

from __future__ import annotations

import faulthandler
import gc
import os
from collections.abc import Generator
from pathlib import Path

import pytest
from _pytest.nodeid import coerce_node_id
from hypothesis import settings

from tests.wide import is_left_out, is_wide, of_the_night

# How long an example takes says how busy the machine is, and nothing about the code.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

_FUNCTIONS = pytest.StashKey[set[str]]()
"""The tests of which some parameters were collected"""

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
    """Leave out the files of which the run needs nothing."""
    if not collection_path.name.startswith("test_"):
        return None
    file = collection_path.relative_to(Path(__file__).parent).as_posix()
    return is_left_out(file, config.option.markexpr) or None


def pytest_sessionstart(session: pytest.Session) -> None:
    """Begin with no test collected."""
    session.stash[_FUNCTIONS] = set()


@pytest.hookimpl(tryfirst=True)
def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark what only `make test-all` runs."""
    file = _file(item)
    function = item.nodeid.partition("[")[0]
    if is_wide(file, item.name, is_first=function not in item.session.stash[_FUNCTIONS]):
        item.add_marker("wide")
    item.session.stash[_FUNCTIONS].add(function)


@pytest.hookimpl(tryfirst=True, specname="pytest_collection_modifyitems")
def pytest_mark_the_night(items: list[pytest.Item]) -> None:
    """Mark what only `make test-night` runs, before the marks select."""
    own = [item for item in items if item.path.is_relative_to(Path(__file__).parent)]
    wide = [item for item in own if item.get_closest_marker("wide")]
    for place in of_the_night([(_file(item), item.name) for item in wide]):
        wide[place].add_marker("night")


def _file(item: pytest.Item) -> str:
    return item.path.relative_to(Path(__file__).parent).as_posix()


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
