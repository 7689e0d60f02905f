"""Poses of sensors and of the vehicle that carries them. No ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mavlink_vehicle.positions.frames import ned_to_enu
from mavlink_vehicle.state.reducer import VehicleState
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.geometry import Vector3

Array: TypeAlias = NDArray[np.float64]

# Limit for extrapolating position and attitude; with older ones the sensor's present pose is
# unknown.
_STALE_S = 0.5
# North, east, down to east, north, up, and forward, left, up to forward, right, down.
_NED_TO_ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
_FLU_TO_FRD = np.diag([1.0, -1.0, -1.0])


class SensorPoseError(ValueError):
    """A pose is malformed; the message gives the format."""


@dataclass(frozen=True)
class SensorPose:
    """Pose of a sensor on the vehicle.

    Attributes:
        position_flu_m: forward, left, up from base_link.
        roll_rad: about forward.
        pitch_rad: about left: positive looks down.
        yaw_rad: about up, counter-clockwise. As in ROS: first roll, then pitch, then yaw.
    """

    position_flu_m: Vector3 = (0.0, 0.0, 0.0)
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0

    @classmethod
    def parse(cls, text: str) -> SensorPose:
        """Read "x y z roll pitch yaw", metres and degrees; empty is base_link itself.

        Raises:
            SensorPoseError: not six finite numbers.
        """
        try:
            numbers = [float(word) for word in text.split()]
        except ValueError:
            numbers = []
        if not text.strip():
            return cls()
        if len(numbers) != 6 or not all(map(math.isfinite, numbers)):
            raise SensorPoseError(
                f"is '{text}'; give six numbers, 'x y z roll pitch yaw' in metres and degrees, or "
                "nothing."
            )
        x, y, z, roll, pitch, yaw = numbers
        return cls((x, y, z), math.radians(roll), math.radians(pitch), math.radians(yaw))

    def to_body(self) -> Array:
        """Return the matrix that turns the sensor's axes into forward, left, up."""
        return turn(self.roll_rad, self.pitch_rad, self.yaw_rad)


def turn(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Array:
    """Return the matrix of a roll, then a pitch, then a yaw about fixed axes."""
    cr, sr = math.cos(roll_rad), math.sin(roll_rad)
    cp, sp = math.cos(pitch_rad), math.sin(pitch_rad)
    cy, sy = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


@dataclass(frozen=True)
class Carrier:
    """Pose of the vehicle that carries the sensors, at one moment.

    Attributes:
        position_enu_m: position in the map frame. The height of a rover or boat is 0: the height
            that it reports is the ground's, and drifts with its GPS.
        height_m: the reported height in the map frame.
        roll_rad: about forward; 0 of a rover or boat, whose sensors look along the ground.
        pitch_rad: about right, positive with the nose up; 0 likewise.
        yaw_ned_rad: from north, clockwise.
    """

    position_enu_m: Vector3
    height_m: float
    roll_rad: float
    pitch_rad: float
    yaw_ned_rad: float

    @property
    def from_body(self) -> Array:
        """The matrix that rotates forward, right, down of the body into the map frame."""
        return np.asarray(_NED_TO_ENU @ turn(self.roll_rad, self.pitch_rad, self.yaw_ned_rad))

    @property
    def from_level(self) -> Array:
        """The same for a body that is not tilted."""
        return np.asarray(_NED_TO_ENU @ turn(0.0, 0.0, self.yaw_ned_rad))

    @property
    def from_north(self) -> Array:
        """The matrix that rotates north, east, down into the map frame."""
        return _NED_TO_ENU

    @property
    def from_flu(self) -> Array:
        """The matrix that rotates forward, left, up of the body into the map frame."""
        return np.asarray(self.from_body @ _FLU_TO_FRD)


def carrier_at(state: VehicleState, map_frame: MapFrame, level: bool, now: float) -> Carrier | None:
    """Return the pose of the vehicle, or None if it is not known well enough.

    The last position is extrapolated by its velocity, the last attitude by its rates.

    Args:
        state: the vehicle's state.
        map_frame: its map frame.
        level: for rovers and boats: the sensors look along the ground.
        now: time of the reading.
    """
    pose, position, attitude = map_frame.pose(state), state.global_position, state.attitude
    if pose is None or position is None or attitude is None:
        return None
    moved_s, turned_s = now - position.time_s, now - attitude.time_s
    if not (abs(moved_s) <= _STALE_S and abs(turned_s) <= _STALE_S):
        return None
    velocity = ned_to_enu(position.velocity_ned_m_s)
    x, y, z = (p + v * moved_s for p, v in zip(pose.position_enu_m, velocity, strict=True))
    roll, pitch, yaw = attitude.roll_rad, attitude.pitch_rad, attitude.yaw_ned_rad
    p, q, r = attitude.rates_frd_rad_s
    about_down = q * math.sin(roll) + r * math.cos(roll)
    # Upright enough for Euler angles; no vehicle senses obstacles with its nose straight up.
    steep = max(math.cos(pitch), 0.1)
    yaw += turned_s * about_down / steep
    if level:
        return Carrier((x, y, 0.0), z, 0.0, 0.0, yaw)
    roll += turned_s * (p + about_down * math.tan(pitch))
    pitch += turned_s * (q * math.cos(roll) - r * math.sin(roll))
    return Carrier((x, y, z), z, roll, pitch, yaw)
