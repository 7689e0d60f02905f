"""The vehicle's stored fence, rally points and mission, read and kept up to date.

The lists are read one after the other, the fence first. Each is read again when the autopilot
shows that it has another one: an acknowledged upload, or another number or count in
MISSION_CURRENT. An upload on another link to an ArduPilot shows nothing, so each is also read
again once a minute; less often if the last reading was slow, so that it takes little of the link.

Reading makes way for every other transfer: a PX4 does one at a time (mavlink_mission.cpp).
"""

from __future__ import annotations

import math
from collections.abc import Callable

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import StoredListFinished
from mavlink_vehicle.mission_items import HOME_PLACEHOLDER, MissionItem, MissionType
from mavlink_vehicle.protocols.mission.mission_download import MissionDownload
from mavlink_vehicle.protocols.mission.transfer import (
    MISSION_ANSWERS,
    TransferFinished,
    TransferResult,
    TransferTiming,
)
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.service import Conversation, SendingRank, VehicleService
from mavlink_vehicle.state.telemetry import MissionProgress
from mavlink_vehicle.state.vehicle_state import VehicleState

_AGAIN_S = 60.0
# Reading takes at most one part in this many of the time.
_SHARE = 20.0
_WAIT_S = 2.0
_OWN_SHOWN_S = 3.0
_ORDER = (MissionType.FENCE, MissionType.RALLY, MissionType.MISSION)
_ACK = mavlink.MAVLink_mission_ack_message
_TRANSFERS = (
    mavlink.MAVLink_mission_count_message,
    mavlink.MAVLink_mission_item_message,
    mavlink.MAVLink_mission_item_int_message,
    mavlink.MAVLink_mission_request_list_message,
    mavlink.MAVLink_mission_request_message,
    mavlink.MAVLink_mission_request_int_message,
    mavlink.MAVLink_mission_write_partial_list_message,
)


def lists_taken(answer: Message) -> tuple[MissionType, ...]:
    """Return the lists that an answer of the autopilot says it has taken, or cleared."""
    if answer.__class__ is not _ACK or answer.type != mavlink.MAV_MISSION_ACCEPTED:
        return ()
    every = answer.mission_type == mavlink.MAV_MISSION_TYPE_ALL
    return tuple(kind for kind in _ORDER if every or answer.mission_type == kind)


class StoredLists(VehicleService):
    """Reads the three lists.

    Attributes:
        mission_offset: the autopilot's own number of the first item of `mission`.
        fence: the items of the fence that was uploaded to it; None while they are not known.
    """

    rank = SendingRank.LISTS
    handles = MISSION_ANSWERS

    def __init__(self, timing: TransferTiming, may_read: Callable[[], bool]) -> None:
        """Prepare; `may_read` says whether no other transfer is in progress."""
        super().__init__()
        self.mission_offset = 0
        self._items: dict[MissionType, tuple[MissionItem, ...]] = {}
        self.fence: tuple[MissionItem, ...] | None = None
        self._timing = timing
        self._may_read = may_read
        self._address: Address | None = None
        self.pending: MissionDownload | None = None
        self._kind = MissionType.FENCE
        self._begun_s = 0.0
        self._due_s: dict[MissionType, float] = {}
        self._free_s = 0.0
        self._put_s: dict[MissionType, float] = {}

    def of(self, kind: MissionType) -> tuple[MissionItem, ...] | None:
        """Return a list as it is stored, with ArduPilot's home; None while it is unknown."""
        return self._items.get(kind)

    @property
    def rally_points(self) -> tuple[MissionItem, ...] | None:
        """The rally points that it stores; None while they are not known."""
        return self._items.get(MissionType.RALLY)

    @property
    def mission(self) -> tuple[MissionItem, ...] | None:
        """The mission that it stores, without ArduPilot's home; None while it is not known."""
        items = self._items.get(MissionType.MISSION)
        return None if items is None else items[self.mission_offset :]

    def vehicle_came(self, conversation: Conversation, now: float) -> None:
        """Read the lists of a vehicle that has them."""
        rules = conversation.profile.missions
        self.mission_offset = 0 if rules is None else rules.offset
        if conversation.profile.wanted_parameters:
            self.resume(conversation.address, now)

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Stop asking."""
        self.pending = None
        self._due_s.clear()
        self.outbox.clear()
        self._set_deadline()

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Drop what is known."""
        self._items.clear()
        self.fence = None

    def resume(self, address: Address, now: float) -> None:
        """Read the lists from now on."""
        self._address = address
        self.pending = None
        self._due_s = dict.fromkeys(_ORDER, now)
        self._set_deadline()

    def refresh(self, kind: MissionType, now: float) -> None:
        """Read a list again, from the beginning: it is another one."""
        if kind in self._due_s:
            self._due_s[kind] = now
            if self._kind is kind:
                self.pending = None
            elif kind is MissionType.FENCE:
                self._cancel(now)
            self._set_deadline()

    def put(self, kind: MissionType, items: tuple[MissionItem, ...], now: float) -> None:
        """Take a list that somebody else of us has read."""
        self._keep(kind, items)
        self._put_s[kind] = now
        if kind in self._due_s:
            self._due_s[kind] = now + _AGAIN_S
            self._set_deadline()

    def put_mission(self, items: tuple[MissionItem, ...], now: float) -> None:
        """Take the mission, without home, that an operation has read."""
        self.put(MissionType.MISSION, (HOME_PLACEHOLDER,) * self.mission_offset + items, now)

    def ended(self, event: StoredListFinished, now: float) -> None:
        """Take the list that a job has read or written; another end leaves it unknown."""
        if event.items is None:
            self.refresh(event.kind, now)
        else:
            self.put(event.kind, event.items, now)

    def refresh_taken(self, answer: Message, now: float) -> None:
        """Read again what the autopilot says it has taken from somebody else, or cleared."""
        for kind in lists_taken(answer):
            if self._may_read():
                self.refresh(kind, now)

    def make_way(self, now: float) -> None:
        """End the reading: another transfer begins, or is under way."""
        self._cancel(now)
        self._free_s = now + _WAIT_S
        self._set_deadline()

    def overhear(self, message: Message, now: float) -> None:
        """Make way for a station that transfers a list."""
        address = self._address
        if address is None or not isinstance(message, _TRANSFERS):
            return
        header = message._header
        sender = (header.srcSystem, header.srcComponent)
        if message.target_system != address.target_system:
            return
        if sender != (address.source_system, address.source_component):
            self.make_way(now)

    def state_changed(self, before: VehicleState, state: VehicleState, now: float) -> None:
        """Look at what shows another list, unless that is our own transfer."""
        mission, earlier = state.mission, before.mission
        if mission is not earlier and mission and earlier and self._may_read():
            self.compare(earlier, mission, now)

    def compare(self, before: MissionProgress, mission: MissionProgress, now: float) -> None:
        """Read again what MISSION_CURRENT shows to be another list."""
        changed = (before.total, before.mission_id) != (mission.total, mission.mission_id)
        # MISSION_CURRENT comes once a second: at first it shows what was put here.
        if changed and now - self._put_s.get(MissionType.MISSION, -math.inf) > _OWN_SHOWN_S:
            self.refresh(MissionType.MISSION, now)
        if before.fence_id != mission.fence_id:
            self.refresh(MissionType.FENCE, now)
        if before.rally_id != mission.rally_id:
            self.refresh(MissionType.RALLY, now)

    def receive(self, message: Message, now: float) -> None:
        """Look for the count and the items."""
        if self.pending is not None:
            self.pending.receive(message, now)
            self._take(self.pending, now)

    def _set_deadline(self) -> None:
        """Continue what is being read, or begin with the list that is due first."""
        if self.pending is not None:
            self.deadline_s = self.pending.deadline_s
        elif self._due_s:
            self.deadline_s = max(min(self._due_s.values()), self._free_s)
        else:
            self.deadline_s = None

    def _on_deadline(self, now: float) -> None:
        """Begin, continue, or make way for another transfer."""
        if not self._may_read():
            self.make_way(now)
        elif self.pending is not None:
            self.pending.handle_timer(now)
            self._take(self.pending, now)
        elif self._address is not None:
            self._kind = next(kind for kind in _ORDER if self._due_s[kind] <= now)
            self._begun_s = now
            self.pending = MissionDownload(self._address, self._timing, self._kind)
            self.pending.start(now)
            self._set_deadline()

    def _cancel(self, now: float) -> None:
        if self.pending is not None:
            self.pending.cancel(now)
            self.outbox += self.pending.messages_to_send()
            self.pending = None

    def _take(self, download: MissionDownload, now: float) -> None:
        """Take what was read, if that has ended."""
        end = download.next_event()
        if end is not None:
            self._take_end(download, end, now)
        self._set_deadline()

    def _take_end(self, download: MissionDownload, end: TransferFinished, now: float) -> None:
        kind = self._kind
        if end.result is TransferResult.DONE:
            # The same list stays the same object. NaN differs from itself, but its name does not.
            if repr(self._items.get(kind)) != repr(end.items):
                self._keep(kind, end.items)
        elif end.result is TransferResult.REFUSED:
            self._keep(kind, ())  # this autopilot has no such list
        self.outbox += download.messages_to_send()
        busy = end.result is TransferResult.BUSY
        pause_s = _WAIT_S if busy else max(_AGAIN_S, _SHARE * (now - self._begun_s))
        self.pending, self._due_s[kind] = None, now + pause_s

    def _keep(self, kind: MissionType, items: tuple[MissionItem, ...]) -> None:
        self._items[kind] = items
        if kind is MissionType.FENCE:
            self.fence = items
