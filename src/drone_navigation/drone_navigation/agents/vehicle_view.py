"""The vehicle as an agent sees it, and rehearsals: the console's ROS client, without its page."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node

from drone_navigation.console.messages import Rehearse
from drone_navigation.console.page_types import JsonObject
from drone_navigation.console.rehearsing.rehearsals import Rehearsals
from drone_navigation.console.shown_values import ShownValues
from drone_navigation.console.vehicle import VehicleClient
from drone_navigation.programs.errors import NavigationError
from drone_navigation.programs.server_link import ServerLink
from navigation_core.geometry import Vector3

__all__ = ["VehicleView"]

_KNOWN_S = 10.0
"""A rehearsal waits this long for the parameters that decide the flight"""
_UNKNOWN = "the server has not reported its parameters."


@dataclass
class _Asked:
    """A rehearsal that waits for what it needs."""

    order: Rehearse
    steps: Sequence[Mapping[str, object]]
    tell: Callable[[JsonObject], None]
    until_s: float = math.inf


class VehicleView:
    """Values of one vehicle, in the thread of ROS; `value` may be read in any."""

    def __init__(self, link: ServerLink, vehicle: str) -> None:
        """Begin to listen.

        Args:
            link: whose node is used.
            vehicle: its namespace; empty without one.
        """
        self._name = f"/{vehicle}" if vehicle else "/"
        self._link = link
        self._board = ShownValues()
        self._client: VehicleClient | None = None
        self._rehearsals = Rehearsals(self._post)
        self._waiting: list[_Asked] = []
        self._is_known = False
        link.attach(self._begin)

    def _post(self, work: Callable[[], None]) -> None:
        with contextlib.suppress(NavigationError):  # the connection has ended
            self._link.post(work)

    # --- any thread ----------------------------------------------------------------------

    @property
    def vehicle(self) -> str:
        """Its name among the console's."""
        return self._name

    def value(self, name: str) -> Any:
        """Return a value by the name that the console has for it; None while unknown."""
        return self._board.get(self._name, name)

    @property
    def position_enu_m(self) -> Vector3 | None:
        """Where the vehicle is in the map; None while unknown."""
        motion = self.value("motion")
        return None if motion is None or not self.value("alive") else tuple(motion["at"])

    @property
    def is_flying(self) -> bool:
        """Whether it is armed, and not known to be on the ground."""
        status = self.value("status") or {}
        return bool(status.get("armed")) and status.get("landed") == "in the air"

    def rehearse(
        self,
        order: Rehearse,
        steps: Sequence[Mapping[str, object]],
        tell: Callable[[JsonObject], None],
    ) -> None:
        """Rehearse an order, or steps instead; ``tell`` gets the result in the thread of ROS."""
        self._post(lambda: self._waiting.append(_Asked(order, steps, tell)))

    # --- the thread of ROS ---------------------------------------------------------------

    def _begin(self, node: Node, now: float) -> VehicleView:
        self._client = VehicleClient(node, self._name, self._board, now)
        self._client.watch(True)
        self._rehearsals.warm_up()
        return self

    def tick(self, now: float) -> None:
        """Take answers, and begin rehearsals whose parameters are known, at a time in s."""
        if self._client is None:
            return
        self._client.tick(now)
        self._rehearsals.tick(now)
        if self._is_known and not self._waiting:
            return
        known = self._client.known_for(self._rehearsals)
        self._is_known = known.server and known.vehicle
        for asked in list(self._waiting):
            asked.until_s = min(asked.until_s, now + _KNOWN_S)
            if not self._is_known and now < asked.until_s:
                continue
            self._waiting.remove(asked)
            if known.server:
                by = f"agent {asked.order.number}"
                self._rehearsals.begin(
                    by, asked.order, known.values, asked.tell, known.lacks, False, asked.steps
                )
            else:
                asked.tell({"error": _UNKNOWN})

    def close(self) -> None:
        """End the process of the rehearsals."""
        self._rehearsals.close()
