"""Notices two ground stations that use one system id.

The answers to one of them go to the other as well, or instead, and each takes the other's
commands for its own. Nothing on the wire says so, here or with a real autopilot.
"""

from __future__ import annotations

from collections.abc import Collection

WINDOW_S = 5.0
"""Two that are alive both speak within this: HEARTBEAT comes once a second"""


class Senders:
    """The addresses from which each system was heard.

    Args:
        vehicles: system ids of the vehicles; parts of a vehicle may have several links.
    """

    def __init__(self, vehicles: Collection[int]) -> None:
        self._vehicles = frozenset(vehicles)
        self._now: dict[int, tuple[str, float]] = {}
        self._before: dict[int, tuple[str, float]] = {}
        self._warned: set[int] = set()

    def hear(self, data: bytes, peer: str, now_s: float) -> str | None:
        """Take what has come in.

        Args:
            data: a datagram, or a frame of a stream.
            peer: from where, as people write it.
            now_s: any clock.

        Returns:
            A warning, once for each system id. Whoever moves from one address to another gets none,
            only two that speak by turns.
        """
        system = _system_of(data)
        if system is None or system in self._vehicles or system in self._warned:
            return None
        last = self._now.get(system)
        if last is not None and last[0] != peer:
            first = self._before.get(system)
            if first is not None and first[0] == peer and now_s - first[1] <= WINDOW_S:
                self._warned.add(system)
                return (
                    f"two ground stations have the system id {system}, at {peer} and {last[0]}; "
                    "give one of them another"
                )
            self._before[system] = last
        self._now[system] = (peer, now_s)
        return None


def _system_of(data: bytes) -> int | None:
    """The sender of the first frame, which must be at the beginning."""
    if len(data) >= 12 and data[0] == 0xFD:
        return data[5]
    if len(data) >= 8 and data[0] == 0xFE:
        return data[3]
    return None
