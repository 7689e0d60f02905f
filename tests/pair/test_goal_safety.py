"""Fence, volume, battery and health: before a goal is accepted, and while it is flown."""

from __future__ import annotations

import re

import pytest

from mavlink_sitl import PlanItem, Severity, VehicleConfig
from navigation_bridge.goals.requests import (
    LandRequest,
    ReturnRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.stations.missions import position_1e7

pytestmark = pytest.mark.wide_but_first


FENCES = {
    "ardupilot": {
        "FENCE_ENABLE": 1.0, "FENCE_TYPE": 3.0, "FENCE_RADIUS": 40.0, "FENCE_ALT_MAX": 30.0,
    },
    "px4": {"GF_ACTION": 2.0, "GF_MAX_HOR_DIST": 40.0, "GF_MAX_VER_DIST": 30.0},
}  # fmt: skip


def ready(
    autopilot: str = "ardupilot",
    parameters: dict[str, float] | None = None,
    battery_policy: str = "reject",
    kind: str = "copter",
) -> SimulatedFlight:
    vehicle = VehicleConfig(
        autopilot=autopilot, vehicle=kind, ready_after_s=1.0, parameters=parameters or {}
    )
    flight = SimulatedFlight(simulated=vehicle, battery_policy=battery_policy).ready()
    flight.run_until(lambda: "FENCE_TYPE" in flight.vehicle.parameters.values or autopilot == "px4")
    return flight


@pytest.fixture(params=["ardupilot", "px4"])
def fenced(request: pytest.FixtureRequest) -> SimulatedFlight:
    flight = ready(request.param, FENCES[request.param])
    flight.run_for(1.0)
    return flight


def test_the_fence_is_read_from_the_vehicle_and_kept_to(fenced: SimulatedFlight) -> None:
    outside = fenced.check(fenced.request(60.0, 0.0, 5.0))
    assert outside is not None
    assert outside.code is OutcomeCode.OUTSIDE_FENCE
    assert "radius of 40 m" in outside.message
    above = fenced.check(fenced.request(5.0, 0.0, 35.0))
    assert above is not None
    assert above.code is OutcomeCode.OUTSIDE_FENCE
    assert "30 m" in above.message
    edge = fenced.check(fenced.request(39.5, 0.0, 5.0))
    assert edge is not None
    assert "fence_margin_m" in edge.message
    assert fenced.check(fenced.request(35.0, 0.0, 5.0)) is None


def test_a_waypoint_outside_the_fence_is_named(fenced: SimulatedFlight) -> None:
    points = ((10.0, 0.0, 5.0), (60.0, 0.0, 5.0), (10.0, 10.0, 5.0))
    refused = fenced.check(WaypointsRequest(tuple(WaypointRequest(point) for point in points)))
    assert refused is not None
    assert refused.code is OutcomeCode.OUTSIDE_FENCE
    assert "Waypoint 2" in refused.message


def test_a_fence_that_is_pulled_in_under_way_ends_the_goal_while_it_is_still_inside(
    fenced: SimulatedFlight,
) -> None:
    fenced.fly_up()
    goal = fenced.send(35.0, 0.0, 5.0, speed=1.0)
    fenced.run_for(3.0)
    vehicle = fenced.simulation.vehicles[0]
    name = "FENCE_RADIUS" if "FENCE_RADIUS" in vehicle.parameters else "GF_MAX_HOR_DIST"
    vehicle.parameters.set(name, 30.0)
    end = fenced.run_to_end(goal, 60.0)
    assert end.code is OutcomeCode.OUTSIDE_FENCE, end.message
    assert "changed" in end.message
    assert fenced.truth()[1] < 0.3


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_areas_that_were_uploaded_count(autopilot: str) -> None:
    """A square with a hole in it, uploaded by somebody else before we come."""
    flight = SimulatedFlight(simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0))
    vehicle = flight.simulation.vehicles[0]
    if autopilot == "ardupilot":
        vehicle.parameters.set("FENCE_ENABLE", 1.0)
        vehicle.parameters.set("FENCE_TYPE", 4.0)
    square = [(-60.0, -60.0), (-60.0, 60.0), (60.0, 60.0), (60.0, -60.0)]
    places = [position_1e7(n, e) for n, e in (*square, (0.0, 30.0))]
    kinds = [(5001, 4.0)] * 4 + [(5004, 8.0)]
    vehicle.firmware.plans.fence.replace(
        [
            PlanItem(command, 0, (number, 0.0, 0.0, 0.0), *place)
            for (command, number), place in zip(kinds, places, strict=True)
        ]
    )
    flight.ready()
    flight.run_until(lambda: flight.vehicle.stored_lists.fence is not None, 20.0)
    for target, words in (
        ((70.0, 0.0, 5.0), "polygon"),
        ((30.0, 2.0, 5.0), "circle"),
        ((50.0, 0.0, 5.0), "leaves the fence's circle"),
    ):
        refused = flight.check(flight.request(*target))
        assert refused is not None, target
        assert refused.code is OutcomeCode.OUTSIDE_FENCE
        assert words in refused.message
    assert flight.check(flight.request(0.0, 50.0, 5.0)) is None


PLANE_FENCES = {
    "ardupilot": {
        "FENCE_ENABLE": 1.0, "FENCE_TYPE": 3.0, "FENCE_RADIUS": 900.0, "FENCE_ALT_MAX": 120.0,
    },
    "px4": {"GF_ACTION": 2.0, "GF_MAX_HOR_DIST": 900.0, "GF_MAX_VER_DIST": 120.0},
}  # fmt: skip


@pytest.mark.night_but_first
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_plane_keeps_its_circles_from_the_rim_of_the_fence_and_its_overshoot_from_the_top(
    autopilot: str,
) -> None:
    vehicle = VehicleConfig(
        autopilot=autopilot,
        vehicle="plane",
        ready_after_s=1.0,
        parameters=PLANE_FENCES[autopilot],
    )
    flight = SimulatedFlight(
        simulated=vehicle, battery_policy="ignore", volume_radius_m=3000.0
    ).ready()
    flight.run_for(2.0)
    for target, words in (
        ((200.0, 0.0, 111.5), "a margin of 9 m"),
        ((800.0, 0.0, 60.0), "m from the boundary of the fence's circle"),
    ):
        refused = flight.check(flight.request(*target))
        assert refused is not None
        assert words in refused.message
    goal = flight.send(200.0, 0.0, 110.9)
    highest_m = 0.0
    while not flight.ends(goal):
        flight.tick()
        highest_m = max(highest_m, flight.truth()[0][2])
    assert flight.ends(goal)[0].code is OutcomeCode.SUCCESS, flight.ends(goal)
    assert highest_m < 119.0


def test_without_a_fence_nothing_is_rejected_for_one() -> None:
    flight = ready(parameters={"FENCE_ENABLE": 0.0, "FENCE_RADIUS": 10.0})
    assert flight.check(flight.request(60.0, 0.0, 5.0)) is None


def test_a_vehicle_that_leaves_the_volume_ends_its_goal_and_holds() -> None:
    flight = ready()
    flight.fly_up()
    goal = flight.send(0.0, 60.0, 5.0)
    flight.run_until(lambda: flight.truth()[0][1] > 10.0)
    flight.reconfigure(volume_radius_m=12.0)
    end = flight.run_to_end(goal, 30.0)
    assert end.code is OutcomeCode.OUTSIDE_VOLUME, end.message
    assert flight.truth()[1] < 0.3


def test_a_goal_with_insufficient_battery_is_rejected_or_warned_about() -> None:
    far = tuple(WaypointRequest((x, 0.0, 5.0)) for x in (400.0, 0.0))
    request = WaypointsRequest(far, laps=10)
    refused = ready().check(request)
    assert refused is not None
    assert refused.code is OutcomeCode.LOW_BATTERY
    assert "battery_reserve is 20 %" in refused.message
    for policy in ("warn", "ignore"):
        assert ready(battery_policy=policy).check(request) is None


@pytest.mark.parametrize(
    ("autopilot", "kind", "parameters", "speed_m_s"),
    [
        ("ardupilot", "copter", {"WPNAV_SPEED": 800.0}, 8.0),
        ("ardupilot", "copter", {"WPNAV_SPEED": 800.0, "RTL_SPEED": 100.0}, 1.0),
        ("ardupilot", "rover", {"WP_SPEED": 2.0}, 2.0),
        ("px4", "copter", {"MPC_XY_CRUISE": 6.0}, 6.0),
        ("px4", "rover", {"RO_SPEED_LIM": 1.5}, 1.5),
    ],
)
def test_the_return_is_reckoned_at_the_vehicles_own_speed(
    autopilot: str, kind: str, parameters: dict[str, float], speed_m_s: float
) -> None:
    flight = ready(autopilot, parameters, kind=kind)
    flight.run_for(2.0)
    height_m = 0.0 if kind == "rover" else 5.0
    flight.reconfigure(battery_reserve=0.9, battery_endurance_s=60.0)
    # The goal's own speed is neither the default (3 m/s) nor the vehicle's.
    refused = flight.check(flight.request(400.0, 0.0, height_m, speed=10.0))
    assert refused is not None
    (back_s,) = (float(s) for s in re.findall(r"(\d+) s for the return", refused.message))
    assert back_s == pytest.approx(400.0 / speed_m_s + height_m, abs=2.0), refused.message


def test_the_return_is_reckoned_at_the_goals_speed_while_the_vehicles_is_not_known() -> None:
    flight = ready(
        "ardupilot", {"RTL_SPEED": 0.0, "WP_SPEED": 0.0, "CRUISE_SPEED": 0.0}, kind="rover"
    )
    flight.run_for(2.0)
    flight.reconfigure(battery_reserve=0.9, battery_endurance_s=60.0)
    refused = flight.check(flight.request(400.0, 0.0, 0.0, speed=10.0))
    assert refused is not None
    assert "40 s for the return" in refused.message


@pytest.mark.night
def test_the_battery_of_px4s_own_simulation_does_not_ground_it() -> None:
    """It falls to 50 % within half a minute of arming, then stands still."""
    flight = ready("px4")
    flight.fly_up()
    flight.run_for(30.0)
    assert flight.run_to_end(flight.send(10.0, 0.0, 4.0)).code is OutcomeCode.SUCCESS


def test_a_battery_that_runs_low_under_way_ends_the_goal_but_not_the_return() -> None:
    flight = ready()
    goal = flight.send(200.0, 0.0, 5.0)
    flight.run_until(lambda: flight.truth()[0][0] > 40.0)
    flight.simulation.vehicles[0].set_battery_remaining(0.21)
    end = flight.run_to_end(goal, 60.0)
    assert end.code is OutcomeCode.LOW_BATTERY, end.message
    assert "the return takes" in end.message
    assert flight.truth()[1] < 0.3
    assert flight.check(flight.request(45.0, 0.0, 5.0)) is not None
    assert flight.check(LandRequest()) is None
    goal = flight.start(ReturnRequest())
    flight.run_for(4.0)
    assert not flight.ends(goal)


def test_a_mission_that_the_vehicle_flies_is_held_to_the_same() -> None:
    flight = ready(parameters=FENCES["ardupilot"])
    points = tuple(WaypointRequest((x, 0.0, 5.0)) for x in (10.0, 35.0))
    beyond = (*points, WaypointRequest((60.0, 0.0, 5.0)))
    refused = flight.check(WaypointsRequest(beyond, by_mission=True))
    assert refused is not None
    assert refused.code is OutcomeCode.OUTSIDE_FENCE
    goal = flight.start(WaypointsRequest(points, by_mission=True))
    flight.run_until(lambda: flight.truth()[0][0] > 5.0)
    flight.simulation.vehicles[0].set_battery_remaining(0.2)
    end = flight.run_to_end(goal, 60.0)
    assert end.code is OutcomeCode.LOW_BATTERY, end.message
    assert flight.truth()[1] < 0.3
    assert flight.vehicle.mode_name == "BRAKE"


def test_a_gps_that_was_just_lost_is_seen_before_the_estimator_says_so() -> None:
    flight = ready()
    flight.fly_up()
    flight.simulation.vehicles[0].lose_gps()
    flight.run_for(2.0)
    refused = flight.check(flight.request(10.0, 0.0, 5.0))
    assert refused is not None
    assert refused.code is OutcomeCode.UNHEALTHY
    assert "3D fix" in refused.message
    assert flight.check(LandRequest()) is None


def test_a_vehicle_that_somebody_else_armed_is_not_disarmed_by_a_cancel() -> None:
    flight = ready()
    flight.set_mode_as_pilot("GUIDED")
    flight.run_for(1.5)
    flight.vehicle.arm(flight.now)
    flight.run_until(lambda: flight.vehicle.state.armed, 10.0)
    flight.run_for(0.5)
    goal = flight.send(10.0, 0.0, 5.0)
    flight.run_to_status(goal, "TAKING_OFF")
    assert flight.bridge.goals.cancel(goal, flight.now)
    end = flight.run_to_end(goal, 30.0)
    assert end.code is OutcomeCode.CANCELED, end.message
    assert "armed" in end.message
    assert flight.vehicle.state.armed


def test_a_goal_that_was_reached_quotes_nothing() -> None:
    flight = ready()
    end = flight.run_to_end(flight.send(5.0, 0.0, 2.0))
    assert end.code is OutcomeCode.SUCCESS
    assert flight.vehicle.state.status_texts
    assert "autopilot reported" not in end.message


def test_a_crash_is_quoted_and_not_the_answer_to_a_request_of_the_server() -> None:
    flight = ready()
    goal = flight.send(20.0, 0.0, 5.0)
    flight.run_to_status(goal, "NAVIGATING")
    simulated = flight.simulation.vehicles[0]
    simulated.crash("scaffold", 0.9)
    # Observed: the server asks for messages now and then, and this is ArduPilot's answer.
    simulated.firmware.say(Severity.INFO, "No ap_message for mavlink id (136)")
    end = flight.run_to_end(goal, 10.0)
    assert end.code is OutcomeCode.DISARMED
    assert end.message.endswith("The autopilot reported: 'Crash: hit scaffold at 0.9 m/s'.")
