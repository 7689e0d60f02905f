"""``make demo-nav2``: a simulated vehicle for clients of Nav2, and a flight by Nav2's actions."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import threading
from pathlib import Path

from drone_navigation.processes import ProcessError, ProcessGroup
from flight_logs.command_version import add_version

EXIT_OK = 0
EXIT_FAILED = 1
_READY_TIMEOUT_S = 60.0  # ten times what an idle machine needs
_FILES = Path("bridge_config")


def make_parser() -> argparse.ArgumentParser:
    """Return the command line of the demo."""
    parser = argparse.ArgumentParser(
        prog="python -m drone_navigation.demo_nav2",
        description="Start a simulated vehicle, a navigation server and navigation_nav2, and fly "
        "a pose and waypoints by Nav2's actions. Start it in the folder of the repository.",
    )
    add_version(parser, "drone_navigation")
    parser.add_argument("--vehicle", choices=("copter", "rover", "boat", "plane"), default="copter")
    firmwares = ("ardupilot", "px4")
    parser.add_argument("--autopilot", choices=firmwares, default=firmwares[0])
    parser.add_argument(
        "--serve", action="store_true", help="fly nothing; wait for clients until Ctrl-C"
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/demo-nav2"), metavar="DIR", help="folder for the logs"
    )
    return parser


def main(args: list[str] | None = None) -> int:
    """Fly the demo; return 0 if both goals succeed."""
    options = make_parser().parse_args(args)
    config = _FILES / f"simulated/{options.autopilot}_{options.vehicle}.yaml"
    if not config.exists():
        print(f"{config} not found; start in the folder of the repository.", file=sys.stderr)
        return EXIT_FAILED
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    server = ["--config", str(config), "--tlog", str(out / "flight.tlog")]
    simulator = ["--vehicle", options.vehicle, "--autopilot", options.autopilot]
    try:
        with ProcessGroup(out) as group:
            environment = group.start_vehicle(server, simulator)
            words = ["python", "-m", "drone_navigation.navigation_nav2"]
            nav2 = group.start("navigation_nav2", words, environment)
            nav2.wait_for("Ready for clients", _READY_TIMEOUT_S)
            os.environ.update(environment)
            domain = environment["ROS_DOMAIN_ID"]
            print(f"Clients of Nav2 find this vehicle with ROS_DOMAIN_ID={domain}", flush=True)
            if options.serve:
                print("Ctrl-C ends it.", flush=True)
                # An interrupt just before a wait without a limit would only be seen after it.
                with contextlib.suppress(KeyboardInterrupt):
                    while True:
                        threading.Event().wait(0.5)
                return EXIT_OK
            # It needs nav2_msgs, which is built for this demo.
            from drone_navigation.nav2.demo_flight import fly  # noqa: PLC0415

            return EXIT_OK if fly() else EXIT_FAILED
    except ProcessError as error:
        print(f"The demo failed: {error}", file=sys.stderr)
    except KeyboardInterrupt:
        print("The demo was interrupted.", file=sys.stderr)
    return EXIT_FAILED


if __name__ == "__main__":
    sys.exit(main())
