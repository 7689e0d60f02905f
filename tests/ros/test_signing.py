"""A server with a key, a vehicle with the same, and ground stations with it and without."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray

from drone_navigation.processes import free_udp_port
from mavlink_vehicle.codec import Message, make
from tests.support.processes import Process
from tests.support.ros.ros_flight import READY_TIMEOUT_S, Flight, navigate_goal
from tests.support.stations.pymavlink_station import PymavlinkStation

pytestmark = [pytest.mark.wide, pytest.mark.xdist_group("ros_signing")]

PASSPHRASE = "hangar 7"
KEY = hashlib.sha256(PASSPHRASE.encode()).digest()
EPOCH_UNIX_S = 1_420_070_400
DO_SET_MODE = 176
LAND = 9


class SignedFlight(Flight):
    """Server and vehicle have one key; the vehicle was given it by cable."""

    def __init__(self, folder: Path) -> None:
        """Start both."""
        key_file = folder / "key"
        key_file.write_text(PASSPHRASE + "\n")
        key_file.chmod(0o600)
        self.station_port = free_udp_port()
        self.diagnostics: list[DiagnosticArray] = []
        super().__init__(
            folder,
            "--ros-args",
            "-p", f"signing_key_file:={key_file}",
            "-p", f"gcs_links:=['udpin://127.0.0.1:{self.station_port}']",
            "--",
        )  # fmt: skip
        self.subscribe(DiagnosticArray, "/diagnostics", self.diagnostics.append, 10)

    def start_simulator(self) -> Process:
        """Start a vehicle and give it the key."""
        process = super().start_simulator()
        limit_s = time.monotonic() + READY_TIMEOUT_S
        while not self.relay.from_vehicle("HEARTBEAT"):
            assert time.monotonic() < limit_s, process.text
            time.sleep(0.05)
        told = make(
            "SETUP_SIGNING",
            target_system=1,
            target_component=1,
            secret_key=list(KEY),
            initial_timestamp=int((time.time() - EPOCH_UNIX_S) * 1e5),
        )
        self.relay.send_to_vehicle(told)
        return process

    def dropped(self) -> list[int]:
        """Return the greatest counts that the newest diagnostics report of a link."""
        self.diagnostics.clear()
        self.wait(lambda: len(self.diagnostics) > 1, 5.0, "diagnostics")
        found = [v for one in self.diagnostics for status in one.status for v in status.values]
        return [
            max(int(value.value) for value in found if value.key == f"{name} messages since start")
            for name in ("unsigned", "wrongly signed", "replayed")
        ]


@pytest.fixture(scope="module")
def signed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SignedFlight]:
    flight = SignedFlight(tmp_path_factory.mktemp("signed"))
    yield flight
    flight.close()


def set_mode(mode: int) -> Message:
    return make(
        "COMMAND_LONG",
        target_system=1,
        target_component=1,
        command=DO_SET_MODE,
        param1=1.0,
        param2=float(mode),
    )


def test_commands_without_the_key_or_for_the_second_time_do_nothing(signed: SignedFlight) -> None:
    trusted = PymavlinkStation(signed.station_port, KEY, system=253)
    stranger = PymavlinkStation(signed.station_port, None, system=252)
    forger = PymavlinkStation(signed.station_port, bytes(range(32)), system=251)
    trusted.send(make("HEARTBEAT", type=6, autopilot=8))
    assert trusted.hear("HEARTBEAT").get_srcSystem() == 1
    trusted.send(set_mode(LAND))
    landing = trusted.sent[-1]
    assert trusted.hear("COMMAND_ACK").result == 0

    before = signed.dropped()
    record = signed.send(navigate_goal(6.0, 0.0, 3.0))
    signed.wait_for_status(record, "NAVIGATING")
    for _ in range(20):
        stranger.send(set_mode(LAND))
        forger.send(set_mode(LAND))
        trusted.write(landing)
        signed.spin_for(0.05)
    result = signed.wait_for_result(record)
    assert result.success, result.message
    after = signed.dropped()
    assert [b - a for a, b in zip(before, after, strict=True)] == [20, 20, 20]
    for station in (trusted, stranger, forger):
        station.close()


def test_a_command_with_the_key_is_obeyed(signed: SignedFlight) -> None:
    trusted = PymavlinkStation(signed.station_port, KEY, system=250)
    record = signed.send(navigate_goal(-15.0, 0.0, 3.0))
    signed.wait_for_status(record, "NAVIGATING")
    trusted.send(set_mode(LAND))
    result = signed.wait_for_result(record)
    assert result.message.startswith("PILOT_OVERRIDE: "), result.message
    trusted.close()
