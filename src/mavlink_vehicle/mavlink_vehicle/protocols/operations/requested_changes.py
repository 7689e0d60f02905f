"""Distinguishes the changes that we requested from those of a pilot or a failsafe.

A HEARTBEAT shows a new mode up to a second after the change, perhaps when the operation that
asked for it has already timed out or was cancelled. So each request licenses exactly one
change to exactly what it asked for, while its operation runs and for a grace period after. If
the pilot switches back, that is a second change, and not licensed.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class _Licence:
    mode: int | None  # custom_mode, for a mode change
    armed: bool | None  # for arming and disarming
    ended_s: float | None = None


class RequestedChanges:
    """The changes that may still come from our own requests."""

    def __init__(self, grace_s: float) -> None:
        """Keep a request for `grace_s` after its operation ended."""
        self._grace_s = grace_s
        self._licences: list[_Licence] = []

    def add(self, *, mode: int | None = None, armed: bool | None = None) -> None:
        """A command was sent that asks for this mode, or for this armed state."""
        self._licences.append(_Licence(mode, armed))

    def end(self, now: float) -> None:
        """The operation in progress has ended; its command may still take effect for a while."""
        for licence in self._licences:
            if licence.ended_s is None:
                licence.ended_s = now

    def take_mode(self, mode: int, now: float) -> bool:
        """The mode changed to this; use up the request for it and return whether there was one."""
        return self._take(_Licence(mode, None), now)

    def take_armed(self, armed: bool, now: float) -> bool:
        """The armed state changed to this; use up the request for it if there was one."""
        return self._take(_Licence(None, armed), now)

    def contradicted(self, now: float, *, mode: int | None, armed: bool | None) -> bool:
        """Return whether an earlier request for something else may still take effect."""
        self._expire(now)
        return any(
            (mode is not None and licence.mode not in (None, mode))
            or (armed is not None and licence.armed not in (None, armed))
            for licence in self._licences
        )

    def _take(self, change: _Licence, now: float) -> bool:
        self._expire(now)
        for licence in self._licences:
            if (licence.mode, licence.armed) == (change.mode, change.armed):
                self._licences.remove(licence)
                return True
        return False

    def _expire(self, now: float) -> None:
        self._licences = [
            licence
            for licence in self._licences
            if licence.ended_s is None or now - licence.ended_s <= self._grace_s
        ]
