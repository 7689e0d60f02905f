"""A mark that a vehicle of an exploration lands on, and the camera that sees it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_bridge.goals.requests import TargetSource
from navigation_bridge.tasks.followed_target import FollowedTarget
from navigation_core.geometry import Vector3, add, subtract
from navigation_core.tasks.inputs.tracked_target import TargetSample
from tests.explore.exploration import Ship

__all__ = ["MARK", "LandingMark"]

MARK = TargetSource(topic="/mark")
_PERIOD_S = 0.1
_HALF_VIEW_RAD = math.radians(35.0)


@dataclass
class LandingMark:
    """A mark; a camera looks down for it at 10 Hz while a server lands on it.

    The measured place is the estimated one of the vehicle and the true way to the mark, as a camera
    on the vehicle has it.

    Attributes:
        ship: the vehicle.
        place_enu_m: where it lies at first, from the home of the vehicle.
        covered_below_m: height of the vehicle below which it is not seen.
        fault: what happens to it: "", "vanishes", "jumps", or its samples lie: "nan", "old", "far".
        fault_s: from when on, in simulated time.
        jump_m: how far it jumps, east.
        is_told: whether it reports where it is, as a boat does, and needs no camera.
        jumps_below_m: height of the vehicle below which it jumps, once it is time; 0 for any.
    """

    ship: Ship
    place_enu_m: Vector3
    covered_below_m: float
    fault: str
    fault_s: float
    jump_m: float
    is_told: bool = False
    jumps_below_m: float = 0.0
    _is_late: bool = False
    _due_s: float = -math.inf

    def turn(self) -> None:
        """Look for it, if that is due."""
        now_s, server = self.ship.now_s, self.ship.server
        if server is None or now_s < self._due_s or now_s < server.stalled_until_s:
            return
        self._due_s = now_s + _PERIOD_S - 1e-9
        feature, pose = server.bridge.feature(FollowedTarget), server.bridge.pose
        if feature.source != MARK or pose is None:
            return
        fault = self.fault if now_s >= self.fault_s else ""
        true_enu_m = self.ship.truth().position_enu_m
        self._is_late = self._is_late or true_enu_m[2] <= self.jumps_below_m
        if fault == "jumps" and self.jumps_below_m and not self._is_late:
            fault = ""
        place = add(self.place_enu_m, (self.jump_m if fault == "jumps" else 0.0, 0.0, 0.0))
        away = subtract(place, true_enu_m)
        if fault == "vanishes" or not self._sees(away):
            return
        position, measured_s = add(pose.position_enu_m, away), now_s
        if fault == "old":
            measured_s -= 3600.0
        elif fault == "nan":
            position = (math.nan, position[1], position[2])
        elif fault == "far":
            position = (position[0] + 1e5, position[1], position[2])
        else:
            self.ship.log("mark", place)
        feature.offer(MARK, TargetSample(measured_s, position), now_s)

    def _sees(self, away_m: Vector3) -> bool:
        if self.is_told:
            return True
        height_m = -away_m[2]
        angle_rad = math.atan2(math.hypot(away_m[0], away_m[1]), max(height_m, 1e-3))
        return angle_rad < _HALF_VIEW_RAD and height_m >= self.covered_below_m
