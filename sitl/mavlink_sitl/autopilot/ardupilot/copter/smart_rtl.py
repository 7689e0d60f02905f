"""SMART_RTL of a copter: home along the way that it came, without its loops, and down."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.copter.rtl import LandsAtTheEnd, stopping_point
from mavlink_sitl.exchange import Guidance, Vector, YawMode

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter
ABOVE_M = 2.0
"""It stops so high above the first point of its way, and lands from there"""
LEAST_RADIUS_M = 0.2
STILL_M_S = 0.3


class SmartStage(Enum):
    """The stage of the return."""

    FOLLOW = 1
    ABOVE = 2
    LAND = 3


class SmartReturn(LandsAtTheEnd):
    """Flies from corner to corner of its way, and lands where it was armed."""

    vehicle: Copter
    _stage = SmartStage.FOLLOW

    @property
    def landing(self) -> bool:
        """In the last stage only."""
        return self._stage is SmartStage.LAND

    def enter(self) -> None:
        """Brake, and find the corners of the way."""
        crumbs = self.vehicle.trail.crumbs
        self._points = crumbs.shortest() if crumbs is not None else []
        self._stage = SmartStage.FOLLOW
        self._speed_m_s = 0.0
        self._target = stopping_point(self.vehicle)
        self.guide(self._towards(self._target, restarts=True))

    def _towards(self, point: Vector, restarts: bool = False) -> Guidance:
        guidance = self.hold_guidance().at(point)
        return replace(
            guidance,
            straight=1.0,
            yaw_mode=YawMode.LOOK_AHEAD,
            restart_xy=restarts,
            restart_z=restarts,
        )

    def update(self) -> None:
        """Run one step of the stage, or advance to the next."""
        copter = self.vehicle
        if copter.landed or not copter.armed:
            return
        if self._stage is SmartStage.LAND:
            self.descend(self.hold_guidance().at(self._target))
        elif self._there():
            self._advance()

    def _there(self) -> bool:
        """Near the corner; at the last one it also has to stand."""
        m = self.vehicle.motion
        radius = max(self.vehicle.parameters["WPNAV_RADIUS"] / 100.0, LEAST_RADIUS_M)
        near = math.dist(m[:3], self._target) <= radius
        if self._stage is not SmartStage.ABOVE:
            return near
        return near and math.hypot(*m[3:6]) < STILL_M_S

    def _advance(self) -> None:
        if self._stage is SmartStage.ABOVE:
            self._stage = SmartStage.LAND
            return
        north, east, down = self._points.pop() if self._points else self._target
        if not self._points:
            self._stage = SmartStage.ABOVE
            down -= ABOVE_M
        self._target = (north, east, down)
        self.guide(self._towards(self._target))
