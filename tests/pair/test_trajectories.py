"""Trajectories of other programs, flown by simulated copters."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from mavlink_sitl import Obstacle, RangeSensor, VehicleConfig, World
from navigation_bridge.goals.requests import TrajectoryRequest
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.progress import Status
from navigation_core.trajectories.timed_point import TimedPoint
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.trajectory_flight import Curve, TrajectoryFlight, circle, lissajous

pytestmark = pytest.mark.wide_but_first

AUTOPILOTS = ["ardupilot", "px4"]


def straight(start: Vector3, speed_m_s: float, duration_s: float) -> tuple[TimedPoint, ...]:
    """Return points to the east at a steady speed, which end in motion."""
    x, y, z = start
    return tuple(
        TimedPoint(t, (x + speed_m_s * t, y, z), (speed_m_s, 0.0, 0.0))
        for t in (0.0, 0.5 * duration_s, duration_s)
    )


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize(
    ("curve", "size_m", "speed_m_s", "most_m"),
    [(lissajous, 12.0, 3.0, 0.15), (circle, 8.0, 3.0, 0.15), (circle, 40.0, 8.0, 0.5)],
    ids=["lissajous_3", "circle_3", "circle_8"],
)
def test_a_trajectory_is_flown_by_its_time_with_little_error(
    autopilot: str,
    curve: Callable[[Vector3, float, float], Curve],
    size_m: float,
    speed_m_s: float,
    most_m: float,
) -> None:
    flight = TrajectoryFlight(autopilot, volume_radius_m=300.0, speed_max_m_s=1.05 * speed_m_s)
    planned = curve(flight.here, size_m, speed_m_s)
    begun_s = flight.now
    goal_id = flight.start(TrajectoryRequest("map", planned.points()))
    errors = flight.errors(goal_id)
    assert errors.largest_m < most_m
    assert errors.yaw_deg < 1.5
    (end,) = flight.ends(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert end.final_error_m is not None
    assert end.final_error_m < 0.5
    scales = [
        f.trajectory.time_scale
        for f in flight.feedback(goal_id)
        if f.trajectory and f.status is Status.NAVIGATING
    ]
    assert min(scales) == 1.0
    assert flight.now - begun_s >= planned.duration_s


@pytest.mark.night_but_first
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_trajectory_of_the_topic_replaces_the_flown_one_without_a_gap(autopilot: str) -> None:
    flight = TrajectoryFlight(autopilot)
    planned = lissajous(flight.here, 12.0, 2.0)
    goal_id = flight.start(TrajectoryRequest("map", planned.points(0.0, 8.0)))
    flight.run_until(lambda: flight.status(goal_id) == "NAVIGATING")
    begin_s = flight.now
    slowest_m_s, jump_m, before = math.inf, 0.0, None
    while flight.now < begin_s + 20.0:
        flight.tick()
        goal = flight.bridge.goals.active
        sent = None if goal is None else goal.task.commanded
        if sent is not None and before is not None:
            jump_m = max(jump_m, math.dist(sent.position_enu_m, before))
        before = None if sent is None else sent.position_enu_m
        since_s = flight.now - begin_s
        if since_s > 6.0:
            slowest_m_s = min(slowest_m_s, flight.truth()[1])
        if round(100.0 * since_s) % 200 == 0:
            again = planned.points(since_s, since_s + 8.0)
            flight.offer(TrajectoryRequest("map", again, begins_s=flight.now))
    assert jump_m < 2.0 * 0.05 * 2.0
    assert slowest_m_s > 0.7
    progress = flight.feedback(goal_id)[-1].trajectory
    assert progress is not None
    assert progress.replacements >= 8
    assert progress.error_m < 0.3
    assert not flight.ends(goal_id)


@pytest.mark.night_but_first
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_stream_that_ends_in_motion_runs_out_to_a_stop(autopilot: str) -> None:
    flight = TrajectoryFlight(autopilot)
    goal_id = flight.start(TrajectoryRequest())
    flight.run_for(2.0)
    assert flight.status(goal_id) == "HOLDING"
    start = flight.here
    flight.offer(TrajectoryRequest("map", straight(start, 2.0, 5.0)))
    flight.run_for(4.0)
    assert flight.status(goal_id) == "NAVIGATING"
    assert flight.truth()[1] > 1.7
    end = flight.run_to_end(goal_id, 60.0)
    assert end.code is OutcomeCode.TIMEOUT, end.message
    assert "ended in motion" in end.message
    assert flight.truth()[1] < 0.3
    assert 8.0 < flight.truth()[0][0] - start[0] < 13.0


REJECTED: dict[str, tuple[Callable[[TimedPoint], TimedPoint], str]] = {
    "not a number": (lambda p: replace(p, position_enu_m=(math.nan, 0.0, 3.0)), "not finite"),
    "times fall": (lambda p: replace(p, time_s=0.0), "times must rise"),
    "no velocity": (lambda p: replace(p, velocity_enu_m_s=None), "whether it has a velocity"),
    "too fast": (lambda p: replace(p, velocity_enu_m_s=(99.0, 0.0, 0.0)), "the limit is"),
}


@pytest.mark.parametrize("fault", REJECTED)
def test_a_trajectory_with_a_fault_is_rejected_and_nothing_moves(fault: str) -> None:
    flight = TrajectoryFlight()
    points = list(straight(flight.here, 1.0, 4.0))
    make, words = REJECTED[fault]
    points[1] = make(points[1])
    rejection = flight.check(TrajectoryRequest("map", tuple(points)))
    assert rejection is not None
    assert rejection.code is OutcomeCode.TRAJECTORY_INVALID
    assert words in rejection.message
    assert "oint 1" in rejection.message or "point 2" in rejection.message
    place = flight.truth()[0]
    flight.run_for(2.0)
    assert math.dist(flight.truth()[0], place) < 0.3


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("kind", ["rover", "plane"])
def test_other_vehicles_are_unsupported_before_anybody_arms_them(kind: str, autopilot: str) -> None:
    vehicle = VehicleConfig(vehicle=kind, autopilot=autopilot, ready_after_s=1.0)
    flight = SimulatedFlight(simulated=vehicle).ready()
    rejection = flight.check(TrajectoryRequest("map", straight((0.0, 0.0, 0.0), 1.0, 4.0)))
    assert rejection is not None
    assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE, rejection


def test_bounds_and_the_beginning_of_a_trajectory_are_checked() -> None:
    flight = TrajectoryFlight(volume_radius_m=20.0)
    x, y, z = flight.here
    cases = {
        OutcomeCode.TRAJECTORY_INVALID: straight((x + 5.0, y, z), 1.0, 4.0),
        # It ends 1 m inside, but the stop after it does not.
        OutcomeCode.OUTSIDE_VOLUME: straight((x, y, z), 2.0, 9.5),
    }  # fmt: skip
    for code, points in cases.items():
        rejection = flight.check(TrajectoryRequest("map", points))
        assert rejection is not None
        assert rejection.code is code, rejection
    late = TrajectoryRequest("map", straight((x, y, z), 1.0, 4.0), begins_s=flight.now - 5.0)
    rejection = flight.check(late)
    assert rejection is not None
    assert "comes late" in rejection.message
    unknown = flight.check(TrajectoryRequest("camera", straight((x, y, z), 1.0, 4.0)))
    assert unknown is not None
    assert unknown.code is OutcomeCode.UNKNOWN_FRAME


@pytest.mark.night
def test_a_trajectory_that_is_too_fast_is_slowed_down_where_that_is_allowed_and_reported() -> None:
    flight = TrajectoryFlight(trajectory_too_fast="slow_down", speed_max_m_s=3.0)
    planned = lissajous(flight.here, 12.0, 6.0)
    goal_id = flight.start(TrajectoryRequest("map", planned.points()))
    flight.run_for(5.0)
    fastest_m_s = 0.0
    while not flight.ends(goal_id):
        flight.run_for(0.1)
        fastest_m_s = max(fastest_m_s, flight.truth()[1])
    (end,) = flight.ends(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "times slower" in end.message
    assert fastest_m_s < 3.3
    progress = flight.feedback(goal_id)[-1].trajectory
    assert progress is not None
    assert "times slower" in progress.limited_by


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_vehicle_stops_on_its_trajectory_before_what_its_sensor_sees(autopilot: str) -> None:
    wall = (Obstacle("wall", (18.0, 0.0), size_m=(0.4, 30.0), top_m=40.0),)
    world = World(obstacles=wall, range_sensor=RangeSensor(reach_m=10.0, noise_m=0.03))
    flight = TrajectoryFlight(autopilot, world=world, blocked_timeout_s=8.0)
    x, y, z = flight.here
    points = (TimedPoint(0.0, (x, y, z)), TimedPoint(15.0, (x, y + 30.0, z)))
    goal_id = flight.start(TrajectoryRequest("map", points))
    end = flight.run_to_end(goal_id, 60.0)
    assert end.code is OutcomeCode.NO_PATH, end.message
    assert "BLOCKED" in {f.status.value for f in flight.feedback(goal_id)}
    assert flight.truth()[1] < 0.3
    assert not flight.ground_truth.hits
    assert 0.5 < flight.clearance_m() < 6.0


FENCED = {
    "ardupilot": {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 2.0, "FENCE_RADIUS": 60.0},
    "px4": {"GF_ACTION": 2.0, "GF_MAX_HOR_DIST": 60.0},
}


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
@pytest.mark.parametrize("topic", [False, True], ids=["goal", "topic"])
def test_a_fence_that_shrinks_over_a_trajectory_ends_it_inside(topic: bool, autopilot: str) -> None:
    flight = TrajectoryFlight(autopilot, onboard=FENCED[autopilot])
    flight.run_for(10.0)  # it reads its fence meanwhile
    request = TrajectoryRequest("map", straight(flight.here, 3.0, 15.0))
    goal_id = flight.start(TrajectoryRequest() if topic else request)
    flight.run_until(lambda: flight.status(goal_id) in ("HOLDING", "NAVIGATING"))
    if topic:
        flight.offer(request)
    flight.run_for(2.0)
    assert flight.status(goal_id) == "NAVIGATING"
    name = "FENCE_RADIUS" if autopilot == "ardupilot" else "GF_MAX_HOR_DIST"
    flight.simulation.vehicles[0].parameters.set(name, 30.0)
    flight.vehicle.parameters.refresh(flight.now)  # nobody reports it
    end = flight.run_to_end(goal_id, 60.0)
    assert end.code is (OutcomeCode.NO_PATH if topic else OutcomeCode.OUTSIDE_FENCE), end.message
    assert "fence" in end.message
    assert flight.truth()[1] < 0.3
    assert math.hypot(*flight.truth()[0][:2]) < 30.0
    flight.run_for(5.0)
    assert math.hypot(*flight.truth()[0][:2]) < 30.0


@pytest.mark.parametrize("autopilot", AUTOPILOTS)
def test_a_turn_on_the_spot_has_the_rate_that_was_planned_and_ends_when_it_is_cancelled(
    autopilot: str,
) -> None:
    flight = TrajectoryFlight(autopilot)
    rate = 0.3  # counter-clockwise, from the north
    points = tuple(
        TimedPoint(float(t), flight.here, (0.0, 0.0, 0.0), None, 0.5 * math.pi + rate * t, rate)
        for t in range(20)
    )
    goal_id = flight.start(TrajectoryRequest("map", points))
    flight.run_until(lambda: flight.status(goal_id) == "NAVIGATING")
    flight.run_for(4.0)
    before = flight.yaw_enu_rad
    flight.run_for(2.0)
    assert math.remainder(flight.yaw_enu_rad - before, math.tau) == pytest.approx(0.6, abs=0.06)
    flight.bridge.goals.cancel(goal_id, flight.now)
    end = flight.run_to_end(goal_id)
    assert end.code is OutcomeCode.CANCELED, end.message
    flight.run_for(1.0)
    before = flight.yaw_enu_rad
    flight.run_for(3.0)
    assert math.remainder(flight.yaw_enu_rad - before, math.tau) == pytest.approx(0.0, abs=0.03)


@pytest.mark.night
def test_a_pause_stops_the_vehicle_on_its_trajectory_and_it_continues_from_there() -> None:
    flight = TrajectoryFlight()
    planned = lissajous(flight.here, 12.0, 2.0)
    goal_id = flight.start(TrajectoryRequest("map", planned.points()))
    flight.run_for(8.0)
    goal = flight.bridge.goals.active
    assert goal is not None
    assert goal.pause(flight.now) is None
    flight.run_for(6.0)
    assert flight.status(goal_id) == "PAUSED"
    assert flight.truth()[1] < 0.3
    goal.task.unpause(flight.now)
    end = flight.run_to_end(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
