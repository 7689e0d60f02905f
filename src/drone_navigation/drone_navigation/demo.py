"""``make demo``: simulator, navigation server and client as three processes, one flight.

The vehicle has a range scanner, and is sent round a world that the server knows nothing of. On
the way it gets another goal. The flight is then read from the recording and checked.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
from dataclasses import dataclass
from pathlib import Path

from drone_navigation.processes import ProcessError, ProcessGroup
from flight_logs.command_version import add_version
from flight_reports.flight_plot import plot_flight
from flight_reports.flight_recording import FlightRecording, NoFlightError
from flight_reports.pictures.scene import replan_times_s
from navigation_core.outcomes import OutcomeCode

EXIT_OK = 0
EXIT_FAILED = 1
_FLIGHT_TIMEOUT_S = 160.0
_LANDING_TIMEOUT_S = 60.0
_FILES = Path("bridge_config")
_SUMMARY = "simulator.json"
# The path is straight until the scanner sees what is across it: once at least.
_WAYPOINTS, _GOALS, _REPLANS = 3, 2, 1
RADIUS_M = 0.5
"""vehicle_radius_m of the set-ups that the demos use"""


class DemoError(RuntimeError):
    """A check of the demo failed; the text says which."""


@dataclass(frozen=True)
class Nearest:
    """Least clearance to an obstacle, by the simulator's ground truth.

    Attributes:
        clearance_m: from the vehicle's middle to the obstacle's surface.
        obstacle: its name.
        collided: whether the vehicle has flown into something.
    """

    clearance_m: float
    obstacle: str
    collided: bool


@dataclass(frozen=True)
class Scenario:
    """A vehicle, its route and its obstacles.

    Attributes:
        world: what surrounds the vehicle, for the simulator only.
        route: waypoints to fly.
        update: the goal that replaces the route on the way, as ``navigation_client`` takes it.
        speed_m_s: ground speed.
        takes_s: measured duration of the demo.
    """

    world: Path
    route: Path
    update: str
    speed_m_s: float
    takes_s: int


# Recommended among obstacles: a vehicle whose server hangs flies on for a second instead of three.
_SETTINGS = {("copter", "ardupilot"): ("--param", "GUID_TIMEOUT=1")}
SCENARIOS = {
    "copter": Scenario(
        _FILES / "worlds/demo.yaml",
        _FILES / "routes/demo.waypoints",
        "t=42: 0 0 4",
        2.5,
        100,
    ),
    "rover": Scenario(
        _FILES / "worlds/demo_rover.yaml",
        _FILES / "routes/demo_rover.waypoints",
        "t=56: 0 0 0",
        1.5,
        110,
    ),
}


def make_parser() -> argparse.ArgumentParser:
    """Return the command line of the demo."""
    parser = argparse.ArgumentParser(
        prog="python -m drone_navigation.demo",
        description="Fly a simulated vehicle with a range scanner around obstacles unknown to the "
        "server and replace the goal in flight; check and draw the flight. Start it in the "
        "folder of the repository.",
    )
    add_version(parser, "drone_navigation")
    parser.add_argument("--vehicle", choices=sorted(SCENARIOS), default="copter")
    parser.add_argument(
        "--autopilot",
        choices=("ardupilot", "px4"),
        default="ardupilot",
        help="firmware of the simulated vehicle (default: ardupilot)",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/demo"), metavar="DIR", help="folder for the results"
    )
    return parser


def main(args: list[str] | None = None) -> int:
    """Fly the demo; return 0 if all checks pass."""
    options = make_parser().parse_args(args)
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    tlog, picture = out / "flight.tlog", out / "flight.png"
    for old in (tlog, picture):
        old.unlink(missing_ok=True)
    try:
        code = _fly(out, tlog, options.vehicle, options.autopilot)
        recording = plot_flight(tlog, picture)
        if code != 0:
            raise DemoError(f"The client exited with {code}; see {out}.")
        print(report(recording, _nearest(out / _SUMMARY)), flush=True)
    except (DemoError, ProcessError, NoFlightError) as error:
        print(f"The demo failed: {error}", file=sys.stderr)
        if tlog.exists() and not picture.exists():
            with contextlib.suppress(NoFlightError):
                plot_flight(tlog, picture)
        if picture.exists():
            print(f"The flight is drawn in {picture}.", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt:
        print("The demo was interrupted.", file=sys.stderr)
        return EXIT_FAILED
    print(f"Recorded {tlog}, drawn in {picture}", flush=True)
    print("Next: make console flies a simulated copter from a page in the browser.", flush=True)
    return EXIT_OK


def _nearest(summary: Path) -> Nearest:
    """Return the least clearance reported by the simulator."""
    try:
        (vehicle,) = json.loads(summary.read_text(encoding="utf-8"))["vehicles"]
        return Nearest(
            vehicle["least_clearance_m"], vehicle["nearest_obstacle"], vehicle["collided"]
        )
    except (OSError, ValueError, KeyError) as error:
        raise DemoError(f"The simulator wrote no summary: {error}.") from error


def _fly(out: Path, tlog: Path, vehicle: str, autopilot: str) -> int:
    """Return the client's exit code."""
    scenario = SCENARIOS[vehicle]
    server = _FILES / f"simulated/{autopilot}_{vehicle}.yaml"
    (out / _SUMMARY).unlink(missing_ok=True)
    for path in (server, scenario.world, scenario.route):
        if not path.exists():
            raise DemoError(f"{path} not found; start the demo in the folder of the repository.")
    print(f"The demo takes about {scenario.takes_s} s, and longer on a slow machine.", flush=True)
    client = [
        "drone_navigation.navigation_client", "--waypoints", str(scenario.route), "--avoid",
        "--speed", f"{scenario.speed_m_s:g}", "--update", scenario.update,
    ]  # fmt: skip
    simulator = [
        "--vehicle", vehicle, "--autopilot", autopilot, "--world", str(scenario.world),
        "--summary", str(out / _SUMMARY), *_SETTINGS.get((vehicle, autopilot), ()),
    ]  # fmt: skip
    with ProcessGroup(out) as group:
        environment = group.start_vehicle(["--config", str(server), "--tlog", str(tlog)], simulator)
        # The client draws directly on this terminal.
        code = group.run_in_terminal(client, environment, _FLIGHT_TIMEOUT_S)
        if code == EXIT_OK and vehicle == "copter":
            land = ["drone_navigation.navigation_client", "land"]
            code = group.run_in_terminal(land, environment, _LANDING_TIMEOUT_S)
        return code


def report(recording: FlightRecording, nearest: Nearest) -> str:
    """Check the flight and summarise it in one sentence.

    Args:
        recording: of the flight.
        nearest: what truly happened.

    Raises:
        DemoError: three waypoints, a goal sent in flight, a replan or success are missing, or the
            vehicle came nearer to an obstacle than its radius.
    """
    if nearest.collided:
        raise DemoError(f"The vehicle flew into the obstacle '{nearest.obstacle}'.")
    if nearest.clearance_m < RADIUS_M:
        raise DemoError(
            f"The clearance was only {nearest.clearance_m:.2f} m to the obstacle "
            f"'{nearest.obstacle}'; its radius is {RADIUS_M:g} m."
        )
    goals = recording.goals.values
    replans = len(replan_times_s(recording))
    ends = [goal.code for goal in recording.all_goals if goal.ended_s is not None]
    if ends[-1:] != [OutcomeCode.SUCCESS.value]:
        raise DemoError(f"The last goal did not end with SUCCESS; the outcomes are {ends}.")
    if len(goals) < _GOALS or len(goals[0].targets_enu_m) < _WAYPOINTS:
        raise DemoError("The recording lacks the route or the goal that replaces it.")
    if replans < _REPLANS:
        raise DemoError(f"The path was replanned {replans} times; at least {_REPLANS} expected.")
    took_s = recording.status.times_s[-1] - recording.goals.times_s[0]
    seen = [obstacles for _, obstacles in recording.obstacles]
    parts = [
        f"{_WAYPOINTS} waypoints and {len(goals) - 1} goal sent in flight",
        f"{recording.figures.distance_m:.0f} m in {took_s:.0f} s",
        f"replanned {replans} times",
        f"{max((len(obstacles) for obstacles in seen), default=0)} cells sensed as occupied",
        f"{nearest.clearance_m:.2f} m least clearance, to '{nearest.obstacle}'",
    ]
    return "Flown: " + ", ".join(parts) + "."


if __name__ == "__main__":
    sys.exit(main())
