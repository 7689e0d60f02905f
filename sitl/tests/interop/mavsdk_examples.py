"""Runs the examples of MAVSDK-Python with the simulated PX4 in place of the real one.

    python -m interop.mavsdk_examples CHECKOUT --python PYTHON [NAME ...]

CHECKOUT is a clone of mavlink/MAVSDK-Python; PYTHON an interpreter with `mavsdk` before version 4,
whose interface the examples use, `anyio` and `tqdm`. Nothing of it is in this repository, and
nothing is downloaded; docs/suites.md has the results.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from pytest_mavlink_sitl import simulator_process
from sitl_support.tally import Outcome, Tally

ADAPTER = Path(__file__).with_name("mavsdk_adapter.py")
LIMIT_S = 300.0
ENDLESS_S = 40.0
ENDLESS = {
    "goto", "manual_control",
    "highres_imu", "mavlink_direct_receive", "telemetry", "telemetry_flight_mode",
    "telemetry_is_armed_is_in_air", "telemetry_status_text",
}  # fmt: skip
"""These continue until somebody stops them"""
NOT_RUN = {
    "camera": "needs a camera",
    "camera_params": "needs a camera and a keyboard",
    "gimbal": "needs a gimbal",
    "gripper": "needs a gripper",
    "px4_ev_automation": "a demonstration of an electric vehicle's site",
    "px4_ev_automation_keyboard": "needs a keyboard",
    "rtk_base_ublox": "needs a receiver on a serial port",
    "transponder": "needs other aircraft",
    "winch": "needs a winch",
    "show_debug_output": "connects to nothing",
}
EXPECTED_TO_FAIL: dict[str, str] = {
    "calibration": "nobody turns the vehicle: the accelerometer fails, as in the real simulator",
    "ftp_download_file": "only boards have the file that it names, none in the real simulator",
}
"""By name of the example: why it stays out"""
DO_NOT_EXIT = {"offboard_position_velocity_ned": "-- Stopping offboard", "shell": "nsh>"}
"""The last words of those that leave a stream open: MAVSDK's process then never ends (3.17)"""
DO_NOT_EXIT_S = 90.0
BEFORE = {"logfile_download": "takeoff_and_land"}
"""The example to fly first, with the same vehicle: a vehicle that never flew has no log"""
PARAMETER_FILE = "# Vehicle-Id Component-Id Name Value Type\n1\t1\tMIS_TAKEOFF_ALT\t7.5\t9\n"
"""The file that `upload_params` uploads"""
HOME = "47.397742,8.545594,488,0"
"""Of PX4's own simulator: missions of the examples name places near it"""


def examples_of(checkout: Path) -> list[Path]:
    """The programs among the examples."""
    folder = checkout / "examples"
    return sorted([*folder.glob("*.py"), *folder.glob("offboard_from_csv/*.py")])


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def run(example: Path, python: str) -> Outcome:
    """Run one example, and what it needs before, against a copter of its own."""
    before = BEFORE.get(example.stem)
    with simulator_process("--autopilot", "px4", "--quiet", "--home", HOME) as port:
        if before is not None:
            first = _run(example.with_name(f"{before}.py"), python, port)
            if not first.passed:
                return first._replace(why=f"{before} before it: {first.why}")
        return _run(example, python, port)


def _run(example: Path, python: str, port: int) -> Outcome:
    """Run one example in its own folder of results."""
    begun_s = time.monotonic()
    endless, last_words = example.stem in ENDLESS, DO_NOT_EXIT.get(example.stem, "")
    limit_s = ENDLESS_S if endless else DO_NOT_EXIT_S if last_words else LIMIT_S
    with tempfile.TemporaryDirectory() as home:
        ports = (str(port), str(_free_port()))
        arguments = []
        if example.stem == "upload_params":
            given = Path(home) / "vehicle.params"
            given.write_text(PARAMETER_FILE, "utf-8")
            arguments = ["udpin://0.0.0.0:14540", str(given)]
        command = [python, "-u", str(ADAPTER), str(example), *ports, *arguments]
        with (Path(home) / "output").open("w+b") as stream:
            process = subprocess.Popen(
                command,
                cwd=example.parent,
                env={**os.environ, "HOME": home, "PYTHONPATH": "", "PYTHONWARNINGS": "ignore"},
                stdin=subprocess.PIPE,  # nobody types, but an event loop can wait for it
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # its server goes with it
            )
            try:
                code: int | None = process.wait(limit_s)
            except subprocess.TimeoutExpired:
                code = None
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.communicate()
            stream.seek(0)
            output = stream.read().decode("utf-8", "replace")
    lines = output.strip().splitlines() or [""]
    goes_on = output > "" if endless else last_words > "" and last_words in output
    passed = "Traceback" not in output and (code == 0 or (code is None and goes_on))
    why = "did not end" if code is None and not passed else lines[-1]
    return Outcome(passed, why, output, time.monotonic() - begun_s)


def main() -> int:
    """Run the examples; 0 when all is as expected, 1 when not, 2 for no checkout."""
    parser = argparse.ArgumentParser(description="Run MAVSDK-Python's examples on the simulator.")
    parser.add_argument("checkout", type=Path, help="a clone of mavlink/MAVSDK-Python")
    parser.add_argument("names", nargs="*", help="only examples whose name contains one of these")
    parser.add_argument(
        "--python", default=sys.executable, help="one that has mavsdk before 4, anyio and tqdm"
    )
    parser.add_argument("--verbose", action="store_true", help="print what failing ones print")
    options = parser.parse_intermixed_args()
    # Whoever ends this also ends what it has started.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    found = examples_of(options.checkout.resolve())
    if not found:
        print(f"{options.checkout} is no checkout of MAVSDK-Python.", file=sys.stderr)
        return 2
    tally = Tally(options.verbose)
    for example in found:
        name = example.stem
        if options.names and not any(part in name for part in options.names):
            continue
        if name in NOT_RUN:
            print(f"not run          {name}: {NOT_RUN[name]}", flush=True)
            continue
        outcome = run(example, options.python)
        tally.add(name, outcome, EXPECTED_TO_FAIL.get(name))
    return tally.end()


if __name__ == "__main__":
    sys.exit(main())
