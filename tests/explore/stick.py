"""A client that steers a vehicle of an exploration by velocity commands."""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_bridge.goals.requests import VelocityRequest
from navigation_bridge.tasks.velocity_commands import VelocityCommands
from navigation_core.geometry import Vector3
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame
from tests.explore.exploration import Ship

__all__ = ["Stick"]

_PERIOD_S = 0.1
# Far from the ids of goals that are asked for.
_IDS_FROM = 2**64


@dataclass
class Stick:
    """Publishes one velocity at 10 Hz.

    Attributes:
        ship: the vehicle.
        frame: the axes of the velocity.
        linear_m_s: the velocity; its numbers may be anything.
        turn_rate_rad_s: turn rate.
        ends_s: time after which it is silent.
    """

    ship: Ship
    frame: VelocityFrame
    linear_m_s: Vector3
    turn_rate_rad_s: float
    ends_s: float
    _due_s: float = -math.inf

    def turn(self) -> None:
        """Publish, if that is due."""
        now_s, server = self.ship.now_s, self.ship.server
        if server is None or now_s < self._due_s or now_s < server.stalled_until_s:
            return
        if now_s > self.ends_s:
            return
        self._due_s = now_s + _PERIOD_S - 1e-9
        command = VelocityCommand(now_s, self.frame, self.linear_m_s, self.turn_rate_rad_s)
        goal_id = f"{_IDS_FROM + round(1e3 * now_s):032x}"
        server.bridge.feature(VelocityCommands).follow(command, goal_id, now_s)
        self.ship.note_started(goal_id, VelocityRequest())
        server.collect()
