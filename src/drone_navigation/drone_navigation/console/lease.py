"""Control of a vehicle by one page at a time. No I/O, no clock."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["SILENCE_S", "Leases"]

SILENCE_S = 5.0
"""A page that is silent for this time loses control; a page reports once a second."""


@dataclass
class _Lease:
    page: int
    heard_s: float


class Leases:
    """Control of the vehicles, by page."""

    def __init__(self) -> None:
        """Start without any."""
        self._leases: dict[str, _Lease] = {}

    def holder(self, vehicle: str) -> int | None:
        """Return the number of the page that controls a vehicle, if any."""
        lease = self._leases.get(vehicle)
        return None if lease is None else lease.page

    def take(self, vehicle: str, page: int, now: float, *, over: bool) -> bool:
        """Give a page control.

        Args:
            vehicle: its name.
            page: number of the page.
            now: time, s.
            over: whether the page knows that it takes control from another one.

        Returns:
            Whether the page has control now.
        """
        self.expire(now)
        lease = self._leases.get(vehicle)
        if lease is not None and lease.page != page and not over:
            return False
        self._leases[vehicle] = _Lease(page, now)
        return True

    def holds(self, vehicle: str, page: int, now: float) -> bool:
        """Return whether a page has control at a time, s."""
        self.expire(now)
        return self.holder(vehicle) == page

    def hear(self, page: int, now: float) -> None:
        """Note that a page is there at a time, s."""
        self.expire(now)
        for lease in self._leases.values():
            if lease.page == page:
                lease.heard_s = now

    def give(self, page: int, vehicle: str | None = None) -> None:
        """Take control from a page: of one vehicle, or of all."""
        for name in list(self._leases):
            if self._leases[name].page == page and vehicle in (None, name):
                del self._leases[name]

    def expire(self, now: float) -> None:
        """Take control from pages that have been silent, at a time in s."""
        for name in list(self._leases):
            if now - self._leases[name].heard_s > SILENCE_S:
                del self._leases[name]
