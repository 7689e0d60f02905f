"""Two ground stations with one system id are noticed, and nobody else."""

from __future__ import annotations

import socket
import threading
from contextlib import ExitStack

from pymavlink.dialects.v10 import all as mav1
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation
from mavlink_sitl.links.addresses import parse_address
from mavlink_sitl.links.senders import WINDOW_S, Senders
from mavlink_sitl.wall_clock_link import Runner

LIMIT_S = 200.0


def beat(system: int, component: int = 190, version: int = 2) -> bytes:
    dialect = mav if version == 2 else mav1
    message = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    return bytes(message.pack(dialect.MAVLink(None, system, component)))


def warnings(*heard: tuple[bytes, str, float]) -> list[str]:
    senders = Senders([1])
    return [text for each in heard if (text := senders.hear(*each)) is not None]


def test_two_that_speak_by_turns_are_warned_of_once() -> None:
    turns = [(beat(255, 190 + i % 2, 1 + i % 2), "ab"[i % 2], i * 0.5) for i in range(20)]
    (text,) = warnings(*turns)
    assert text.startswith("two ground stations have the system id 255, at a and b")


def test_one_that_comes_back_from_another_address_is_not() -> None:
    moves = [(beat(255), "a", 0.0), (beat(255), "b", 1.0), (beat(255), "b", 2.0)]
    assert not warnings(*moves, (beat(255), "a", 2.0 + WINDOW_S))


def test_other_ids_parts_of_the_vehicle_and_noise_are_not() -> None:
    for sender in (beat, lambda _: b"\xfd" + bytes(3)):
        turns = [(sender(250 + i % 2), "ab"[i % 2], i * 0.5) for i in range(20)]
        assert not warnings(*turns)
    assert not warnings(*[(beat(1, 191), "ab"[i % 2], i * 0.5) for i in range(20)])


def test_the_runner_warns_of_two_stations_on_two_sockets() -> None:
    warned = threading.Event()
    texts: list[str] = []

    def warn(text: str) -> None:
        texts.append(text)
        warned.set()

    simulation = Simulation(seed=1)
    runner = Runner(simulation, [parse_address("udpin://127.0.0.1:0")], 1.0, lambda: None, warn)
    address = runner.endpoints[0].describe().removeprefix("udpin://").split(":")
    thread = threading.Thread(target=runner.run, daemon=True)
    with ExitStack() as stack:
        stack.callback(runner.close)
        stack.callback(thread.join, LIMIT_S)
        stack.callback(runner.stop)
        stations = [
            stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2)
        ]
        thread.start()
        for number in range(60):
            stations[number % 2].sendto(beat(255), (address[0], int(address[1])))
            if warned.wait(0.1):
                break
        assert warned.is_set()
    assert "system id 255, at 127.0.0.1:" in texts[0]
