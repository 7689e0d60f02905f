"""Acts at waypoints, done by simulated vehicles: in routes by setpoints and in missions."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import mavlink
from navigation_bridge.goals.goal import GoalFinished
from navigation_bridge.goals.requests import (
    ActKind,
    ActRequest,
    PointMode,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

NEAR, FAR = (10.0, 0.0, 3.0), (10.0, 10.0, 3.0)
SERVO = ActRequest(ActKind.SERVO, channel=9, pulse_us=1200)
WAIT = ActRequest(ActKind.WAIT, duration_s=4.0)
SET_SERVO = mavlink.MAV_CMD_DO_SET_SERVO
IN_USE = ActRequest(ActKind.SERVO, channel=1, pulse_us=1200)


def flight_of(autopilot: str, **parameters: float) -> SimulatedFlight:
    simulated = VehicleConfig(autopilot=autopilot, ready_after_s=1.0, parameters=parameters)
    return SimulatedFlight(simulated=simulated).ready()


def route(
    first: tuple[ActRequest, ...], last: tuple[ActRequest, ...] = (), by_mission: bool = False
) -> WaypointsRequest:
    waypoints = (
        WaypointRequest(NEAR, acceptance_radius_m=1.0, acts=first),
        WaypointRequest(FAR, acceptance_radius_m=1.0, acts=last),
    )
    return WaypointsRequest(waypoints, by_mission)


def fly(flight: SimulatedFlight, request: WaypointsRequest) -> tuple[GoalFinished, float]:
    """Fly to the end; returns it, and how long the vehicle stood near the first waypoint."""
    goal_id = flight.start(request)
    still_s = 0.0
    for _ in range(4_000):
        if flight.ends(goal_id):
            return flight.ends(goal_id)[0], still_s
        flight.run_for(0.05)
        position, speed_m_s = flight.truth()
        still_s += 0.05 if speed_m_s < 0.3 and math.dist(position, NEAR) < 1.0 else 0.0
    raise AssertionError(f"no end: {flight.outputs[-5:]}")


def servos_us(flight: SimulatedFlight) -> dict[int, int]:
    outputs: dict[int, int] = flight.simulation.vehicles[0].firmware.outputs.servos_us
    return outputs


@pytest.mark.parametrize("by_mission", [False, True])
def test_an_arducopter_does_acts_in_order_and_waits(by_mission: bool) -> None:
    flight = flight_of("ardupilot")
    later = ActRequest(ActKind.SERVO, channel=9, pulse_us=1800)
    last = ActRequest(ActKind.SERVO, channel=10, pulse_us=1500)
    end, still_s = fly(flight, route((SERVO, WAIT, later), (last, last), by_mission))
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert servos_us(flight) == {9: 1800, 10: 1500}
    assert 3.5 < still_s < 10.0


def test_a_waypoint_with_acts_alone_is_flown_through() -> None:
    flight = flight_of("ardupilot")
    end, still_s = fly(flight, route((SERVO,)))
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert servos_us(flight) == {9: 1200}
    assert still_s == 0.0


def test_a_rejected_act_is_named_and_ends_the_goal_only_if_it_is_required() -> None:
    flight = flight_of("ardupilot")
    end, _ = fly(flight, route((IN_USE, SERVO)))
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "Not done: SERVO at waypoint 1." in end.message
    assert any("DO_SET_SERVO was answered with FAILED" in line.text for line in flight.log_lines())
    required = ActRequest(ActKind.SERVO, True, channel=1, pulse_us=1200)
    end, _ = fly(flight, route((required,)))
    assert end.code is OutcomeCode.ACT_FAILED
    assert "SERVO at waypoint 1, which is required" in end.message
    flight.run_for(2.0)
    assert flight.truth()[1] < 0.3
    assert math.dist(flight.truth()[0], FAR) > 3.0


@pytest.mark.wide
def test_a_px4_answers_for_outputs_but_not_for_a_camera_that_it_lacks() -> None:
    flight = flight_of("px4")
    trigger = ActRequest(ActKind.TRIGGER_DISTANCE, distance_m=5.0)
    output = ActRequest(ActKind.SERVO, channel=2, pulse_us=1750)
    end, _ = fly(flight, route((output,), (trigger,)))
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "Not done: TRIGGER_DISTANCE at waypoint 2." in end.message
    (sent,) = [
        m
        for _, m in flight.sent
        if isinstance(m, mavlink.MAVLink_command_long_message)
        and m.command == mavlink.MAV_CMD_DO_SET_ACTUATOR
    ]
    assert sent.param2 == 0.5
    assert math.isnan(sent.param1)


@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_all_acts_are_stored_in_a_mission_as_sent(autopilot: str) -> None:
    own = {"CAM1_TYPE": 1.0, "MNT1_TYPE": 1.0, "GRIP_ENABLE": 1.0}
    flight = flight_of(autopilot, **(own if autopilot == "ardupilot" else {}))
    acts = (
        ActRequest(ActKind.PHOTO),
        ActRequest(ActKind.TRIGGER_DISTANCE, distance_m=5.5),
        ActRequest(ActKind.POINT, pitch_rad=-0.7, yaw_rad=0.3),
        ActRequest(ActKind.POINT, point=PointMode.POSITION, target=(30.0, 5.0, 1.0)),
        ActRequest(ActKind.POINT, point=PointMode.NEUTRAL),
        ActRequest(ActKind.GRIPPER, grabs=True),
        WAIT,
        ActRequest(ActKind.TRIGGER_DISTANCE),
    )
    end, still_s = fly(flight, route(acts, acts[:2], by_mission=True))
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert 2.0 < still_s < 10.0, "it brakes in that time, too"


def test_a_vehicle_without_a_camera_rejects_a_photo() -> None:
    rejection = flight_of("ardupilot").check(route((ActRequest(ActKind.PHOTO),)))
    assert rejection is not None
    assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
    assert rejection.message.startswith("Waypoint 1: act 1 (PHOTO): the vehicle has no camera")


@pytest.mark.parametrize("by_mission", [False, True])
def test_an_arducopter_points_shoots_and_grips_on_its_route(by_mission: bool) -> None:
    flight = flight_of("ardupilot", CAM1_TYPE=1.0, MNT1_TYPE=1.0, GRIP_ENABLE=1.0)
    payload = flight.simulation.vehicles[0].firmware.payload
    first = (
        ActRequest(ActKind.POINT, pitch_rad=-math.pi / 2, yaw_rad=-math.pi / 4),
        ActRequest(ActKind.TRIGGER_DISTANCE, distance_m=3.0),
        ActRequest(ActKind.GRIPPER, grabs=True),
    )
    last = (ActRequest(ActKind.TRIGGER_DISTANCE), ActRequest(ActKind.PHOTO))
    end, _ = fly(flight, route(first, last, by_mission))
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "Not done" not in end.message
    assert (payload.pitch_deg, payload.yaw_deg) == pytest.approx((-90.0, 45.0))
    assert payload.gripped is True
    assert 4 <= payload.photos <= 5, "one at once, one each 3 m of 10 m, one at the end"


@pytest.mark.parametrize("by_mission", [False, True])
def test_a_px4_with_a_gimbal_points_it_on_its_route(by_mission: bool) -> None:
    """The mission takes control of it first, without which its own commands are denied."""
    flight = flight_of("px4", MNT_MODE_IN=4.0, MNT_RANGE_PITCH=180.0)
    payload = flight.simulation.vehicles[0].firmware.payload
    points = ActRequest(ActKind.POINT, pitch_rad=-math.pi / 2, yaw_rad=-math.pi / 4)
    goal_id = flight.start(route((points,), (WAIT,), by_mission))
    # A PX4 that leaves its mission turns its gimbal ahead again.
    flight.run_until(lambda: payload.pitch_deg < -89.0, 60.0)
    assert payload.yaw_deg == pytest.approx(45.0)
    flight.run_until(lambda: bool(flight.ends(goal_id)), 60.0)
    (end,) = flight.ends(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "Not done" not in end.message


def plane_flight() -> SimulatedFlight:
    simulated = VehicleConfig(vehicle="plane", ready_after_s=1.0)
    return SimulatedFlight(simulated=simulated, volume_radius_m=2000.0).ready()


def plane_route(flight: SimulatedFlight, radius_m: float) -> tuple[GoalFinished, float]:
    """Fly a plane past a waypoint and to a last one; returns the end, and the time that it held."""
    later = ActRequest(ActKind.SERVO, channel=9, pulse_us=1800)
    last = ActRequest(ActKind.SERVO, channel=10, pulse_us=1500)
    waypoints = (
        WaypointRequest((300.0, 0.0, 60.0), acceptance_radius_m=radius_m, acts=(SERVO,)),
        WaypointRequest((300.0, 400.0, 60.0), acceptance_radius_m=150.0, acts=(last, WAIT, later)),
    )
    goal_id, held_s = flight.start(WaypointsRequest(waypoints)), 0.0
    while not flight.ends(goal_id):
        flight.run_for(0.5)
        held_s += 0.5 * (flight.status(goal_id) == "HOLDING")
    return flight.ends(goal_id)[0], held_s


def test_a_plane_does_acts_as_it_passes_and_as_it_circles() -> None:
    flight = plane_flight()
    end, held_s = plane_route(flight, 150.0)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "Not done" not in end.message
    assert servos_us(flight) == {9: 1800, 10: 1500}
    assert held_s >= 3.5
    sent = [m.param2 for _, m in flight.sent if getattr(m, "command", 0) == SET_SERVO]
    assert list(dict.fromkeys(sent)) == [1200.0, 1500.0, 1800.0]


def test_a_plane_drops_nothing_outside_the_radius_of_a_waypoint() -> None:
    flight = plane_flight()
    end, _ = plane_route(flight, 5.0)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "Not done: SERVO at waypoint 1." in end.message


def test_a_plane_that_does_not_do_a_required_act_circles_and_the_goal_ends() -> None:
    flight = plane_flight()
    required = ActRequest(ActKind.SERVO, True, channel=1, pulse_us=1200)
    waypoints = (
        WaypointRequest((300.0, 0.0, 60.0), acceptance_radius_m=150.0, acts=(required,)),
        WaypointRequest((900.0, 0.0, 60.0)),
    )
    end = flight.run_to_end(flight.start(WaypointsRequest(waypoints)))
    assert end.code is OutcomeCode.ACT_FAILED, end.message
    assert "circles where it was" in end.message
    flight.run_for(40.0)
    assert flight.truth()[0][0] < 700.0
