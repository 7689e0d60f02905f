"""REP 105: `odom` is continuous, `map` may jump; and stamps are of the measurement."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest

from mavlink_vehicle.positions import frames
from mavlink_vehicle.state.telemetry import Attitude, GlobalPosition
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_bridge.vehicle.odom_frame import OdomFrame, OdomPose, at_time_of_position
from navigation_bridge.vehicle.sample_times import SampleTimes

Vector = tuple[float, float, float]
STILL: Vector = (0.0, 0.0, 0.0)
STEP_MS = 100


def pose(
    place: Vector, yaw_rad: float = 0.0, roll_rad: float = 0.0, pitch_rad: float = 0.0
) -> MapPose:
    w, x, y, z = frames.quaternion_from_euler(roll_rad, pitch_rad, yaw_rad)
    return MapPose(place, yaw_rad, (x, y, z, w))


def state(
    time_ms: int,
    velocity_enu_m_s: Vector = STILL,
    rates_flu_rad_s: Vector = STILL,
    attitude_ms: int | None = None,
    boot_count: int = 0,
) -> VehicleState:
    p, q, r = rates_flu_rad_s
    velocity = frames.enu_to_ned(velocity_enu_m_s)
    attitude_ms = time_ms if attitude_ms is None else attitude_ms
    return VehicleState(
        boot_count=boot_count,
        global_position=GlobalPosition(0.0, time_ms, 47.0, 8.0, 500.0, 10.0, velocity, 0.0),
        attitude=Attitude(0.0, attitude_ms, 0.0, 0.0, 0.0, (p, -q, -r)),
    )


def composed(frame: OdomFrame) -> OdomPose:
    """Return base_link in map, as a listener of the tree computes it."""
    (place, turn), (inner, inner_turn) = frame.in_map, frame.base_link
    w, x, y, z = turn
    turned = frames.quaternion_multiply(
        frames.quaternion_multiply(turn, (0.0, *inner)), (w, -x, -y, -z)
    )[1:]
    at = tuple(a + b for a, b in zip(place, turned, strict=True))
    return at, frames.quaternion_multiply(turn, inner_turn)  # type: ignore[return-value]


def angle_rad(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    return 2.0 * math.acos(min(abs(sum(p * q for p, q in zip(a, b, strict=True))), 1.0))


def is_pose(found: OdomPose, wanted: MapPose) -> bool:
    x, y, z, w = wanted.orientation_xyzw
    near = math.dist(found[0], wanted.position_enu_m) < 1e-6
    return near and angle_rad(found[1], (w, x, y, z)) < 1e-6


def test_without_jumps_odom_is_map() -> None:
    frame = OdomFrame()
    for i in range(50):
        moved = pose((0.3 * i, 0.1 * i, 5.0), 0.05 * i)
        frame.follow(moved, state(STEP_MS * i, (3.0, 1.0, 0.0), (0.0, 0.0, 0.5)))
        assert frame.in_map == (STILL, (1.0, 0.0, 0.0, 0.0))
        assert is_pose(frame.base_link, moved)


@pytest.mark.parametrize("jump_m", [(20.0, 0.0, 0.0), (0.0, -3.0, 0.0), (0.0, 0.0, 2.0)])
def test_a_jump_of_the_position_moves_odom(jump_m: Vector) -> None:
    frame = OdomFrame()
    before = None
    for i in range(40):
        jumped = jump_m if i >= 20 else STILL
        moved = pose(tuple(a + b for a, b in zip((0.5 * i, 0.0, 10.0), jumped, strict=True)))  # type: ignore[arg-type]
        frame.follow(moved, state(STEP_MS * i, (5.0, 0.0, 0.0)))
        assert is_pose(composed(frame), moved)
        if before is not None:
            assert math.dist(frame.base_link[0], before) == pytest.approx(0.5)
        before = frame.base_link[0]
    assert frame.in_map[0] == pytest.approx(jump_m)


def test_a_reset_of_the_yaw_turns_odom_and_nothing_in_it() -> None:
    frame = OdomFrame()
    for i in range(20):
        reset_rad = math.radians(40.0) if i >= 10 else 0.0
        turned = pose((30.0, 0.0, 10.0), 1.0 + reset_rad, 0.1, -0.2)
        frame.follow(turned, state(STEP_MS * i))
        assert is_pose(composed(frame), turned)
        assert frame.base_link[0] == pytest.approx((30.0, 0.0, 10.0))
        assert angle_rad(frame.base_link[1], frames.quaternion_from_euler(0.1, -0.2, 1.0)) < 1e-6
    assert frame.in_map[1] == pytest.approx(frames.quaternion_from_yaw(math.radians(40.0)))


def test_a_fast_turn_is_no_reset() -> None:
    frame = OdomFrame()
    for i in range(30):
        frame.follow(pose(STILL, 0.2 * i), state(STEP_MS * i, STILL, (0.0, 0.0, 2.0)))
    assert frame.in_map == (STILL, (1.0, 0.0, 0.0, 0.0))


def test_after_a_silence_motion_is_motion_and_a_jump_a_jump() -> None:
    frame = OdomFrame()
    frame.follow(pose(STILL), state(0, (5.0, 0.0, 0.0)))
    frame.follow(pose((26.0, 0.0, 0.0)), state(5000, (5.0, 0.0, 0.0)))
    assert frame.in_map[0] == STILL
    frame.follow(pose((71.0, 0.0, 0.0)), state(10_000, (5.0, 0.0, 0.0)))
    assert frame.base_link[0] == pytest.approx((51.0, 0.0, 0.0))
    assert frame.in_map[0] == pytest.approx((20.0, 0.0, 0.0))


def test_an_attitude_that_has_stopped_is_no_reset() -> None:
    frame = OdomFrame()
    for i in range(20):
        stopped = 5 <= i < 13  # for 0.8 s, in which the vehicle turns on
        yaw_rad = 0.05 * (5 if stopped else i)
        attitude_ms = STEP_MS * (5 if stopped else i)
        frame.follow(pose(STILL, yaw_rad), state(STEP_MS * i, STILL, (0, 0, 0.5), attitude_ms))
    assert frame.in_map == (STILL, (1.0, 0.0, 0.0, 0.0))


def test_a_climb_rate_of_the_wrong_sign_is_no_jump() -> None:
    frame = OdomFrame()
    for i in range(40):
        frame.follow(pose((0.0, 0.0, 0.5 * i)), state(STEP_MS * i, (0.0, 0.0, -5.0)))
    assert frame.in_map == (STILL, (1.0, 0.0, 0.0, 0.0))


def test_a_restart_starts_over() -> None:
    frame = OdomFrame()
    frame.follow(pose(STILL), state(1000))
    frame.follow(pose((50.0, 0.0, 0.0)), state(1100))
    assert frame.in_map[0] == pytest.approx((50.0, 0.0, 0.0))
    frame.follow(pose((50.0, 0.0, 0.0)), state(5000, boot_count=1))
    assert frame.in_map[0] == STILL


@pytest.mark.parametrize("seed", range(20))
def test_random_flights_with_resets_stay_continuous_and_true(seed: int) -> None:
    random_ = random.Random(seed)
    frame, place, yaw, time_ms = OdomFrame(), [0.0, 0.0, 10.0], 0.0, 0
    velocity, rate = [0.0, 0.0, 0.0], 0.0
    before: OdomPose | None = None
    for _ in range(200):
        passed_ms = random_.choice([50, 100, 100, 250])
        passed_s = passed_ms / 1000
        time_ms += passed_ms
        velocity = [v + random_.uniform(-2, 2) * passed_s for v in velocity]
        rate += random_.uniform(-2, 2) * passed_s
        place = [p + v * passed_s for p, v in zip(place, velocity, strict=True)]
        yaw += rate * passed_s
        if random_.random() < 0.05:
            place = [p + random_.uniform(-30, 30) for p in place]
        if random_.random() < 0.05:
            yaw += random_.uniform(-3, 3)
        now = pose((place[0], place[1], place[2]), yaw, 0.2, -0.1)
        frame.follow(now, state(time_ms, (velocity[0], velocity[1], velocity[2]), (0.0, 0.0, rate)))
        assert is_pose(composed(frame), now)
        assert frame.in_map[1][1:3] == pytest.approx((0.0, 0.0))  # odom stays level
        if before is not None:
            speed_m_s = math.hypot(*velocity) + 2.0 * passed_s
            assert math.dist(before[0], frame.base_link[0]) < speed_m_s * passed_s + 1.0
        before = frame.base_link


@pytest.mark.parametrize("rates", [(0.5, 0.0, 0.0), (0.0, -0.7, 0.0), (0.1, 0.2, 1.5)])
@pytest.mark.parametrize("attitude", [(0.0, 0.0, 0.0), (0.6, -0.5, 2.0), (0.0, 1.3, -3.0)])
def test_the_attitude_is_that_of_the_time_of_the_position(rates: Vector, attitude: Vector) -> None:
    roll, pitch, yaw = attitude
    before = pose(STILL, yaw, roll, pitch)
    told = state(1000, STILL, rates, attitude_ms=900)
    moved = at_time_of_position(before, told)
    back = at_time_of_position(moved, state(900, STILL, rates, attitude_ms=1000))
    x, y, z, w = back.orientation_xyzw
    assert is_pose((STILL, (w, x, y, z)), before)
    turned = angle_rad(moved.orientation_xyzw, before.orientation_xyzw)
    assert turned == pytest.approx(0.1 * math.hypot(*rates))


def test_an_attitude_is_turned_about_the_axes_of_the_body() -> None:
    # Nose up by 45 degrees: a yaw rate of the body is partly a roll in the world.
    before = pose(STILL, 0.0, 0.0, -math.pi / 4)
    moved = at_time_of_position(before, state(1000, STILL, (0.0, 0.0, 1.0), attitude_ms=900))
    turn = frames.quaternion_multiply(
        frames.quaternion_from_euler(0.0, -math.pi / 4, 0.0), frames.quaternion_from_yaw(0.1)
    )
    x, y, z, w = moved.orientation_xyzw
    assert (w, x, y, z) == pytest.approx(turn)
    stale = state(1000, STILL, (0.0, 0.0, 1.0), attitude_ms=300)
    assert at_time_of_position(before, stale) is before
    assert at_time_of_position(before, replace(stale, attitude=None)) is before


def test_a_sample_that_comes_late_is_stamped_as_it_was_measured() -> None:
    times, random_ = SampleTimes(), random.Random(1)
    assert times.age_s(1000, 50.0) == 0.0
    for i in range(200):
        delay_s = 0.004 + random_.choice([0.0, 0.01, 0.3])
        arrived_s = 1000.0 + 0.1 * i + delay_s
        times.observe(0, 100 * i, arrived_s)
        if i > 20:
            assert times.age_s(100 * i, arrived_s) == pytest.approx(delay_s - 0.004, abs=1e-9)


def test_a_clock_that_drifts_is_followed_and_a_restart_starts_over() -> None:
    times = SampleTimes()
    for i in range(6000):  # the vehicle's clock is slow by 7 ms in a second
        arrived_s = 0.1 * i * 1.007 + 0.004
        times.observe(0, 100 * i, arrived_s)
        assert times.age_s(100 * i, arrived_s) < 0.045
    times.observe(1, 500, 700.0)
    assert times.age_s(500, 700.0) == 0.0
