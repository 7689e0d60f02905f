"""Missions are written, read and cleared correctly under any link faults."""

from __future__ import annotations

from dataclasses import dataclass, field

from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink_vehicle.codec import Codec, Message, make, mavlink
from mavlink_vehicle.events import OperationFinished, OperationKind, OperationResult
from mavlink_vehicle.mission_items import RELATIVE_ALT, MissionItem, item_of
from mavlink_vehicle.profiles import ardupilot, px4
from mavlink_vehicle.protocols.mission.mission_operation import (
    MissionJob,
    MissionOperation,
    MissionTiming,
)
from mavlink_vehicle.protocols.mission.transfer import TransferTiming
from mavlink_vehicle.protocols.operations.command import Address, CommandTiming
from mavlink_vehicle.state.reducer import VehicleState
from tests.support.links.lossy_channel import FATES, Fate, LossyChannel

TICK_S = 0.05
LIMIT_S = 40.0
PERFECT: list[Fate] = [(0.0,)]
TIMING = MissionTiming(LIMIT_S, TransferTiming(0.5, 6), CommandTiming(0.5, 4))
OLD = MissionItem(mavlink.MAV_CMD_NAV_LAND, RELATIVE_ALT)
ITEMS = tuple(
    MissionItem(mavlink.MAV_CMD_NAV_WAYPOINT, RELATIVE_ALT, x=number, z=1.0 * number)
    for number in range(1, 5)
)


@dataclass
class Store:
    """A vehicle's list and nothing else, in ArduPilot's manner or PX4's."""

    in_place: bool
    items: list[MissionItem] = field(default_factory=lambda: [OLD] * 6)
    outbox: list[Message] = field(default_factory=list)
    taken: list[MissionItem] = field(default_factory=list)
    count: int | None = None
    asked_s: float = 0.0
    heard_s: float = 0.0

    def receive(self, message: Message, now: float) -> None:
        handler = getattr(self, f"_{message.get_type().lower()}", None)
        if handler is not None:
            handler(message, now)

    def step(self, now: float) -> None:
        if self.count is None:
            return
        if now - self.heard_s > (8.0 if self.in_place else 5.0):
            self.count = None
            if self.in_place:
                self._send("MISSION_ACK", type=mavlink.MAV_MISSION_OPERATION_CANCELLED)
        elif now - self.asked_s > (1.0 if self.in_place else 0.25):
            self._ask(now)

    def _send(self, name: str, **fields: int) -> None:
        self.outbox.append(make(name, target_system=1, target_component=191, **fields))

    def _ask(self, now: float) -> None:
        self.asked_s = now
        name = "MISSION_REQUEST" if self.in_place else "MISSION_REQUEST_INT"
        self._send(name, seq=len(self.taken))

    def _mission_count(self, message: Message, now: float) -> None:
        self.count, self.taken, self.heard_s = message.count, [], now
        if self.in_place:
            del self.items[message.count :]
        self._ask(now)

    def _mission_item_int(
        self, message: mavlink.MAVLink_mission_item_int_message, now: float
    ) -> None:
        if self.count is None:
            self._send("MISSION_ACK", type=mavlink.MAV_MISSION_ERROR)
        elif message.seq != len(self.taken):
            self._send("MISSION_ACK", type=mavlink.MAV_MISSION_INVALID_SEQUENCE)
        else:
            self._take(item_of(message), now)

    def _take(self, item: MissionItem, now: float) -> None:
        self.heard_s = now
        if self.in_place:
            self.items[len(self.taken) : len(self.taken) + 1] = [item]
        self.taken.append(item)
        if len(self.taken) < (self.count or 0):
            self._ask(now)
            return
        self.items, self.count = self.taken, None
        self._send("MISSION_ACK", type=mavlink.MAV_MISSION_ACCEPTED)

    def _mission_request_list(self, message: Message, now: float) -> None:
        self._send("MISSION_COUNT", count=len(self.items))

    def _mission_request_int(self, message: Message, now: float) -> None:
        if message.seq < len(self.items):
            self.outbox.append(self.items[message.seq].message(message.seq, (1, 191)))

    def _mission_clear_all(self, message: Message, now: float) -> None:
        self.items, self.count = [], None
        self._send("MISSION_ACK", type=mavlink.MAV_MISSION_ACCEPTED)

    def _command_long(self, message: Message, now: float) -> None:
        self._send("COMMAND_ACK", command=message.command)


def run(
    kind: OperationKind, store: Store, up: list[Fate], down: list[Fate]
) -> tuple[OperationFinished, list[MissionItem]]:
    """Returns the one end, and what was stored when it came."""
    rules = (ardupilot.COPTER if store.in_place else px4.COPTER).missions
    assert rules is not None
    items = ITEMS if kind is OperationKind.UPLOAD_MISSION else ()
    job = MissionJob(kind, items, rules, "vehicle")
    operation = MissionOperation(1, job, Address(1, 191, 1, 1), TIMING)
    to_vehicle: LossyChannel[bytes] = LossyChannel(up)
    to_us: LossyChannel[bytes] = LossyChannel(down)
    ours, theirs, now = Codec(1, 191), Codec(1, 1), 0.0
    ends: list[tuple[OperationFinished, list[MissionItem]]] = []
    operation.begin(VehicleState(system_id=1), True, now)
    while now < LIMIT_S + 12.0:
        for message in operation.messages_to_send():
            to_vehicle.push(ours.encode(message), now)
        for data in to_vehicle.pop(now):
            for message in theirs.decode(data):
                store.receive(message, now)
        store.step(now)
        for message in store.outbox:
            to_us.push(theirs.encode(message), now)
        store.outbox.clear()
        for data in to_us.pop(now):
            for message in ours.decode(data):
                operation.receive(message, now)
        operation.handle_timer(now)
        while (end := operation.next_event()) is not None:
            ends.append((end, list(store.items[rules.offset :])))
        now += TICK_S
    assert len(ends) == 1
    assert operation.finished
    assert operation.deadline_s is None
    return ends[0]


@given(up=FATES, down=FATES, in_place=st.booleans())
@settings(max_examples=60)
def test_an_upload_ends_once_and_truthfully(
    up: list[Fate], down: list[Fate], in_place: bool
) -> None:
    end, stored = run(OperationKind.UPLOAD_MISSION, Store(in_place), up, down)
    if end.result is OperationResult.ACHIEVED:
        assert stored == list(ITEMS)
    if up == down == PERFECT:
        assert end.result is OperationResult.ACHIEVED, end.reason


@given(up=FATES, down=FATES, in_place=st.booleans())
@settings(max_examples=40)
def test_clearing_ends_once_and_truthfully(
    up: list[Fate], down: list[Fate], in_place: bool
) -> None:
    end, stored = run(OperationKind.CLEAR_MISSION, Store(in_place), up, down)
    if end.result is OperationResult.ACHIEVED:
        assert stored == []


@given(up=FATES, down=FATES, in_place=st.booleans())
@settings(max_examples=40)
def test_a_download_ends_once(up: list[Fate], down: list[Fate], in_place: bool) -> None:
    end, _ = run(OperationKind.DOWNLOAD_MISSION, Store(in_place), up, down)
    assert end.result in (OperationResult.ACHIEVED, OperationResult.TIMED_OUT)
