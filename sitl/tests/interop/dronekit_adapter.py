"""Runs one of dronekit-python's own tests against a simulator: a process of its own.

    python -m interop.dronekit_adapter CHECKOUT MODULE FUNCTION PORT

The tests expect a launcher of the real firmware, a test runner that is no longer made, and two
small packages of the days of Python 2. Here are substitutes for the parts of those that the
tests use; the tests' own code is imported as it is.
"""

from __future__ import annotations

import importlib
import re
import socket
import sys
import time
import types
import unittest
from collections.abc import Callable
from pathlib import Path
from typing import Any

Test = Callable[..., None]
PORT = "5760"
RENAMED = {"THR_MIN": "WPNAV_SPEED"}
"""Parameters of the firmware of 2015 that the tests set, and others that there still are"""


def _module(name: str, **contents: Any) -> types.ModuleType:
    module = types.ModuleType(name)
    module.__dict__.update(contents)
    sys.modules[name] = module
    return module


def stand_in() -> None:
    """Provide `nose.tools`, `monotonic` and `past.builtins`, as far as they are used."""
    case = unittest.TestCase()
    asserts: dict[str, Any] = {
        "assert_equal": case.assertEqual,
        "assert_equals": case.assertEqual,
        "assert_not_equals": case.assertNotEqual,
        "assert_true": case.assertTrue,
        "assert_false": case.assertFalse,
        "with_setup": lambda *_: lambda test: test,
    }
    _module("nose", tools=_module("nose.tools", **asserts))
    _module("monotonic", monotonic=time.monotonic)
    _module("past", builtins=_module("past.builtins", basestring=str))
    _module("dronekit_sitl", SITL=object)


def main() -> int:
    """Run it; an exception ends the process with a traceback."""
    checkout, module, function, port = sys.argv[1:]
    stand_in()
    sys.path.insert(0, checkout)
    helpers = importlib.import_module("dronekit.test")

    def with_sitl(test: Test) -> Test:
        # The simulator runs already; the test gets its address, and nothing else changes.
        return lambda *args: test(f"tcp:127.0.0.1:{port}", *args)

    helpers.with_sitl = with_sitl  # type: ignore[attr-defined]
    tests = load(Path(checkout), f"dronekit.test.{module}")
    getattr(tests, function)()
    return 0


def load(checkout: Path, name: str) -> types.ModuleType:
    """Import a module of tests with the parameters of today, and a free port for its own server."""
    importlib.import_module(name.rpartition(".")[0])
    path = checkout / f"{name.replace('.', '/')}.py"
    source = path.read_text("utf-8")
    for old, new in {**RENAMED, PORT: str(free_port())}.items():
        source = re.sub(rf"\b{old}\b", new, source)
    module = _module(name, __file__=str(path))
    exec(compile(source, str(path), "exec"), module.__dict__)
    return module


def free_port() -> int:
    """A TCP port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


if __name__ == "__main__":
    sys.exit(main())
