"""Velocity commands of a program, as long as it gives them."""

from __future__ import annotations

import asyncio
import math
from functools import partial

from drone_navigation.programs.flown_goal import FlownGoal
from drone_navigation.programs.goal_messages import velocity
from drone_navigation.programs.server_link import ServerLink
from navigation_bridge.names import FRAME_BASE_LINK, FRAME_MAP

__all__ = ["Steering"]

_PERIOD_S = 0.1


class Steering(FlownGoal):
    """A goal that follows velocities.

    The commands come from the event loop: a program that hangs gives none, and the vehicle stops
    after the server's `cmd_vel_timeout_s`.
    """

    def __init__(
        self, link: ServerLink, speed_m_s: float, origin: str = "", leased: bool = False
    ) -> None:
        """Send the goal; the vehicle holds until the first velocity."""
        super().__init__(link, velocity(speed_m_s), origin, leased)

    async def move(
        self,
        forward_m_s: float = 0.0,
        left_m_s: float = 0.0,
        up_m_s: float = 0.0,
        turn_deg_s: float = 0.0,
        *,
        seconds: float,
        frame: str = FRAME_BASE_LINK,
    ) -> None:
        """Keep a velocity for some time, and stop with its end.

        Args:
            forward_m_s: in `map` east.
            left_m_s: in `map` north.
            up_m_s: upwards.
            turn_deg_s: counter-clockwise seen from above.
            seconds: how long.
            frame: `base_link` or `map`.

        Raises:
            NavigationError: the goal was rejected or has ended.
            ValueError: another frame.
        """
        if frame not in (FRAME_BASE_LINK, FRAME_MAP):
            raise ValueError(f"A velocity is in the frame 'base_link' or 'map', not in '{frame}'.")
        await self.accepted()
        loop = asyncio.get_running_loop()
        until_s = loop.time() + seconds
        moves = (float(forward_m_s), float(left_m_s), float(up_m_s))
        turn_rad_s = math.radians(turn_deg_s)
        try:
            while loop.time() < until_s:
                if self.is_over:
                    await self
                    return
                self._link.post(partial(self._link.steer, moves, turn_rad_s, frame))
                await asyncio.sleep(_PERIOD_S)
        finally:
            self._link.post(partial(self._link.steer, (0.0, 0.0, 0.0), 0.0, frame))
