"""Targets that are followed, on each kind of vehicle and both firmwares; what is rejected."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from mavlink_sitl import Obstacle, VehicleConfig, World
from mavlink_vehicle.codec import Message
from navigation_bridge.goals.requests import FollowRequest, OffsetFrame, TargetSource
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.inputs.tracked_target import TargetSample
from navigation_core.tasks.progress import FollowState
from tests.support.flights.follow_flight import FollowFlight, Motion
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.messages.autopilot_messages import AutopilotMessages

TOPIC = TargetSource(topic="/target")
BEHIND = FollowRequest(TOPIC, (-6.0, 0.0, 5.0), least_distance_m=4.0, max_speed_m_s=7.0)
COPTERS = ["ardupilot", pytest.param("px4", marks=pytest.mark.wide)]
MAST = World(obstacles=(Obstacle("mast", (0.0, 25.0), radius_m=1.5, top_m=40.0),))
MAST_FILE = "obstacles: [{kind: cylinder, name: mast, at_m: [25, 0], radius_m: 1.5, height_m: 40}]"


def east(speed_m_s: float, start: tuple[float, float, float] = (10.0, 0.0, 0.0)) -> Motion:
    """A motion to the east at a constant speed."""
    return lambda passed_s: (start[0] + speed_m_s * passed_s, start[1], start[2])


@pytest.mark.parametrize("autopilot", COPTERS)
def test_a_copter_keeps_its_place_behind_a_target_at_5_m_s(autopilot: str) -> None:
    flight = FollowFlight(east(5.0), autopilot=autopilot, speed_max_m_s=8.0, volume_radius_m=500.0)
    goal_id = flight.follow(BEHIND)
    flight.chase(25.0)
    assert flight.state(goal_id) is FollowState.FOLLOWING
    assert flight.error_m((-6.0, 0.0, 5.0)) < 1.0
    assert flight.nearest_m > 4.0
    assert flight.fastest_m_s < 7.7
    assert flight.status(goal_id) == "NAVIGATING"
    flight.bridge.goals.cancel(goal_id, flight.now)
    assert flight.run_to_end(goal_id).code is OutcomeCode.CANCELED


@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("kind", ["rover", "boat"])
def test_what_drives_follows_over_ground_and_stops_for_a_target_that_comes(
    kind: str, autopilot: str
) -> None:
    flight = FollowFlight(east(1.2), kind, autopilot, volume_radius_m=500.0)
    request = replace(BEHIND, offset_m=(-5.0, 0.0, 3.0), least_distance_m=2.0)
    goal_id = flight.follow(request)
    flight.chase(40.0)
    assert flight.state(goal_id) is FollowState.FOLLOWING
    assert math.dist(flight.truth()[0][:2], (flight.target[0] - 5.0, 0.0)) < 1.5
    assert flight.nearest_m > 2.0
    turned_s, turned_m = flight.now - flight.began_s, flight.target[0]
    flight.motion = lambda passed_s: (turned_m - 0.5 * (passed_s - turned_s), 0.0, 0.0)
    before = flight.truth()[0]
    flight.chase(8.0)
    assert math.dist(flight.truth()[0], before) < 4.0
    assert flight.truth()[1] < 0.4


@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_target_that_comes_makes_a_copter_back_off(autopilot: str) -> None:
    flight = FollowFlight(
        lambda passed_s: (max(40.0 - 2.0 * passed_s, -20.0), 0.0, 10.0), autopilot=autopilot
    )
    request = replace(BEHIND, offset_m=(12.0, 0.0, 0.0), offset_frame=OffsetFrame.MAP)
    goal_id = flight.follow(request)
    flight.chase(60.0)
    assert flight.nearest_m > 4.0
    assert flight.state(goal_id) is FollowState.FOLLOWING


@pytest.mark.parametrize("autopilot", COPTERS)
def test_a_lost_target_is_waited_for_and_then_ends_the_goal(autopilot: str) -> None:
    flight = FollowFlight(east(3.0), autopilot=autopilot)
    goal_id = flight.follow(replace(BEHIND, lost_timeout_s=5.0))
    flight.chase(5.0)
    flight.is_seen = False
    flight.chase(4.0)
    assert flight.state(goal_id) is FollowState.LOST
    assert flight.status(goal_id) == "HOLDING"
    end = flight.run_to_end(goal_id)
    assert end.code is OutcomeCode.TARGET_LOST
    assert end.message.startswith(
        "TARGET_LOST: No usable sample of the target has come for 5 s. The vehicle has stopped."
    )
    assert flight.truth()[1] < 0.5


LIES = {
    "NaN": TargetSample(0.0, (math.nan, 0.0, 0.0)),
    "an hour old": TargetSample(-3600.0, (10.0, 0.0, 0.0)),
    "in the future": TargetSample(60.0, (10.0, 0.0, 0.0)),
    "300 m/s": TargetSample(0.0, (10.0, 0.0, 0.0), (300.0, 0.0, 0.0)),
    "100 km away": TargetSample(0.0, (100_000.0, 0.0, 0.0)),
}
REASONS = ("not finite", "3600.0 s ago", "60.0 s in the future", "300 m/s", "100 km away")


def test_a_target_that_lies_moves_nothing() -> None:
    flight = FollowFlight(east(0.0))
    start = flight.truth()[0]
    for lie, reason in zip(LIES.values(), REASONS, strict=True):
        goal_id = flight.follow(replace(BEHIND, lost_timeout_s=2.0))
        for _ in range(25):
            if not flight.ends(goal_id):
                flight.measure(replace(lie, measured_s=flight.now + lie.measured_s))
                flight.run_for(0.1)
        end = flight.run_to_end(goal_id)
        assert end.code is OutcomeCode.TARGET_LOST
        assert reason in end.message
    assert math.dist(flight.truth()[0], start) < 0.5
    assert "A sample of the target was rejected" in "\n".join(
        line.text for line in flight.log_lines()
    )


@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_known_obstacle_is_flown_around(autopilot: str, tmp_path: Path) -> None:
    file = tmp_path / "obstacles.yaml"
    file.write_text(MAST_FILE)
    flight = FollowFlight(
        east(2.0, (10.0, 0.0, 5.0)),
        autopilot=autopilot,
        world=MAST,
        obstacles_file=str(file),
    )
    request = replace(BEHIND, offset_m=(-6.0, 0.0, 0.0), offset_frame=OffsetFrame.MAP)
    goal_id = flight.follow(request)
    flight.chase(35.0)
    assert flight.clearance_m() > 0.0
    assert flight.error_m((-6.0, 0.0, 0.0)) < 1.5
    assert flight.feedback(goal_id)[-1].replans > 0


def _position(other: AutopilotMessages, stamp_ms: int, name: str) -> Message:
    """Return the position of another system, 20 m to the north of the simulated home."""
    lat, lon = round(1e7 * (-35.363261 + 20.0 / 111_195.0)), round(1e7 * 149.16523)
    if name == "FOLLOW_TARGET":
        at = {"lat": lat, "lon": lon, "alt": 584.0}
        return other(name, timestamp=stamp_ms, est_capabilities=1, **at)
    return other(name, time_boot_ms=stamp_ms, lat=lat, lon=lon, alt=584_000, hdg=0)


def _follow_system(
    flight: FollowFlight, system_id: int, name: str, count: int, hear: Callable[..., None]
) -> str:
    """Follow a system, which is heard ten times a second; return the goal's id."""
    source = TargetSource(system_id=system_id)
    goal_id = flight.follow(replace(BEHIND, source=source, offset_frame=OffsetFrame.MAP))
    other = AutopilotMessages(system_id)
    for number in range(count):
        hear(_position(other, 1000 + 100 * number, name), flight.now)
        flight.run_for(0.1)
    return goal_id


@pytest.mark.parametrize("name", ["FOLLOW_TARGET", "GLOBAL_POSITION_INT"])
def test_another_mavlink_system_is_followed(name: str) -> None:
    flight = FollowFlight(east(0.0))
    goal_id = _follow_system(flight, 7, name, 100, flight.bridge.receive)
    assert flight.state(goal_id) is FollowState.FOLLOWING
    distance_m = flight.feedback(goal_id)[-1].follow.distance_m  # type: ignore[union-attr]
    assert distance_m == pytest.approx(math.hypot(6.0, 5.0), abs=3.0)


@pytest.mark.parametrize(("name", "follows"), [("FOLLOW_TARGET", 1), ("GLOBAL_POSITION_INT", 0)])
def test_a_ground_station_on_a_link_of_its_own_is_followed(name: str, follows: int) -> None:
    flight = FollowFlight(east(0.0))
    goal_id = _follow_system(flight, 255, name, 50, flight.bridge.overhear)
    state = flight.state(goal_id)
    assert state is (FollowState.FOLLOWING if follows else FollowState.ACQUIRING)


BAD = {
    "no source": (replace(BEHIND, source=TargetSource()), "INVALID_TARGET", "0 of pose_topic"),
    "two sources": (
        replace(BEHIND, source=TargetSource("/a", "b")),
        "INVALID_TARGET",
        "2 of pose_topic",
    ),
    "its own system": (replace(BEHIND, source=TargetSource(system_id=1)), "INVALID_TARGET", "own"),
    "a topic of another type": (
        replace(BEHIND, topic_types=("std_msgs/msg/String",)),
        "INVALID_TARGET",
        "std_msgs/msg/String",
    ),
    "no name of a topic": (
        replace(BEHIND, source=TargetSource("bad name")),
        "INVALID_TARGET",
        "no name of a topic",
    ),
    "NaN": (replace(BEHIND, offset_m=(math.nan, 0.0, 9.0)), "INVALID_NUMBER", "offset.x is nan"),
    "an offset that is too short": (
        replace(BEHIND, offset_m=(4.2, 0.0, 0.0)),
        "INVALID_NUMBER",
        "0.5 m more than least_distance, 4 m",
    ),
    "no offset": (replace(BEHIND, offset_m=(0.0,) * 3), "INVALID_NUMBER", "leads 0.00 m"),
    "a far offset": (replace(BEHIND, offset_m=(9e3, 0.0, 0.0)), "INVALID_NUMBER", "at most 500 m"),
    "a negative distance": (replace(BEHIND, least_distance_m=-1.0), "INVALID_NUMBER", "negative"),
    "nearer than its radius": (
        replace(BEHIND, least_distance_m=0.1),
        "INVALID_NUMBER",
        "vehicle_radius_m",
    ),
    "a negative duration": (replace(BEHIND, max_duration_s=-1.0), "INVALID_NUMBER", "negative"),
    "an endless timeout": (replace(BEHIND, lost_timeout_s=1e9), "INVALID_NUMBER", "0 to 600 s"),
    "a negative speed": (replace(BEHIND, max_speed_m_s=-1.0), "NEGATIVE_SPEED", "max_speed"),
    "an unknown yaw": (replace(BEHIND, yaw=None), "INVALID_NUMBER", "yaw_mode"),
    "an unknown offset_frame": (
        replace(BEHIND, offset_frame=None),
        "INVALID_NUMBER",
        "offset_frame",
    ),
}


def test_bad_goals_are_rejected_with_a_code_and_a_sentence() -> None:
    flight = FollowFlight(east(0.0))
    for name, (request, code, words) in BAD.items():
        rejection = flight.check(request)
        assert rejection is not None, name
        assert rejection.code.value == code, name
        assert words in rejection.message, name


def test_what_does_not_fly_yet_and_a_plane_are_rejected() -> None:
    parked = SimulatedFlight(simulated=VehicleConfig(ready_after_s=1.0)).ready()
    rejection = parked.check(BEHIND)
    assert rejection is not None
    assert rejection.code is OutcomeCode.NOT_FLYING
    assert "following never takes off" in rejection.message
    plane = SimulatedFlight(simulated=VehicleConfig(ready_after_s=1.0, vehicle="plane")).ready()
    rejection = plane.check(BEHIND)
    assert rejection is not None
    assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
