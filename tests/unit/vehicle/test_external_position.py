"""External poses: what is checked, what is sent, when the source counts as reset."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import ExternalPosesResumed, ExternalPosesStopped
from mavlink_vehicle.positions.frames import (
    quaternion_enu_flu_to_ned_frd,
    quaternion_from_euler,
    quaternion_ned_frd_to_enu_flu,
)
from mavlink_vehicle.protocols.streams.external_position import (
    ExternalPose,
    ExternalPositionError,
    ExternalPositionSender,
    Origin,
)
from mavlink_vehicle.state.vehicle_state import VehicleState

POSE = ExternalPose(
    100.0,
    (3.0, -4.0, -5.0),
    quaternion_from_euler(0.1, -0.2, 2.5),
    (1.0, 0.5, -0.25),
    (0.01, 0.02, 0.03),
    (0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
    (0.01, 0.02, 0.03, 0.04, 0.05, 0.06),
)
_DIAGONAL = (0, 6, 11, 15, 18, 20)


def offered(
    *poses: ExternalPose, is_px4: bool = False, origin: Origin | None = None, needs: bool = True
) -> list[Message]:
    sender = ExternalPositionSender(origin)
    firmware = mavlink.MAV_AUTOPILOT_PX4 if is_px4 else mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    state = VehicleState(system_id=7, autopilot=firmware, armed=not needs)
    for pose in poses:
        sender.offer(pose, state, pose.measured_s + 0.01)
    return sender.messages_to_send()


@pytest.mark.parametrize(
    ("is_px4", "frame"),
    [(False, mavlink.MAV_FRAME_LOCAL_FRD), (True, mavlink.MAV_FRAME_LOCAL_NED)],
)
def test_a_pose_with_a_velocity_is_odometry(is_px4: bool, frame: int) -> None:
    (message,) = offered(POSE, is_px4=is_px4)
    assert message.get_type() == "ODOMETRY"
    assert (message.frame_id, message.child_frame_id) == (frame, mavlink.MAV_FRAME_BODY_FRD)
    assert message.time_usec == 100_000_000
    assert (message.x, message.y, message.z) == POSE.position_ned_m
    assert tuple(message.q) == POSE.attitude
    assert (message.vx, message.vy, message.vz) == POSE.velocity_frd_m_s
    assert (message.rollspeed, message.pitchspeed, message.yawspeed) == POSE.rates_frd_rad_s
    assert tuple(message.pose_covariance[place] for place in _DIAGONAL) == POSE.pose_variance
    assert sum(message.pose_covariance) == pytest.approx(sum(POSE.pose_variance or ()))
    assert tuple(message.velocity_covariance[place] for place in _DIAGONAL) == POSE.twist_variance


def test_what_is_unknown_is_nan_and_an_ardupilot_gets_no_unknown_velocity() -> None:
    bare = ExternalPose(100.0, POSE.position_ned_m, POSE.attitude)
    (message,) = offered(bare, is_px4=True)
    assert message.get_type() == "ODOMETRY"
    assert all(map(math.isnan, (message.vx, message.vy, message.vz, message.pose_covariance[0])))
    (message,) = offered(bare)
    assert message.get_type() == "VISION_POSITION_ESTIMATE"
    assert (message.x, message.y, message.z) == POSE.position_ned_m
    assert (message.roll, message.pitch, message.yaw) == pytest.approx((0.1, -0.2, 2.5))
    assert math.isnan(message.covariance[0])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"position_ned_m": (math.nan, 0.0, 0.0)}, "not finite"),
        ({"position_ned_m": (0.0, math.inf, 0.0)}, "not finite"),
        ({"position_ned_m": (20_000.0, 0.0, 0.0)}, "more than 10000 m"),
        ({"attitude": (0.0, 0.0, 0.0, 0.0)}, "not a unit quaternion"),
        ({"attitude": (1.0, math.nan, 0.0, 0.0)}, "not finite"),
        ({"velocity_frd_m_s": (200.0, 0.0, 0.0)}, "above 100 m/s"),
        ({"pose_variance": (0.1, -0.1, 0.1, 0.1, 0.1, 0.1)}, "negative"),
        ({"measured_s": 98.0}, "2.0 s old"),
        ({"measured_s": 103.0}, "-3.0 s old"),
        ({"measured_s": math.nan}, "not finite"),
    ],
)
def test_a_pose_that_cannot_be_is_rejected(change: dict[str, object], said: str) -> None:
    sender = ExternalPositionSender()
    with pytest.raises(ExternalPositionError, match=said):
        sender.offer(
            replace(POSE, **change),  # type: ignore[arg-type]
            VehicleState(),
            100.0,
        )
    assert sender.messages_to_send() == []


def test_poses_out_of_order_are_rejected_and_too_many_left_out() -> None:
    with pytest.raises(ExternalPositionError, match="out of order"):
        offered(POSE, replace(POSE, measured_s=99.9))
    poses = [replace(POSE, measured_s=100.0 + 0.005 * count) for count in range(40)]
    assert len(offered(*poses)) == 10


@pytest.mark.parametrize(
    ("position_ned_m", "yaw_rad", "resets"),
    [
        ((4.0, -4.0, -5.0), 2.5, 0),  # 10 m/s
        ((5.4, -4.0, -5.0), 2.5, 0),
        ((6.4, -4.0, -5.0), 2.5, 0),
        ((7.0, -4.0, -5.0), 2.5, 1),
        ((3.0, -4.0, -5.0), 3.5, 0),
        ((3.0, -4.0, -5.0), 2.5 + math.pi, 1),
    ],
)
def test_a_jump_of_the_source_is_a_reset(
    position_ned_m: tuple[float, float, float], yaw_rad: float, resets: int
) -> None:
    after = replace(
        POSE,
        measured_s=100.1,
        position_ned_m=position_ned_m,
        attitude=quaternion_from_euler(0.1, -0.2, yaw_rad),
    )
    first, second = offered(POSE, after)
    assert (first.reset_counter, second.reset_counter) == (0, resets)


def test_a_clock_that_was_set_back_is_a_reset() -> None:
    _, second = offered(POSE, replace(POSE, measured_s=50.0))
    assert second.reset_counter == 1


def test_the_reset_counter_wraps() -> None:
    poses = [
        replace(POSE, measured_s=100.0 + 0.1 * count, position_ned_m=(50.0 * (count % 2), 0.0, 0.0))
        for count in range(258)
    ]
    counters = [message.reset_counter for message in offered(*poses)]
    assert counters[254:] == [254, 255, 0, 1]


def test_the_origin_is_set_every_two_seconds_while_there_is_none() -> None:
    origin = (47.3977, 8.5456, 488.0)
    poses = [replace(POSE, measured_s=100.0 + 0.1 * count) for count in range(45)]
    sent = [m for m in offered(*poses, origin=origin) if m.get_type() != "ODOMETRY"]
    assert [m.get_type() for m in sent] == ["SET_GPS_GLOBAL_ORIGIN"] * 3
    assert (sent[0].target_system, sent[0].latitude, sent[0].longitude, sent[0].altitude) == (
        7, 473977000, 85456000, 488000,
    )  # fmt: skip
    assert len(offered(*poses, origin=origin, needs=False)) == 45


def test_the_turn_between_the_axes_is_its_own_inverse() -> None:
    attitude = quaternion_from_euler(0.3, -0.4, 1.2)
    back = quaternion_enu_flu_to_ned_frd(quaternion_ned_frd_to_enu_flu(attitude))
    assert abs(sum(a * b for a, b in zip(attitude, back, strict=True))) == pytest.approx(1.0)


def test_a_source_that_stops_is_reported_once_and_so_is_its_return() -> None:
    sender = ExternalPositionSender()

    def offer(now: float) -> None:
        pose = replace(POSE, measured_s=now - 0.01)
        sender.offer(pose, VehicleState(autopilot=mavlink.MAV_AUTOPILOT_PX4), now)

    assert sender.deadline_s is None
    assert sender.silent_s(99.0) is None
    offer(100.0)
    offer(100.5)
    sender.handle_timer(101.4)
    assert sender.next_event() is None
    assert sender.deadline_s == 101.5
    sender.handle_timer(101.5)
    assert sender.next_event() == ExternalPosesStopped(1.0)
    assert sender.deadline_s is None
    sender.handle_timer(110.0)
    assert sender.next_event() is None
    assert sender.silent_s(110.0) == 9.5
    offer(112.5)
    assert sender.next_event() == ExternalPosesResumed(12.0)
    sender.link_lost(VehicleState(), 0.0)
    sender.handle_timer(200.0)
    assert sender.next_event() is None
    assert sender.silent_s(200.0) is None
