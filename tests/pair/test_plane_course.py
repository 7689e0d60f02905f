"""Velocity commands, flown by simulated planes: a course over ground, a climb and an airspeed."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import Wind, World
from navigation_bridge.goals.requests import VelocityRequest
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.velocity_stick import SteeredFlight

pytestmark = pytest.mark.wide

# Above the simulated ArduPlane's AIRSPEED_MIN, 17 m/s.
SPEED_M_S = 18.0
RADIUS_M = 700.0
REPOSITION = 192  # MAV_CMD_DO_REPOSITION
SETTINGS = {
    "speed_up_m_s": 3.0,
    "speed_down_m_s": 2.0,
    "volume_altitude_min_m": 25.0,
    "volume_altitude_max_m": 120.0,
}


def flying(
    world: World | None = None, radius_m: float = 3000.0, **more: float | str
) -> SteeredFlight:
    settings: dict[str, float | str] = {**SETTINGS, "volume_radius_m": radius_m, **more}
    return SteeredFlight("plane", "ardupilot", world, None, **settings)


def velocity(flight: SteeredFlight) -> tuple[float, float, float]:
    """Return the true velocity: east, north, up."""
    north, east, down = (float(v) for v in flight.simulation.truth.velocity_ned_m_s[0])
    return east, north, -down


def course_deg(flight: SteeredFlight) -> float:
    east, north, _ = velocity(flight)
    return math.degrees(math.atan2(north, east))


@pytest.mark.night
def test_a_plane_flies_the_course_the_climb_and_the_speed_that_it_is_told() -> None:
    flight = flying()
    goal_id = flight.begin(20.0)
    flight.steer(20.0, (SPEED_M_S, 0.0, 0.0), frame="map")
    assert course_deg(flight) == pytest.approx(0.0, abs=1.0)
    assert flight.status(goal_id) == "NAVIGATING"
    # Thin air: the true speed is 6 % above the indicated one.
    assert flight.speed_m_s == pytest.approx(1.06 * SPEED_M_S, rel=0.06)
    flight.steer(10.0, (SPEED_M_S, 0.0, 2.0), frame="map")
    low_m = flight.truth()[0][2]
    flight.steer(10.0, (SPEED_M_S, 0.0, 2.0), frame="map")
    assert flight.truth()[0][2] - low_m == pytest.approx(20.0, abs=3.0)
    assert flight.status(goal_id) == "CLIMBING"
    flight.steer(3.0, (0.0, SPEED_M_S, -1.0), frame="map")
    assert flight.status(goal_id) == "TURNING"
    flight.steer(15.0, (0.0, SPEED_M_S, -1.0), frame="map")
    assert flight.status(goal_id) == "DESCENDING"
    assert course_deg(flight) == pytest.approx(90.0, abs=1.0)
    assert velocity(flight)[2] == pytest.approx(-1.0, abs=0.3)
    flight.steer(12.0, (SPEED_M_S, 0.0, 0.0), rate=0.1)
    flight.steer(8.0, (SPEED_M_S, 0.0, 0.0))
    assert math.remainder(course_deg(flight) - 90.0 - math.degrees(1.2), 360.0) == pytest.approx(
        0.0, abs=6.0
    )
    seen = flight.feedback(goal_id)[-1]
    assert seen.velocity_enu_m_s == pytest.approx(velocity(flight), abs=1.0)
    assert flight.setpoint_times(0.0) == [], "a plane follows none"


def test_the_course_is_kept_over_ground_in_wind_from_the_side() -> None:
    flight = flying(World(wind=Wind((7.0, 0.0, 0.0))))
    flight.begin(20.0)
    flight.steer(25.0, (SPEED_M_S, 0.0, 0.0), frame="map")
    begun = flight.truth()[0]
    flight.steer(15.0, (SPEED_M_S, 0.0, 0.0), frame="map")
    east_m, north_m = (b - a for a, b in zip(begun[:2], flight.truth()[0][:2], strict=True))
    assert math.degrees(math.atan2(north_m, east_m)) == pytest.approx(0.0, abs=4.0)


@pytest.mark.night
def test_it_circles_before_the_edge_of_the_volume_and_comes_back() -> None:
    flight = flying(radius_m=RADIUS_M)
    goal_id = flight.begin(20.0)
    farthest_m = 0.0
    for _ in range(90):
        flight.steer(1.0, (0.0, -SPEED_M_S, 0.0), frame="map")
        farthest_m = max(farthest_m, math.hypot(*flight.truth()[0][:2]))
    assert RADIUS_M - 200.0 < farthest_m < RADIUS_M
    assert flight.status(goal_id) == "BLOCKED"
    assert "leads out of the flight volume" in flight.said
    flight.steer(20.0, (0.0, SPEED_M_S, 0.0), frame="map")
    assert course_deg(flight) == pytest.approx(90.0, abs=2.0)


@pytest.mark.night
def test_when_the_commands_stop_it_circles_and_the_goal_ends() -> None:
    flight = flying(settle_timeout_s=30.0)
    goal_id = flight.begin(20.0)
    flight.steer(15.0, (SPEED_M_S, 0.0, 0.0), frame="map")
    place = flight.truth()[0]
    flight.run_for(2.0)
    assert flight.status(goal_id) == "HOLDING"
    end = flight.run_to_end(goal_id, 60.0)
    assert end.code is OutcomeCode.TIMEOUT, end.message
    assert "circles where it was" in end.message
    for _ in range(40):
        flight.run_for(1.0)
        assert math.dist(flight.truth()[0][:2], place[:2]) < 400.0


def test_a_dead_server_leaves_it_circling_ahead_in_the_volume() -> None:
    flight = flying(radius_m=RADIUS_M)
    flight.begin(20.0)
    while flight.truth()[0][0] < RADIUS_M - 350.0:
        flight.steer(0.5, (SPEED_M_S, 0.0, 0.0), frame="map")
    place, farthest_m, away_m = flight.truth()[0], 0.0, 0.0
    for _ in range(120):
        flight.stall(1.0)
        farthest_m = max(farthest_m, math.hypot(*flight.truth()[0][:2]))
        away_m = max(away_m, math.dist(flight.truth()[0][:2], place[:2]))
    assert farthest_m < RADIUS_M
    assert away_m < 450.0


def test_a_pilot_who_takes_over_keeps_the_plane() -> None:
    flight = flying(cmd_vel_start="command")
    goal_id = flight.begin(20.0)
    flight.steer(8.0, (SPEED_M_S, 0.0, 0.0), frame="map")
    flight.set_mode_as_pilot("CRUISE")
    end = flight.steer_to_end(goal_id, (SPEED_M_S, 0.0, 0.0))
    assert end.code is OutcomeCode.PILOT_OVERRIDE, end.message
    flight.steer(5.0, (SPEED_M_S, 0.0, 0.0))
    assert flight.vehicle.mode_name == "CRUISE"
    assert flight.bridge.goals.active is None


def test_no_place_but_the_first_takes_the_mode_from_a_pilot() -> None:
    """What is on its way, or is sent before the vehicle reports its mode, is rejected."""
    flight = flying()
    flight.begin(20.0)
    flight.steer(10.0, (SPEED_M_S, 0.0, 0.0), frame="map")
    sent = [m for _, m in flight.sent if getattr(m, "command", 0) == REPOSITION]
    changes_mode = [bool(int(m.param2) & 1) for m in sent]
    assert changes_mode[-8:] == [False] * 8
    assert any(changes_mode)


def test_a_command_that_a_plane_cannot_fly_has_it_circle_with_a_sentence() -> None:
    flight = flying()
    goal_id = flight.begin()
    flight.steer(3.0, (5.0, 0.0, 0.0))
    assert flight.status(goal_id) == "BLOCKED"
    assert "the least airspeed of this plane is 17 m/s" in flight.said
    flight.steer(3.0, (-18.0, 0.0, 0.0))
    assert flight.feedback(goal_id)[-1].limited_by == "A plane cannot fly backwards."


def test_a_highest_speed_below_the_least_airspeed_is_rejected() -> None:
    rejection = flying().check(VelocityRequest(5.0))
    assert rejection is not None
    assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
    assert "the least airspeed of this plane is" in rejection.message


def test_a_plane_whose_airspeeds_are_not_known_is_rejected() -> None:
    plane = SteeredFlight("plane", vehicle_parameters={"AIRSPEED_MIN": 0.0})
    rejection = plane.check(VelocityRequest())
    assert rejection is not None
    assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
    assert "have not been read" in rejection.message


def test_a_plane_of_px4_is_rejected_since_each_place_would_take_its_mode_from_a_pilot() -> None:
    rejection = SteeredFlight("plane", "px4").check(VelocityRequest())
    assert rejection is not None
    assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
    assert "take its mode from a pilot" in rejection.message
