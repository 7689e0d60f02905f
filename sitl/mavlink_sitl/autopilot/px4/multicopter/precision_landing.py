"""AUTO.PRECLAND of PX4's multicopters: lands on the target of LANDING_TARGET.

Rules read in the firmware (navigator, landing target) and recorded of v1.17 with a position in
MAV_FRAME_LOCAL_NED. Left out: targets that are seen as angles.
"""

from __future__ import annotations

import math
from enum import Enum, auto
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.px4.multicopter.copter_modes import (
    CopterMode,
    descending,
    descent_speed_m_s,
)
from mavlink_sitl.exchange import Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.personality import ModeSpec
    from mavlink_sitl.autopilot.px4.multicopter.copter import Px4Copter

SETTLES_S = 2.0
"""Over the target before it sinks, and at the start before it searches"""
SEEN_IN_SEARCH_S = 1.0
"""It stops its climb for this long when it sees the target"""
SILENT_NEAR_GROUND_S = 0.5
ABOVE_SEEN_M = 1.0
"""The height that it climbs further after it has seen the target in a climb"""


class Stage(Enum):
    """The stage of a precision landing."""

    START = auto()
    APPROACH = auto()
    DESCENT = auto()
    FINAL = auto()
    SEARCH = auto()
    FALLBACK = auto()


_SINKS = (Stage.DESCENT, Stage.FINAL, Stage.FALLBACK)


class PrecisionLanding(CopterMode):
    """Flies over the target, sinks on it, searches for one that is lost; then lands as it is.

    Attributes:
        target: NED metres; None before it was seen.
    """

    target: Vector | None = None
    _heard_s = -math.inf
    _stage = Stage.START

    def __init__(self, vehicle: Px4Copter, spec: ModeSpec) -> None:
        super().__init__(vehicle, spec)
        self._searches = 0

    def hear(self, place: Vector) -> None:
        """Take a measurement, NED metres."""
        self.target, self._heard_s = place, self.vehicle.now_s

    @property
    def landing(self) -> bool:
        """See `Mode`."""
        return self._stage in _SINKS

    def enter(self) -> None:
        """Stay, and look for the target."""
        self._searches = 0
        self._start()
        self.update()

    def update(self) -> None:
        """Run one step of the stage."""
        if self.vehicle.landed:
            return
        if self._stage is Stage.START:
            self._look()
        elif self._stage is Stage.APPROACH:
            self._approach()
        elif self._stage is Stage.SEARCH:
            self._search()
        else:
            self._sink()

    def _go(self, stage: Stage) -> None:
        self._stage, self._since_s = stage, self.vehicle.now_s
        self._over_since_s: float | None = None
        self._speed = -1.0

    def _start(self) -> None:
        """Stay where it is, unless it has searched often enough."""
        if self._searches > self.vehicle.parameters["PLD_MAX_SRCH"]:
            self._give_up()
            return
        self._searches += 1
        self._go(Stage.START)
        self.guide(self.hold_at(self.here()))

    def _give_up(self) -> None:
        """Land where it is."""
        self._go(Stage.FALLBACK)
        self._at = self.here()[:2]
        self._sink()

    def _seen(self, timeout_s: float) -> Vector | None:
        """The target, if it was seen lately."""
        return self.target if self.vehicle.now_s - self._heard_s <= timeout_s else None

    def _is_seen(self) -> bool:
        return self._seen(self.vehicle.parameters["PLD_BTOUT"]) is not None

    def _is_over(self, target: Vector) -> bool:
        north, east, _ = self.here()
        radius = self.vehicle.parameters["PLD_HACC_RAD"]
        return abs(target[0] - north) < radius and abs(target[1] - east) < radius

    def _look(self) -> None:
        if self._is_seen():
            self._begin_approach()
        elif self.vehicle.now_s - self._since_s > SETTLES_S:
            if self.vehicle.parameters["PLD_SRCH_TOUT"] > 0.0:
                self._go(Stage.SEARCH)
                north, east, _ = self.here()
                self._search_down_m = -self.vehicle.parameters["PLD_SRCH_ALT"]
                self.guide(self.hold_at((north, east, self._search_down_m)))
            else:
                self._give_up()

    def _begin_approach(self) -> None:
        self._go(Stage.APPROACH)
        self._approach_down_m = self.here()[2]
        self._approach()

    def _approach(self) -> None:
        if self.target is None:
            return
        over = self._is_over(self.target)
        if over and not self._is_seen():
            self._start()
            return
        now_s = self.vehicle.now_s
        if over and self._over_since_s is None:
            self._over_since_s = now_s
        settled = self._over_since_s is not None and now_s - self._over_since_s > SETTLES_S
        if over and settled:
            self._go(Stage.DESCENT)
            self._sink()
            return
        self.drive(self.hold_at((*self.target[:2], self._approach_down_m)))

    def _search(self) -> None:
        now_s, p = self.vehicle.now_s, self.vehicle.parameters
        if self._over_since_s is None and self._is_seen():
            self._over_since_s = now_s
            north, east, down = self.here()
            down = max(down - ABOVE_SEEN_M, self._search_down_m)
            self.guide(self.hold_at((north, east, down)))
        if self._over_since_s is not None and now_s - self._over_since_s > SEEN_IN_SEARCH_S:
            if self._is_seen():
                self._begin_approach()
        elif now_s - self._since_s > p["PLD_SRCH_TOUT"]:
            self._give_up()

    def _sink(self) -> None:
        if self._stage is Stage.DESCENT and self.target is not None:
            p = self.vehicle.parameters
            low = self.target[2] - self.here()[2] < p["PLD_FAPPR_ALT"]
            silent_s = SILENT_NEAR_GROUND_S if low else p["PLD_BTOUT"]
            self._at = self.target[:2]
            if self._seen(silent_s) is None:
                if not low:
                    self._start()
                    return
                self._go(Stage.FINAL)
        first = self._speed < 0.0
        self._speed = descent_speed_m_s(self.vehicle)
        self.drive(descending(self, self._at, self._speed, first))
