"""MAVFTP as a means to get logs: answers that are wrong, late, short, repeated or nonsense."""

from __future__ import annotations

import random
import struct

import pytest

from mavlink_vehicle.codec import Message, make
from mavlink_vehicle.events import StoredLog
from mavlink_vehicle.protocols.logs.ftp import FtpAnswer, FtpError, FtpLine, FtpOp
from mavlink_vehicle.protocols.logs.ftp_download import FtpLogDownload
from mavlink_vehicle.protocols.logs.ftp_list import FtpLogList
from mavlink_vehicle.protocols.operations.command import Address

ADDRESS = Address(255, 190, 1, 1)
DATA = random.Random(5).randbytes(5000)
LOG = StoredLog(7, len(DATA), 0, "/APM/LOGS/00000007.BIN")
HEADER = struct.Struct("<HBBBBBxI")


def answer(
    request: Message,
    data: bytes = b"",
    error: int | None = None,
    later: int = 1,
    session: int = 0,
    offset: int | None = None,
) -> Message:
    """The answer to a request."""
    number, _, op, _, _, _, asked = HEADER.unpack_from(bytes(request.payload))
    data = data if error is None else bytes([error])
    kind, offset = 128 if error is None else 129, asked if offset is None else offset
    head = HEADER.pack((number + later) % 65536, session, kind, len(data), op, 0, offset)
    return made(head + data)


def made(payload: bytes) -> Message:
    return make(
        "FILE_TRANSFER_PROTOCOL", target_network=0, target_system=255, target_component=190,
        payload=list(payload.ljust(251, b"\0")),
    )  # fmt: skip


def asked(request: Message) -> tuple[int, int, int, int]:
    """Session, operation, offset and size of a request."""
    _, session, op, size, _, _, offset = HEADER.unpack_from(bytes(request.payload))
    return session, op, offset, size


def opened(session: int = 3) -> FtpLogDownload:
    download = FtpLogDownload(FtpLine(ADDRESS, 3.0), LOG)
    download.start(0.0)
    (request,) = download.messages_to_send()
    assert asked(request)[1] == FtpOp.OPEN_TO_READ
    assert bytes(request.payload[12:]).rstrip(b"\0").decode() == LOG.path
    download.receive(answer(request, struct.pack("<I", len(DATA)), session=session), 0.01)
    return download


def serve(download: FtpLogDownload, part: int = 239) -> bytes:
    """Answer all that is asked, with at most that many bytes each; return what was given out."""
    now, given = 0.02, b""
    for _ in range(20_000):
        for request in download.messages_to_send():
            session, op, offset, size = asked(request)
            if op == FtpOp.READ:
                assert session == 3
                data = DATA[offset : offset + min(size, part)]
                download.receive(answer(request, data, session=3), now)
        while (chunk := download.next_chunk()) is not None:
            assert chunk[0] == len(given)
            given += chunk[1]
        if download.done or download.problem:
            break
        now = max(download.deadline_s or now, now) + 1e-6
        download.handle_timer(now)
    return given


@pytest.mark.parametrize("part", [1, 100, 238, 239])
def test_short_parts_are_completed(part: int) -> None:
    assert serve(opened(), part) == DATA


def test_few_requests_are_open_at_a_time_and_not_too_fast() -> None:
    download = opened()
    assert len(download.messages_to_send()) == 1
    now = 0.01
    for _ in range(10):
        now += 239 / 72_000.0
        download.handle_timer(now)
    assert len(download.messages_to_send()) == 3


def test_what_a_later_answer_has_overtaken_is_read_again_at_once() -> None:
    download = opened()
    requests = download.messages_to_send()
    for step in range(1, 4):
        download.handle_timer(0.01 + step * 0.004)
        requests += download.messages_to_send()
    assert [asked(request)[2] for request in requests] == [0, 239, 478, 717]
    download.receive(answer(requests[2], DATA[478:717]), 0.03)
    download.handle_timer(0.031)
    again = download.messages_to_send()
    assert asked(again[0])[2] == 0
    # The first answer comes after all: it is not that of the second request.
    download.receive(answer(requests[0], b"x" * 239), 0.032)
    assert download.next_chunk() is None
    download.receive(answer(again[0], DATA[:239]), 0.033)
    assert download.next_chunk() == (0, DATA[:239])


def test_an_answer_with_another_offset_is_not_taken() -> None:
    download = opened()
    (request,) = download.messages_to_send()
    download.receive(answer(request, DATA[:239], offset=239), 0.02)
    assert download.next_chunk() is None
    assert serve(download) == DATA


def test_a_file_that_the_autopilot_has_closed_is_opened_again() -> None:
    download = opened()
    (request,) = download.messages_to_send()
    download.receive(answer(request, error=FtpError.INVALID_SESSION), 0.02)
    download.handle_timer(0.021)
    (request,) = download.messages_to_send()
    assert asked(request)[:2] == (0, FtpOp.OPEN_TO_READ)
    download.receive(answer(request, struct.pack("<I", len(DATA)), session=3), 0.03)
    assert serve(download) == DATA


def test_a_file_that_ends_early_is_reported() -> None:
    download = opened()
    (request,) = download.messages_to_send()
    download.receive(answer(request, error=FtpError.END_OF_FILE), 0.02)
    assert "ended the reading" in download.problem
    last = [asked(message)[:2] for message in download.messages_to_send()]
    assert last == [(3, FtpOp.TERMINATE)] * 2
    assert download.deadline_s is None


def test_silence_is_reported_after_many_requests() -> None:
    download, now = opened(), 0.02
    for _ in range(2000):
        if download.problem:
            break
        now = max(download.deadline_s or now, now)
        download.handle_timer(now)
        download.messages_to_send()
    assert "stopped sending" in download.problem
    assert now > 2.0


def test_folders_are_looked_for_until_there_is_one() -> None:
    folders = {
        "/fs/microsd/log": [b"D.", b"D..", b"D2026-11-23", b"Dsess001", b"Dother", b"Fmsgs.txt\t5"],
        "/fs/microsd/log/2026-11-23": [b"F10_06_00.ulg\t77", b"S", b"F10_07_00.ulg\tx"],
        "/fs/microsd/log/sess001": [b"Flog100.ulg\t9"],
    }
    listing, visited = FtpLogList(FtpLine(ADDRESS, 3.0)), []
    listing.start(0.0)
    while listing.logs is None and not listing.problem:
        (request,) = listing.messages_to_send()
        path = bytes(request.payload[12:]).rstrip(b"\0").decode()
        visited.append(path)
        entries = folders.get(path)
        if entries is None:
            listing.receive(answer(request, error=FtpError.NOT_FOUND), 0.0)
        elif asked(request)[2] >= len(entries):
            listing.receive(answer(request, error=FtpError.END_OF_FILE), 0.0)
        else:
            start = asked(request)[2]
            listing.receive(answer(request, b"\0".join(entries[start : start + 2]) + b"\0"), 0.0)
    assert "/log" not in visited
    assert listing.logs == {
        0: StoredLog(0, 77, 1795428360, "/fs/microsd/log/2026-11-23/10_06_00.ulg"),
        1: StoredLog(1, 9, 0, "/fs/microsd/log/sess001/log100.ulg"),
    }


def test_an_autopilot_without_mavftp_is_reported() -> None:
    listing = FtpLogList(FtpLine(ADDRESS, 3.0))
    listing.start(0.0)
    now = 0.0
    for _ in range(20):
        now = listing.deadline_s or now
        listing.handle_timer(now)
    assert listing.problem == "The autopilot did not list /APM/LOGS over MAVFTP."


def test_nonsense_is_no_answer_and_harms_nothing() -> None:
    noise = random.Random(8)
    download, listing = opened(), FtpLogList(FtpLine(ADDRESS, 3.0))
    listing.start(0.0)
    for step in range(3000):
        payload = bytearray(noise.randbytes(251))
        if step % 2:
            payload[3], payload[4], payload[5] = noise.choice((128, 129)), noise.randrange(256), 5
            payload[0], payload[1] = (3000 + noise.randrange(32)) % 256, 3000 // 256
        message = made(bytes(payload))
        FtpAnswer.of(message, ADDRESS)
        download.receive(message, 0.02)
        listing.receive(message, 0.02)
        download.messages_to_send()
    offset = 0
    while (chunk := download.next_chunk()) is not None:
        assert chunk[0] == offset
        offset += len(chunk[1])
    assert offset <= len(DATA)


def test_an_answer_to_another_station_or_another_question_is_not_ours() -> None:
    listing = FtpLogList(FtpLine(ADDRESS, 3.0))
    listing.start(0.0)
    (request,) = listing.messages_to_send()
    given = answer(request, error=FtpError.NOT_FOUND)
    given.target_component = 191
    listing.receive(given, 0.1)
    given = answer(request, error=FtpError.NOT_FOUND)
    given.payload[5] = FtpOp.READ
    listing.receive(given, 0.1)
    assert not listing.messages_to_send()
    listing.receive(answer(request, error=FtpError.NOT_FOUND), 0.1)
    assert listing.messages_to_send()


def test_numbers_do_not_begin_again_with_each_transfer() -> None:
    (_, first), (_, second) = (FtpLine(ADDRESS, now).request(FtpOp.LIST) for now in (9.0, 9.5))
    assert first.payload[:2] != second.payload[:2]
