"""A server that dies, or is late, in each phase of a flight: what its vehicle does then.

The truth of the simulator counts. ``measured`` is also where the table of
docs/autopilots.md ("When the bridge dies") comes from.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import pytest

from mavlink_sitl import BatteryModel, VehicleConfig
from navigation_bridge.goals.requests import (
    LandRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.velocity_stick import SteeredFlight

pytestmark = pytest.mark.wide_but_first


COPTERS = [("copter", "ardupilot"), ("copter", "px4")]
DRIVING = [("rover", "ardupilot"), ("rover", "px4"), ("boat", "ardupilot"), ("boat", "px4")]
PLANES = [("plane", "ardupilot"), ("plane", "px4")]
IDS = "-".join
STEP_S, WATCHED_S, STANDS_M_S = 0.05, 20.0, 0.25
# Overshoot of an ArduCopter that brakes by itself; it then comes back.
SETTLES_M, SLOWS_M_S = 0.5, 0.3
SPEED_M_S = 4.0
GOAL = (0.0, 30.0, 8.0)


class Left(NamedTuple):
    """The motion of a vehicle without its server.

    Attributes:
        forward_m: how far it got along its course.
        back_m: how far it came back from there before it left its mode.
        fastest_m_s: its greatest speed while in that mode.
        rest_s: time until it stood; infinite if it did not within the time that it was watched.
        mode: its mode at the end.
        height_m: its height above the ground at the end.
    """

    forward_m: float
    back_m: float
    fastest_m_s: float
    rest_s: float
    mode: str
    height_m: float


def measured(flight: SimulatedFlight, watched_s: float = WATCHED_S) -> Left:
    """Stop the server for good and watch the vehicle."""
    copter = flight.simulation.vehicles[0].firmware
    begun_in = copter.mode.spec.name
    start, _ = flight.truth()
    velocity = flight.simulation.truth.velocity_ned_m_s[0]
    east, north = float(velocity[1]), float(velocity[0])
    level_m_s = math.hypot(east, north)
    course = (east / level_m_s, north / level_m_s) if level_m_s > 0.05 else (0.0, 1.0)
    forward_m = back_m = fastest_m_s = 0.0
    moving_s, now_s = 0.0, 0.0
    while now_s < watched_s:
        flight.stall(STEP_S)
        now_s += STEP_S
        (x, y, _), speed_m_s = flight.truth()
        if speed_m_s > STANDS_M_S:
            moving_s = now_s
        if copter.mode.spec.name != begun_in:
            continue
        along_m = (x - start[0]) * course[0] + (y - start[1]) * course[1]
        forward_m = max(forward_m, along_m)
        back_m = max(back_m, forward_m - along_m)
        fastest_m_s = max(fastest_m_s, speed_m_s)
    rest_s = math.inf if moving_s > watched_s - 1.0 else moving_s
    height_m = flight.truth()[0][2]
    return Left(forward_m, back_m, fastest_m_s, rest_s, copter.mode.spec.name, height_m)


def ready(vehicle: str, autopilot: str, **parameters: float) -> SimulatedFlight:
    """Return a vehicle that waits for a goal; one that flies is at 8 m, a plane on the ground."""
    simulated = VehicleConfig(
        vehicle=vehicle,
        autopilot=autopilot,
        ready_after_s=1.0,
        battery=BatteryModel(capacity_mah=60_000.0),
        parameters=dict(parameters),
    )
    flight = SimulatedFlight(simulated=simulated, battery_policy="ignore").ready()
    flight.run_for(2.0)
    if vehicle == "copter":
        assert flight.run_to_end(flight.send(0.0, 0.0, 8.0)).code.value == "SUCCESS"
    return flight


def left_m(flight: SimulatedFlight, place: tuple[float, ...] = GOAL) -> float:
    return math.dist(flight.truth()[0][:2], place[:2])


def flown_to(flight: SimulatedFlight, away_m: float, height_m: float = GOAL[2]) -> SimulatedFlight:
    """Fly on until the goal is at a distance."""
    flight.start(flight.request(GOAL[0], GOAL[1], height_m, speed=SPEED_M_S))
    flight.run_until(lambda: left_m(flight) <= away_m, 200.0)
    return flight


@pytest.mark.parametrize("vehicle", COPTERS, ids=IDS)
@pytest.mark.parametrize("away_m", [3.0, 2.5, 2.0, 1.5, 1.0, 0.6, 0.3, 0.1])
def test_a_brake_that_nobody_ends_leads_to_a_standstill(
    vehicle: tuple[str, str], away_m: float
) -> None:
    flight = flown_to(ready(*vehicle), away_m)
    speed_m_s = flight.truth()[1]
    left = measured(flight)
    assert left.back_m < SETTLES_M, left
    assert left.fastest_m_s <= speed_m_s + SLOWS_M_S, left
    assert left.forward_m < away_m + 0.5 * 3.0 * speed_m_s, left
    if vehicle[1] == "ardupilot":
        assert left.mode == "GUIDED"
        assert left.rest_s < 6.0, left


@pytest.mark.parametrize("timeout_s", [0.5, 1.0, 10.0])
def test_the_timeout_is_that_of_the_vehicle(timeout_s: float) -> None:
    flight = flown_to(ready("copter", "ardupilot", GUID_TIMEOUT=timeout_s), 1.5)
    speed_m_s = flight.truth()[1]
    left = measured(flight, 30.0)
    assert left.back_m < SETTLES_M + 0.3, left
    assert left.fastest_m_s <= speed_m_s + SLOWS_M_S, left


@pytest.mark.parametrize("after_s", [0.3, 0.6, 1.0, 1.5])
def test_who_speeds_up_when_the_server_dies_gets_hardly_faster(after_s: float) -> None:
    flight = ready("copter", "ardupilot")
    flight.start(flight.request(*GOAL, speed=SPEED_M_S))
    flight.run_until(lambda: flight.truth()[1] > 0.05)
    flight.run_for(after_s)
    speed_m_s = flight.truth()[1]
    left = measured(flight)
    # It leans already, which accelerates it for a second.
    assert left.fastest_m_s <= min(speed_m_s + 1.2, SPEED_M_S + SLOWS_M_S), left


@pytest.mark.parametrize("height_m", [3.0, 20.0])
@pytest.mark.parametrize("away_m", [1.0, 0.5, 0.2])
def test_a_climb_and_a_descent_that_nobody_ends_do_not_turn_back(
    height_m: float, away_m: float
) -> None:
    flight = ready("copter", "ardupilot")
    flight.start(flight.request(0.0, 0.0, height_m))
    flight.run_until(lambda: abs(flight.truth()[0][2] - height_m) <= away_m)
    sign = math.copysign(1.0, height_m - 8.0)
    highest_m = sign * flight.truth()[0][2]
    for _ in range(300):
        flight.stall(STEP_S)
        height = sign * flight.truth()[0][2]
        highest_m = max(highest_m, height)
        assert height > highest_m - 0.3
    assert highest_m < sign * height_m + 1.5


def test_a_turn_that_nobody_ends_leads_straight_on() -> None:
    flight = ready("copter", "ardupilot")
    assert flight.run_to_end(flight.start(flight.request(0.0, 0.0, 8.0))).code.value == "SUCCESS"
    corner = _Corner(flight)
    flight.run_until(corner.turns, 60.0)
    left = measured(flight)
    assert left.fastest_m_s < SPEED_M_S + SLOWS_M_S, left
    assert left.mode == "GUIDED"


class _Corner:
    """A route around a corner, until it is turning."""

    def __init__(self, flight: SimulatedFlight) -> None:
        self._flight = flight
        corners = ((0.0, 25.0, 8.0), (25.0, 25.0, 8.0))
        points = tuple(WaypointRequest(point, acceptance_radius_m=3.0) for point in corners)
        flight.start(WaypointsRequest(points, max_speed_m_s=SPEED_M_S))

    def turns(self) -> bool:
        north, east, _ = (float(v) for v in self._flight.simulation.truth.velocity_ned_m_s[0])
        return math.hypot(north, east) > 1.0 and 0.5 < math.atan2(east, north) < 1.0


@pytest.mark.night_but_first
@pytest.mark.parametrize("vehicle", COPTERS, ids=IDS)
def test_velocity_commands_that_stop_with_the_server(vehicle: tuple[str, str]) -> None:
    for moves_s in (4.0, 0.5):
        flight = SteeredFlight(*vehicle)
        flight.begin()
        flight.steer(4.0, (3.0, 0.0, 0.0))
        flight.steer(moves_s, (0.0, 0.0, 0.0))
        speed_m_s = flight.truth()[1]
        left = measured(flight)
        assert left.back_m < SETTLES_M, left
        assert left.fastest_m_s <= speed_m_s + SLOWS_M_S, left


@pytest.mark.parametrize("late_s", [0.3, 0.7, 1.3, 2.0])
@pytest.mark.parametrize("away_m", [2.5, 1.0, 0.3])
def test_who_brakes_when_the_server_is_late_does_not_turn_back(
    late_s: float, away_m: float
) -> None:
    flight = flown_to(ready("copter", "ardupilot"), away_m)
    speed_m_s = flight.truth()[1]
    left = measured(flight, late_s)
    assert left.back_m < SETTLES_M, left
    assert left.fastest_m_s <= speed_m_s + SLOWS_M_S, left
    goal_id = f"{2:032x}"
    farthest_m = 0.0
    while not flight.ends(goal_id):
        flight.tick()
        farthest_m = max(farthest_m, left_m(flight))
    assert flight.ends(goal_id)[0].code.value == "SUCCESS"
    assert farthest_m < away_m + 3.0


@pytest.mark.parametrize("vehicle", DRIVING, ids=IDS)
@pytest.mark.parametrize("away_m", [8.0, 2.0])
def test_what_drives_continues_and_stops(vehicle: tuple[str, str], away_m: float) -> None:
    flight = ready(*vehicle)
    flight.start(flight.request(*GOAL[:2], 0.0, speed=2.0))
    flight.run_until(lambda: left_m(flight) <= away_m, 200.0)
    speed_m_s = flight.truth()[1]
    left = measured(flight, 12.0)
    assert left.back_m < SETTLES_M, left
    assert left.fastest_m_s < speed_m_s + SLOWS_M_S, left
    assert left.forward_m < 14.0, left
    assert left.mode == "GUIDED" if vehicle[1] == "ardupilot" else left.mode == "AUTO.RTL"


Begin = Callable[[SimulatedFlight], None]


def _taking_off(flight: SimulatedFlight) -> None:
    flight.start(TakeoffRequest(20.0))
    flight.run_until(lambda: flight.truth()[0][2] > 2.0)


def _landing(flight: SimulatedFlight) -> None:
    assert flight.run_to_end(flight.send(0.0, 0.0, 8.0)).code.value == "SUCCESS"
    flight.start(LandRequest())
    flight.run_until(lambda: flight.truth()[0][2] < 6.0)


def _holding(flight: SimulatedFlight) -> None:
    assert flight.run_to_end(flight.send(0.0, 0.0, 8.0)).code.value == "SUCCESS"


@pytest.mark.parametrize("vehicle", COPTERS, ids=IDS)
@pytest.mark.parametrize(
    ("begin", "height_m"),
    [(_taking_off, 20.0), (_landing, 0.0), (_holding, 8.0)],
    ids=["take-off", "landing", "hold"],
)
def test_what_the_autopilot_does_by_itself_continues(
    vehicle: tuple[str, str], begin: Begin, height_m: float
) -> None:
    flight = SimulatedFlight(
        simulated=VehicleConfig(
            autopilot=vehicle[1],
            ready_after_s=1.0,
            battery=BatteryModel(capacity_mah=60_000.0),
        )
    ).ready()
    flight.run_for(2.0)
    begin(flight)
    left = measured(flight, 40.0)
    assert left.height_m == pytest.approx(height_m, abs=1.0), left
    assert left.forward_m < 1.0, left


@pytest.mark.parametrize("vehicle", PLANES, ids=IDS)
def test_a_plane_flies_on_and_circles(vehicle: tuple[str, str]) -> None:
    flight = ready(*vehicle)
    flight.start(flight.request(200.0, 100.0, 60.0))
    flight.run_until(lambda: flight.truth()[0][2] > 45.0, 200.0)
    flight.run_for(5.0)
    left = measured(flight, 90.0)
    assert left.rest_s == math.inf
    assert left.height_m > 30.0, left
    assert left_m(flight, (200.0, 100.0)) < 200.0


# --- the bounds of a flight -------------------------------------------------------------------

FACE_M, TOP_M, INSIDE_M = 40.0, 25.0, 0.1
# A PX4 that drives returns when its setpoints end, and turns first: its targets are as far inside.
TURNING = {("rover", "px4"): 1.7, ("boat", "px4"): 4.8}


def in_a_volume(vehicle: str, autopilot: str, **parameters: float) -> SimulatedFlight:
    """Return a vehicle that waits for a goal in its flight volume."""
    simulated = VehicleConfig(
        vehicle=vehicle,
        autopilot=autopilot,
        ready_after_s=1.0,
        battery=BatteryModel(capacity_mah=60_000.0),
        parameters=parameters,
    )
    flight = SimulatedFlight(
        simulated=simulated,
        battery_policy="ignore",
        volume_radius_m=FACE_M,
        volume_altitude_max_m=TOP_M,
    ).ready()
    flight.run_for(2.0)
    return flight


def towards_the_face(
    vehicle: str,
    autopilot: str,
    inside_m: float | None = None,
    speed_m_s: float | None = None,
    **parameters: float,
) -> SimulatedFlight:
    """Send a vehicle to a target as near to the face of its flight volume as it may be."""
    if inside_m is None:
        inside_m = TURNING.get((vehicle, autopilot), INSIDE_M)
    flight = in_a_volume(vehicle, autopilot, **parameters)
    height_m, usual_m_s = (8.0, SPEED_M_S) if vehicle == "copter" else (0.0, 2.0)
    if vehicle == "copter":
        assert flight.run_to_end(flight.send(0.0, 0.0, height_m)).code.value == "SUCCESS"
    target = flight.request(0.0, FACE_M - inside_m, height_m, speed=speed_m_s or usual_m_s)
    flight.start(target)
    return flight


def farthest_m(flight: SimulatedFlight, watched_s: float = WATCHED_S) -> float:
    """Stop the server for good; return how far from its home the vehicle gets, over ground."""
    farthest = 0.0
    for _ in range(round(watched_s / STEP_S)):
        flight.stall(STEP_S)
        farthest = max(farthest, math.hypot(*flight.truth()[0][:2]))
    return farthest


@pytest.mark.parametrize("vehicle", [*COPTERS, *DRIVING], ids=IDS)
@pytest.mark.parametrize("before_m", [6.0, 3.0])
def test_a_dead_server_leaves_its_vehicle_in_the_volume(
    vehicle: tuple[str, str], before_m: float
) -> None:
    flight = towards_the_face(*vehicle)
    nearest_m = before_m
    if vehicle in TURNING:  # it stops before its target
        nearest_m = max(before_m, TURNING[vehicle] + 1.3)
    flight.run_until(lambda: math.hypot(*flight.truth()[0][:2]) > FACE_M - nearest_m, 200.0)
    assert farthest_m(flight) < FACE_M + 0.3


@pytest.mark.parametrize("speed_m_s", [0.8, 2.0, 4.0])
@pytest.mark.parametrize("before_m", [2.0, 4.5, 1.4])
@pytest.mark.parametrize("vehicle", TURNING, ids=IDS)
def test_what_returns_without_its_server_turns_in_the_volume(
    vehicle: tuple[str, str], before_m: float, speed_m_s: float
) -> None:
    """Dead this far before its target; a boat reaches it within 2 m."""
    flight = towards_the_face(*vehicle, speed_m_s=speed_m_s)
    stop_m = FACE_M - TURNING[vehicle] - before_m
    flight.run_until(lambda: math.hypot(*flight.truth()[0][:2]) > stop_m, 200.0)
    assert farthest_m(flight) < FACE_M


@pytest.mark.wide
@pytest.mark.parametrize("late_s", [0.8, 1.3, 3.0])
@pytest.mark.parametrize("vehicle", TURNING, ids=IDS)
def test_what_returns_while_its_server_is_late_turns_in_the_volume(
    vehicle: tuple[str, str], late_s: float
) -> None:
    flight = towards_the_face(*vehicle)
    stop_m = FACE_M - TURNING[vehicle] - 2.0
    flight.run_until(lambda: math.hypot(*flight.truth()[0][:2]) > stop_m, 200.0)
    flight.hang_for(late_s)
    farthest = 0.0
    for _ in range(3000):
        flight.tick()
        farthest = max(farthest, math.hypot(*flight.truth()[0][:2]))
    assert farthest < FACE_M


@pytest.mark.parametrize("vehicle", TURNING, ids=IDS)
def test_velocity_commands_keep_off_the_face_by_the_turn_of_a_return(
    vehicle: tuple[str, str],
) -> None:
    flight = SteeredFlight(*vehicle, volume_radius_m=FACE_M)
    flight.begin()
    flight.steer(30.0, (2.0, 0.0, 0.0))
    assert math.hypot(*flight.truth()[0][:2]) > FACE_M - 8.0
    assert farthest_m(flight) < FACE_M


@pytest.mark.parametrize("vehicle", TURNING, ids=IDS)
def test_a_target_is_rejected_where_a_return_has_no_room_to_turn(
    vehicle: tuple[str, str],
) -> None:
    flight = in_a_volume(*vehicle)
    target = (0.0, FACE_M - TURNING[vehicle] + 0.1, 0.0)
    for request in (flight.request(*target), WaypointsRequest((WaypointRequest(target),))):
        rejection = flight.check(request)
        assert rejection is not None
        assert rejection.code.value == "OUTSIDE_VOLUME"
        assert "COM_OBL_RC_ACT" in rejection.message


@pytest.mark.parametrize("before_m", [6.0, 3.0, 1.5])
def test_a_boat_that_holds_without_its_server_may_go_to_the_face(before_m: float) -> None:
    flight = towards_the_face("boat", "px4", INSIDE_M, COM_OBL_RC_ACT=5.0)
    flight.run_until(lambda: math.hypot(*flight.truth()[0][:2]) > FACE_M - before_m, 200.0)
    assert farthest_m(flight) < FACE_M
    assert flight.simulation.vehicles[0].firmware.mode.spec.name == "AUTO.LOITER"


TO_THE_FACE = [("copter", "ardupilot"), ("rover", "ardupilot"), *TURNING]


@pytest.mark.parametrize("vehicle", TO_THE_FACE, ids=IDS)
def test_a_target_at_the_face_is_reached(vehicle: tuple[str, str]) -> None:
    flight = towards_the_face(*vehicle)
    goal_id = f"{2 if vehicle[0] == 'copter' else 1:032x}"
    flight.run_until(lambda: bool(flight.ends(goal_id)), 200.0)
    assert flight.ends(goal_id)[0].code.value == "SUCCESS", flight.ends(goal_id)


@pytest.mark.parametrize("vehicle", COPTERS, ids=IDS)
def test_a_dead_server_leaves_its_copter_below_the_top_of_the_volume(
    vehicle: tuple[str, str],
) -> None:
    flight = towards_the_face(*vehicle)
    flight.start(flight.request(0.0, 0.0, TOP_M - INSIDE_M))
    flight.run_until(lambda: flight.truth()[0][2] > TOP_M - 2.0, 200.0)
    highest_m = 0.0
    for _ in range(60):
        flight.stall(STEP_S)
        highest_m = max(highest_m, flight.truth()[0][2])
    assert highest_m < TOP_M + 0.5


def test_a_dead_server_leaves_an_arducopter_in_its_fence() -> None:
    fence = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 2.0, "FENCE_RADIUS": FACE_M, "FENCE_ACTION": 0.0}
    flight = ready("copter", "ardupilot", **fence)
    flight.start(flight.request(0.0, FACE_M - 1.0, 8.0, speed=SPEED_M_S))
    flight.run_until(lambda: flight.truth()[0][1] > FACE_M - 5.0, 200.0)
    assert farthest_m(flight) < FACE_M


@pytest.mark.parametrize("vehicle", PLANES, ids=IDS)
def test_a_dead_server_leaves_its_plane_circling_in_the_volume(vehicle: tuple[str, str]) -> None:
    simulated = VehicleConfig(
        vehicle=vehicle[0],
        autopilot=vehicle[1],
        ready_after_s=1.0,
        battery=BatteryModel(capacity_mah=60_000.0),
    )
    flight = SimulatedFlight(
        simulated=simulated, battery_policy="ignore", volume_radius_m=500.0
    ).ready()
    flight.run_for(2.0)
    target = (0.0, 335.0, 60.0)  # two radii of its circle, of 80 m at most, before the face
    flight.start(flight.request(*target))
    flight.run_until(lambda: left_m(flight, target) < 90.0, 200.0)
    assert farthest_m(flight, 60.0) < 500.0
