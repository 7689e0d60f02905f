"""Runs dronekit-python's own tests with the simulated ArduCopter in place of the real one.

    python -m interop.dronekit_suite CHECKOUT [NAME ...]

CHECKOUT is a clone of dronekit/dronekit-python. Nothing of it is in this repository, and nothing is
downloaded; docs/suites.md has the results.
"""

from __future__ import annotations

import argparse
import contextlib
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from sitl_support.programs import environment
from sitl_support.tally import Outcome, Tally

SUITES = ("sitl", "unit")
LIMIT_S = 150.0
STARTS_IN_S = 90.0
EXPECTED_TO_FAIL: dict[str, str] = {
    "sitl.test_capability_and_version.test_115": "expects no MAVFTP; ArduCopter 4 has it",
    "sitl.test_channels.test_timeout": "expects 8 channels; RC_CHANNELS has 18",
    "sitl.test_errprinter.test_115": "expects 'APM:Copter', the name of ArduCopter until 2016",
    "sitl.test_sensor_calibration.test_magnetometer_calibration": "expects UNSUPPORTED; "
    "ArduCopter 4 calibrates its compasses",
    "sitl.test_sensor_calibration.test_simple_accelerometer_calibration": "expects a failure; "
    "ArduCopter 4 calibrates",
    "sitl.test_sensor_calibration.test_accelerometer_calibration": "expects a failure after a "
    "calibration by hand; it is not modelled, and UNSUPPORTED",
    "sitl.test_waypoints.test_parameter": "expects no home position at first; the simulated "
    "copter has one within two seconds",
}
"""By name of the test: why it stays out"""


def tests_of(checkout: Path) -> list[tuple[str, str]]:
    """The tests in a checkout: module below `dronekit.test`, and function."""
    found = []
    for suite in SUITES:
        for path in sorted((checkout / "dronekit/test" / suite).glob("test_*.py")):
            names = re.findall(r"^def (test\w*)\(", path.read_text("utf-8"), re.MULTILINE)
            found += [(f"{suite}.{path.stem}", name) for name in names]
    return found


@contextlib.contextmanager
def listening_copter(speedup: float) -> Iterator[int]:
    """A simulated copter on a free TCP port, as the launcher of the tests has one."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    link = ["--link", f"tcpin://127.0.0.1:{port}", "--speedup", str(speedup), "--quiet"]
    process = subprocess.Popen([sys.executable, "-m", "mavlink_sitl", *link], env=environment())
    try:
        _await_listener(port)
        yield port
    finally:
        process.kill()
        process.wait()


def _await_listener(port: int) -> None:
    limit_s = time.monotonic() + STARTS_IN_S
    while True:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
            return
        if time.monotonic() > limit_s:
            raise TimeoutError(f"the simulator does not listen on port {port}")
        time.sleep(0.05)


def run(checkout: Path, module: str, function: str, speedup: float) -> Outcome:
    """Run one test against a copter of its own."""
    adapter = [sys.executable, "-m", "interop.dronekit_adapter", str(checkout)]
    begun_s = time.monotonic()
    with listening_copter(speedup) as port:
        try:
            done = subprocess.run(
                [*adapter, module, function, str(port)],
                env=environment(PYTHONWARNINGS="ignore"),
                capture_output=True,
                text=True,
                timeout=LIMIT_S,
                check=False,
            )
            passed, output = done.returncode == 0, done.stdout + done.stderr
        except subprocess.TimeoutExpired as expired:
            passed, output = False, f"{_text(expired.stdout)}{_text(expired.stderr)}\ntimed out"
    last = output.strip().splitlines()[-1:] or [""]
    return Outcome(passed, last[0], output, time.monotonic() - begun_s)


def _text(output: bytes | str | None) -> str:
    return output.decode("utf-8", "replace") if isinstance(output, bytes) else output or ""


def main() -> int:
    """Run the suite; 0 when all is as expected, 1 when something is not, 2 for no checkout."""
    parser = argparse.ArgumentParser(description="Run dronekit-python's tests on the simulator.")
    parser.add_argument("checkout", type=Path, help="a clone of dronekit/dronekit-python")
    parser.add_argument("names", nargs="*", help="only tests whose name contains one of these")
    parser.add_argument("--speedup", type=float, default=1.0, help="of the simulator (default: 1)")
    parser.add_argument("--verbose", action="store_true", help="print what failing tests print")
    options = parser.parse_intermixed_args()
    # Whoever ends this also ends what it has started.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    found = tests_of(options.checkout)
    if not found:
        print(f"{options.checkout} is no checkout of dronekit-python.", file=sys.stderr)
        return 2
    tally = Tally(options.verbose)
    for module, function in found:
        name = f"{module}.{function}"
        if options.names and not any(part in name for part in options.names):
            continue
        outcome = run(options.checkout.resolve(), module, function, options.speedup)
        tally.add(name, outcome, EXPECTED_TO_FAIL.get(name))
    return tally.end()


if __name__ == "__main__":
    sys.exit(main())
