"""The camera, the gimbal and the gripper of a vehicle, as its parameters say that it has them.

The answers are those of an ArduCopter 4.7 with a servo gimbal, a servo camera and a servo gripper;
its gimbal turns as fast as it is asked to.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.plans.plans import Cmd, PlanItem
from mavlink_sitl.exchange import PhotoTaken, Result, Severity, Vector
from mavlink_sitl.geodesy import GeoPoint

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander

PITCH_DEG, YAW_DEG = (-90.0, 20.0), (-180.0, 180.0)
NEUTRAL, YAW_LOCK = 2, 16
LEAVE, SELF, RELEASE = -1, -2, -3
"""Ids of DO_GIMBAL_MANAGER_CONFIGURE"""


class Payload:
    """Camera, gimbal and gripper of one vehicle, from one power-up to the next.

    Attributes:
        photos: how many photos were taken.
        photo_places: where, NED metres.
        pitch_deg: of the gimbal, above the horizon.
        yaw_deg: of the gimbal, clockwise, from the nose or from north.
        yaw_locked: whether it is from north.
        target: where it looks at, NED metres, or None.
        control: system and component in control of the gimbal; zeros for nobody.
        gripped: whether the gripper is closed; None before it was told.
    """

    def __init__(self, vehicle: Commander) -> None:
        self._vehicle = vehicle
        self._every_m = 0.0
        self._last_photo: tuple[float, float, float] = (math.inf, math.inf, math.inf)
        self.photos = 0
        self.photo_places: list[tuple[float, float, float]] = []
        self.pitch_deg = self.yaw_deg = 0.0
        self.yaw_locked = False
        self.target: Vector | None = None
        self.control = (0, 0)
        self.gripped: bool | None = None

    def _has(self, parameter: str) -> bool:
        parameters = self._vehicle.parameters
        return parameter in parameters and parameters[parameter] > 0.0

    @property
    def has_camera(self) -> bool:
        """Whether there is a camera."""
        return self._has("CAM1_TYPE")

    @property
    def has_gimbal(self) -> bool:
        """Whether there is a gimbal."""
        return self._has("MNT1_TYPE")

    # The camera.

    def take_photo(self) -> Result:
        """IMAGE_START_CAPTURE of one photo."""
        if not self.has_camera:
            return Result.FAILED
        self.photos += 1
        self._last_photo = self._vehicle.motion[:3]
        self.photo_places.append(self._last_photo)
        self._vehicle.events.append(PhotoTaken(self.photos))
        return Result.ACCEPTED

    def trigger_every(self, distance_m: float, *, at_once: bool) -> Result:
        """DO_SET_CAM_TRIGG_DIST; accepted without a camera, too."""
        self._every_m = distance_m if self.has_camera else 0.0
        self._last_photo = self._vehicle.motion[:3]
        if at_once and distance_m > 0.0:
            self.take_photo()
        return Result.ACCEPTED

    def update(self) -> None:
        """Take the photo that is due by the distance."""
        if self._every_m > 0.0:
            flown_m = math.dist(self._vehicle.motion[:2], self._last_photo[:2])
            if flown_m >= self._every_m:
                self.take_photo()

    # The gimbal.

    def configure(self, primary: tuple[float, float]) -> Result:
        """DO_GIMBAL_MANAGER_CONFIGURE."""
        if not self.has_gimbal:
            return Result.FAILED
        system, component = (int(value) for value in primary)
        if system == RELEASE:
            self.control = (0, 0)
        elif system not in (LEAVE, SELF):
            self.control = (system, component)
        return Result.ACCEPTED

    def point(self, pitch_deg: float, yaw_deg: float, flags: int) -> Result:
        """DO_GIMBAL_MANAGER_PITCHYAW; rates do not count."""
        if not self.has_gimbal:
            return Result.FAILED
        if flags & NEUTRAL:
            pitch_deg, yaw_deg, flags = 0.0, 0.0, 0
        if not (math.isfinite(pitch_deg) and math.isfinite(yaw_deg)):
            return Result.FAILED
        if not PITCH_DEG[0] <= pitch_deg <= PITCH_DEG[1] or not abs(yaw_deg) <= YAW_DEG[1]:
            return Result.FAILED
        self.target = None
        self.pitch_deg, self.yaw_deg = pitch_deg, yaw_deg
        self.yaw_locked = bool(flags & YAW_LOCK)
        return Result.ACCEPTED

    def look_at(self, target: Vector | None) -> Result:
        """DO_SET_ROI_LOCATION and DO_SET_ROI_NONE; accepted without a gimbal, too."""
        self.target = target
        return Result.ACCEPTED

    def angles_rad(self) -> tuple[float, float, bool]:
        """Pitch above the horizon, yaw clockwise, and whether that is from north."""
        if self.target is None:
            return math.radians(self.pitch_deg), math.radians(self.yaw_deg), self.yaw_locked
        here = self._vehicle.motion[:3]
        north, east, down = (a - b for a, b in zip(self.target, here, strict=True))
        return math.atan2(-down, math.hypot(north, east)), math.atan2(east, north), True

    # The gripper.

    def grip(self, *, grabs: bool) -> Result:
        """DO_GRIPPER."""
        if not self._has("GRIP_ENABLE"):
            return Result.FAILED
        self.gripped = grabs
        self._vehicle.say(Severity.INFO, f"Gripper load {'grabbing' if grabs else 'releasing'}")
        return Result.ACCEPTED

    # Missions.

    def do(self, item: PlanItem, place: GeoPoint | None) -> None:
        """Do an item of a mission; others and missing devices are passed over."""
        command, (first, second, third, _) = item.command, item.params
        single = command == Cmd.IMAGE_START_CAPTURE and third == 1.0
        if single or (command == Cmd.DIGICAM_CONTROL and item.x == 1):
            self.take_photo()
        elif command == Cmd.TRIGGER_DISTANCE:
            self.trigger_every(first, at_once=third == 1.0)
        elif command == Cmd.GIMBAL_PITCHYAW:
            self.point(first, second, item.x)
        elif command == Cmd.MOUNT_CONTROL:
            self.point(first, third, 0)
        elif command in (Cmd.SET_ROI_LOCATION, Cmd.SET_ROI_NONE):
            there = None if place is None else self._vehicle.navigator.frame.to_local(place)
            self.look_at(there if command == Cmd.SET_ROI_LOCATION else None)
        elif command == Cmd.GRIPPER:
            self.grip(grabs=second == 1.0)
