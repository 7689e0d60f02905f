"""Position from outside the autopilot (a camera, motion capture) for its estimator.

A pose with a velocity goes out as ODOMETRY, one without as VISION_POSITION_ESTIMATE to an
ArduPilot, whose velocity would otherwise become NaN. An ArduPilot takes ODOMETRY in
MAV_FRAME_LOCAL_FRD only (GCS_Common.cpp); to a PX4 that frame has an unknown heading, so it gets
MAV_FRAME_LOCAL_NED (mavlink_receiver.cpp). https://mavlink.io/en/messages/common.html#ODOMETRY

Without a GPS the autopilot cannot know where on earth its local frame lies. It is sent the origin
once, by SET_GPS_GLOBAL_ORIGIN, before it has a position and while it is disarmed; a PX4 also by the
command DO_SET_GLOBAL_ORIGIN, which is to replace that message and which it knows from 1.18 on. Its
release is often not known yet by then, and one that does not know the command changes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.events import ExternalPosesResumed, ExternalPosesStopped
from mavlink_vehicle.positions.frames import Quaternion, Vector3, yaw_of_quaternion
from mavlink_vehicle.protocols.service import SendingRank, VehicleService
from mavlink_vehicle.state.telemetry import LocalPosition
from mavlink_vehicle.state.vehicle_state import VehicleState

__all__ = ["FRESH_S", "ExternalPose", "ExternalPositionError", "ExternalPositionSender", "Origin"]

Origin = tuple[float, float, float]
"""Latitude and longitude in degrees, altitude above mean sea level in metres."""

_OLDEST_S = 0.5
_FARTHEST_M = 10_000.0
_FASTEST_M_S = 100.0
_NORM_TOLERANCE = 0.02
# Faster than this between two samples is a jump of the source, and no motion.
_JUMP_M, _JUMP_M_S = 0.5, 30.0
_JUMP_RAD, _JUMP_RAD_S = math.radians(20.0), math.radians(720.0)
_SHORTEST_S = 0.018
"""At most 50 Hz; samples that come faster are left out. PX4 wants 30 Hz, ArduPilot 4 Hz."""
_ORIGIN_AGAIN_S = 2.0
FRESH_S = 1.0
"""After a longer silence the source counts as stopped."""
_NAN = math.nan


class ExternalPositionError(ValueError):
    """This pose is not sent; the text says why."""


@dataclass(frozen=True)
class ExternalPose:
    """One pose of the vehicle.

    Attributes:
        measured_s: when it was measured, in the time of the vehicle's clock.
        position_ned_m: from the origin of the autopilot's local frame.
        attitude: (w, x, y, z), FRD -> NED.
        velocity_frd_m_s: None where unknown.
        rates_frd_rad_s: None where unknown.
        pose_variance: north, east, down in m2, then about these axes in rad2; None where unknown.
        twist_variance: forward, right, down in (m/s)2, then about these axes; None where unknown.
    """

    measured_s: float
    position_ned_m: Vector3
    attitude: Quaternion
    velocity_frd_m_s: Vector3 | None = None
    rates_frd_rad_s: Vector3 | None = None
    pose_variance: tuple[float, ...] | None = None
    twist_variance: tuple[float, ...] | None = None


class ExternalPositionSender(VehicleService):
    """Checks poses and sends them.

    Attributes:
        resets: how often the source has jumped; the message's reset_counter is this modulo 256.
    """

    rank = SendingRank.DATA
    asked_directly = True

    def __init__(self, origin: Origin | None = None) -> None:
        """Prepare; `origin` is set where the autopilot has none."""
        super().__init__()
        self.resets = 0
        self._origin = origin
        self._origin_s = -math.inf
        self._last: ExternalPose | None = None
        self._sent_s: float | None = None
        self._has_stopped = False

    def offer(self, pose: ExternalPose, state: VehicleState, now: float) -> None:
        """Send a pose.

        Args:
            pose: newer than the last one.
            state: the vehicle's.
            now: time in seconds.

        Raises:
            ExternalPositionError: it is not sent, and why.
        """
        _check(pose, now)
        last = self._last
        if last is not None and pose.measured_s <= last.measured_s:
            if last.measured_s - pose.measured_s < _OLDEST_S:
                raise ExternalPositionError("External poses are out of order.")
            last = None  # its clock was set back, which the next pose would not be for long
        if last is not None and pose.measured_s - last.measured_s < _SHORTEST_S:
            return
        if self._last is not None and (last is None or _jumps(last, pose)):
            self.resets += 1
        self._last = pose
        self._note_sent(now)
        origin_is_due = now - self._origin_s >= _ORIGIN_AGAIN_S
        if self._origin is not None and origin_is_due and _needs_origin(state):
            self._origin_s = now
            self.outbox.extend(_origin_messages(self._origin, state))
        is_px4 = state.autopilot == mavlink.MAV_AUTOPILOT_PX4
        reset_counter = self.resets % 256
        if is_px4 or pose.velocity_frd_m_s is not None:
            frame = mavlink.MAV_FRAME_LOCAL_NED if is_px4 else mavlink.MAV_FRAME_LOCAL_FRD
            self.outbox.append(_odometry(pose, frame, reset_counter))
        else:
            self.outbox.append(_vision_position(pose, reset_counter))

    def difference_m(self, local: LocalPosition | None, now: float) -> float | None:
        """Return how far the autopilot's local position is from the last pose.

        None without a local position or a fresh pose.
        """
        last = self._last
        if local is None or last is None or now - last.measured_s > FRESH_S:
            return None
        return math.dist(local.position_ned_m, last.position_ned_m)

    def _note_sent(self, now: float) -> None:
        if self._has_stopped and self._sent_s is not None:
            self._has_stopped = False
            self.events.append(ExternalPosesResumed(now - self._sent_s))
        self._sent_s = now
        self.deadline_s = now + FRESH_S

    def silent_s(self, now: float) -> float | None:
        """Return how long no pose has been sent; None if none is in use."""
        return None if self._sent_s is None else now - self._sent_s

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Start over with the next pose: none can be sent."""
        self._sent_s, self._has_stopped, self.deadline_s = None, False, None
        self.events.clear()

    def _on_deadline(self, now: float) -> None:
        """Notice that no more poses come; they go out as they come."""
        self.deadline_s = None
        if self._sent_s is not None:
            self._has_stopped = True
            self.events.append(ExternalPosesStopped(now - self._sent_s))


def _check(pose: ExternalPose, now: float) -> None:
    """Reject what the estimator must not get.

    Raises:
        ExternalPositionError: says what it is.
    """
    variances = (*(pose.pose_variance or ()), *(pose.twist_variance or ()))
    numbers = (
        pose.measured_s,
        *pose.position_ned_m,
        *pose.attitude,
        *(pose.velocity_frd_m_s or ()),
        *(pose.rates_frd_rad_s or ()),
        *variances,
    )
    if not all(map(math.isfinite, numbers)):
        raise ExternalPositionError("An external pose has a number that is not finite.")
    age_s = now - pose.measured_s
    if not -_OLDEST_S <= age_s <= _OLDEST_S:
        raise ExternalPositionError(
            f"An external pose is {age_s:.1f} s old; it must be at most {_OLDEST_S:g} s. "
            "Compare the clocks of both computers."
        )
    if max(map(abs, pose.position_ned_m)) > _FARTHEST_M:
        raise ExternalPositionError(
            f"An external pose is more than {_FARTHEST_M:g} m from the origin."
        )
    if abs(math.hypot(*pose.attitude) - 1.0) > _NORM_TOLERANCE:
        raise ExternalPositionError("The orientation of an external pose is not a unit quaternion.")
    if pose.velocity_frd_m_s is not None and math.hypot(*pose.velocity_frd_m_s) > _FASTEST_M_S:
        raise ExternalPositionError(f"An external velocity is above {_FASTEST_M_S:g} m/s.")
    if any(variance < 0.0 for variance in variances):
        raise ExternalPositionError("A variance of an external pose is negative.")


def _jumps(before: ExternalPose, after: ExternalPose) -> bool:
    """Return whether the source's frame has moved between two poses."""
    passed_s = after.measured_s - before.measured_s
    turn = abs(sum(a * b for a, b in zip(before.attitude, after.attitude, strict=True)))
    turned_rad = 2.0 * math.acos(min(turn, 1.0))
    return (
        math.dist(before.position_ned_m, after.position_ned_m) > _JUMP_M + _JUMP_M_S * passed_s
        or turned_rad > _JUMP_RAD + _JUMP_RAD_S * passed_s
    )


def _diagonal(variance: tuple[float, ...] | None) -> list[float]:
    """Return the upper triangle of a covariance, row by row; its first is NaN if unknown."""
    rows = [0.0] * 21
    if variance is None:
        rows[0] = _NAN
        return rows
    place = 0
    for index, value in enumerate(variance):
        rows[place] = value
        place += 6 - index
    return rows


def _odometry(pose: ExternalPose, frame: int, reset_counter: int) -> Message:
    x, y, z = pose.position_ned_m
    vx, vy, vz = pose.velocity_frd_m_s or (_NAN, _NAN, _NAN)
    roll, pitch, yaw = pose.rates_frd_rad_s or (_NAN, _NAN, _NAN)
    return make(
        "ODOMETRY",
        time_usec=round(pose.measured_s * 1e6),
        frame_id=frame,
        child_frame_id=mavlink.MAV_FRAME_BODY_FRD,
        x=x, y=y, z=z,
        q=list(pose.attitude),
        vx=vx, vy=vy, vz=vz,
        rollspeed=roll, pitchspeed=pitch, yawspeed=yaw,
        pose_covariance=_diagonal(pose.pose_variance),
        velocity_covariance=_diagonal(pose.twist_variance),
        reset_counter=reset_counter,
        estimator_type=mavlink.MAV_ESTIMATOR_TYPE_VISION,
    )  # fmt: skip


def _vision_position(pose: ExternalPose, reset_counter: int) -> Message:
    w, x, y, z = pose.attitude
    north, east, down = pose.position_ned_m
    return make(
        "VISION_POSITION_ESTIMATE",
        usec=round(pose.measured_s * 1e6),
        x=north,
        y=east,
        z=down,
        roll=math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        pitch=math.asin(min(max(2.0 * (w * y - z * x), -1.0), 1.0)),
        yaw=yaw_of_quaternion(pose.attitude),
        covariance=_diagonal(pose.pose_variance),
        reset_counter=reset_counter,
    )


def _needs_origin(state: VehicleState) -> bool:
    return state.origin is None and not state.position_valid and not state.armed


def _origin_messages(origin: Origin, state: VehicleState) -> Iterator[Message]:
    latitude_deg, longitude_deg, altitude_m = origin
    latitude, longitude = round(latitude_deg * 1e7), round(longitude_deg * 1e7)
    yield make(
        "SET_GPS_GLOBAL_ORIGIN",
        target_system=state.system_id,
        latitude=latitude,
        longitude=longitude,
        altitude=round(altitude_m * 1e3),
    )
    if state.autopilot == mavlink.MAV_AUTOPILOT_PX4:
        yield make(
            "COMMAND_INT",
            target_system=state.system_id,
            target_component=mavlink.MAV_COMP_ID_AUTOPILOT1,
            frame=mavlink.MAV_FRAME_GLOBAL,
            command=mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN,
            x=latitude,
            y=longitude,
            z=altitude_m,
        )
