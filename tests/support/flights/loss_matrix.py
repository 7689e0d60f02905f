"""Every action over every bad link, flown on one simulated clock; and the page that shows it.

``python -m tests.support.flights.loss_matrix`` flies all cells and writes the tables of
docs/loss_matrix.md. A cell is one action of one firmware under one disturbance; what must
come of it is :func:`expected`, which the tests hold the flights and the page to.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from mavlink_sitl import LinkFaults, VehicleConfig
from mavlink_vehicle.codec import Message
from navigation_bridge.goals.requests import (
    LandRequest,
    NavigateRequest,
    Request,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from tests.support.flights.simulated_flight import SimulatedFlight

PAGE = Path(__file__).parents[3] / "docs" / "loss_matrix.md"
FIRMWARES = {"ardupilot": "ArduCopter", "px4": "PX4"}
HEIGHT_M = 3.0
# The bound on a cell, from acceptance to the end, or to rest after the bridge was killed: a
# PX4 that returns climbs to 30 m first (RTL_RETURN_ALT) and descends slowly.
LIMIT_S = 150.0
_POLL_TICKS = 5
_WATCH_S = 3.0
_REST_S = 2.0
_REST_M_S = 0.3
_UNDER_WAY_M = 3.0
_ROUTE = ((8.0, 0.0), (8.0, 8.0))


@dataclass(frozen=True)
class Action:
    """A column: what is asked for, and when it counts as under way."""

    name: str
    request: Request
    begins_in_the_air: bool = False


@dataclass(frozen=True)
class Disturbance:
    """A row: a bad link from the start, or something that happens once under way."""

    name: str
    faults: LinkFaults | None = None
    silence_s: float = 0.0
    reboot: bool = False
    kill: bool = False

    @property
    def strikes(self) -> bool:
        """Whether it comes in the middle of the flight."""
        return self.silence_s > 0.0 or self.reboot or self.kill


@dataclass(frozen=True)
class Cell:
    """The result of a flight.

    Attributes:
        outcome: the goal's code; what the vehicle did by itself if the bridge was killed.
        seconds: simulated, from acceptance to the end; to rest from the kill.
        message: the goal's last words.
        ends: how many terminal events the goal had.
        moving: what was sent after the end that could move the vehicle.
        streaming: whether setpoints still went out when the watch was over.
        place_enu_m: where the vehicle truly was at last.
        speed_m_s: how fast it truly was at last.
    """

    outcome: str
    seconds: float
    message: str
    ends: int
    moving: tuple[str, ...]
    streaming: bool
    place_enu_m: tuple[float, float, float]
    speed_m_s: float


def _route(by_mission: bool) -> WaypointsRequest:
    points = tuple(WaypointRequest((x, y, HEIGHT_M)) for x, y in _ROUTE)
    return WaypointsRequest(points, by_mission=by_mission)


ACTIONS = (
    Action(
        "Navigate", NavigateRequest("map", (12.0, 0.0, HEIGHT_M), (0.0, 0.0, 0.0, 0.0), False, 0.0)
    ),
    Action("NavigateWaypoints SETPOINTS", _route(by_mission=False)),
    Action("NavigateWaypoints MISSION", _route(by_mission=True)),
    Action("Takeoff", TakeoffRequest(HEIGHT_M)),
    Action("Land", LandRequest(), begins_in_the_air=True),
)

DISTURBANCES = (
    Disturbance("loss 0 %"),
    Disturbance("loss 5 %", LinkFaults(loss=0.05)),
    Disturbance("loss 20 %", LinkFaults(loss=0.2)),
    Disturbance("loss 40 %", LinkFaults(loss=0.4)),
    Disturbance("duplication 50 %", LinkFaults(duplicate=0.5)),
    Disturbance("reordering within 200 ms", LinkFaults(jitter_s=0.2)),
    Disturbance("delay 500 ms", LinkFaults(delay_s=0.5)),
    Disturbance("silence 3 s", silence_s=3.0),
    Disturbance("silence 30 s", silence_s=30.0),
    Disturbance("autopilot reboot", reboot=True),
    Disturbance("bridge killed", kill=True),
)


def expected(firmware: str, action: Action, disturbance: Disturbance) -> str:
    """Return the one right outcome of a cell."""
    streamed = action.name in ("Navigate", "NavigateWaypoints SETPOINTS")
    if disturbance.kill:
        if action.begins_in_the_air:
            return "lands"
        # PX4 takes the end of the stream for a failure (COM_OBL_RC_ACT), ArduCopter brakes.
        return "returns" if streamed and firmware == "px4" else "stands"
    if disturbance.reboot:
        return "VEHICLE_REBOOTED"
    if disturbance.silence_s > 10.0:
        return "LINK_LOST"
    if disturbance.silence_s > 0.0 and streamed and firmware == "px4":
        return "FAILSAFE_OFFBOARD"
    return "SUCCESS"


def fly(firmware: str, action: Action, disturbance: Disturbance, seed: int = 1) -> Cell:
    """Fly one cell."""
    vehicle = VehicleConfig(autopilot=firmware, ready_after_s=1.0)
    flight = SimulatedFlight(seed=seed, simulated=vehicle)
    if not action.begins_in_the_air:
        flight.simulation.link.set_faults(disturbance.faults)
    flight.ready()
    _until(flight, lambda: flight.check(action.request) is None or action.begins_in_the_air)
    if action.begins_in_the_air:
        flight.fly_up()
        flight.simulation.link.set_faults(disturbance.faults)
    accepted_s = flight.now
    goal_id = flight.start(action.request)
    if disturbance.strikes:
        _until(flight, lambda: bool(flight.ends(goal_id)) or _is_under_way(flight, action))
    if disturbance.kill:
        return _watch_without_bridge(flight)
    if disturbance.reboot:
        flight.simulation.vehicles[0].power_cycle()
    if disturbance.silence_s:
        flight.simulation.link.silent = True
        flight.run_for(disturbance.silence_s)
        flight.simulation.link.silent = False
    _until(flight, lambda: bool(flight.ends(goal_id)))
    return _judge(flight, goal_id, accepted_s)


def _judge(flight: SimulatedFlight, goal_id: str, accepted_s: float) -> Cell:
    """Watch for a while what is still sent, and say how it was."""
    if flight.vehicle.setpoints.is_open:  # a PX4 is handed over to its own hold mode meanwhile
        _until(flight, lambda: not flight.vehicle.setpoints.is_open)
    flight.run_for(_WATCH_S)
    ends = flight.ends(goal_id)
    ended_s = next(time_s for time_s, output in flight.outputs if output is ends[0])
    place, speed_m_s = flight.truth()
    given_up = ends[0].code.value != "SUCCESS"
    return Cell(
        outcome=ends[0].code.value,
        seconds=ended_s - accepted_s,
        message=ends[0].message,
        ends=len(ends),
        moving=tuple(
            f"{time_s - ended_s:.2f} s after the end: {message}"
            for time_s, message in flight.sent
            if time_s > ended_s and _moves(flight, message, given_up)
        ),
        streaming=bool(flight.setpoint_times(flight.now - 0.5 * _WATCH_S)),
        place_enu_m=place,
        speed_m_s=speed_m_s,
    )


def _moves(flight: SimulatedFlight, message: Message, given_up: bool) -> bool:
    """Whether a message could move the vehicle.

    After a success the vehicle is still ours, and may be commanded to stand still: by its own mode,
    or by a velocity of zero. Once control was given up it may not even be told that.
    """
    kind: str = message.get_type()
    if kind.startswith("SET_POSITION_TARGET"):
        has_position = message.type_mask & _IGNORE_POSITION != _IGNORE_POSITION
        return given_up or has_position or math.hypot(message.vx, message.vy, message.vz) > 0.0
    if kind not in ("COMMAND_LONG", "COMMAND_INT"):
        return kind.startswith(_MOVING_KINDS)
    if message.command == _DO_SET_MODE and not given_up:
        profile = flight.vehicle.profile
        assert profile is not None
        assert profile.hold_mode is not None
        hold = profile.modes[profile.hold_mode]
        return message.param2 not in (hold, hold >> 16 & 0xFF)
    return bool(message.command in _MOVING_COMMANDS)


_IGNORE_POSITION = 0b111
_MOVING_KINDS = ("MISSION_ITEM", "MISSION_COUNT", "MISSION_SET_CURRENT", "MISSION_CLEAR", "SET_")
_DO_SET_MODE = 176
# NAV_RETURN_TO_LAUNCH, NAV_LAND, NAV_TAKEOFF, DO_SET_MODE, DO_REPOSITION, MISSION_START,
# COMPONENT_ARM_DISARM
_MOVING_COMMANDS = (20, 21, 22, _DO_SET_MODE, 192, 300, 400)


def _watch_without_bridge(flight: SimulatedFlight) -> Cell:
    """Let the vehicle do what it does by itself until it has come to rest."""
    killed_s = flight.simulation.time_s
    (x_m, y_m, _), _ = flight.truth()
    resting_s = 0.0
    while resting_s < _REST_S and flight.simulation.time_s - killed_s < LIMIT_S:
        flight.simulation.run_for(0.1)
        resting_s = resting_s + 0.1 if flight.truth()[1] < _REST_M_S else 0.0
    place, speed_m_s = flight.truth()
    outcome = "flies on"
    if flight.simulation.truth.on_ground[0]:
        went_m = math.dist((x_m, y_m), place[:2])
        home = math.hypot(*place[:2]) < _UNDER_WAY_M <= went_m
        outcome = "returns" if home else "lands"
    elif resting_s >= _REST_S:
        outcome = "stands"
    seconds = flight.simulation.time_s - killed_s - resting_s
    return Cell(outcome, seconds, "", 0, (), False, place, speed_m_s)


def _is_under_way(flight: SimulatedFlight, action: Action) -> bool:
    (x_m, y_m, z_m), _ = flight.truth()
    if action.begins_in_the_air:
        return z_m < HEIGHT_M - 0.7
    if isinstance(action.request, TakeoffRequest):
        return z_m > 1.0
    return math.hypot(x_m, y_m) > _UNDER_WAY_M + 1.0


def _until(flight: SimulatedFlight, condition: Callable[[], bool]) -> None:
    """Continue until something holds, which is looked at now and then only."""
    end_s = flight.now + LIMIT_S
    while not condition():
        assert flight.now < end_s, f"not within {LIMIT_S:g} s; last: {flight.outputs[-3:]}"
        for _ in range(_POLL_TICKS):
            flight.tick()


def table(cell_text: Callable[[Action, Disturbance], str]) -> str:
    """Return the Markdown table of one firmware."""
    lines = [
        "| | " + " | ".join(action.name for action in ACTIONS) + " |",
        "|---" * (len(ACTIONS) + 1) + "|",
    ]
    lines += [
        f"| {row.name} | " + " | ".join(cell_text(action, row) for action in ACTIONS) + " |"
        for row in DISTURBANCES
    ]
    return "\n".join(lines) + "\n"


def outcomes_on_page(page: str, firmware: str) -> dict[tuple[str, str], str]:
    """Return the outcomes in the page's table of one firmware, by row and column.

    A time alone is a success.
    """
    body = _section(page, firmware).group(2)
    columns, _, *rows = [
        [field.strip() for field in line.strip("|\n").split("|")] for line in body.splitlines()
    ]
    return {
        (row[0], column): re.sub(r" ?[\d.]+$", "", text) or "SUCCESS"
        for row in rows
        for column, text in zip(columns[1:], row[1:], strict=True)
    }


def _section(page: str, firmware: str) -> re.Match[str]:
    title = re.escape(FIRMWARES[firmware])
    section = re.search(rf"(## {title}\n\n)((?:\|.*\n)+)", page)
    if section is None:
        raise ValueError(f"{PAGE.name} has no table below '## {FIRMWARES[firmware]}'")
    return section


def write_page(cells: Mapping[tuple[str, str, str], Cell]) -> None:
    """Put what was flown into the page; cells by firmware, action and disturbance."""
    page = PAGE.read_text(encoding="utf-8")
    for firmware in FIRMWARES:

        def text(action: Action, disturbance: Disturbance, firmware: str = firmware) -> str:
            cell = cells[firmware, action.name, disturbance.name]
            return f"{cell.outcome} {cell.seconds:.1f}".removeprefix("SUCCESS ")

        section = _section(page, firmware)
        page = page[: section.start(2)] + table(text) + page[section.end(2) :]
    PAGE.write_text(page, encoding="utf-8")


def main() -> None:
    """Fly everything and write the page."""
    cells = {}
    for firmware in FIRMWARES:
        for action in ACTIONS:
            for disturbance in DISTURBANCES:
                cell = fly(firmware, action, disturbance)
                cells[firmware, action.name, disturbance.name] = cell
                right = cell.outcome == expected(firmware, action, disturbance)
                verdict = "" if right else f"  WRONG: {cell.message}"
                print(f"{firmware}, {action.name}, {disturbance.name}: {cell.outcome}{verdict}")
    write_page(cells)


if __name__ == "__main__":
    main()
