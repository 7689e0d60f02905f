"""Requests of clients to the vehicle's gimbal and camera, beside goals. No ROS.

A request has a number below 0; those above are acts of a goal, which go before: a request that is
under way ends then, and none begins while an act is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from mavlink_vehicle.events import (
    EquipmentAnswered,
    GimbalTurned,
    PhotoReported,
    VehicleEvent,
)
from mavlink_vehicle.positions import frames
from mavlink_vehicle.profiles.equipment import EquipmentCommand, EquipmentRules
from navigation_bridge.goals.point_requests import check_frame, position_in_map
from navigation_bridge.requests.feature import Feature, FeatureParts
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode, Rejection

__all__ = [
    "GimbalMode",
    "GimbalReport",
    "PayloadDone",
    "PayloadRequests",
    "PointGimbalRequest",
    "gimbal_report",
]

# The gimbal is there within this. A servo's own error may be a degree.
_REACHED_RAD = math.radians(2.0)
_FRESH_S = 1.0


class GimbalMode(Enum):
    """Where a gimbal is pointed, by the numbers of ``custom_interfaces/action/PointGimbal``."""

    ANGLE = 0
    POINT = 1
    VEHICLE = 2
    NONE = 3


@dataclass(frozen=True)
class PointGimbalRequest:
    """A goal of ``custom_interfaces/action/PointGimbal`` as it was sent.

    Attributes:
        mode: where to; None for an unknown number.
        pitch_rad: above the horizon.
        yaw_rad: counter-clockwise, from the nose, or from east.
        yaw_locked: whether the yaw is from east.
        frame_id: frame of the target.
        target: what it points at, in that frame.
        system_id: MAVLink system of another vehicle.
    """

    mode: GimbalMode | None
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    yaw_locked: bool = False
    frame_id: str = ""
    target: Vector3 = (0.0, 0.0, 0.0)
    system_id: int = 0


@dataclass(frozen=True)
class GimbalReport:
    """Where the gimbal points.

    Attributes:
        pitch_rad: above the horizon.
        yaw_rad: counter-clockwise, from the nose, or from east.
        yaw_locked: whether the yaw is from east.
        control: MAVLink system and component in control of it; zeros for nobody, or unknown.
    """

    pitch_rad: float
    yaw_rad: float
    yaw_locked: bool
    control: tuple[int, int]


@dataclass(frozen=True)
class PayloadDone:
    """The end of a request; each has one."""

    code: OutcomeCode
    message: str


TakeDone: TypeAlias = Callable[[PayloadDone], object]


def gimbal_report(turned: GimbalTurned) -> GimbalReport:
    """Return what a gimbal reports in the map's sense of rotation."""
    locked = turned.from_north
    yaw_rad = frames.yaw_ned_to_enu(turned.yaw_rad) if locked else -turned.yaw_rad
    yaw_rad = math.remainder(yaw_rad, math.tau)
    return GimbalReport(turned.pitch_rad, yaw_rad, locked, turned.control)


class PayloadRequests(Feature):
    """Serves one request at a time, and passes on what gimbal and camera report.

    Attributes:
        on_gimbal: takes each report of the gimbal.
        on_photo: takes each report of a photo.
    """

    def __init__(self, parts: FeatureParts) -> None:
        """Prepare."""
        super().__init__(parts)
        self._takers: dict[int, TakeDone] = {}
        self._number = 0
        self._done = ""
        self.on_gimbal: Callable[[GimbalReport], object] = lambda _: None
        self.on_photo: Callable[[PhotoReported], object] = lambda _: None

    @property
    def gimbal(self) -> GimbalReport | None:
        """The last report of the gimbal; None before the first."""
        turned = self.parts.vehicle.payload.gimbal
        return None if turned is None else gimbal_report(turned)

    def point(self, request: PointGimbalRequest, take: TakeDone, now: float) -> None:
        """Point the gimbal; `PayloadDone` answers when the vehicle has accepted or rejected it.

        Args:
            request: where to.
            take: takes the answer.
            now: time in seconds.
        """
        rejection = _problem(request) or self._lack("gimbal")
        commands = rejection or self._commands(request, now)
        self._begin(commands, "The gimbal was pointed.", take, now)

    def take_photo(self, take: TakeDone, now: float) -> None:
        """Take one photo; `PayloadDone` answers."""
        rejection = self._lack("camera")
        photo = self._rules.photo(self.parts.vehicle.equipment.count_photo())
        self._begin(rejection or (photo,), "The camera was triggered.", take, now)

    def is_there(self, request: PointGimbalRequest, now: float) -> bool | None:
        """Return whether the gimbal points where a request wants it; None while it is not known.

        Args:
            request: one that points by angles; others are there when they are accepted.
            now: time in seconds.
        """
        if request.mode is not GimbalMode.ANGLE:
            return True
        turned = self.parts.vehicle.payload.gimbal
        if turned is None or now - turned.time_s > _FRESH_S:
            return None
        report = gimbal_report(turned)
        yaw_rad = report.yaw_rad
        if report.yaw_locked != request.yaw_locked:
            heading_rad = self.parts.look(now).yaw_enu_rad
            if heading_rad is None:
                return None
            yaw_rad += heading_rad if request.yaw_locked else -heading_rad
        off_rad = abs(math.remainder(yaw_rad - request.yaw_rad, math.tau))
        return max(off_rad, abs(report.pitch_rad - request.pitch_rad)) <= _REACHED_RAD

    def take(self, event: VehicleEvent) -> bool:
        """Process an event of the vehicle; return whether it was about its payload."""
        if isinstance(event, GimbalTurned):
            self.on_gimbal(gimbal_report(event))
        elif isinstance(event, PhotoReported):
            self.on_photo(event)
        elif isinstance(event, EquipmentAnswered):
            taker = self._takers.pop(event.number, None)
            if taker is not None:
                taker(self._answer(event.failure))
        else:
            return False
        return True

    @property
    def _rules(self) -> EquipmentRules:
        profile = self.parts.vehicle.profile
        return EquipmentRules() if profile is None else profile.equipment

    def _lack(self, what: str) -> Rejection | None:
        """Return why nothing can be asked of the vehicle now, or of this device, or None."""
        if self.parts.unreached:
            return Rejection(OutcomeCode.NO_VEHICLE, self.parts.unreached)
        name, absent = self._rules.absent.get(what, ("", math.nan))
        if self.parts.vehicle.parameters.values.get(name) == absent:
            text = f"The vehicle has no {what} ({name} is {absent:g}); set it up."
            return Rejection(OutcomeCode.UNSUPPORTED_VEHICLE, text)
        if self.parts.vehicle.equipment.is_busy:
            text = "The vehicle's equipment is in use by another request or an act; try again."
            return Rejection(OutcomeCode.BUSY, text)
        return None

    def _begin(
        self,
        commands: tuple[EquipmentCommand, ...] | Rejection,
        done: str,
        take: TakeDone,
        now: float,
    ) -> None:
        if isinstance(commands, Rejection):
            take(PayloadDone(commands.code, commands.message))
            return
        self._number -= 1
        self._done = done
        self._takers[self._number] = take
        self.parts.vehicle.equipment.send(self._number, commands, now)

    def _answer(self, failure: str) -> PayloadDone:
        if failure:
            return PayloadDone(OutcomeCode.ACT_FAILED, f"The vehicle did not do it: {failure}.")
        return PayloadDone(OutcomeCode.SUCCESS, self._done)

    def _commands(
        self, request: PointGimbalRequest, now: float
    ) -> tuple[EquipmentCommand, ...] | Rejection:
        rules, address = self._rules, self.parts.vehicle.address
        first = (
            rules.report_gimbal(),
            rules.control_gimbal(address.source_system, address.source_component),
        )
        if request.mode is GimbalMode.NONE:
            return (*first, rules.end_position(), rules.point_neutral(), rules.release_gimbal())
        if request.mode is GimbalMode.VEHICLE:
            return (*first, rules.point_vehicle(request.system_id))
        if request.mode is GimbalMode.POINT:
            snapshot = self.parts.look(now)
            if not isinstance(snapshot, LocatedSnapshot) or snapshot.pose is None:
                return Rejection(OutcomeCode.NO_POSITION, "The vehicle's position is unknown.")
            place = position_in_map(request.frame_id, request.target, snapshot.pose, snapshot.enu)
            return (*first, rules.point_position(self.parts.map_frame.geodetic(place)))
        locked, yaw_rad = request.yaw_locked, -request.yaw_rad
        if locked:
            yaw_rad = frames.yaw_enu_to_ned(request.yaw_rad)
        yaw_deg = math.degrees(math.remainder(yaw_rad, math.tau))
        pitch_deg = math.degrees(request.pitch_rad)
        return (*first, rules.point_angle(pitch_deg, yaw_deg, locked=locked))


def _problem(request: PointGimbalRequest) -> Rejection | None:
    """Check a request without a vehicle."""
    if request.mode is None:
        text = "mode is unknown; send ANGLE, POINT, VEHICLE or NONE."
        return Rejection(OutcomeCode.INVALID_NUMBER, text)
    if request.mode is GimbalMode.ANGLE:
        if not (math.isfinite(request.pitch_rad) and math.isfinite(request.yaw_rad)):
            text = f"pitch is {request.pitch_rad} and yaw {request.yaw_rad}; both must be finite."
            return Rejection(OutcomeCode.INVALID_NUMBER, text)
        if abs(request.pitch_rad) > math.pi / 2.0 + 1e-3 or abs(request.yaw_rad) > math.tau:
            text = (
                f"pitch is {request.pitch_rad:g} and yaw {request.yaw_rad:g} rad; give a pitch of "
                "-1.5708 to 1.5708 and a yaw of -6.2832 to 6.2832 rad."
            )
            return Rejection(OutcomeCode.INVALID_NUMBER, text)
    if request.mode is GimbalMode.POINT:
        if not all(map(math.isfinite, request.target)):
            text = f"target is {request.target}; every number must be finite."
            return Rejection(OutcomeCode.INVALID_NUMBER, text)
        return check_frame(request.frame_id, request.target)
    if request.mode is GimbalMode.VEHICLE and request.system_id == 0:
        return Rejection(OutcomeCode.INVALID_NUMBER, "system_id is 0; send that of a vehicle.")
    return None
