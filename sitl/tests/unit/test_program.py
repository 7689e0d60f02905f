"""`python -m mavlink_sitl` as a process, over real sockets, with pymavlink's own client."""

from __future__ import annotations

import io
import math
import re
import signal
import socket
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation
from mavlink_sitl.command_line.options import parse
from mavlink_sitl.simulation import EPOCH_US
from sitl_support.programs import WAIT_S, client, free_udp_port, running
from sitl_support.tlogs import read_records

TRIES = 5


def command(connection: Any, number: int, *params: float) -> int:
    """Send a command, and again without an answer: a socket that is not read overflows."""
    values = [*params, *([0.0] * (7 - len(params)))]
    for confirmation in range(TRIES):
        connection.mav.command_long_send(1, 1, number, confirmation, *values)
        ack = connection.recv_match(
            type="COMMAND_ACK",
            condition=f"COMMAND_ACK.command == {number}",
            blocking=True,
            timeout=WAIT_S / TRIES,
        )
        if ack is not None:
            return int(ack.result)
    raise AssertionError(f"no answer to command {number}")


def heartbeat(connection: Any) -> Any:
    message = connection.recv_match(type="HEARTBEAT", blocking=True, timeout=WAIT_S)
    assert message is not None
    return message


def climb(connection: Any) -> None:
    """GUIDED, arm, take off, until it is 3 m high."""
    ready = "EKF3 IMU1 is using GPS"
    while connection.recv_match(type="STATUSTEXT", blocking=True, timeout=WAIT_S).text != ready:
        pass
    assert command(connection, mav.MAV_CMD_DO_SET_MODE, 1, 4) == 0
    assert command(connection, mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0
    assert command(connection, mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 4) == 0
    assert command(connection, mav.MAV_CMD_SET_MESSAGE_INTERVAL, 32, 1e5) == 0
    for _ in range(1000):
        message = connection.recv_match(type="LOCAL_POSITION_NED", blocking=True, timeout=WAIT_S)
        assert message is not None
        if message.z < -3.0:
            return
    pytest.fail("it did not climb")


def test_a_flight_over_udp_recorded_and_ended_by_sigterm(tmp_path: Path) -> None:
    log = tmp_path / "flight.tlog"
    port = free_udp_port()
    with (
        client(f"udpin:127.0.0.1:{port}") as connection,
        running(
            "--link", f"udpout:127.0.0.1:{port}", "--speedup", "20", "--tlog", str(log)
        ) as program,
    ):
        assert program.first_line.endswith(f"vehicle 1: ArduCopter on udpout://127.0.0.1:{port}")
        climb(connection)
        printed = program.end()
    for word in ("ready", "armed", "mode GUIDED", "takeoff", "ended"):
        assert re.search(rf"s  (vehicle 1: )?{word}$", printed, re.MULTILINE), printed
    assert "\033" not in printed, "no colour where there is no terminal"
    frames = [frame for _, frame in read_records(log.read_bytes())]
    assert {frame[5] for frame in frames} == {1, 255}


@pytest.mark.wide
@pytest.mark.parametrize("speedup", ["10", "50", "1000"])
def test_at_any_speed_the_same_inputs_give_the_same_bytes(speedup: str, tmp_path: Path) -> None:
    """The bytes from the socket, flown again in-process at the logged times, give the same log."""
    log, again = tmp_path / "flight.tlog", io.BytesIO()
    port = free_udp_port()
    options = ("--speedup", speedup, "--seed", "11", "--ready-after", "1", "--wind", "4,200,1")
    with (
        client(f"udpin:127.0.0.1:{port}") as connection,
        running("--link", f"udpout:127.0.0.1:{port}", "--tlog", str(log), *options) as program,
    ):
        climb(connection)
        program.end()
    flown = log.read_bytes()
    arguments, _ = parse(options)
    simulation = Simulation(arguments.vehicles, arguments.seed, again, world=arguments.world)
    for unix_time_us, frame in read_records(flown):
        simulation.run_to_us(unix_time_us - EPOCH_US)
        if frame[5] == 255:
            simulation.link.write(frame)
    assert len(flown) > 2_000
    assert again.getvalue()[: len(flown)] == flown


def wait_for_mode(connection: Any, custom_mode: int) -> Any:
    """The first heartbeat with a mode."""
    for _ in range(600):
        beat = heartbeat(connection)
        if beat.custom_mode == custom_mode:
            return beat
    pytest.fail("the mode did not come")


@pytest.mark.night
def test_a_px4_plane_takes_off_over_udp() -> None:
    port, takeoff, hold = free_udp_port(), 0x02040000, 0x03040000
    with (
        client(f"udpin:127.0.0.1:{port}") as connection,
        running(
            "--vehicle",
            "plane",
            "--autopilot",
            "px4",
            "--ready-after",
            "1",
            # An emulated ARM64 station loses frames at 20 times real time, the mode's among them.
            "--speedup",
            "8",
            "--link",
            f"udpout:127.0.0.1:{port}",
        ) as program,
    ):
        assert "PX4 plane" in program.first_line
        assert heartbeat(connection).type == 1
        wait_for_mode(connection, hold)
        while heartbeat(connection).system_status != 3:
            pass
        assert command(connection, mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, *[math.nan] * 4) == 0
        assert command(connection, mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0
        assert wait_for_mode(connection, takeoff).base_mode & 128
        wait_for_mode(connection, hold)
        printed = program.end()
    assert re.search(r"s  (vehicle 1: )?takeoff$", printed, re.MULTILINE), printed


def test_a_flight_over_tcp_with_two_clients() -> None:
    with running("--link", "tcpin://127.0.0.1:0", "--speedup", "20") as program:
        address = f"tcp:127.0.0.1:{program.port}"
        with client(address) as connection, client(address) as listener:
            heartbeat(listener)
            climb(connection)
            heartbeat(listener)
        with client(address) as another:
            assert heartbeat(another).custom_mode == 4, "it flies on when clients leave"


def test_a_listening_udp_link_answers_who_speaks() -> None:
    with (
        running("--link", "udpin://127.0.0.1:0", "--speedup", "20") as program,
        client(f"udpout:127.0.0.1:{program.port}") as connection,
    ):
        connection.mav.heartbeat_send(6, 8, 0, 0, 4)
        heartbeat(connection)
        assert command(connection, 31999) == 3


@pytest.mark.night
def test_every_link_carries_telemetry_and_the_answers_of_who_asks_on_it() -> None:
    port = free_udp_port()
    with (
        client(f"udpin:127.0.0.1:{port}") as one,
        running("--link", f"udpout://127.0.0.1:{port}", "--link", "tcpin://127.0.0.1:0") as program,
        client(f"tcp:127.0.0.1:{program.port}") as other,
    ):
        heartbeat(one)
        heartbeat(other)
        assert command(other, 31999) == 3
        heartbeat(one)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_cleanly_even_when_it_has_much_to_do(number: int) -> None:
    with running("--link", "udpin://127.0.0.1:0", "--speedup", "1000") as program:
        while "ready" not in program.line():
            pass
        assert program.end(number).rstrip().endswith("ended")


@pytest.mark.night
def test_it_flies_on_when_nobody_reads_its_lines() -> None:
    with running("--link", "tcpin://127.0.0.1:0", "--speedup", "20") as program:
        assert program.process.stdout is not None
        program.process.stdout.close()
        with client(f"tcp:127.0.0.1:{program.port}") as connection:
            climb(connection)
        program.process.terminate()
        assert program.process.wait(WAIT_S) == 0


@pytest.mark.night
def test_it_flies_on_without_a_listener() -> None:
    with running("--link", f"udpout://127.0.0.1:{free_udp_port()}", "--speedup", "20") as program:
        while "ready" not in program.line():
            pass
        program.end()


def test_garbage_on_every_kind_of_link_does_not_stop_it() -> None:
    noise = bytes(range(256)) * 20 + b"\xfd\xff\x00" * 50
    with running("--link", "udpin://127.0.0.1:0", "--speedup", "20") as program:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for size in (0, 1, 100, 5000):
                sender.sendto(noise[:size], ("127.0.0.1", program.port))
        with client(f"udpout:127.0.0.1:{program.port}") as connection:
            assert command(connection, 31999) == 3
    with running("--link", "tcpin://127.0.0.1:0", "--speedup", "20") as program:
        with socket.create_connection(("127.0.0.1", program.port)) as sender:
            sender.sendall(noise)
        with client(f"tcp:127.0.0.1:{program.port}") as connection:
            assert command(connection, 31999) == 3


@pytest.mark.night
def test_quiet_prints_nothing() -> None:
    with running("--quiet", "--link", "tcpin://127.0.0.1:0", "--speedup", "abc") as program:
        assert "the speedup must be a number" in program.first_line
        assert program.process.wait(WAIT_S) == 2


def test_a_port_that_is_taken_gets_one_sentence() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"tcpin://127.0.0.1:{taken.getsockname()[1]}"
        with running("--link", address) as program:
            assert program.first_line == (
                f"mavlink_sitl: cannot open {address}: Address already in use"
            )
            assert program.process.wait(WAIT_S) == 2


def test_a_log_that_cannot_be_written_gets_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "no" / "such.tlog"
    with running("--tlog", str(path)) as program:
        assert program.first_line == (
            f"mavlink_sitl: cannot write {path}: the folder {path.parent} does not exist; create it"
        )
        assert program.process.wait(WAIT_S) == 2
