"""ArduPilot's suite of a vehicle, with the simulated autopilot in the place of its program."""

from __future__ import annotations

import importlib
import os
import re
import sys
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

CLASSES = {
    "copter": ("arducopter", "AutoTestCopter"),
    "rover": ("rover", "AutoTestRover"),
    "plane": ("arduplane", "AutoTestPlane"),
}
_FIRMWARE = Path(__file__).resolve().with_name("firmware.py")
_PORTS_EACH = 20
_OWN_PORTS = frozenset(("5762", "5763"))
"""Of the second and third serial port"""
_QUOTED = re.compile(r"""["']([A-Z][A-Z0-9]{1,11}_[A-Z0-9_]{1,14})["']\s*[:,)]""")
_AT_BEGIN = re.compile(r"^([A-Z][A-Z0-9]*_[A-Z0-9_]+)[\s,]", re.MULTILINE)


def test_names(checkout: Path, vehicle: str) -> list[str]:
    """Return the names of all tests of a suite."""
    return sorted(test.name for test in _tests(suite_of(checkout, vehicle, 1.0, 0)))


def run_one(checkout: Path, vehicle: str, name: str, speedup: float, place: int) -> NoReturn:
    """Run a test, and end this process: exit code 0 if it passed, 1 if not.

    The suite has a thread that would keep the process alive after an error.

    Args:
        checkout: ArduPilot's sources.
        vehicle: one of `CLASSES`.
        name: of the test.
        speedup: simulated seconds per second.
        place: of those that run at the same time, from 0 on; each has ports of its own.
    """
    passed = False
    try:
        suite = suite_of(checkout, vehicle, speedup, place)
        results = suite.run_tests([test for test in _tests(suite) if test.name == name])
        passed = bool(results) and all(result.passed for result in results)
    except Exception:
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0 if passed else 1)


def suite_of(checkout: Path, vehicle: str, speedup: float, place: int) -> Any:
    """Return the suite of a vehicle, its launcher replaced.

    Raises:
        FileNotFoundError: the folder is no checkout.
        ImportError: the suite needs a module that is not installed.
    """
    folder = checkout / "Tools" / "autotest"
    if not (folder / "vehicle_test_suite.py").is_file():
        raise FileNotFoundError(f"{folder} has no vehicle_test_suite.py")
    sys.path.insert(0, str(folder))
    os.chdir(checkout)
    # `Parameters` runs it as a program; a checkout that was unpacked may have lost that right.
    (folder / "param_metadata" / "param_parse.py").chmod(0o755)
    module: Any = importlib.import_module(CLASSES[vehicle][0])
    util: Any = importlib.import_module("pysim.util")
    suite = getattr(module, CLASSES[vehicle][1])("none", speedup=speedup, logs_dir=None)
    first = _PORTS_EACH * place
    suite.adjust_ardupilot_port = lambda port: port + first
    suite.sitl_rcin_port = lambda offset=0: 5501 + offset + first
    suite.spare_network_port = lambda offset=0: 8000 + offset + first
    util.start_SITL = _launcher(vehicle, suite, _hidden(folder))
    _move_connections(first)
    return suite


def _move_connections(distance: int) -> None:
    """Have the suite's further connections, to ports that it knows by heart, reach this vehicle."""
    mavutil: Any = importlib.import_module("pymavlink.mavutil")
    connect = mavutil.mavlink_connection

    def connect_here(device: str, *args: Any, **options: Any) -> Any:
        host, _, port = device.rpartition(":")
        if host.startswith("tcp:") and port in _OWN_PORTS:
            device = f"{host}:{int(port) + distance}"
        return connect(device, *args, **options)

    mavutil.mavlink_connection = connect_here


def _hidden(folder: Path) -> Path:
    """Write the names of parameters in the suite and its files, and return the file.

    Many belong to parts of the firmware that are switched off: known, but not in its list.
    """
    sources = [*folder.glob("*.py"), *folder.glob("default_params/*.parm")]
    found: set[str] = set()
    for source in sources:
        pattern = _QUOTED if source.suffix == ".py" else _AT_BEGIN
        found.update(pattern.findall(source.read_text(encoding="utf-8", errors="replace")))
    names = sorted(name for name in found if not name.startswith("MAV_"))
    file = Path(tempfile.mkdtemp(prefix="autotest_")) / "hidden.txt"
    file.write_text("\n".join(names), encoding="utf-8")
    return file


def _launcher(vehicle: str, suite: Any, hidden: Path) -> Callable[..., Any]:
    """Return what stands in for the suite's launcher of the firmware."""
    pexpect = importlib.import_module("pexpect")

    def start(_binary: str, **options: Any) -> Any:
        words = [str(_FIRMWARE), "--vehicle", vehicle]
        words += [f"--home={options['home']}", f"--speedup={options['speedup']}"]
        words += [f"--port={suite.adjust_ardupilot_port(5760)}"]
        words += [f"--sticks-port={suite.sitl_rcin_port()}"]
        words += [f"--hidden={hidden}"]
        defaults = options.get("defaults_filepath") or []
        files = [defaults] if isinstance(defaults, str) else list(defaults)
        if files:
            words += ["--defaults", *files]
        child = pexpect.spawn(sys.executable, words, timeout=60, encoding="utf-8")
        child.expect("Listening on")
        return child

    return start


def _tests(suite: Any) -> list[Any]:
    module = importlib.import_module("vehicle_test_suite")
    return [test if hasattr(test, "name") else module.Test(test) for test in suite.tests()]
