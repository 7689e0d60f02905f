"""MAVFTP of both simulated firmwares, request by request."""

from __future__ import annotations

import json
import lzma
import struct
import zlib

import pytest
from pymavlink.mavftp import MAVFTP

from mavlink_sitl.mavlink.files import storage
from sitl_support.ftp_client import (
    ACK,
    CARDS,
    NAK,
    FtpClient,
    card,
    connected,
    reply,
)
from sitl_support.ground_station import ACCEPTED

TERMINATE, RESET, LIST, OPEN, READ, CREATE, WRITE, REMOVE, MAKE, REMOVE_FOLDER = range(1, 11)
OPEN_TO_WRITE, TRUNCATE, RENAME, CRC, BURST = range(11, 16)
FAIL, ERRNO, INVALID_SIZE, INVALID_SESSION, NO_SESSIONS = 1, 2, 3, 4, 5
END, UNKNOWN, EXISTS, PROTECTED, NOT_FOUND = 6, 7, 8, 9, 10
FIRMWARES = sorted(CARDS)


@pytest.fixture(params=FIRMWARES)
def client(request: pytest.FixtureRequest) -> FtpClient:
    return connected(request.param)


def put(client: FtpClient, name: str, data: bytes) -> None:
    client.done(CREATE, card(client, name))
    for offset in range(0, len(data), 200):
        client.done(WRITE, data[offset : offset + 200], offset)
    client.done(TERMINATE)


def get(client: FtpClient, path: bytes) -> bytes:
    """By ReadFile, part by part."""
    client.done(OPEN, path)
    data = b""
    while (answer := client.one(READ, offset=len(data), size=239)).kind == ACK:
        data += answer.data
    assert list(answer.data) == [END]
    client.done(TERMINATE)
    return data


# Files of one's own.


def test_a_file_is_written_read_listed_summed_and_removed(client: FtpClient) -> None:
    data = bytes(range(256)) * 3
    put(client, "a.bin", data)
    assert get(client, card(client, "a.bin")) == data
    assert b"Fa.bin\t768" in client.done(LIST, card(client))
    (crc,) = struct.unpack("<I", client.done(CRC, card(client, "a.bin")))
    assert crc == zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF
    client.done(REMOVE, card(client, "a.bin"))
    assert client.refused(OPEN, card(client, "a.bin")) == [NOT_FOUND]
    assert client.refused(REMOVE, card(client, "a.bin")) == [NOT_FOUND]


def test_a_path_may_end_with_a_zero(client: FtpClient) -> None:
    put(client, "a", b"x")
    assert struct.unpack("<I", client.done(OPEN, card(client, "a") + b"\0")) == (1,)


def test_folders_are_made_renamed_and_removed_when_empty(client: FtpClient) -> None:
    client.done(MAKE, card(client, "new"))
    assert client.refused(MAKE, card(client, "new")) == [EXISTS]
    assert client.refused(MAKE, card(client, "none/new")) == [NOT_FOUND]
    put(client, "new/b", b"12")
    assert client.refused(REMOVE_FOLDER, card(client, "new")) == [ERRNO, 39]  # ENOTEMPTY
    client.done(RENAME, card(client, "new") + b"\0" + card(client, "other"))
    assert b"Fb\t2" in client.done(LIST, card(client, "other"))
    client.done(REMOVE, card(client, "other/b"))
    client.done(REMOVE_FOLDER, card(client, "other"))
    assert client.refused(LIST, card(client, "other")) == [NOT_FOUND]
    assert client.refused(REMOVE_FOLDER, card(client, "other")) == [NOT_FOUND]
    assert client.refused(RENAME, b"/one-path-only") == [INVALID_SIZE]


def test_an_existing_file_is_appended_to_or_begun_again(client: FtpClient) -> None:
    put(client, "a", b"12345")
    client.done(OPEN_TO_WRITE, card(client, "a"))
    client.done(WRITE, b"XY", offset=6)
    client.done(TERMINATE)
    assert get(client, card(client, "a")) == b"12345\0XY"
    put(client, "a", b"1")
    assert get(client, card(client, "a")) == b"1"
    assert client.refused(OPEN_TO_WRITE, card(client, "b")) == [NOT_FOUND]


def test_it_outlives_a_restart(client: FtpClient) -> None:
    put(client, "kept", b"1")
    client.station.vehicle.power_cycle()
    client.station.run(3.0)
    assert get(client, card(client, "kept")) == b"1"


def test_there_is_only_so_much_room(client: FtpClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(storage, "BYTES_MAX", 300)
    monkeypatch.setattr(storage, "ENTRIES_MAX", 2)
    client.done(CREATE, card(client, "a"))
    client.done(WRITE, bytes(200))
    assert client.refused(WRITE, bytes(200), offset=200) == [ERRNO, 28]  # ENOSPC
    client.done(TERMINATE)
    put(client, "b", b"")
    assert client.refused(CREATE, card(client, "c")) == [ERRNO, 28]


def test_no_path_leads_out(client: FtpClient) -> None:
    assert client.done(LIST, b"/../../") == client.done(LIST, b"/")
    assert client.refused(OPEN, b"/../../etc/passwd") == [NOT_FOUND]


# Sessions and answers.


def test_one_file_is_open_at_a_time(client: FtpClient) -> None:
    px4 = card(client) == b"/fs/microsd/"
    assert client.refused(READ, size=10) == [INVALID_SESSION if px4 else NOT_FOUND]
    assert client.refused(WRITE, b"1") == [INVALID_SESSION if px4 else NOT_FOUND]
    put(client, "a", b"1")
    client.done(OPEN, card(client, "a"))
    assert client.refused(OPEN, card(client, "a")) == [NO_SESSIONS if px4 else FAIL]
    assert client.refused(WRITE, b"1") == [INVALID_SESSION if px4 else FAIL]
    assert client.refused(READ, size=1, session=7) == [INVALID_SESSION]
    client.done(RESET)
    client.done(OPEN, card(client, "a"))


def test_a_file_that_is_idle_gives_way(client: FtpClient) -> None:
    put(client, "a", b"1")
    client.done(OPEN, card(client, "a"))
    client.station.run(11.0)
    client.done(OPEN, card(client, "a"))


def test_a_file_that_is_idle_for_long_is_closed(client: FtpClient) -> None:
    put(client, "a", b"1")
    client.done(OPEN, card(client, "a"))
    client.station.run(21.0)
    px4 = card(client) == b"/fs/microsd/"
    assert client.refused(READ, size=1) == [INVALID_SESSION if px4 else NOT_FOUND]


def test_an_ardupilots_other_session_ends_nothing() -> None:
    client = connected("ardupilot")
    put(client, "a", b"1")
    client.done(OPEN, card(client, "a"), session=3)
    client.done(TERMINATE, session=4)
    assert client.done(READ, size=1, session=3) == b"1"
    assert client.refused(LIST, b"/", session=4) == [INVALID_SESSION]


def test_a_px4_answers_with_its_session_and_ends_only_that() -> None:
    client = connected("px4")
    put(client, "a", b"1")
    assert client.one(OPEN, card(client, "a"), session=9).session == 0
    assert client.refused(TERMINATE, session=9) == [INVALID_SESSION]
    client.done(TERMINATE)
    assert client.refused(TERMINATE) == [INVALID_SESSION]


def test_a_request_that_comes_again_gets_the_same_answer(client: FtpClient) -> None:
    client.done(MAKE, card(client, "new"))
    client._number -= 1
    client.done(MAKE, card(client, "new"))


def test_what_is_not_known_is_rejected(client: FtpClient) -> None:
    px4 = card(client) == b"/fs/microsd/"
    for op in (TRUNCATE, 16, 77):
        assert client.refused(op, b"/a") == [UNKNOWN if px4 else FAIL]
    assert client.refused(LIST, b"/", size=250) == [INVALID_SIZE]
    assert client.done(0) == b""


def test_what_the_vehicle_made_is_not_changed() -> None:
    for autopilot, log, refusal in (
        ("ardupilot", "/APM/LOGS/00000001.BIN", [ERRNO, 13]),  # EACCES
        ("px4", "/etc/extras/component_general.json.xz", [PROTECTED]),
    ):
        client = connected(autopilot)
        client.station.vehicle.firmware.arm(force=True)
        client.station.run(1.0)
        client.station.vehicle.firmware.disarm(force=True)
        for op in (REMOVE, CREATE):
            assert client.refused(op, log.encode("ascii")) == refusal
    assert client.refused(CREATE, b"/new") == [PROTECTED]
    assert client.refused(MAKE, b"/fs/new") == [PROTECTED]


# Bursts.


@pytest.mark.parametrize("size", [239, 80, 0])
def test_a_burst_gives_the_file_and_ends_with_its_end(client: FtpClient, size: int) -> None:
    data = bytes(range(250)) * 8
    put(client, "a", data)
    client.done(OPEN, card(client, "a"))
    answers = client.ask(BURST, size=size)
    *parts, end = answers
    assert b"".join(part.data for part in parts) == data
    assert [a.number for a in answers] == [parts[0].number + i for i in range(len(answers))]
    assert [part.offset for part in parts] == [
        sum(len(p.data) for p in parts[:i]) for i in range(len(parts))
    ]
    px4 = card(client) == b"/fs/microsd/"
    assert {len(part.data) for part in parts[:-1]} == {239 if px4 else size or 239}
    assert (end.kind, list(end.data), end.offset) == (NAK, [END], len(data))
    assert not any(part.complete for part in parts)


def test_a_long_burst_is_complete_after_a_limit(client: FtpClient) -> None:
    data = bytes(range(200)) * 3000
    put(client, "a", b"")
    client.station.vehicle.logbook.storage.files[card(client, "a").decode()] += data
    client.done(OPEN, card(client, "a"))
    client.send(BURST, offset=1000, size=239)
    client.station.run(3.0)
    found = b""
    parts = [reply(m) for m in client.station.messages("FILE_TRANSFER_PROTOCOL")]
    parts = [part for part in parts if part.op == BURST]
    px4 = card(client) == b"/fs/microsd/"
    assert len(parts) == (147 if px4 else 2000)
    assert [part.complete for part in parts] == [*[0] * (len(parts) - 1), 1]
    found = b"".join(part.data for part in parts)
    assert found == data[1000 : 1000 + len(found)]
    assert client.done(READ, offset=len(data) - 1, size=1) == data[-1:]


# Files that ArduPilot generates.


def decoded(client: FtpClient, asked: bytes = b"") -> tuple[list[tuple[bytes, float, int]], object]:
    client.done(OPEN, b"@PARAM/param.pck" + asked)
    *parts, _ = client.ask(BURST, size=239)
    client.done(TERMINATE)
    found = MAVFTP.ftp_param_decode(b"".join(part.data for part in parts))
    assert found is not None
    return found.params, found.defaults


@pytest.mark.parametrize("vehicle", ["copter", "rover", "boat", "plane"])
def test_param_pck_has_all_parameters(vehicle: str) -> None:
    client = connected("ardupilot", vehicle)
    parameters = client.station.vehicle.parameters
    found, _ = decoded(client)
    assert [name.decode() for name, _, _ in found] == list(parameters.names())
    for name, value, _ in found:
        assert value == pytest.approx(parameters[name.decode()], rel=1e-6)


def test_param_pck_takes_a_start_a_count_and_defaults() -> None:
    client = connected("ardupilot")
    parameters = client.station.vehicle.parameters
    parameters.set("WPNAV_SPEED", 700.0)
    place = parameters.names().index("WPNAV_SPEED")
    found, defaults = decoded(client, f"?start={place}&count=2&withdefaults=1".encode("ascii"))
    assert found[0][:2] == (b"WPNAV_SPEED", 700.0)
    assert len(found) == 2
    assert isinstance(defaults, list)
    assert defaults[0][:2] == (b"WPNAV_SPEED", 1000.0)
    assert client.refused(OPEN, b"@PARAM/param.pck?start=70000") == [ERRNO, 22]  # EINVAL
    assert client.refused(OPEN, b"@PARAM/other") == [NOT_FOUND]
    assert client.refused(CREATE, b"@PARAM/param.pck") == [ERRNO, 13]


def test_param_pck_is_read_in_parts_of_one_size_and_no_value_is_cut() -> None:
    client = connected("ardupilot")
    client.done(OPEN, b"@PARAM/param.pck")
    first = client.done(READ, size=80)
    assert client.refused(READ, size=60) == [ERRNO, 22]
    magic, count, total = struct.unpack_from("<HHH", first)
    assert (magic, count) == (0x671B, total)
    assert client.done(READ, size=80) == first


# Files of PX4.


def test_component_metadata_names_a_file_and_its_sum() -> None:
    client = connected("px4")
    station = client.station
    assert station.command(512, 397) == ACCEPTED
    station.run(0.1)
    general = get(client, b"etc/extras/component_general.json.xz")
    crc = zlib.crc32(general, 0xFFFFFFFF) ^ 0xFFFFFFFF
    told = bytes(station.last("UNKNOWN_397").data)[10:-2]
    assert struct.unpack_from("<I", told, 4) == (crc,)
    assert told[8:].rstrip(b"\0") == b"mftp://etc/extras/component_general.json.xz"
    (kind,) = json.loads(lzma.decompress(general))["metadataTypes"]
    parameters = get(client, kind["uri"].removeprefix("mftp://").encode("ascii"))
    assert kind["fileCrc"] == zlib.crc32(parameters, 0xFFFFFFFF) ^ 0xFFFFFFFF
    described = json.loads(lzma.decompress(parameters))["parameters"]
    assert {d["name"] for d in described} == set(station.vehicle.parameters.specs)
