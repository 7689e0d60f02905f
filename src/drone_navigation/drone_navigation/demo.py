"""``make demo``: simulator, navigation server and client as three processes, one flight."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

from drone_navigation.flight_plot import plot_flight
from drone_navigation.flight_recording import RecordingError
from drone_navigation.processes import (
    Process,
    ProcessError,
    free_domain,
    free_udp_port,
    ros_environment,
)

EXIT_OK = 0
EXIT_FAILED = 1
_READY_TIMEOUT_S = 20.0
_FLIGHT_TIMEOUT_S = 90.0


def make_parser() -> argparse.ArgumentParser:
    """Return the command line of the demo."""
    parser = argparse.ArgumentParser(
        prog="python -m drone_navigation.demo",
        description="Fly the goal (10, 5, 2) with a simulated copter and draw the flight.",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/demo"), metavar="DIR", help="where results go"
    )
    parser.add_argument("--goal", nargs=3, default=("10", "5", "2"), metavar=("X", "Y", "Z"))
    return parser


def main(args: list[str] | None = None) -> int:
    """Fly the demo; 0 on success."""
    options = make_parser().parse_args(args)
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    tlog, picture = out / "flight.tlog", out / "flight.png"
    for old in (tlog, picture):
        old.unlink(missing_ok=True)
    try:
        code = _fly(out, tlog, tuple(options.goal))
    except ProcessError as error:
        print(f"The demo failed: {error}", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt:
        print("The demo was interrupted.", file=sys.stderr)
        return EXIT_FAILED
    if code != 0:
        print(f"The demo failed: the client ended with {code}; see {out}", file=sys.stderr)
        return EXIT_FAILED
    try:
        plot_flight(tlog, picture)
    except RecordingError as error:
        print(f"The flight was flown but not drawn: {error}", file=sys.stderr)
        return EXIT_FAILED
    print(f"Recorded {tlog}, drawn in {picture}", flush=True)
    return EXIT_OK


def _fly(out: Path, tlog: Path, goal: tuple[str, ...]) -> int:
    begin_s = time.monotonic()
    environment = ros_environment(free_domain(os.getpid()))
    port = free_udp_port()
    processes: list[Process] = []
    try:
        server = Process(
            "navigation_server",
            [
                "python", "-m", "drone_navigation.navigation_server",
                "--link", f"udpin://127.0.0.1:{port}", "--arming", "auto", "--tlog", str(tlog),
            ],
            environment,
            out / "server.log",
        )  # fmt: skip
        processes.append(server)
        simulator = Process(
            "mavlink_sitl",
            ["python", "-m", "mavlink_sitl", "--link", f"udpout://127.0.0.1:{port}"],
            environment,
            out / "sitl.log",
        )
        processes.append(simulator)
        server.wait_for("Position valid", _READY_TIMEOUT_S)
        print(f"Ready after {time.monotonic() - begin_s:.1f} s", flush=True)
        # The client draws on this terminal itself.
        client = subprocess.Popen(
            [sys.executable, "-m", "drone_navigation.navigation_client", "--goal", *goal],
            env=environment,
        )
        try:
            return client.wait(_FLIGHT_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            raise ProcessError(f"the client was not done in {_FLIGHT_TIMEOUT_S:g} s") from None
        finally:
            if client.poll() is None:
                client.kill()
                client.wait(5.0)
    finally:
        for process in reversed(processes):
            process.stop()


if __name__ == "__main__":
    sys.exit(main())
