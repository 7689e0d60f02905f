"""The frame `odom` of REP 105, in which the vehicle never jumps. No ROS.

The estimator of an autopilot can be reset, and its origin can move: the pose in `map` then
changes from one message to the next. The part of a change that velocity and turn rates do not
explain moves `odom` in `map`; everything else moves the vehicle in `odom`. So a pose in `odom` is
continuous, and drifts by what was taken for a jump.
"""

from __future__ import annotations

import math

from mavlink_vehicle.positions import frames
from mavlink_vehicle.positions.frames import Quaternion
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_core.geometry import Vector3

__all__ = ["OdomFrame", "OdomPose", "at_time_of_position"]

# How far a change may be from the mean of the velocities before and after it. A velocity is off
# by up to 0.7 m/s (PX4, see the tasks' `standstill`), and changes by 5 m/s2.
_STEP_M, _VELOCITY_ERROR_M_S, _ACCELERATION_M_S2 = 0.5, 0.7, 5.0
# The same of a turn; a copter can begin to yaw with 5 rad/s2.
_STEP_RAD, _RATE_ERROR_RAD_S, _ACCELERATION_RAD_S2 = math.radians(8.0), 0.1, 5.0
# After a silence the motion meanwhile is bounded, so that a jump still shows; a heading can be any.
_LONGEST_S = 1.0
_ALIGNED_S = 0.5

OdomPose = tuple[Vector3, Quaternion]
"""Translation in m and rotation (w, x, y, z) of a frame in its parent."""


def at_time_of_position(pose: MapPose, state: VehicleState) -> MapPose:
    """Return a pose with its attitude at the time of its position.

    GLOBAL_POSITION_INT and ATTITUDE come apart, by a tenth of a second and more: the attitude is
    turned on, or back, by its rates. One that is too old is left as it is.

    Args:
        pose: of `MapFrame.pose`.
        state: that it is of.
    """
    position, attitude = state.global_position, state.attitude
    if position is None or attitude is None:
        return pose
    later_s = 1e-3 * (position.time_boot_ms - attitude.time_boot_ms)
    if later_s == 0.0 or abs(later_s) > _ALIGNED_S:
        return pose
    x, y, z, w = pose.orientation_xyzw
    turned = _turned((w, x, y, z), _rates_flu(state), later_s)
    w, x, y, z = (-part for part in turned) if turned[0] < 0.0 else turned
    yaw = frames.yaw_of_quaternion((w, x, y, z))
    return MapPose(pose.position_enu_m, yaw, (x, y, z, w))


class OdomFrame:
    """Follows the poses of one vehicle.

    Attributes:
        in_map: position and orientation of `odom` in `map`; the latter is a yaw.
        base_link: position and orientation of the vehicle in `odom`.
    """

    def __init__(self) -> None:
        """Begin with `odom` as `map`."""
        self.in_map: OdomPose = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
        self.base_link: OdomPose = self.in_map
        self._boot_count: int | None = None
        # Time since boot, value and its derivative, of the last position and the last attitude.
        self._place: tuple[int, Vector3, Vector3] = (0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self._turn: tuple[int, Quaternion, Vector3] | None = None

    def follow(self, pose: MapPose, state: VehicleState) -> None:
        """Take the next pose; a restart of the autopilot starts over.

        Args:
            pose: attitude and position of one time.
            state: that it is of; without a global position nothing is taken.
        """
        position, attitude = state.global_position, state.attitude
        if position is None:
            return
        x, y, z, w = pose.orientation_xyzw
        here: OdomPose = (pose.position_enu_m, (w, x, y, z))
        now_ms = position.time_boot_ms
        place = (now_ms, here[0], frames.ned_to_enu(position.velocity_ned_m_s))
        turn = None
        if attitude is not None and abs(now_ms - attitude.time_boot_ms) <= 1e3 * _ALIGNED_S:
            turn = (now_ms, here[1], _rates_flu(state))
        if self._boot_count != state.boot_count or now_ms < self._place[0]:
            self._boot_count, self._turn = state.boot_count, None
            self.in_map = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
        else:
            expected = self._expected_place(place)
            step_rad = 0.0 if turn is None or self._turn is None else _yaw_step(self._turn, turn)
            if expected is not None or step_rad:
                self._move_odom(here, expected or here[0], step_rad)
        self._place, self._turn = place, turn or self._turn
        self.base_link = _within(here, self.in_map)

    def _expected_place(self, now: tuple[int, Vector3, Vector3]) -> Vector3 | None:
        """Return where the velocities lead to, if the vehicle is elsewhere.

        Height is judged by the amount of the climb rate: an ArduCopter of 2018 reports it with the
        other sign (recorded).
        """
        before_ms, before, velocity_before = self._place
        passed_s = 1e-3 * (now[0] - before_ms)
        velocity = _mean(velocity_before, now[2])
        expected = _plus(before, velocity, passed_s)
        bounded_s = min(passed_s, _LONGEST_S)
        slack_m = _STEP_M + _VELOCITY_ERROR_M_S * bounded_s
        slack_m += 0.25 * _ACCELERATION_M_S2 * bounded_s**2
        is_beside = math.dist(now[1][:2], expected[:2]) > slack_m
        is_above = abs(now[1][2] - before[2]) - abs(velocity[2]) * passed_s > slack_m
        if not is_beside and not is_above:
            return None
        east_m, north_m, _ = expected if is_beside else now[1]
        return east_m, north_m, (expected if is_above else now[1])[2]

    def _move_odom(self, here: OdomPose, expected: Vector3, step_rad: float) -> None:
        """Move `odom` so that the vehicle is in it where it was expected to be."""
        place_in_odom, _ = _within((expected, here[1]), self.in_map)
        turn = frames.quaternion_multiply(frames.quaternion_from_yaw(step_rad), self.in_map[1])
        self.in_map = (_plus(here[0], frames.quaternion_turn(turn, place_in_odom), -1.0), turn)


def _yaw_step(
    before: tuple[int, Quaternion, Vector3], now: tuple[int, Quaternion, Vector3]
) -> float:
    """Return by how much of a change of yaw there were no rates; 0 if they explain it."""
    passed_s = 1e-3 * (now[0] - before[0])
    turned = _turned(before[1], _mean(before[2], now[2]), passed_s)
    step = frames.quaternion_multiply(now[1], frames.quaternion_inverse(turned))
    step_rad = frames.normalize_angle(2.0 * math.atan2(step[3], step[0]))
    slack_rad = _STEP_RAD + _RATE_ERROR_RAD_S * passed_s
    slack_rad += 0.25 * _ACCELERATION_RAD_S2 * passed_s**2
    return step_rad if abs(step_rad) > slack_rad else 0.0


def _rates_flu(state: VehicleState) -> Vector3:
    if state.attitude is None:
        return (0.0, 0.0, 0.0)
    p, q, r = state.attitude.rates_frd_rad_s
    return (p, -q, -r)


def _within(pose: OdomPose, frame: OdomPose) -> OdomPose:
    """Return a pose in a frame that has the same parent."""
    back = frames.quaternion_inverse(frame[1])
    place = frames.quaternion_turn(back, _plus(pose[0], frame[0], -1.0))
    w, x, y, z = frames.quaternion_multiply(back, pose[1])
    return place, ((-w, -x, -y, -z) if w < 0.0 else (w, x, y, z))


def _turned(attitude: Quaternion, rates_rad_s: Vector3, for_s: float) -> Quaternion:
    """Return an attitude after it has turned about the body's axes."""
    rate_rad_s = math.hypot(*rates_rad_s)
    if rate_rad_s == 0.0:
        return attitude
    half = 0.5 * rate_rad_s * for_s
    x, y, z = (math.sin(half) / rate_rad_s * rate for rate in rates_rad_s)
    return frames.quaternion_multiply(attitude, (math.cos(half), x, y, z))


def _mean(a: Vector3, b: Vector3) -> Vector3:
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])


def _plus(a: Vector3, b: Vector3, factor: float) -> Vector3:
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]
