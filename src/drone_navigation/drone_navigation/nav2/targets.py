"""Poses of Nav2's clients as targets in the vehicle's map, and the height that they mean. No ROS.

Clients of Nav2 know no height: RViz's 2D Goal Pose and the examples of Nav2 send z = 0. Taken at
its word, that would fly a copter into the ground. So z = 0 means: keep the height.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from mavlink_vehicle.positions import frames
from mavlink_vehicle.profiles.profile import VehicleKind
from navigation_bridge.goals.point_requests import yaw_enu_rad
from navigation_bridge.names import FRAME_BASE_LINK, FRAME_MAP
from navigation_core.geometry import Vector3

LEAST_HEIGHTS_M = {VehicleKind.COPTER: 3.0, VehicleKind.PLANE: 30.0}
"""Least heights above the ground where none is configured; the server's own is 20 m for planes"""

_UNSET_M = 1e-3
# A vehicle that holds is within this of its target's height. It keeps the target's, not its own:
# goals that are sent again and again would let it drift.
_HELD_M = 1.0
_NORM_TOLERANCE = 0.1
# Below half a turn, the direction of a turn to a yaw is known.
_TURN_MAX_RAD = 2.0 * math.pi / 3.0


class Refusal(NamedTuple):
    """Why something is not done.

    Attributes:
        code: a name of GoalCode.msg.
        text: a sentence for people.
    """

    code: str
    text: str

    def __str__(self) -> str:
        """Return "CODE: sentence"."""
        return f"{self.code}: {self.text}"


class TargetError(ValueError):
    """A pose cannot be flown to.

    Attributes:
        refusal: why.
    """

    def __init__(self, code: str, text: str) -> None:
        """Say why, as in `Refusal`."""
        self.refusal = Refusal(code, text)
        super().__init__(str(self.refusal))


@dataclass(frozen=True)
class Present:
    """The vehicle as a goal finds it.

    Attributes:
        position_enu_m: its position in the map.
        yaw_enu_rad: its yaw.
        ground_m: map z of the ground, that of home.
        target_m: map z of the last target, None before the first.
    """

    position_enu_m: Vector3
    yaw_enu_rad: float
    ground_m: float = 0.0
    target_m: float | None = None


@dataclass(frozen=True)
class Target:
    """Target of a goal: position in the map, and yaw; None faces the direction of travel."""

    position_enu_m: Vector3
    yaw_enu_rad: float | None


@dataclass(frozen=True)
class HeightRule:
    """Heights of targets.

    Attributes:
        least_m: least height above the ground of a vehicle that flies.
        drives: whether the vehicle stays on the ground.
    """

    least_m: float
    drives: bool = False

    @classmethod
    def of(cls, kind: VehicleKind, least_m: float) -> HeightRule:
        """Return the rule for a kind of vehicle; 0 m means its default."""
        drives = kind in (VehicleKind.ROVER, VehicleKind.BOAT)
        return cls(least_m or LEAST_HEIGHTS_M.get(kind, 3.0), drives)

    def height_m(self, wanted_m: float, present: Present) -> float:
        """Return the map z of a target.

        Args:
            wanted_m: map z that a client sent. 0 means the present height: that of the last
                target if the vehicle is there, else its own. Infinity and NaN are returned, for
                the server to reject.
            present: the vehicle.
        """
        if not math.isfinite(wanted_m):
            return wanted_m
        unset = abs(wanted_m) < _UNSET_M
        if self.drives:
            return present.ground_m if unset else wanted_m
        if unset:
            own_m, target_m = present.position_enu_m[2], present.target_m
            held = target_m is not None and abs(target_m - own_m) < _HELD_M
            wanted_m = target_m if held and target_m is not None else own_m
        return max(wanted_m, present.ground_m + self.least_m)


def map_target(
    frame_id: str,
    position: Vector3,
    orientation_xyzw: tuple[float, float, float, float],
    present: Present,
    rule: HeightRule,
) -> Target:
    """Return where a pose of a client leads.

    Args:
        frame_id: `map` or empty, or `base_link`: forward, left, up of the present pose, level.
        position: in the frame, m.
        orientation_xyzw: in the frame; all zeros for none.
        present: the vehicle.
        rule: for its height.

    Raises:
        TargetError: another frame, or no rotation.
    """
    if frame_id not in (FRAME_MAP, FRAME_BASE_LINK, ""):
        raise TargetError(
            "UNKNOWN_FRAME",
            f"Frame '{frame_id}' is not known here; send poses in '{FRAME_MAP}' or "
            f"'{FRAME_BASE_LINK}'.",
        )
    norm = math.hypot(*orientation_xyzw)
    yaw = yaw_enu_rad(orientation_xyzw)
    if not norm <= _UNSET_M and (not abs(norm - 1.0) <= _NORM_TOLERANCE or yaw is None):
        raise TargetError(
            "INVALID_ORIENTATION",
            "The orientation is not a unit quaternion with a heading; send a "
            "rotation about z, or all zeros to face the direction of travel.",
        )
    if frame_id == FRAME_BASE_LINK:
        here = present.position_enu_m
        offset = frames.body_flu_to_enu(position, present.yaw_enu_rad)
        height_m = offset[2] if abs(offset[2]) < _UNSET_M else here[2] + offset[2]
        position = (here[0] + offset[0], here[1] + offset[1], height_m)
        if yaw is not None:
            yaw = frames.normalize_angle(yaw + present.yaw_enu_rad)
    height_m = rule.height_m(position[2], present)
    return Target((position[0], position[1], height_m), yaw)


def turns(yaw_rad: float, turn_rad: float) -> list[float]:
    """Return the yaws of a turn by an angle, one after the other, ENU.

    Args:
        yaw_rad: where it begins.
        turn_rad: counter-clockwise, of any size.
    """
    count = max(math.ceil(abs(turn_rad) / _TURN_MAX_RAD), 1)
    return [frames.normalize_angle(yaw_rad + turn_rad * (i + 1) / count) for i in range(count)]
