"""The log protocols against a model of an autopilot: loss, duplicates, reordering, odd answers."""

from __future__ import annotations

import itertools
import random

import pytest

from mavlink_vehicle.codec import Message, make
from mavlink_vehicle.events import (
    LogChunkReceived,
    LogsListed,
    LogTransferEnded,
    OperationResult,
    StoredLog,
    VehicleEvent,
)
from mavlink_vehicle.protocols.logs.log_download import RATE_BYTES_S
from mavlink_vehicle.protocols.logs.log_transfer import LogTransfer
from mavlink_vehicle.protocols.operations.command import Address

ADDRESS = Address(1, 191, 1, 1)
STEP_S = 0.01
LOG = random.Random(5).randbytes(40_000)


class Model:
    """Answers every request at once, whole; the way here and back may lose, repeat and mix."""

    def __init__(self, logs: dict[int, bytes], seed: int = 0, loss: float = 0.0) -> None:
        self.logs = logs
        self.random = random.Random(seed)
        self.loss = loss
        self.mixed = False
        self.mute = False
        self.asked: list[tuple[float, Message]] = []
        self._under_way: list[tuple[float, Message]] = []

    def take(self, message: Message, now: float) -> None:
        self.asked.append((now, message))
        if self.mute or self.random.random() < self.loss:
            return
        kind = message.get_type()
        if kind == "LOG_REQUEST_LIST":
            for log_id, data in self.logs.items():
                self._answer(entry(log_id, len(data), len(self.logs)), now)
        elif kind == "LOG_REQUEST_DATA":
            data = self.logs[message.id]
            end = min(message.ofs + message.count, len(data))
            for offset in range(message.ofs, end, 90):
                piece = data[offset : min(offset + 90, end)]
                self._answer(log_data(message.id, offset, piece), now)

    def _answer(self, message: Message, now: float) -> None:
        for _ in range(1 + (self.mixed and self.random.random() < 0.2)):
            if self.random.random() >= self.loss:
                late_s = 0.05 + (0.2 * self.random.random() if self.mixed else 0.0)
                self._under_way.append((now + late_s, message))

    def arrived(self, now: float) -> list[Message]:
        here = sorted((m for m in self._under_way if m[0] <= now), key=lambda item: item[0])
        self._under_way = [m for m in self._under_way if m[0] > now]
        return [message for _, message in here]

    def requests(self, kind: str) -> list[Message]:
        return [message for _, message in self.asked if message.get_type() == kind]


def entry(log_id: int, size: int, count: int, time_utc: int = 0) -> Message:
    return make(
        "LOG_ENTRY", id=log_id, size=size, num_logs=count, last_log_num=count, time_utc=time_utc
    )


def log_data(log_id: int, offset: int, data: bytes) -> Message:
    padded = data + bytes(90 - len(data))
    return make("LOG_DATA", id=log_id, ofs=offset, count=len(data), data=list(padded))


def run(transfer: LogTransfer, model: Model, until_s: float = 300.0) -> list[VehicleEvent]:
    """Let both talk until the transfer has ended; return its events."""
    now, events = 0.0, []
    while transfer.busy and now < until_s:
        for message in transfer.messages_to_send():
            model.take(message, now)
        now += STEP_S
        for message in model.arrived(now):
            transfer.receive(message, now)
        deadline = transfer.deadline_s
        if deadline is not None and deadline <= now:
            transfer.handle_timer(now)
    for message in transfer.messages_to_send():
        model.take(message, now)
    while (event := transfer.next_event()) is not None:
        events.append(event)
    return events


def bytes_of(events: list[VehicleEvent], offset: int = 0) -> bytes:
    data = bytearray()
    for event in events:
        if isinstance(event, LogChunkReceived):
            assert event.offset_bytes == offset
            offset += len(event.data)
            data += event.data
    return bytes(data)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("mixed", [False, True])
def test_whatever_is_lost_repeated_or_mixed_the_bytes_are_the_logs(seed: int, mixed: bool) -> None:
    model = Model({3: LOG}, seed, loss=0.2)
    model.mixed = mixed
    transfer = LogTransfer(lambda: ADDRESS)
    begin = random.Random(seed).randrange(0, 20_000)
    transfer.download(StoredLog(3, len(LOG), 0), begin, 0.0)
    events = run(transfer, model)
    assert isinstance(events[-1], LogTransferEnded)
    assert events[-1].result is OperationResult.ACHIEVED
    assert bytes_of(events, begin) == LOG[begin:]
    assert model.asked[-1][1].get_type() == "LOG_REQUEST_END"


def test_one_span_at_a_time_is_asked_for_and_no_faster_than_the_limit() -> None:
    model = Model({0: LOG})
    transfer = LogTransfer(lambda: ADDRESS)
    transfer.download(StoredLog(0, len(LOG), 0), 0, 0.0)
    run(transfer, model)
    asked = [(at, m) for at, m in model.asked if m.get_type() == "LOG_REQUEST_DATA"]
    assert [m.ofs for _, m in asked] == [0, 11520, 23040, 34560]
    for (before_s, message), (at_s, _) in itertools.pairwise(asked):
        assert at_s - before_s >= message.count / RATE_BYTES_S


def test_gaps_that_lie_close_together_are_asked_for_as_one() -> None:
    transfer = LogTransfer(lambda: ADDRESS)
    transfer.download(StoredLog(0, 11_520, 0), 0, 0.0)
    transfer.messages_to_send()
    for place in range(128):
        if place not in (2, 5, 100):
            transfer.receive(log_data(0, 90 * place, bytes(90)), 0.2)
    transfer.handle_timer(1.0)
    (again,) = transfer.messages_to_send()
    assert (again.ofs, again.count) == (180, 360)


def test_a_log_that_is_there_already_is_complete_at_once() -> None:
    model = Model({1: LOG})
    transfer = LogTransfer(lambda: ADDRESS)
    transfer.download(StoredLog(1, len(LOG), 0), len(LOG), 0.0)
    events = run(transfer, model)
    assert bytes_of(events) == b""
    assert isinstance(events[-1], LogTransferEnded)
    assert events[-1].result is OperationResult.ACHIEVED
    assert not model.requests("LOG_REQUEST_DATA")


def test_an_empty_log_is_an_empty_file() -> None:
    transfer = LogTransfer(lambda: ADDRESS)
    transfer.download(StoredLog(1, 0, 0), 0, 0.0)
    events = run(transfer, Model({1: b""}))
    assert isinstance(events[-1], LogTransferEnded)
    assert events[-1].result is OperationResult.ACHIEVED


def test_data_of_other_logs_and_impossible_data_are_ignored() -> None:
    transfer = LogTransfer(lambda: ADDRESS)
    transfer.download(StoredLog(1, 180, 0), 0, 0.0)
    transfer.receive(log_data(2, 0, b"x" * 90), 0.2)
    wrong = log_data(1, 0, b"y" * 90)
    wrong.count = 200
    transfer.receive(wrong, 0.2)
    transfer.receive(log_data(1, 4_000_000_000, b"z" * 90), 0.2)
    transfer.receive(log_data(1, 0, b"a" * 90), 0.3)
    transfer.receive(log_data(1, 90, b"b" * 90), 0.3)
    events = []
    while (event := transfer.next_event()) is not None:
        events.append(event)
    assert bytes_of(events) == b"a" * 90 + b"b" * 90


def test_an_autopilot_that_sends_no_data_is_given_up() -> None:
    model = Model({1: LOG})
    transfer = LogTransfer(lambda: ADDRESS)
    transfer.download(StoredLog(1, len(LOG), 0), 0, 0.0)
    model.mute = True
    events = run(transfer, model)
    end = events[-1]
    assert isinstance(end, LogTransferEnded)
    assert end.result is OperationResult.TIMED_OUT
    assert end.reason.startswith("The autopilot stopped sending log 1 at byte 0 of 40000")


def test_an_autopilot_that_cannot_read_its_log_is_given_up() -> None:
    """A read error shows as packets with no bytes (AP_Logger_MAVLinkLogTransfer.cpp)."""
    transfer = LogTransfer(lambda: ADDRESS)
    transfer.download(StoredLog(1, 1000, 0), 0, 0.0)
    now = 0.0
    while transfer.busy and now < 200.0:
        now += 0.1
        for message in transfer.messages_to_send():
            if message.get_type() == "LOG_REQUEST_DATA":
                transfer.receive(log_data(1, message.ofs, b""), now)
        transfer.handle_timer(now)
    assert not transfer.busy


def test_a_list_is_counted_again_when_the_number_of_logs_changes() -> None:
    transfer = LogTransfer(lambda: ADDRESS)
    transfer.list_logs(0.0)
    transfer.receive(entry(1, 10, 3), 0.1)
    transfer.receive(entry(2, 20, 3), 0.1)
    transfer.receive(entry(1, 99, 2), 0.2)
    assert transfer.busy
    transfer.receive(entry(2, 98, 2, 1_700_000_000), 0.2)
    listed = transfer.next_event()
    assert listed == LogsListed((StoredLog(1, 99, 0), StoredLog(2, 98, 1_700_000_000)))


def test_a_new_transfer_ends_the_one_under_way() -> None:
    transfer = LogTransfer(lambda: ADDRESS)
    transfer.list_logs(0.0)
    transfer.list_logs(0.1)
    ended = transfer.next_event()
    assert isinstance(ended, LogTransferEnded)
    assert ended.result is OperationResult.CANCELLED
    assert transfer.next_event() is None
    assert transfer.busy


def test_without_a_transfer_nothing_is_asked_or_taken() -> None:
    transfer = LogTransfer(lambda: ADDRESS)
    transfer.receive(entry(1, 10, 1), 0.0)
    transfer.receive(log_data(1, 0, b"a"), 0.0)
    transfer.handle_timer(100.0)
    transfer.stop("nothing to stop")
    assert transfer.messages_to_send() == []
    assert transfer.next_event() is None
    assert transfer.deadline_s is None
