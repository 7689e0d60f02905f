"""Goals over a signed link, and what becomes of those who have no key."""

from __future__ import annotations

import hashlib

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Codec, make
from mavlink_vehicle.io.links import open_link
from mavlink_vehicle.io.links.udp import UdpLink
from mavlink_vehicle.io.router import Router
from mavlink_vehicle.signing import Signing
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.udp_flight import HostileStation

pytestmark = pytest.mark.wide_but_first


KEY = hashlib.sha256(b"hangar 7").digest()
NOW_UNIX_S = 1_800_000_000.0
NOW = int((NOW_UNIX_S - 1_420_070_400) * 1e5)
FIRMWARES = ("ardupilot", "px4")


class SignedFlight(SimulatedFlight):
    """Server and vehicle with one key; the vehicle was given it over a cable before."""

    def __init__(
        self, autopilot: str, vehicle_behind_s: float = 0.0, vehicle_key: bytes = KEY
    ) -> None:
        """Start both."""
        super().__init__(simulated=VehicleConfig(ready_after_s=1.0, autopilot=autopilot))
        self.codec = Codec(1, 191, Signing(KEY, lambda: NOW_UNIX_S + self.now))
        told = make(
            "SETUP_SIGNING",
            target_system=1,
            target_component=1,
            secret_key=list(vehicle_key),
            initial_timestamp=NOW - int(vehicle_behind_s * 1e5),
        )
        self.simulation.link.write(Codec(255, 190).encode(told))

    def hear(self, data: bytes) -> None:
        """Let bytes come in as from the vehicle's link."""
        for message in self.codec.decode(data):
            self.bridge.receive(message, self.now)


@pytest.mark.parametrize("autopilot", FIRMWARES)
def test_a_goal_is_flown_signed(autopilot: str) -> None:
    flight = SignedFlight(autopilot)
    flight.ready()
    end = flight.run_to_end(flight.send(10.0, 5.0, 3.0))
    assert end.code is OutcomeCode.SUCCESS, end.message
    counts = flight.codec.statistics
    assert (counts.badly_signed, counts.replayed) == (0, 0)
    assert counts.unsigned < 100, "what the vehicle said before it knew the key"


@pytest.mark.parametrize("autopilot", FIRMWARES)
def test_a_vehicle_whose_clock_stands_an_hour_behind_is_heard_soon(autopilot: str) -> None:
    flight = SignedFlight(autopilot, vehicle_behind_s=3600.0)
    flight.ready()
    end = flight.run_to_end(flight.send(5.0, 0.0, 3.0))
    assert end.code is OutcomeCode.SUCCESS, end.message


@pytest.mark.parametrize("firmware", ["px4-1.18", "ardupilot-4.7"])
def test_a_key_that_comes_in_flight_disturbs_no_goal(firmware: str) -> None:
    """Somebody sends one to a vehicle and a server without any."""
    simulated = VehicleConfig(
        autopilot=firmware.partition("-")[0], firmware=firmware, ready_after_s=1.0
    )
    flight = SimulatedFlight(simulated=simulated).ready()
    goal = flight.send(20.0, 0.0, 3.0)
    flight.run_to_status(goal, "NAVIGATING")
    key = make(
        "SETUP_SIGNING", target_system=1, target_component=1, secret_key=list(KEY),
        initial_timestamp=NOW,
    )  # fmt: skip
    flight.simulation.link.write(Codec(255, 190).encode(key))
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message


@pytest.mark.parametrize("autopilot", FIRMWARES)
def test_neither_silence_nor_lies_of_strangers_disturb_a_signed_goal(autopilot: str) -> None:
    """They speak as the vehicle, unsigned, with another key, and with what it said before."""
    flight = SignedFlight(autopilot)
    flight.ready()
    overheard: list[bytes] = []
    flight.codec.frame_observer = overheard.append
    goal = flight.send(25.0, 0.0, 3.0)
    flight.run_to_status(goal, "NAVIGATING")
    before = flight.codec.statistics
    taken = (before.unsigned, before.badly_signed, before.replayed)
    strangers = [Codec(1, 1), Codec(1, 1, Signing(bytes(range(32)), lambda: NOW_UNIX_S + 999.0))]
    lies = [
        make("HEARTBEAT", type=2, autopilot=3, base_mode=81, custom_mode=9, system_status=5),
        make("LOCAL_POSITION_NED", time_boot_ms=10**6, x=900.0, y=900.0, z=-500.0),
        make("ATTITUDE", time_boot_ms=10**6, roll=3.0),
        make("COMMAND_ACK", command=176, result=4),
        make("EXTENDED_SYS_STATE", landed_state=1),
    ]
    for turn in range(100):
        for stranger in strangers:
            for lie in lies:
                flight.hear(stranger.encode(lie))
        flight.hear(overheard[turn])
        flight.run_for(0.02)
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message
    after = flight.codec.statistics
    told = (after.unsigned, after.badly_signed, after.replayed)
    assert [b - a for a, b in zip(taken, told, strict=True)] == [500, 500, 100]


def test_strangers_on_the_port_of_a_vehicle_are_counted_with_it() -> None:
    """None of what they say is believed, not even who they are."""
    links = [open_link("udpin://127.0.0.1:0")]
    signing = Signing(KEY, lambda: NOW_UNIX_S)
    router = Router(links, lambda: Codec(1, 191, signing))
    assert isinstance(links[0], UdpLink)
    beat = make("HEARTBEAT", type=2, autopilot=3)
    parties = [HostileStation(links[0].port, 1, 1) for _ in range(4)]
    known, unsigned, forger, echo = parties
    frame = Codec(1, 1, Signing(KEY, lambda: NOW_UNIX_S)).encode(beat)
    known.write(frame)
    received = router.receive(0.0)
    unsigned.send(beat, beat)
    forger.write(Codec(1, 1, Signing(bytes(32), lambda: NOW_UNIX_S)).encode(beat))
    echo.write(frame * 3)
    router.poll(1.0)
    received += router.receive(1.0)
    for now in (1.0, 20.0, 40.0, 41.0):
        counts = router.statistics.of_system(1)
        told = (counts.frames, counts.unsigned, counts.badly_signed, counts.replayed)
        assert told == (1, 2, 1, 3), "also when they are forgotten"
        router.poll(now)
        known.write(b"-")
        received += router.receive(now)
    assert len(received) == 1
    router.close()
    for party in parties:
        party.close()


def test_a_link_has_one_number_in_signatures_whoever_comes_and_goes() -> None:
    """An autopilot follows 16 streams and no more; a peer that reconnects must not be a new one."""
    links = [open_link("udpin://127.0.0.1:0") for _ in range(2)]
    signing = Signing(KEY, lambda: NOW_UNIX_S)
    router = Router(links[:1], lambda: Codec(1, 191, signing), links[1:])
    numbers: list[set[int]] = [set(), set()]
    for turn in range(20):
        for link, seen in zip(links, numbers, strict=True):
            assert isinstance(link, UdpLink)
            peer = HostileStation(link.port)
            peer.write(b"-")
            router.poll(turn * 40.0)
            router.receive(turn * 40.0)
            router.overhear(turn * 40.0)
            router.send(make("HEARTBEAT", type=6))
            seen.update(frame[-13] for frame in peer.read())
            peer.close()
    assert numbers == [{0}, {1}]
    router.close()


@pytest.mark.parametrize("autopilot", FIRMWARES)
def test_a_vehicle_with_another_key_is_never_heard(autopilot: str) -> None:
    flight = SignedFlight(autopilot, vehicle_key=bytes(range(32)))
    flight.run_for(10.0)
    assert flight.bridge.pose is None
    assert flight.codec.statistics.badly_signed > 20
    assert flight.check(flight.request(1.0, 0.0, 3.0)) is not None
