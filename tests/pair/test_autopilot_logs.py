"""The autopilot's own logs: listed and downloaded from a simulated vehicle, over bad links too."""

from __future__ import annotations

import itertools
import random

import pytest

from mavlink_sitl import LinkFaults, VehicleConfig
from mavlink_vehicle.codec import Codec, make
from mavlink_vehicle.events import (
    HeartbeatLost,
    LogChunkReceived,
    LogMeans,
    LogsListed,
    LogTransferEnded,
    OperationResult,
    StoredLog,
)
from mavlink_vehicle.protocols.logs.ftp import FtpLine, FtpOp
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.vehicle import VehicleConfig as VehicleSettings
from tests.support.flights.vehicle_pair import VehiclePair

pytestmark = pytest.mark.wide


LOSSY = LinkFaults(loss=0.2)
REORDERED = LinkFaults(loss=0.2, duplicate=0.2, delay_s=0.05, jitter_s=0.1)


def flown(
    autopilot: str,
    faults: LinkFaults | None = None,
    flights: int = 1,
    means: LogMeans = LogMeans.AUTO,
) -> VehiclePair:
    """A vehicle that was armed and disarmed a number of times, on a link with these faults.

    Its logs are made longer than one request asks for.
    """
    config = VehicleConfig(autopilot=autopilot, ready_after_s=1.0)
    own = VehicleSettings(log_means=means)
    pair = VehiclePair(seed=3, config=own, simulated=config).ready()
    for _ in range(flights):
        pair.copter.firmware.arm(force=True)
        pair.run_until(lambda: pair.vehicle.state.armed)
        pair.run_for(4.0)
        pair.copter.firmware.disarm(force=True)
        pair.run_until(lambda: not pair.vehicle.state.armed)
    noise = random.Random(1)
    for log in pair.copter.logbook.logs:
        log.data += noise.randbytes(noise.randrange(40_000, 50_000))
    pair.copter.link.set_faults(faults)
    pair.events.clear()
    return pair


def first_id(autopilot: str) -> int:
    return 1 if autopilot == "ardupilot" else 0


def end_of(pair: VehiclePair, timeout_s: float = 120.0) -> LogTransferEnded:
    pair.flush()
    pair.run_until(lambda: bool(pair.all(LogTransferEnded)), timeout_s)
    (end,) = pair.all(LogTransferEnded)
    return end


def the_log(pair: VehiclePair) -> StoredLog:
    """List the logs; return the last one."""
    pair.vehicle.logs.list_logs(pair.now)
    assert end_of(pair).result is OperationResult.ACHIEVED
    (listed,) = pair.all(LogsListed)
    pair.events.clear()
    return listed.logs[-1]


def received(pair: VehiclePair, offset: int = 0) -> bytes:
    """The bytes that came, which must follow one another."""
    data = bytearray()
    for chunk in pair.all(LogChunkReceived):
        assert chunk.offset_bytes == offset
        offset += len(chunk.data)
        data += chunk.data
    return bytes(data)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("faults", [None, LOSSY])
def test_logs_are_listed(autopilot: str, faults: LinkFaults | None) -> None:
    pair = flown(autopilot, faults, flights=2)
    pair.vehicle.logs.list_logs(pair.now)
    assert end_of(pair).result is OperationResult.ACHIEVED
    (listed,) = pair.all(LogsListed)
    first = first_id(autopilot)
    assert [log.log_id for log in listed.logs] == [first, first + 1]
    assert [log.size_bytes for log in listed.logs] == [
        len(log.data) for log in pair.copter.logbook.logs
    ]


def test_an_ardupilot_that_has_no_log_says_so_and_a_px4_is_silent() -> None:
    pair = flown("ardupilot", flights=0)
    pair.vehicle.logs.list_logs(pair.now)
    assert end_of(pair).result is OperationResult.ACHIEVED
    assert pair.all(LogsListed) == [LogsListed(())]

    pair = flown("px4", flights=0, means=LogMeans.LOG_REQUEST)
    pair.vehicle.logs.list_logs(pair.now)
    end = end_of(pair)
    assert end.result is OperationResult.TIMED_OUT
    assert "A PX4 without logs does not answer" in end.reason


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("faults", [None, LOSSY])
def test_mavftp_lists_them_by_their_names(autopilot: str, faults: LinkFaults | None) -> None:
    pair = flown(autopilot, faults, flights=15, means=LogMeans.FTP)
    pair.vehicle.logs.list_logs(pair.now)
    assert end_of(pair).result is OperationResult.ACHIEVED
    (listed,) = pair.all(LogsListed)
    first, kept = first_id(autopilot), pair.copter.logbook.logs
    assert [log.log_id for log in listed.logs] == list(range(first, first + 15))
    assert [log.size_bytes for log in listed.logs] == [len(log.data) for log in kept]
    if autopilot == "px4":
        assert [log.time_utc_s for log in listed.logs] == [log.begun_unix_s for log in kept]


def test_mavftp_lists_them_where_log_requests_are_not_answered() -> None:
    pair = flown("px4", flights=0)
    pair.vehicle.logs.list_logs(pair.now)
    assert end_of(pair).result is OperationResult.ACHIEVED
    assert pair.all(LogsListed) == [LogsListed(())]


def downloading_what_is_open(autopilot: str) -> VehiclePair:
    """A download by MAVFTP has begun of a file that another station has opened."""
    pair = flown(autopilot, means=LogMeans.FTP)
    log = the_log(pair)
    pair.copter.link.write(ftp_request(FtpOp.OPEN_TO_READ, log.path))
    pair.run_for(1.0)
    pair.vehicle.logs.download(log, 0, pair.now)
    return pair


def test_a_file_that_another_station_has_open_is_waited_for() -> None:
    pair = downloading_what_is_open("px4")
    pair.run_for(5.0)
    assert not pair.all(LogChunkReceived)
    pair.copter.link.write(ftp_request(FtpOp.TERMINATE))
    assert end_of(pair).result is OperationResult.ACHIEVED
    assert received(pair) == bytes(pair.copter.logbook.logs[0].data)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_file_that_was_left_open_is_closed_by_waiting(autopilot: str) -> None:
    pair = downloading_what_is_open(autopilot)
    assert end_of(pair).result is OperationResult.ACHIEVED


def test_a_file_that_stays_open_elsewhere_is_given_up() -> None:
    pair = downloading_what_is_open("px4")
    while not pair.all(LogTransferEnded) and pair.now < 200.0:
        pair.copter.link.write(ftp_request(FtpOp.LIST, "/fs"))  # the other station works on
        pair.run_for(1.0)
    end = end_of(pair)
    assert end.result is OperationResult.TIMED_OUT
    assert "does not open /fs/microsd/log/" in end.reason
    assert end.reason.endswith("over MAVFTP: no sessions.")


@pytest.mark.parametrize(
    ("op", "error"),
    [(6, 2), (7, 10), (8, 2), (9, 8), (10, 2), (11, 2), (12, 1), (13, 3), (15, 10), (200, 1)],
)
def test_the_simulator_rejects_what_does_not_read(op: int, error: int) -> None:
    """Of a log, which is not its to change; nothing is open."""
    pair = flown("ardupilot", means=LogMeans.FTP)
    link = pair.copter.link
    link.read()
    link.write(ftp_request(op, "/APM/LOGS/00000001.BIN"))
    pair.simulation.run_for(0.1)
    answers = Codec(1, 191).decode(link.read())
    (answer,) = [m for m in answers if m.get_type() == "FILE_TRANSFER_PROTOCOL"]
    assert (answer.payload[3], answer.payload[5], answer.payload[12]) == (129, op, error)
    assert len(pair.copter.logbook.logs) == 1


_times = itertools.count(1.0)


def ftp_request(op: int, path: str = "") -> bytes:
    """A request of another station."""
    _, message = FtpLine(Address(255, 190, 1, 1), next(_times)).request(
        FtpOp.LIST, data=path.encode()
    )
    message.payload[3] = op
    return Codec(255, 190).encode(message)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("faults", [None, LOSSY, REORDERED])
@pytest.mark.parametrize("means", [LogMeans.LOG_REQUEST, LogMeans.FTP])
def test_a_log_is_downloaded_byte_for_byte(
    autopilot: str, faults: LinkFaults | None, means: LogMeans
) -> None:
    pair = flown(autopilot, faults, means=means)
    pair.vehicle.logs.download(the_log(pair), 0, pair.now)
    began = pair.now
    end = end_of(pair)
    assert end.result is OperationResult.ACHIEVED, end
    assert received(pair) == bytes(pair.copter.logbook.logs[0].data)
    rate = len(received(pair)) / (pair.now - began)
    print(f"{autopilot} {faults}: {len(received(pair))} bytes, {rate / 1e3:.1f} kB/s")
    assert pair.vehicle.heartbeats.alive


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("means", [LogMeans.LOG_REQUEST, LogMeans.FTP])
def test_a_download_is_resumed_where_it_ended(autopilot: str, means: LogMeans) -> None:
    pair = flown(autopilot, LOSSY, means=means)
    log = the_log(pair)
    pair.vehicle.logs.download(log, 0, pair.now)
    pair.run_until(lambda: len(pair.all(LogChunkReceived)) >= 2)
    pair.vehicle.logs.stop("test")
    pair.flush()
    start = received(pair)
    assert end_of(pair).result is OperationResult.CANCELLED
    pair.events.clear()
    pair.vehicle.logs.download(log, len(start), pair.now)
    assert end_of(pair).result is OperationResult.ACHIEVED
    assert start + received(pair, len(start)) == bytes(pair.copter.logbook.logs[0].data)
    assert 0 < len(start) < log.size_bytes


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("means", [LogMeans.LOG_REQUEST, LogMeans.FTP])
def test_arming_ends_a_download_and_the_answer_to_it(autopilot: str, means: LogMeans) -> None:
    pair = flown(autopilot, means=means)
    pair.copter.logbook.logs[0].data += bytes(300_000)
    pair.vehicle.logs.download(the_log(pair), 0, pair.now)
    pair.run_until(lambda: len(pair.all(LogChunkReceived)) >= 1)
    pair.copter.firmware.arm(force=True)
    end = end_of(pair)
    assert (end.result, end.reason) == (OperationResult.CANCELLED, "The vehicle was armed.")
    came = len(pair.all(LogChunkReceived))
    pair.run_for(5.0)
    assert len(pair.all(LogChunkReceived)) == came


def test_a_lost_link_ends_a_download() -> None:
    pair = flown("ardupilot")
    pair.vehicle.logs.download(the_log(pair), 0, pair.now)
    pair.copter.link.silent = True
    assert end_of(pair).reason == "The link to the autopilot was lost."


@pytest.mark.parametrize("means", [LogMeans.LOG_REQUEST, LogMeans.FTP])
def test_a_hang_of_our_own_machine_is_no_lost_link(means: LogMeans) -> None:
    """The driver runs its timers after a hang before it reads what has come meanwhile."""
    pair = flown("ardupilot", LOSSY, means=means)
    pair.vehicle.logs.download(the_log(pair), 0, pair.now)
    pair.run_until(lambda: len(pair.all(LogChunkReceived)) >= 2)
    pair.simulation.run_for(5.0)
    pair.clock.advance_to(pair.simulation.time_s)
    pair.vehicle.handle_timer(pair.now)
    end = end_of(pair)
    assert end.result is OperationResult.ACHIEVED, end
    assert received(pair) == bytes(pair.copter.logbook.logs[0].data)
    assert not pair.all(HeartbeatLost)
    # From then on silence counts.
    pair.copter.link.silent = True
    began = pair.now
    pair.run_until(lambda: not pair.vehicle.heartbeats.alive, 10.0)
    assert pair.now - began < 3.5


def test_a_restart_ends_a_download() -> None:
    pair = flown("ardupilot")
    log = the_log(pair)
    pair.copter.link.set_faults(LinkFaults(loss=0.5))
    pair.vehicle.logs.download(log, 0, pair.now)
    pair.flush()
    pair.reboot()
    assert end_of(pair).reason == "The autopilot restarted."


def test_the_simulated_ardupilot_ignores_requests_while_it_answers_one() -> None:
    pair = flown("ardupilot")
    station, link = Codec(255, 190), pair.copter.link
    ask = make("LOG_REQUEST_DATA", target_system=1, target_component=1, id=1, ofs=0, count=9000)
    other = make("LOG_REQUEST_DATA", target_system=1, target_component=1, id=1, ofs=900, count=90)
    link.read()
    link.write(station.encode(ask))
    link.write(station.encode(other))
    pair.simulation.run_for(1.0)
    offsets = [m.ofs for m in Codec(1, 191).decode(link.read()) if m.get_type() == "LOG_DATA"]
    assert offsets == list(range(0, 9000, 90))


def test_the_simulated_px4_gives_data_only_after_a_list() -> None:
    pair = flown("px4")
    station, link = Codec(255, 190), pair.copter.link
    ask = make("LOG_REQUEST_DATA", target_system=1, target_component=1, id=0, ofs=0, count=100)

    def answered() -> list[tuple[int, int]]:
        link.read()
        link.write(station.encode(ask))
        pair.simulation.run_for(0.2)
        data = [m for m in Codec(1, 191).decode(link.read()) if m.get_type() == "LOG_DATA"]
        return [(m.ofs, m.count) for m in data]

    assert answered() == []
    listing = make("LOG_REQUEST_LIST", target_system=1, target_component=1, start=0, end=0xFFFF)
    link.write(station.encode(listing))
    pair.simulation.run_for(0.2)
    assert answered() == [(0, 90), (90, 90)]
