"""The circles and polygons of the vehicle's uploaded fence, kept up to date.

The list is read again every minute, as somebody on another link may upload another fence; at
once when the autopilot was heard to take one.
It waits while a mission is transferred: a PX4 does one transfer at a time
(mavlink_mission.cpp).
"""

from __future__ import annotations

from collections.abc import Callable

from mavlink_vehicle.codec import Message
from mavlink_vehicle.mission_items import MissionItem, MissionType
from mavlink_vehicle.protocols.mission.mission_download import MissionDownload
from mavlink_vehicle.protocols.mission.transfer import TransferResult, TransferTiming
from mavlink_vehicle.protocols.operations.command import Address

_AGAIN_S = 60.0
_WAIT_S = 2.0


class FenceItems:
    """Reads the fence's items."""

    def __init__(self, timing: TransferTiming, may_read: Callable[[], bool]) -> None:
        """Prepare; `may_read` says whether no other transfer is under way."""
        self.items: tuple[MissionItem, ...] | None = None
        self._timing = timing
        self._may_read = may_read
        self._address: Address | None = None
        self._download: MissionDownload | None = None
        self._begin_s: float | None = None
        self._outbox: list[Message] = []

    def start(self, now: float) -> None:
        """Nothing to ask before `resume`."""

    def resume(self, address: Address, now: float) -> None:
        """Read the list from now on."""
        self._address = address
        self._download = None
        self._begin_s = now

    def refresh(self, now: float) -> None:
        """Read the list again, from the beginning: it is another one."""
        if self._address is not None:
            self._download, self._begin_s = None, now

    def forget(self) -> None:
        """Drop what is known: the autopilot restarted."""
        self.items = None

    def pause(self) -> None:
        """Stop asking."""
        self._download = self._begin_s = None
        self._outbox.clear()

    def receive(self, message: Message, now: float) -> None:
        """Look for the count and the items."""
        if self._download is not None:
            self._download.receive(message, now)
            self._take(now)

    def next_deadline(self) -> float | None:
        """Return when to go on."""
        return self._begin_s if self._download is None else self._download.next_deadline()

    def handle_timer(self, now: float) -> None:
        """Begin, go on, or make way for another transfer."""
        if self._download is not None:
            if not self._may_read():
                self._download.cancel(now)
                self._outbox += self._download.messages_to_send()
                self._download, self._begin_s = None, now + _WAIT_S
                return
            self._download.handle_timer(now)
            self._take(now)
        elif self._begin_s is not None and now >= self._begin_s and self._address is not None:
            if not self._may_read():
                self._begin_s = now + _WAIT_S
                return
            self._download = MissionDownload(self._address, self._timing, MissionType.FENCE)
            self._download.start(now)

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent."""
        messages, self._outbox = self._outbox, []
        if self._download is not None:
            messages += self._download.messages_to_send()
        return messages

    def next_event(self) -> None:
        """There are none."""

    def _take(self, now: float) -> None:
        if self._download is None:
            return
        end = self._download.next_event()
        if end is None:
            return
        if end.result is TransferResult.DONE:
            # The same list stays the same object.
            self.items = self.items if end.items == self.items else end.items
        elif end.result is TransferResult.REFUSED:
            self.items = ()  # this autopilot has no such list
        self._outbox += self._download.messages_to_send()
        busy = end.result is TransferResult.BUSY
        self._download, self._begin_s = None, now + (_WAIT_S if busy else _AGAIN_S)
