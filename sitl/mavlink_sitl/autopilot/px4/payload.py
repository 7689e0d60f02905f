"""The gimbal of a PX4 and its camera.

Its module for MAVLink's gimbal protocol v2 moves servos (MNT_MODE_OUT 0), or passes on what it
is asked for to a gimbal with MAVLink (2). Recorded of PX4 1.17 with that module and MNT_MODE_IN 4:
who is in control, what is accepted, and where the gimbal points then. The module starts with the
vehicle, if at all.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.devices.payload import NEUTRAL, RELEASE, SELF, YAW_LOCK, Payload
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.exchange import Result, Vector
from mavlink_sitl.geodesy import GeoPoint

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

Angles = tuple[float, float, float]
Rates = tuple[float, float]
RETRACT, ROLL_LOCK, PITCH_LOCK = 1, 4, 8
LOCKS = ROLL_LOCK | PITCH_LOCK | YAW_LOCK
_AUTO, _GIMBAL_V2 = 0.0, 4.0
SERVOS, MAVLINK_GIMBAL = 1, 154
"""Gimbal devices: the autopilot itself, or a component of its own"""
_DEVICES = {0.0: SERVOS, 2.0: MAVLINK_GIMBAL}
"""By MNT_MODE_OUT"""
_RANGES = {"ROLL": "MNT_RANGE_ROLL", "PITCH": "MNT_RANGE_PITCH", "YAW": "MNT_RANGE_YAW"}
"""Of a servo gimbal, half to each side"""
LIMITS_DEG = {"ROLL": (-30.0, 30.0), "PITCH": (-90.0, 45.0), "YAW": (-180.0, 180.0)}
"""Of the gimbal with MAVLink"""
_ALL_AXES, _YAW_ALONE = 1.0, 2.0
"""Values of MNT_DO_STAB"""
RATES_S = 2.0
"""A gimbal that is to turn at a rate stops after this"""
MOUNT_NEUTRAL, MOUNT_TARGETING = (0.0, 1.0), 2.0
"""Modes of DO_MOUNT_CONTROL"""


def upright(pitch_deg: float, yaw_deg: float) -> Angles:
    """Return roll, pitch and yaw with a pitch within 90 degrees, as a quaternion gives them back.

    Not a number where one of them is none.
    """
    if not (math.isfinite(pitch_deg) and math.isfinite(yaw_deg)):
        return (math.nan, math.nan, math.nan)
    roll_deg, pitch_deg = 0.0, math.remainder(pitch_deg, 360.0)
    if abs(pitch_deg) > 90.0:
        roll_deg, pitch_deg = 180.0, math.copysign(180.0, pitch_deg) - pitch_deg
        yaw_deg += 180.0
    return roll_deg, pitch_deg, math.remainder(yaw_deg, 360.0)


class Px4Payload(Payload):
    """Gimbal and camera of one PX4, from one power-up to the next.

    Attributes:
        device: SERVOS or MAVLINK_GIMBAL; 0 without a gimbal.
        own: system and component of the autopilot itself.
        roll_deg: of the gimbal.
        flags: ROLL_LOCK, PITCH_LOCK and YAW_LOCK of what it was asked for last.
    """

    _vehicle: Px4Vehicle

    def __init__(self, vehicle: Px4Vehicle, has_camera: bool = False) -> None:
        super().__init__(vehicle)
        self._has_camera = has_camera
        self._number = 0.0
        self._interval_s, self._left = 0.0, 0
        self._photo_at_s = math.inf
        values = vehicle.parameters
        takes = values["MNT_MODE_IN"] in (_AUTO, _GIMBAL_V2)
        self.device = _DEVICES.get(values["MNT_MODE_OUT"], 0) if takes else 0
        self.own = (1, 1)
        self.roll_deg = 0.0
        self.flags = ROLL_LOCK | PITCH_LOCK
        self._wanted: Angles | None = None
        self._rates_deg_s = (0.0, 0.0)
        self._set_at_s = self._moved_at_s = vehicle.now_s

    @property
    def has_gimbal(self) -> bool:
        """Whether the module runs."""
        return self.device != 0

    @property
    def has_camera(self) -> bool:
        """Whether a MAVLink camera is beside the autopilot."""
        return self._has_camera

    def start_capture(self, interval_s: float, count: int, number: float) -> Result:
        """IMAGE_START_CAPTURE.

        Args:
            interval_s: between photos.
            count: how many; 0 until they are stopped.
            number: of a single photo; one that came before is a repetition.
        """
        if count == 1 and number > 0.0 and number == self._number:
            return Result.ACCEPTED
        if count != 1 and interval_s == 0.0:
            return Result.DENIED
        self._number = number
        self._interval_s, self._left = interval_s, count - 1
        self._photo_at_s = math.inf if count == 1 else self._vehicle.now_s + interval_s
        return self.take_photo()

    def stop_capture(self) -> Result:
        """IMAGE_STOP_CAPTURE."""
        self._photo_at_s = math.inf
        return Result.ACCEPTED

    def _take_due_photo(self) -> None:
        if self._vehicle.now_s < self._photo_at_s:
            return
        self._left -= 1
        ends = self._left == 0
        self._photo_at_s = math.inf if ends else self._photo_at_s + self._interval_s
        self.take_photo()

    def configure_for(self, primary: tuple[float, float], source: tuple[int, int]) -> Result:
        """DO_GIMBAL_MANAGER_CONFIGURE: system and component each for itself.

        Args:
            primary: what is asked for.
            source: system and component that asks.
        """
        system, component = (
            _controller(*each) for each in zip(primary, self.control, source, self.own, strict=True)
        )
        self.control = (system, component)
        return Result.ACCEPTED

    def point_from(
        self,
        angles_deg: Angles,
        rates_deg_s: tuple[float, float],
        flags: int,
        source: tuple[int, int],
    ) -> Result:
        """Point it, for the one in control.

        Args:
            angles_deg: roll, pitch, yaw; not a number to leave it to the rates.
            rates_deg_s: of pitch and yaw; not a number for none.
            flags: GIMBAL_MANAGER_FLAGS.
            source: system and component that asks.
        """
        if source != self.control:
            return Result.DENIED
        if flags & NEUTRAL:
            self.rest()
        elif not flags & RETRACT:
            self._aim(angles_deg, rates_deg_s, flags)
        return Result.ACCEPTED

    def rest(self) -> None:
        """Return to straight ahead."""
        self.target, self._wanted, self._rates_deg_s = None, (0.0, 0.0, 0.0), (0.0, 0.0)

    def mount(self, mode: float, angles_deg: Angles) -> Result:
        """DO_MOUNT_CONTROL: accepted of anybody.

        Args:
            mode: MAV_MOUNT_MODE; others than these change nothing here.
            angles_deg: roll, pitch, yaw.
        """
        if mode in MOUNT_NEUTRAL:
            self.rest()
        elif mode == MOUNT_TARGETING:
            self._aim(angles_deg, (math.nan, math.nan), ROLL_LOCK | PITCH_LOCK)
        return Result.ACCEPTED

    def look_at(self, target: Vector | None) -> Result:
        """DO_SET_ROI_LOCATION of anybody; DO_SET_ROI_NONE returns to straight ahead."""
        self.rest()
        self.target = target
        if target is not None:
            self.flags |= YAW_LOCK
        return Result.ACCEPTED

    def rest_and_release(self) -> None:
        """The vehicle lands, returns or leaves a mission: nobody is in control any more."""
        self.rest()
        self.control = (0, 0)

    def _aim(self, angles_deg: Angles, rates_deg_s: Rates, flags: int) -> None:
        self.target = None
        self.flags = flags & LOCKS
        self._wanted = angles_deg if all(map(math.isfinite, angles_deg)) else None
        self._rates_deg_s = rates_deg_s
        self._set_at_s = self._vehicle.now_s

    def update(self) -> None:
        """Take the photo that is due, and move the servos."""
        self._take_due_photo()
        if self.device:
            self._turn()

    def _turn(self) -> None:
        now_s = self._vehicle.now_s
        passed_s, self._moved_at_s = now_s - self._moved_at_s, now_s
        wanted = self._wanted if self.target is None else self._towards(self.target)
        if wanted is not None:
            wanted = self._stabilised(wanted)
        else:
            turns = now_s - self._set_at_s <= RATES_S
            rates = [rate if turns and math.isfinite(rate) else 0.0 for rate in self._rates_deg_s]
            pitch_deg, yaw_deg = (
                self.pitch_deg + rates[0] * passed_s,
                self.yaw_deg + rates[1] * passed_s,
            )
            wanted = (self.roll_deg, pitch_deg, yaw_deg)
        self.roll_deg, self.pitch_deg, self.yaw_deg = (
            self._within(angle_deg, axis, range_)
            for angle_deg, (axis, range_) in zip(wanted, _RANGES.items(), strict=True)
        )

    def _towards(self, target: Vector) -> Angles:
        north, east, down = (a - b for a, b in zip(target, self._vehicle.motion[:3], strict=True))
        pitch_rad = math.atan2(-down, math.hypot(north, east))
        return 0.0, math.degrees(pitch_rad), math.degrees(math.atan2(east, north))

    def _stabilised(self, angles_deg: Angles) -> Angles:
        """From the nose; servos are levelled and turned as MNT_DO_STAB says."""
        mode, motion = self._vehicle.parameters["MNT_DO_STAB"], self._vehicle.motion
        level = self.device == SERVOS and mode == _ALL_AXES
        turns = self.device == MAVLINK_GIMBAL or mode in (_ALL_AXES, _YAW_ALONE)
        roll_deg, pitch_deg, yaw_deg = angles_deg
        if level and self.flags & ROLL_LOCK:
            roll_deg -= math.degrees(motion.roll_rad)
        if level and self.flags & PITCH_LOCK:
            pitch_deg -= math.degrees(motion.pitch_rad)
        if turns and self.flags & YAW_LOCK:
            yaw_deg -= math.degrees(motion.yaw_rad)
            if self.device == MAVLINK_GIMBAL:
                yaw_deg = math.remainder(yaw_deg, 360.0)
        return roll_deg, pitch_deg, yaw_deg

    def _within(self, angle_deg: float, axis: str, range_: str) -> float:
        if self.device == MAVLINK_GIMBAL:
            low_deg, high_deg = LIMITS_DEG[axis]
            return min(max(angle_deg, low_deg), high_deg)
        half_deg = self._vehicle.parameters[range_] / 2.0
        return min(max(angle_deg, -half_deg), half_deg)

    def do(self, item: PlanItem, place: GeoPoint | None) -> None:
        """Do an item of a mission, in the autopilot's own name."""
        first, second, third, fourth = item.params
        if item.command == Cmd.IMAGE_START_CAPTURE and self._has_camera:
            # Observed: of a single photo PX4 makes DO_DIGICAM_CONTROL, which no such camera knows.
            if third != 1.0:
                self.start_capture(second, int(third), fourth)
        elif item.command == Cmd.IMAGE_STOP_CAPTURE:
            self.stop_capture()
        if not self.device:
            return
        if item.command == Cmd.GIMBAL_CONFIGURE:
            self.configure_for((first, second), self.own)
        elif item.command == Cmd.GIMBAL_PITCHYAW:
            self.point_from(upright(first, second), (third, fourth), item.x, self.own)
        elif item.command == Cmd.MOUNT_CONTROL:
            self.control = self.own
            self.mount(item.z, (second, first, third))
        elif item.command in (Cmd.SET_ROI_LOCATION, Cmd.SET_ROI, Cmd.SET_ROI_NONE):
            there = None if place is None else self._vehicle.navigator.frame.to_local(place)
            self.look_at(None if item.command == Cmd.SET_ROI_NONE else there)


def _controller(wanted: float, now: int, source: int, own: int) -> int:
    """Return the system or component in control, after DO_GIMBAL_MANAGER_CONFIGURE."""
    if not math.isfinite(wanted):
        return now
    number = round(wanted)
    if number == SELF:
        return own
    if number == RELEASE:
        return 0 if now == source else now
    return number if 0 <= number <= 255 else now
