"""Velocity commands, flown and driven by simulated vehicles."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import Obstacle, RangeSensor, VehicleConfig, World
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.requests import VelocityRequest
from navigation_bridge.tasks.velocity_commands import VelocityCommands
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.station_flight import StationFlight
from tests.support.flights.velocity_stick import SteeredFlight

pytestmark = pytest.mark.wide


COPTERS = [("copter", "ardupilot"), ("copter", "px4")]
GROUND = [("rover", "ardupilot"), ("rover", "px4"), ("boat", "ardupilot")]
VEHICLES = COPTERS + GROUND
SETPOINT = "SET_POSITION_TARGET_LOCAL_NED"
IDS = "-".join


@pytest.mark.parametrize("vehicle", COPTERS, ids=IDS)
def test_a_copter_moves_as_told_turns_as_told_and_stays_where_it_stops(
    vehicle: tuple[str, str],
) -> None:
    flight = SteeredFlight(*vehicle)
    goal_id = flight.begin()
    start = flight.truth()[0]
    flight.steer(6.0, (2.0, 0.0, 0.0), frame="map")
    place = flight.truth()[0]
    assert 8.0 < place[0] - start[0] < 12.0
    assert abs(place[1] - start[1]) < 0.5
    assert abs(place[2] - start[2]) < 0.4
    yaw = flight.yaw_enu_rad
    flight.steer(3.0, (0.0, 0.0, 0.0), rate=0.5)
    turned = math.remainder(flight.yaw_enu_rad - yaw, math.tau)
    assert turned == pytest.approx(1.5, abs=0.3)
    flight.steer(3.0, (0.0, 0.0, 0.0))
    place = flight.truth()[0]
    flight.steer(8.0, (0.0, 0.0, 0.0))
    assert math.dist(flight.truth()[0], place) < 0.3
    course = flight.yaw_enu_rad
    flight.steer(5.0, (1.0, 0.0, 0.0))
    moved = (flight.truth()[0][0] - place[0], flight.truth()[0][1] - place[1])
    assert math.hypot(*moved) > 3.0
    assert math.remainder(math.atan2(moved[1], moved[0]) - course, math.tau) == pytest.approx(
        0.0, abs=0.15
    )
    assert flight.status(goal_id) == "NAVIGATING"


@pytest.mark.parametrize("vehicle", GROUND, ids=IDS)
def test_what_drives_comes_to_the_speed_it_is_told_and_not_beyond(vehicle: tuple[str, str]) -> None:
    flight = SteeredFlight(*vehicle, speed_default_m_s=3.0, volume_radius_m=2000.0)
    flight.begin(3.0)
    backwards = (-1.5,) if vehicle[1] == "ardupilot" else ()
    for told_m_s in (1.5, 2.5, 1.0, *backwards, 0.8):
        fastest_m_s, raised = 0.0, abs(told_m_s) > flight.speed_m_s or told_m_s < 0.0
        for step in range(100):
            flight.steer(0.1, (told_m_s, 0.0, 0.0))
            if raised and step > 25:
                fastest_m_s = max(fastest_m_s, flight.speed_m_s)
        assert fastest_m_s < 1.08 * abs(told_m_s), told_m_s
        assert flight.speed_m_s == pytest.approx(abs(told_m_s), rel=0.06), told_m_s


@pytest.mark.parametrize("vehicle", VEHICLES, ids=IDS)
@pytest.mark.parametrize("speed_m_s", [1.5, 3.0])
def test_half_a_metre_is_kept_to_the_flight_volume(
    vehicle: tuple[str, str], speed_m_s: float
) -> None:
    flight = SteeredFlight(*vehicle, volume_radius_m=25.0)
    flight.begin(speed_m_s)
    farthest_m = 0.0
    for _ in range(450):
        flight.steer(0.1, (speed_m_s, 0.0, 0.0))
        farthest_m = max(farthest_m, math.hypot(*flight.truth()[0][:2]))
    assert 23.0 < farthest_m < 24.5


@pytest.mark.parametrize("vehicle", VEHICLES, ids=IDS)
def test_when_the_commands_stop_the_vehicle_stops_and_the_goal_ends(
    vehicle: tuple[str, str],
) -> None:
    flight = SteeredFlight(*vehicle)
    goal_id = flight.begin()
    flight.steer(5.0, (2.0, 0.0, 0.0))
    assert flight.speed_m_s > 1.5
    place = flight.truth()[0]
    flight.run_for(6.0)
    assert flight.speed_m_s < 0.3
    assert flight.status(goal_id) == "HOLDING"
    assert math.dist(flight.truth()[0], place) < 6.0
    end = flight.run_to_end(goal_id, 30.0)
    assert end.code is OutcomeCode.TIMEOUT, end.message
    assert "No velocity command has been received for 20 s" in end.message
    assert flight.speed_m_s < 0.3


@pytest.mark.parametrize("vehicle", COPTERS, ids=IDS)
def test_a_copter_keeps_the_limits(vehicle: tuple[str, str]) -> None:
    flight = SteeredFlight(*vehicle, speed_default_m_s=4.0)
    flight.begin()
    level, up = [], []
    for linear in ((50.0, 0.0, 0.0), (0.0, 50.0, 0.0), (0.0, 0.0, 50.0), (0.0, 0.0, -50.0)):
        # The integrator of a PX4's climb takes some seconds from one direction to the other.
        for _ in range(60):
            flight.steer(0.1, linear, frame="map")
            north, east, down = (float(v) for v in flight.simulation.truth.velocity_ned_m_s[0])
            level.append(math.hypot(north, east))
            up.append(-down)
    assert 3.6 < max(level) < 1.1 * 4.0
    assert 1.2 < max(up) < 1.15 * 1.5
    assert -1.15 * 1.0 < min(up) < -0.8


def test_a_rover_of_ardupilot_reverses_and_turns_by_turn_rate() -> None:
    flight = SteeredFlight("rover", "ardupilot")
    flight.begin()
    start, yaw = flight.truth()[0], flight.yaw_enu_rad
    flight.steer(4.0, (-1.0, 0.0, 0.0))
    behind = (flight.truth()[0][0] - start[0]) * math.cos(yaw) + (
        flight.truth()[0][1] - start[1]
    ) * math.sin(yaw)
    assert behind < -2.0
    assert abs(math.remainder(flight.yaw_enu_rad - yaw, math.tau)) < 0.2
    flight.steer(4.0, (1.5, 0.0, 0.0), rate=0.4)
    assert math.remainder(flight.yaw_enu_rad - yaw, math.tau) == pytest.approx(1.3, abs=0.5)
    frames = {m.coordinate_frame for _, m in flight.sent if m.get_type() == SETPOINT}
    assert 8 in frames  # MAV_FRAME_BODY_NED


def test_a_rover_of_px4_turns_by_its_course_and_stands_when_told_to_reverse() -> None:
    flight = SteeredFlight("rover", "px4")
    goal_id = flight.begin()
    yaw = flight.yaw_enu_rad
    flight.steer(4.0, (1.5, 0.0, 0.0), rate=0.4)
    assert math.remainder(flight.yaw_enu_rad - yaw, math.tau) == pytest.approx(1.4, abs=0.5)
    flight.steer(4.0, (-1.0, 0.0, 0.0))
    assert flight.speed_m_s < 0.1
    assert flight.status(goal_id) == "BLOCKED"
    assert "cannot be driven backwards" in flight.said


@pytest.mark.parametrize("vehicle", VEHICLES, ids=IDS)
def test_a_velocity_in_the_map_is_a_course_over_ground(vehicle: tuple[str, str]) -> None:
    flight = SteeredFlight(*vehicle)
    flight.begin()
    flight.steer(8.0, (0.0, -2.0, 0.0), frame="map")
    before = flight.truth()[0]
    flight.steer(3.0, (0.0, -2.0, 0.0), frame="map")
    east, north = flight.truth()[0][0] - before[0], flight.truth()[0][1] - before[1]
    assert north < -4.0
    assert abs(east) < 0.8


FENCED = {
    "ardupilot": {
        "FENCE_ENABLE": 1.0, "FENCE_TYPE": 3.0, "FENCE_RADIUS": 30.0, "FENCE_ALT_MAX": 12.0,
        "FENCE_ACTION": 1.0,
    },
    "px4": {"GF_MAX_HOR_DIST": 30.0, "GF_MAX_VER_DIST": 12.0, "GF_ACTION": 3.0},
}  # fmt: skip


@pytest.mark.parametrize("vehicle", [*COPTERS, ("rover", "ardupilot")], ids=IDS)
def test_it_stops_inside_the_vehicles_own_fence(vehicle: tuple[str, str]) -> None:
    kind, autopilot = vehicle
    fence = dict(FENCED[autopilot])
    if kind == "rover":
        fence |= {"FENCE_TYPE": 2.0}
        fence.pop("FENCE_ALT_MAX")
    flight = SteeredFlight(kind, autopilot, vehicle_parameters=fence, speed_default_m_s=5.0)
    flight.run_for(10.0)  # it reads its fence meanwhile
    goal_id = flight.begin()
    flight.steer(20.0, (5.0, 5.0, 3.0), frame="map")
    assert 24.0 < math.hypot(*flight.truth()[0][:2]) < 30.0
    assert flight.speed_m_s < 0.3
    assert flight.status(goal_id) == "BLOCKED"
    assert flight.said.count("BLOCKED") <= 2  # it is said once, not with every command
    if kind == "copter":
        # The fence counts from home, which a PX4 moves in flight.
        position = flight.vehicle.state.global_position
        assert position is not None
        assert 8.0 < position.relative_altitude_m < 12.0
    else:
        return
    flight.steer(6.0, (-2.0, 0.0, 0.0), frame="map")
    assert math.hypot(*flight.truth()[0][:2]) < 26.0
    assert not flight.ends(goal_id)


@pytest.mark.parametrize("vehicle", [*COPTERS, ("rover", "px4")], ids=IDS)
def test_it_stops_inside_the_flight_volume(vehicle: tuple[str, str]) -> None:
    flight = SteeredFlight(*vehicle, volume_radius_m=25.0, volume_altitude_max_m=8.0)
    goal_id = flight.begin()
    flight.steer(25.0, (0.0, 3.0, 2.0), frame="map")
    assert 22.0 < math.hypot(*flight.truth()[0][:2]) < 25.0
    assert (flight.bridge.height_m or 0.0) < 8.0  # the home of a PX4 moves, and heights with it
    assert flight.status(goal_id) == "BLOCKED"
    if vehicle[0] == "copter":
        flight.steer(15.0, (0.0, 0.0, -3.0), frame="map")
        assert flight.truth()[0][2] > 0.5
        assert flight.vehicle.state.armed


@pytest.mark.parametrize("vehicle", [*COPTERS, ("rover", "ardupilot")], ids=IDS)
def test_it_stops_in_front_of_what_its_sensor_sees(vehicle: tuple[str, str]) -> None:
    wall = (Obstacle("wall", (15.0, 0.0), size_m=(0.4, 30.0), top_m=40.0),)
    world = World(obstacles=wall, range_sensor=RangeSensor(reach_m=10.0, noise_m=0.03))
    flight = SteeredFlight(*vehicle, world=world)
    goal_id = flight.begin()
    for _ in range(250):
        flight.steer(0.1, (0.0, 3.0, 0.0), frame="map")
        assert flight.clearance_m() > 0.5
    assert flight.clearance_m() < 5.0
    assert flight.speed_m_s < 0.5
    assert not flight.ground_truth.hits
    assert not flight.ends(goal_id)


@pytest.mark.parametrize("vehicle", VEHICLES, ids=IDS)
def test_a_pilot_who_takes_over_keeps_the_vehicle_though_commands_continue(
    vehicle: tuple[str, str],
) -> None:
    kind, autopilot = vehicle
    flight = SteeredFlight(kind, autopilot, cmd_vel_start="command")
    goal_id = flight.begin()
    flight.steer(5.0, (1.0, 0.0, 0.0))
    modes = {
        ("copter", "ardupilot"): "LOITER", ("copter", "px4"): "AUTO.RTL",
        ("rover", "ardupilot"): "MANUAL", ("rover", "px4"): "AUTO.LOITER",
        ("boat", "ardupilot"): "MANUAL",
    }  # fmt: skip
    flight.set_mode_as_pilot(modes[vehicle])
    end = flight.steer_to_end(goal_id, (1.0, 0.0, 0.0))
    assert end.code is OutcomeCode.PILOT_OVERRIDE, end.message
    ended_s = flight.now
    flight.steer(5.0, (1.0, 0.0, 0.0))
    flight.steer(1.0, (0.0, 0.0, 0.0))
    flight.steer(3.0, (1.0, 0.0, 0.0))  # somebody lets go, and tries again
    assert not flight.setpoint_times(ended_s + 0.1)
    assert flight.vehicle.mode_name == modes[vehicle]
    assert "Velocity commands are ignored" in flight.said
    assert flight.bridge.goals.active is None


def test_a_failsafe_ends_it_with_its_code() -> None:
    flight = SteeredFlight(
        vehicle_parameters={"BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 2.0, "BATT_LOW_TIMER": 3.0}
    )
    goal_id = flight.begin()
    flight.steer(2.0, (1.0, 0.0, 0.0))
    flight.simulation.vehicles[0].set_battery_voltage(10.0)
    end = flight.steer_to_end(goal_id, (1.0, 0.0, 0.0))
    assert end.code is OutcomeCode.FAILSAFE_BATTERY, end.message


def test_a_lost_link_ends_it() -> None:
    flight = SteeredFlight()
    goal_id = flight.begin()
    flight.steer(2.0, (1.0, 0.0, 0.0))
    flight.link_up = False
    end = flight.steer_to_end(goal_id, (1.0, 0.0, 0.0))
    assert end.code is OutcomeCode.LINK_LOST, end.message


@pytest.mark.parametrize("vehicle", [*COPTERS, ("rover", "ardupilot")], ids=IDS)
def test_the_first_command_starts_a_goal_where_that_is_allowed(vehicle: tuple[str, str]) -> None:
    flight = SteeredFlight(*vehicle, cmd_vel_start="command")
    flight.steer(1.0, (0.0, 0.0, 0.0))
    assert not flight.started
    if vehicle[0] == "rover":
        # Nobody has given it to this server yet.
        flight.steer(1.0, (1.0, 0.0, 0.0))
        assert not flight.started
        assert "a mode that this server did not choose" in flight.said
        flight.set_mode_as_pilot("GUIDED")
        flight.run_for(2.0)
    flight.steer(4.0, (1.0, 0.0, 0.0))
    goal_id = flight.started
    assert flight.status(goal_id) == "NAVIGATING"
    assert flight.speed_m_s > 0.8
    flight.steer(4.0, (0.0, 0.0, 0.0))
    end = flight.run_to_end(goal_id, 30.0)
    assert end.code is OutcomeCode.SUCCESS, end.message
    flight.steer(4.0, (1.0, 0.0, 0.0))
    assert flight.started != goal_id
    assert flight.speed_m_s > 0.8


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_what_a_ground_station_has_paused_or_sent_is_not_taken_by_a_command(autopilot: str) -> None:
    flight = StationFlight(autopilot, "copter", cmd_vel_start="command")
    flight.fly_up()
    for pauses in (True, False):
        if pauses:
            flight.pause_or_continue(False)
        else:
            flight.reposition_nowhere()
        flight.run_for(2.0)
        since_s = flight.now
        for _ in range(20):
            command = VelocityCommand(flight.now, VelocityFrame.BODY, (1.0, 0.0, 0.0))
            flight.bridge.feature(VelocityCommands).follow(command, "c0" * 16, flight.now)
            flight.run_for(0.1)
        assert flight.bridge.goals.active is None
        assert not flight.setpoint_times(since_s)
        assert "taken over" in "\n".join(line.text for line in flight.log_lines())
        assert flight.run_to_end(flight.send(0.0, 2.0, 3.0)).code is OutcomeCode.SUCCESS


def test_by_default_commands_alone_move_nothing() -> None:
    flight = SteeredFlight()
    since_s = flight.now
    place = flight.truth()[0]
    flight.steer(3.0, (2.0, 0.0, 0.0))
    assert flight.bridge.goals.active is None
    assert not flight.setpoint_times(since_s + 0.1)
    assert math.dist(flight.truth()[0], place) < 0.3
    assert "cmd_vel_start is 'goal'" in flight.said


def test_commands_during_another_goal_are_ignored_and_do_not_take_over_after_it() -> None:
    flight = SteeredFlight(cmd_vel_start="command")
    goal_id = flight.send(8.0, 0.0, 3.0)
    end = flight.steer_to_end(goal_id, (0.0, 3.0, 0.0), 60.0)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert abs(flight.truth()[0][1]) < 0.6
    assert "(navigate_to_waypoint) is active" in flight.said
    flight.steer(3.0, (0.0, 3.0, 0.0))  # still held
    assert not flight.started
    flight.steer(0.2, (0.0, 0.0, 0.0))
    flight.steer(3.0, (0.0, 3.0, 0.0))
    assert flight.started
    assert flight.speed_m_s > 1.0


def test_another_goal_replaces_it_without_a_jolt() -> None:
    flight = SteeredFlight()
    goal_id = flight.begin()
    flight.steer(4.0, (3.0, 0.0, 0.0), frame="map")
    speed = flight.speed_m_s
    successor = flight.send(30.0, 0.0, 3.0)
    flight.run_for(0.6)
    assert flight.ends(goal_id)[0].code is OutcomeCode.PREEMPTED
    assert flight.speed_m_s > 0.6 * speed
    assert flight.run_to_end(successor).code is OutcomeCode.SUCCESS


@pytest.mark.parametrize("vehicle", VEHICLES, ids=IDS)
def test_a_cancel_and_the_hold_service_stop_it_and_commands_do_not_undo_that(
    vehicle: tuple[str, str],
) -> None:
    flight = SteeredFlight(*vehicle, cmd_vel_start="command")
    goal_id = flight.begin()
    flight.steer(3.0, (1.5, 0.0, 0.0))
    assert flight.bridge.goals.cancel(goal_id, flight.now)
    end = flight.steer_to_end(goal_id, (1.5, 0.0, 0.0))
    assert end.code is OutcomeCode.CANCELED, end.message
    flight.steer(3.0, (1.5, 0.0, 0.0))
    assert flight.speed_m_s < 0.5
    again = flight.begin()
    flight.steer(3.0, (1.5, 0.0, 0.0))
    assert flight.serve(Service.HOLD).success
    assert flight.ends(again)[0].code is OutcomeCode.PREEMPTED
    flight.steer(1.0, (0.0, 0.0, 0.0))
    flight.steer(4.0, (1.5, 0.0, 0.0))
    assert not flight.started
    assert flight.speed_m_s < (1.0 if vehicle[0] == "boat" else 0.5)  # a boat glides


def test_a_pause_service_stops_it_and_resume_lets_it_continue() -> None:
    flight = SteeredFlight()
    goal_id = flight.begin()
    flight.steer(2.0, (1.0, 0.0, 0.0))
    assert flight.bridge.services.pause(flight.now)[0]
    flight.steer(5.0, (1.0, 0.0, 0.0))
    assert flight.status(goal_id) == "PAUSED"
    assert flight.speed_m_s < 0.2
    assert flight.bridge.services.resume(flight.now)[0]
    flight.steer(3.0, (1.0, 0.0, 0.0))
    assert flight.speed_m_s > 0.8


def test_no_command_starts_a_goal_while_the_server_stops() -> None:
    flight = SteeredFlight(cmd_vel_start="command")
    flight.bridge.goals.shut_down(flight.now)
    flight.steer(2.0, (1.0, 0.0, 0.0))
    assert not flight.started


def test_garbage_stops_the_vehicle_at_once_and_is_reported() -> None:
    flight = SteeredFlight()
    goal_id = flight.begin()
    flight.steer(3.0, (2.0, 0.0, 0.0))
    flight.tell((math.nan, 0.0, 0.0))
    flight.run_for(0.3)  # sooner than the timeout
    assert flight.status(goal_id) == "HOLDING"
    assert "linear (nan, 0, 0) m/s" in flight.said
    flight.bridge.feature(VelocityCommands).reject(
        "unknown frame 'odom'; use 'base_link' or 'map'.", flight.now
    )
    flight.run_for(3.0)
    assert flight.speed_m_s < 0.2
    flight.steer(3.0, (2.0, 0.0, 0.0))
    assert flight.speed_m_s > 1.5


@pytest.mark.parametrize(
    ("kind", "code", "words"),
    [
        ("copter", OutcomeCode.NOT_FLYING, "take off first"),
        ("rover", OutcomeCode.NOT_FLYING, "arm it first"),
        ("plane", OutcomeCode.NOT_FLYING, "take off first"),
    ],
)
def test_what_stands_is_rejected(kind: str, code: OutcomeCode, words: str) -> None:
    vehicle = VehicleConfig(vehicle=kind, ready_after_s=1.0)
    flight = SimulatedFlight(simulated=vehicle, arming="auto").ready()
    rejection = flight.check(VelocityRequest())
    assert rejection is not None
    assert rejection.code is code
    assert words in rejection.message


@pytest.mark.parametrize(
    ("speed", "code"),
    [
        (math.nan, OutcomeCode.INVALID_NUMBER),
        (math.inf, OutcomeCode.INVALID_NUMBER),
        (0.01, OutcomeCode.INVALID_NUMBER),
        (-1.0, OutcomeCode.NEGATIVE_SPEED),
    ],
)
def test_a_speed_that_cannot_be_is_rejected(speed: float, code: OutcomeCode) -> None:
    flight = SteeredFlight("rover")
    rejection = flight.check(VelocityRequest(speed))
    assert rejection is not None
    assert rejection.code is code
