"""Hostile ground stations are counted, and do nothing else to an active goal."""

from __future__ import annotations

import random
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Codec, Message, make, mavlink, with_source
from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.io.links import open_link
from mavlink_vehicle.io.links.udp import UdpLink
from mavlink_vehicle.io.router import Router
from mavlink_vehicle.protocols.stations.overheard import HEARD
from mavlink_vehicle.vehicle import Vehicle
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.udp_flight import HostileStation, UdpFlight, udp_flight
from tests.support.messages.random_messages import CLASSES, STRANGE_FLOATS, random_message

pytestmark = pytest.mark.wide


FIRMWARES = {
    "ardupilot": (),
    "px4": ("--autopilot", "px4", "--param", "COM_OF_LOSS_T=4"),
}
LEG_M = 3.0
ALL_MISSIONS = 255
COMMANDS = (mavlink.MAVLINK_MSG_ID_COMMAND_INT, mavlink.MAVLINK_MSG_ID_COMMAND_LONG)
GOALS = pytest.mark.parametrize("by_mission", [False, True], ids=["setpoints", "mission"])


@pytest.fixture(scope="module", params=list(FIRMWARES.values()), ids=list(FIRMWARES))
def flight(request: Any) -> Iterator[UdpFlight]:
    """One vehicle in the air for all tests of a firmware."""
    with udp_flight(*request.param) as flight:
        flight.end(flight.send(0.0, 0.0, 5.0))
        yield flight


def fly_among(
    flight: UdpFlight,
    mischief: Callable[[], None],
    every_s: float = 0.0,
    by_mission: bool = False,
) -> None:
    """Fly a leg during which mischief is done again and again; it must be flown as ever.

    It begins before the goal does: mission upload and change of mode are among it.
    """
    here = flight.on_thread(lambda: flight.bridge.pose)
    assert here is not None
    x = -LEG_M if here.position_enu_m[0] > 0.0 else LEG_M
    over = threading.Event()

    def go_on() -> None:
        while not over.wait(every_s):
            mischief()

    villain = threading.Thread(target=go_on)
    villain.start()
    try:
        end = flight.end(flight.send(x, 0.0, 5.0, by_mission))
    finally:
        over.set()
        villain.join()
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert by_mission or flight.setpoints() > 20
    assert flight.errors == []


def to_us(name: str, **fields: object) -> Message:
    return make(name, target_system=1, target_component=191, **fields)


def to_vehicle(name: str, **fields: object) -> Message:
    return make(name, target_system=1, target_component=1, **fields)


def test_a_station_that_floods_is_throttled(flight: UdpFlight) -> None:
    station = flight.station()
    beat = station.codec.encode(make("HEARTBEAT", type=6, autopilot=8)) * 20
    before = flight.counts()

    def flood() -> None:
        for _ in range(20):
            station.write(beat)

    fly_among(flight, flood, every_s=0.01)
    after = flight.counts()
    assert after.throttled - before.throttled > 10_000
    assert after.frames > before.frames


def test_garbage_old_packets_and_false_names_are_counted_and_not_believed(
    flight: UdpFlight,
) -> None:
    """One babbles, one echoes what it hears, and two speak as the server and the vehicle."""
    babbler, echo = flight.station(253), flight.station(252)
    source = random.Random(1)
    frame = babbler.codec.encode(make("STATUSTEXT", text="x" * 50))
    echo.send(make("HEARTBEAT", type=6, autopilot=8))
    heard: list[bytes] = []
    liars = [flight.station(1, 191), flight.station(1, 1)]
    lies = [
        make("HEARTBEAT", type=2, autopilot=3, base_mode=81, custom_mode=9, system_status=6),
        make("LOCAL_POSITION_NED", time_boot_ms=2**31, x=900.0, y=900.0, z=-500.0),
        make("GLOBAL_POSITION_INT", time_boot_ms=2**31, lat=1, lon=1, alt=1),
        make("EXTENDED_SYS_STATE", landed_state=1),
        make("SYS_STATUS", battery_remaining=1),
        make("STATUSTEXT", severity=0, text="Failsafe: Land"),
        to_vehicle("COMMAND_LONG", command=176, param1=1.0, param2=9.0),
        to_vehicle("MISSION_CLEAR_ALL", mission_type=ALL_MISSIONS),
        to_vehicle("SET_POSITION_TARGET_LOCAL_NED", coordinate_frame=1, x=500.0),
    ]
    before = flight.counts()

    def disturb() -> None:
        bent = bytearray(frame)
        bent[source.randrange(10, len(bent))] ^= 0x10
        babbler.write(bytes(bent))
        babbler.write(frame[: source.randrange(len(frame))])
        babbler.write(source.randbytes(source.randrange(1, 300)))
        new = echo.read()
        heard.extend(new)
        for data in new + heard[:10]:
            echo.write(data)
        for liar in liars:
            liar.send(*lies)

    fly_among(flight, disturb, every_s=0.03)
    after = flight.counts()
    assert after.bad_crc > before.bad_crc
    assert after.bytes_dropped > before.bytes_dropped
    assert len(heard) > 50
    assert after.looped > before.looped, "the server's own HEARTBEATs among what the echo heard"
    assert after.spoofed - before.spoofed > 200


@GOALS
def test_endless_missions_are_rejected_and_forged_answers_are_for_nobody(
    flight: UdpFlight, by_mission: bool
) -> None:
    """The answers are addressed to the server, and say no to what it asks the vehicle."""
    liars = [flight.station(), flight.station(1, 1), flight.station(1, 190)]
    sayings = [
        to_vehicle("MISSION_COUNT", count=65535),
        to_vehicle("MISSION_ITEM_INT", seq=0, frame=6, command=16),
        to_vehicle("MISSION_ITEM_INT", seq=65534, frame=6, command=16),
        to_us("MISSION_COUNT", count=65535),
        to_us("MISSION_ITEM_INT", seq=0, frame=6, command=16),
        *(
            to_us("COMMAND_ACK", command=command, result=result)
            for command in (22, 176, 192, 246, 400, 511, 512)
            for result in (4, 5)
        ),
        to_us("MISSION_ACK", type=0),
        to_us("MISSION_ACK", type=15),
        to_us("MISSION_REQUEST_INT", seq=3),
        make("TIMESYNC", tc1=10**15, ts1=1),
        make("TIMESYNC", tc1=0, ts1=10**15),
        make("PARAM_VALUE", param_id="FENCE_ENABLE", param_value=1.0, param_count=1),
        make("PARAM_VALUE", param_id="WPNAV_SPEED", param_value=1.0, param_type=9),
        make("PARAM_VALUE", param_id="MPC_XY_CRUISE", param_value=0.1, param_type=9),
    ]
    before = flight.on_thread(lambda: dict(flight.bridge.vehicle.parameters.values))

    def say() -> None:
        for liar in liars:
            liar.send(*sayings)
            liar.read()

    fly_among(flight, say, 0.05, by_mission)
    assert flight.on_thread(lambda: dict(flight.bridge.vehicle.parameters.values)) == before


@pytest.mark.night  # beside other tests the server on a slow machine is late itself, and says so
def test_two_hundred_and_fifty_stations_at_once_disturb_nobody(flight: UdpFlight) -> None:
    stations = [flight.station(system) for system in range(2, 256)]
    before = flight.counts()

    def all_speak() -> None:
        for station in stations:
            station.send(
                make("HEARTBEAT", type=6, autopilot=8),
                to_vehicle("PARAM_REQUEST_READ", param_id="SYSID_THISMAV", param_index=-1),
            )
            station.read()

    fly_among(flight, all_speak, every_s=0.5)
    assert flight.counts().frames > before.frames


class Eavesdropper:
    """A vehicle that is found, and the router between it and a ground station; no thread."""

    def __init__(self) -> None:
        """Let the vehicle be heard."""
        links = [open_link("udpin://127.0.0.1:0") for _ in range(2)]
        ports = [link.port for link in links if isinstance(link, UdpLink)]
        self.station_port = ports[1]
        self.router = Router(links[:1], lambda: Codec(1, 191), links[1:])
        self.vehicle = Vehicle()
        self.vehicle.start(0.0)
        self.autopilot = HostileStation(ports[0], 1, 1)
        self.station = HostileStation(ports[1])
        self.autopilot.send(
            make("HEARTBEAT", type=2, autopilot=3, base_mode=81, custom_mode=4, system_status=4),
            make("GLOBAL_POSITION_INT", time_boot_ms=1000, lat=10**8, lon=10**8, alt=5000),
            make("LOCAL_POSITION_NED", time_boot_ms=1000, x=1.0),
        )
        self.now = 1.0
        while self.vehicle.state.system_id == 0 or self.vehicle.state.local_position is None:
            self.turn()

    def turn(self) -> int:
        """Take what has come; returns how much of it came from the vehicle."""
        received: list[Any] = [*self.router.receive(self.now)]
        for message in received:
            self.vehicle.receive(message, self.now)
        overheard: list[Any] = [*self.router.overhear(self.now)]
        for message in overheard:
            self.vehicle.overhear(message, self.now)
        return len(received)

    def counts(self) -> LinkStatistics:
        """Return what was counted of the ground stations."""
        return self.router.statistics.station_links()[0][1]

    def close(self) -> None:
        """Close the sockets."""
        self.router.close()
        self.autopilot.close()
        self.station.close()


@pytest.fixture(scope="module")
def eavesdropper() -> Iterator[Eavesdropper]:
    eavesdropper = Eavesdropper()
    yield eavesdropper
    eavesdropper.close()


def test_what_is_passed_on_to_stations_is_bounded_and_the_vehicle_still_hears_all(
    eavesdropper: Eavesdropper,
) -> None:
    """Each of many stations talks to all others, which grows with their square."""
    stations = [HostileStation(eavesdropper.station_port, system) for system in range(2, 102)]
    before = eavesdropper.counts()
    eavesdropper.autopilot.read()
    heard: list[bytes] = []
    for _ in range(3):
        eavesdropper.now += 0.1
        for station in stations:
            station.send(make("HEARTBEAT", type=6, autopilot=8))
        eavesdropper.turn()
        eavesdropper.turn()
        heard += eavesdropper.autopilot.read()
    after = eavesdropper.counts()
    assert after.frames - before.frames == 300
    assert after.withheld > before.withheld
    sources = [m.get_srcSystem() for data in heard for m in Codec(1, 1).decode(data)]
    assert sum(source in range(2, 102) for source in sources) == 300
    for station in stations:
        station.close()


SOURCES = st.one_of(
    st.sampled_from([(1, 1), (1, 191), (1, 190), (255, 190)]),
    st.tuples(st.integers(1, 255), st.integers(1, 255)),
)
SAYINGS = st.tuples(st.sampled_from(CLASSES), st.integers(0, 2**16), SOURCES)


@given(st.lists(st.one_of(SAYINGS, st.binary(min_size=1, max_size=80)), min_size=1, max_size=20))
@settings(max_examples=100, deadline=None)
def test_nothing_that_a_station_says_is_taken_for_telemetry(
    eavesdropper: Eavesdropper, sayings: list[bytes | tuple[type[Message], int, tuple[int, int]]]
) -> None:
    before = eavesdropper.vehicle.state
    for saying in sayings:
        if isinstance(saying, bytes):
            eavesdropper.station.write(saying)
            continue
        cls, seed, source = saying
        message = random_message(cls, seed, STRANGE_FLOATS)
        eavesdropper.station.send(with_source(message, *source))
    eavesdropper.now += 0.2
    assert eavesdropper.turn() == 0
    assert eavesdropper.vehicle.state is before


def addressed(cls: Any, seed: int) -> Message:
    """Return a message to the vehicle with random content, likely enough to mean something."""
    source = random.Random(seed)
    message = random_message(cls, seed, STRANGE_FLOATS)
    likely: dict[str, tuple[float, ...]] = {
        "target_system": (1,),
        "target_component": (1,),
        "mission_type": (0, 0, 1, 255),
        "param1": (0.0, 1.0),
    }
    if cls.id in COMMANDS:
        likely["command"] = (20, 21, 22, 176, 192, 193, 193, 224, 252, 300, 400)
        likely["param2"] = (*(float(n) for n in range(10)), float(4 << 16), float(3 << 24))
    for name, values in likely.items():
        if name in cls.fieldnames:
            setattr(message, name, source.choice(values))
    return with_source(message, 255, 190)


@pytest.mark.parametrize("autopilot", FIRMWARES)
def test_whatever_stations_say_a_goal_ends_once_and_the_next_is_flown(autopilot: str) -> None:
    """The vehicle itself hears none of it: only what the server makes of it is tried here."""
    simulated = VehicleConfig(ready_after_s=1.0, autopilot=autopilot)
    flight = SimulatedFlight(simulated=simulated, on_station_pause="pause").ready()
    flight.run_for(3.0)
    station, ear = Codec(255, 190), Codec(1, 191)
    goals = [flight.send(30.0, 0.0, 4.0)]
    kinds = sorted(HEARD, key=lambda cls: int(cls.id))
    order = [(cls, seed) for cls in kinds for seed in range(30 if cls.id in COMMANDS else 8)]
    random.Random(1).shuffle(order)
    for cls, seed in order:
        (message,) = ear.decode(station.encode(addressed(cls, seed)))
        flight.bridge.overhear(message, flight.now)
        flight.run_for(0.05)
        if flight.bridge.goals.active_id is None and len(goals) < 50:
            goals.append(flight.send(30.0 if len(goals) % 2 else -30.0, 0.0, 4.0))
    assert len(goals) > 1, "some of it has stopped a goal"
    last = flight.send(0.0, 0.0, 5.0)
    assert flight.run_to_end(last).code is OutcomeCode.SUCCESS
    assert [len(flight.ends(goal)) for goal in goals] == [1] * len(goals)
