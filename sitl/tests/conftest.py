"""Set-up of the simulator's tests: how slow and broad a test is.

`wide` marks the files and tests that are slow and broad, `night` those that wait for the night. Of
all others, only the first set of parameters is quick, and the rest wait for the night: a kind of
vehicle, a link or a recording of each. Of wide sets the last one does not.
"""

from __future__ import annotations

import gc
import re
from pathlib import Path

import pytest
from hypothesis import settings

# How long an example takes says how busy the machine is, and nothing about the code.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out the files of which the run needs nothing: importing them takes time."""
    if not collection_path.name.startswith("test_"):
        return None
    text = collection_path.read_text("utf-8")
    if config.option.markexpr == "not wide":
        return bool(re.search(r"^pytestmark = \[?pytest\.mark\.wide\b", text, re.MULTILINE)) or None
    is_marked = re.search(r"\bmark\.(wide|night)", text) is not None
    is_quick = not is_marked and "parametrize" not in text and "params=" not in text
    return (config.option.markexpr.startswith(("wide", "night")) and is_quick) or None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the sets of parameters, before the marks select."""
    functions: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.path.is_relative_to(Path(__file__).parent):
            functions.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for tests in functions.values():
        for item in tests:
            if item.get_closest_marker("night"):
                item.add_marker("wide")
        is_wide = tests[0].get_closest_marker("wide") is not None
        rest = tests[:-1] if is_wide else tests[1:]
        for item in tests[1:]:
            item.add_marker("wide")
        for item in rest:
            item.add_marker("night")


def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Free what the tests of a file have left: 30 MB for each flight of a simulated vehicle."""
    if nextitem is None or nextitem.path != item.path:
        gc.collect()
