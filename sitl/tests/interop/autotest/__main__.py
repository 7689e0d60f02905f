"""Flies ArduPilot's own vehicle tests against the simulated autopilot.

    python -m interop.autotest CHECKOUT --vehicle copter

CHECKOUT is a folder of ArduPilot's sources with Tools/autotest; the suite needs pexpect. Each test
runs in a process of its own, and once more, alone and slower, where it fails unexpectedly.
`expected.yaml` says which pass, and why others do not.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Collection
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue

import yaml

from interop.autotest.suite import CLASSES, run_one, test_names

_EXPECTED = Path(__file__).with_name("expected.yaml")
_EXIT_FAILED, _EXIT_USAGE = 1, 2
_FEW = 5
"""More failures than these are not the machine's"""
_SLOWER = 10.0
"""A test that failed and should not have is run again this much slower, but not below real time"""


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        prog="python -m interop.autotest",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("checkout", type=Path, help="folder of ArduPilot's sources")
    parser.add_argument("--vehicle", choices=sorted(CLASSES), default="copter")
    parser.add_argument(
        "--tests", help="names, separated by commas; those of expected.yaml if left out"
    )
    parser.add_argument("--speedup", type=float, default=20.0, help="simulated seconds per second")
    parser.add_argument("--workers", type=int, default=2, help="tests at the same time")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for one test")
    parser.add_argument("--list", action="store_true", help="list the suite's tests and end")
    parser.add_argument("--logs", type=Path, help="folder for what each test prints")
    parser.add_argument("--alone", metavar="TEST", help=argparse.SUPPRESS)
    parser.add_argument(
        "--place", type=int, default=0, help="first of the workers' sets of ports, for two runs"
    )
    return parser.parse_args()


def main() -> int:
    """Run the tests; the exit code is 0 if each went as expected, 1 if not, 2 for bad usage."""
    options = _options()
    os.environ.setdefault("BUILDLOGS", tempfile.mkdtemp(prefix="autotest_"))
    checkout = options.checkout.resolve()
    try:
        if options.alone:
            run_one(checkout, options.vehicle, options.alone, options.speedup, options.place)
        if options.list:
            print("\n".join(test_names(checkout, options.vehicle)))
            return 0
    except (ImportError, FileNotFoundError) as error:
        print(f"{error}. Install what the suite imports, and name a checkout.", file=sys.stderr)
        return _EXIT_USAGE
    expected = yaml.safe_load(_EXPECTED.read_text(encoding="utf-8"))[options.vehicle]
    wanted = options.tests.split(",") if options.tests else [*expected["pass"], *expected["fail"]]
    return _run_all(options, checkout, wanted, expected["pass"])


def _run_all(
    options: argparse.Namespace, checkout: Path, wanted: list[str], must_pass: Collection[str]
) -> int:
    logs = options.logs or Path(tempfile.mkdtemp(prefix="autotest_"))
    logs.mkdir(parents=True, exist_ok=True)
    places: SimpleQueue[int] = SimpleQueue()
    for place in range(options.workers):
        places.put(options.place + place)

    def run(name: str, slower: float = 1.0) -> tuple[str, bool, float]:
        place, begun_s = places.get(), time.monotonic()
        words = [sys.executable, "-m", "interop.autotest", str(checkout)]
        words += ["--vehicle", options.vehicle, "--alone", name, "--place", str(place)]
        words += ["--speedup", str(min(options.speedup, max(options.speedup / slower, 1.0)))]
        again = "_again" if slower > 1.0 else ""
        with (logs / f"{options.vehicle}_{name}{again}.log").open("wb") as log:
            child = subprocess.Popen(
                words, stdout=log, stderr=subprocess.STDOUT, start_new_session=True
            )
            try:
                code = child.wait(options.limit * slower)
            except subprocess.TimeoutExpired:
                code = _EXIT_FAILED
            finally:
                _end_all(child)
                places.put(place)
        return name, code == 0, time.monotonic() - begun_s

    passed: set[str] = set()

    def report(name: str, went: bool, took_s: float) -> None:
        if went:
            passed.add(name)
        words = "passed" if went else "FAILED"
        note = "" if went is (name in must_pass) else ", not as expected"
        print(f"{words} {name} in {took_s:.0f} s{note}", flush=True)

    with ThreadPoolExecutor(options.workers) as pool:
        for each in pool.map(run, wanted):
            report(*each)
    # The suite waits by the clock in places: on a busy machine it fails for no other reason.
    failed = [each for each in wanted if each in must_pass and each not in passed]
    for name in failed if len(failed) <= _FEW else ():
        print(f"{name} again, alone and slower:", flush=True)
        report(*run(name, _SLOWER))
    surprises = sum((name in passed) is not (name in must_pass) for name in wanted)
    print(f"{len(passed)} of {len(wanted)} passed, {surprises} not as expected; see {logs}")
    return 0 if not surprises else _EXIT_FAILED


def _end_all(child: subprocess.Popen[bytes]) -> None:
    """End a test and the vehicle that it started, which shares its session."""
    with suppress(ProcessLookupError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()


if __name__ == "__main__":
    sys.exit(main())
