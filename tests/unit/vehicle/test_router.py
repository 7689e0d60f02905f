"""The router on real sockets with several vehicles and ground stations; waits have a limit."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from mavlink_vehicle.codec import MAVLINK_1_HEARTBEATS, Codec, in_mavlink_1, make
from mavlink_vehicle.io.links.udp import MAX_PEERS, PEER_EXPIRY_S
from mavlink_vehicle.io.ports import NEIGHBOUR_BURST, STATION_BURST
from mavlink_vehicle.io.tlog import TlogReader, TlogWriter
from mavlink_vehicle.signing import Signing
from tests.support.links.router_bench import (
    LOOPBACK,
    Party,
    Server,
    opened,
    ring_party,
    settle,
    station,
    until,
    vehicle,
)

UNKNOWN = bytes([0xFD, 2, 0, 0, 9, 1, 1, 0x31, 0xD4, 0, 1, 2, 0, 0])  # message 54321


@pytest.fixture
def closing() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def server(closing: ExitStack) -> Server:
    return opened(closing)


# Several vehicles on one port


def test_vehicles_on_one_port_get_only_their_own_setpoints(
    server: Server, closing: ExitStack
) -> None:
    fleet = [vehicle(closing, server, system) for system in (1, 2, 3)]
    for system in (1, 2, 3):
        for _ in range(5):
            server.send("SET_POSITION_TARGET_LOCAL_NED", target_system=system, target_component=1)
    for party, system in zip(fleet, (1, 2, 3), strict=True):
        until(server, lambda party=party: len(party.names()) >= 5)  # type: ignore[misc]
        setpoints = [m for m in party.heard if m.get_type() != "HEARTBEAT"]
        assert {m.target_system for m in setpoints} == {system}
        # No gaps: each peer's sequence is its own, or it would take us for a bad link.
        assert party.codec.statistics.lost_total == 0


def test_a_garbling_vehicle_does_not_disturb_the_quiet_one_on_its_port(
    server: Server, closing: ExitStack
) -> None:
    quiet, loud = vehicle(closing, server, 1), vehicle(closing, server, 2)
    for number in range(40):
        loud.send(b"\xfd\xff" + bytes(range(200)))
        loud.send(loud.codec.encode(make("ATTITUDE"))[:-1] + b"x")
        quiet.say("ATTITUDE", time_boot_ms=number)
    settle(server, quiet)
    heard = [m.time_boot_ms for m in server.received if m.get_type() == "ATTITUDE"]
    assert heard[-40:] == list(range(40))
    ours, theirs = (server.router.statistics.of_system(system) for system in (1, 2))
    assert (ours.bad_crc, ours.bytes_dropped, ours.lost_total) == (0, 0, 0)
    assert theirs.bytes_dropped > 0
    assert server.router.statistics.of_system(0).frames == ours.frames + theirs.frames


def test_a_vehicle_that_floods_its_port_is_throttled_and_its_neighbour_is_heard(
    server: Server, closing: ExitStack
) -> None:
    quiet, loud = vehicle(closing, server, 1), vehicle(closing, server, 2)
    flood = loud.codec.encode(make("HEARTBEAT", type=2, autopilot=12)) * 400
    # All at one moment: a slow machine sends no flood in real time.
    now_s = time.monotonic()
    for number in range(40):
        loud.send(flood)
        quiet.say("ATTITUDE", time_boot_ms=number)
        server.turn(now_s)
    settle(server, quiet)
    heard = [m.time_boot_ms for m in server.received if m.get_type() == "ATTITUDE"]
    assert heard == list(range(40))
    ours, theirs = (server.router.statistics.of_system(system) for system in (1, 2))
    assert ours.throttled == 0
    assert min(theirs.throttled, theirs.frames) > 0
    assert theirs.throttled + theirs.frames == 40 * 400 + 1


def test_a_vehicle_that_restarts_on_another_port_gets_its_setpoints_there(
    server: Server, closing: ExitStack
) -> None:
    before = vehicle(closing, server, 1)
    after = vehicle(closing, server, 1)
    settle(server, after)
    server.send("COMMAND_LONG", target_system=1, target_component=1, command=400)
    until(server, lambda: "COMMAND_LONG" in after.names())
    assert "COMMAND_LONG" not in before.names()
    frames = server.router.statistics.of_system(1).frames
    now = time.monotonic() + PEER_EXPIRY_S + 1.0
    server.router.poll(now)
    server.router.receive(now)
    assert server.vehicles.peers == ()
    assert server.router.statistics.of_system(1).frames == frames  # counts are not forgotten


def test_endpoints_are_bounded(server: Server, closing: ExitStack) -> None:
    good = vehicle(closing, server, 1)
    for _ in range(MAX_PEERS + 5):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
            one.sendto(b"x", (LOOPBACK, server.vehicles.port))
            server.turn()
            good.say("ATTITUDE")
    settle(server, good)
    assert len(server.vehicles.peers) == MAX_PEERS
    assert len(server.router._table.endpoints) == MAX_PEERS
    server.send("COMMAND_LONG", target_system=1, target_component=1)
    until(server, lambda: "COMMAND_LONG" in good.names())


# Ground stations


def test_a_station_that_only_listens_is_spoken_to_first(closing: ExitStack) -> None:
    ground = Party(255, 190)
    closing.enter_context(ground.socket)
    server = opened(closing, f"udpout://{LOOPBACK}:{ground.port}")
    craft = vehicle(closing, server, 1)
    sent = [craft.say("ATTITUDE", time_boot_ms=n) for n in range(3)]
    until(server, lambda: ground.names().count("ATTITUDE") == 3)
    assert set(sent) <= set(ground.raw)  # byte for byte
    server.send("HEARTBEAT", type=18)
    until(server, lambda: "HEARTBEAT" in ground.names() and ground.heard[-1].type == 18)
    command = ground.say("COMMAND_LONG", target_system=1, target_component=1, command=400)
    until(server, lambda: "COMMAND_LONG" in craft.names())
    assert command in craft.raw
    assert [m.get_type() for m in server.overheard] == ["COMMAND_LONG"]
    assert "COMMAND_LONG" not in [m.get_type() for m in server.received]
    answer = craft.say("COMMAND_ACK", command=400, target_system=255, target_component=190)
    until(server, lambda: ground.has(answer))


def test_a_station_that_connects_by_tcp_hears_without_a_word_and_may_leave(
    closing: ExitStack,
) -> None:
    server = opened(closing, f"tcpin://{LOOPBACK}:0")
    craft = vehicle(closing, server, 1)
    link = server.router._station_ports[1].link
    with socket.create_connection((LOOPBACK, link.port)) as silent:
        until(server, lambda: bool(link.peers))
        frame = craft.say("ATTITUDE")
        settle(server, craft)
        assert silent.recv(65536).startswith(frame)
        silent.sendall(Codec(255, 190).encode(make("COMMAND_LONG", target_system=1, command=9)))
    until(server, lambda: "COMMAND_LONG" in craft.names() and not link.peers)
    (_, (_, counts)) = server.router.statistics.station_links()
    assert counts.forwarded == 1


def test_what_one_station_says_the_others_hear_and_telemetry_never_comes_from_a_station(
    server: Server, closing: ExitStack
) -> None:
    craft = vehicle(closing, server, 1)
    one, two = station(closing, server, 255), station(closing, server, 254)
    one.say("STATUSTEXT", text=b"hello")
    one.say("GLOBAL_POSITION_INT", lat=1)
    settle(server, one)
    until(server, lambda: "STATUSTEXT" in two.names() and "STATUSTEXT" in craft.names())
    assert "STATUSTEXT" not in one.names()
    assert not {"STATUSTEXT", "GLOBAL_POSITION_INT"} & {m.get_type() for m in server.received}


def test_messages_that_we_do_not_know_and_signed_ones_pass_unchanged(
    server: Server, closing: ExitStack
) -> None:
    craft, ground = vehicle(closing, server, 1), station(closing, server)
    signer = Codec(1, 1, Signing(bytes(32), lambda: 1.7e9))
    signed = signer.encode(make("ATTITUDE", roll=1.0))
    craft.send(UNKNOWN + signed)
    settle(server, craft)
    until(server, lambda: ground.has(UNKNOWN, signed))


def test_a_signing_key_is_not_passed_on(server: Server, closing: ExitStack) -> None:
    craft, ground = vehicle(closing, server, 1), station(closing, server)
    ground.say("SETUP_SIGNING", target_system=1, target_component=1, secret_key=[1] * 32)
    ground.say("COMMAND_LONG", target_system=1, target_component=1)
    until(server, lambda: "COMMAND_LONG" in craft.names())
    assert "SETUP_SIGNING" not in craft.names()


def test_a_station_that_claims_to_be_the_vehicle_is_not_believed_and_is_counted(
    server: Server, closing: ExitStack
) -> None:
    vehicle(closing, server, 1)
    ground, other = station(closing, server), station(closing, server, 254)
    forger = Codec(1, 1)
    for name in ("HEARTBEAT", "GLOBAL_POSITION_INT"):
        ground.send(forger.encode(make(name)))
    server.send("HEARTBEAT", type=18)
    ground.send(Codec(1, 191).encode(make("HEARTBEAT", type=6)))
    settle(server, ground)
    ((_, counts),) = server.router.statistics.station_links()
    assert counts.spoofed == 3
    assert "GLOBAL_POSITION_INT" not in other.names()
    assert {m.get_srcSystem() for m in server.overheard} == {255, 254}


def test_what_a_station_sends_to_a_system_that_is_not_there_is_counted(
    server: Server, closing: ExitStack
) -> None:
    craft, ground = vehicle(closing, server, 1), station(closing, server)
    ground.say("COMMAND_LONG", target_system=9, target_component=1)
    settle(server, ground)
    ((_, counts),) = server.router.statistics.station_links()
    assert counts.unrouted == 1
    assert "COMMAND_LONG" not in craft.names()


def test_a_flood_of_a_station_is_throttled_and_the_quiet_vehicle_is_heard(
    server: Server, closing: ExitStack
) -> None:
    craft = vehicle(closing, server, 1)
    ground, flooder = station(closing, server), station(closing, server, 254)
    frame = flooder.codec.encode(make("STATUSTEXT", text=b"flood"))
    for number in range(60):
        for _ in range(50):
            flooder.send(frame)
        craft.say("ATTITUDE", time_boot_ms=number)
        server.turn()
    ground.say("COMMAND_LONG", target_system=1, target_component=1, command=400)
    until(server, lambda: "COMMAND_LONG" in craft.names())  # its neighbour gets through
    heard = [m.time_boot_ms for m in server.received if m.get_type() == "ATTITUDE"]
    assert heard == list(range(60))
    ((_, counts),) = server.router.statistics.station_links()
    assert counts.throttled > 0
    # Frames that the kernel has no room for while the link rests are lost before they can count.
    assert counts.throttled + counts.frames <= 60 * 50 + 3
    assert counts.frames >= STATION_BURST


def test_each_of_fifty_stations_gets_all_that_a_vehicle_says_in_a_second(
    server: Server, closing: ExitStack
) -> None:
    craft = vehicle(closing, server, 1)
    for system in range(200, 250):
        station(closing, server, system)
    ((_, before),) = server.router.statistics.station_links()  # their own HEARTBEATs
    now_s = time.monotonic() + 10.0  # all at one moment: nothing is filled up again meanwhile
    for number in range(70):
        craft.say("ATTITUDE", time_boot_ms=number)
        while len([m for m in server.received if m.get_type() == "ATTITUDE"]) <= number:
            server.turn(now_s)
    ((_, counts),) = server.router.statistics.station_links()
    assert counts.sent - before.sent == 50 * 70
    assert counts.withheld == before.withheld


def test_a_peer_that_speaks_for_several_vehicles_may_send_as_much_as_they(
    closing: ExitStack,
) -> None:
    throttled = {}
    for vehicles in (1, 3):
        server = opened(closing, vehicles=vehicles)
        relay = vehicle(closing, server, 1)
        vehicle(closing, server, 9)
        for system in (2, 3):
            relay.send(Codec(system, 1).encode(make("HEARTBEAT", autopilot=3)))
        settle(server, relay)
        datagram = b"".join(relay.codec.encode(make("ATTITUDE")) for _ in range(20))
        now = time.monotonic()  # and no later: nothing is filled up again
        for _ in range(int(1.5 * NEIGHBOUR_BURST) // 20):
            relay.send(datagram)
            server.router.receive(now)
        throttled[vehicles] = server.router.statistics.of_system(1).throttled
    assert throttled[1] > 0
    assert throttled[3] == 0


def test_garbage_of_a_station_reaches_nobody(server: Server, closing: ExitStack) -> None:
    craft, ground = vehicle(closing, server, 1), station(closing, server)
    until(server, lambda: "HEARTBEAT" in craft.names())
    before = len(craft.raw)
    for number in range(30):
        ground.send(bytes((number * n) % 256 for n in range(200)))
    settle(server, ground)
    craft.listen()
    assert [m.get_type() for m in craft.codec.decode(b"".join(craft.raw[before:]))] == [
        "SYSTEM_TIME"
    ]
    assert server.router.statistics.of_system(1).bytes_dropped == 0


# Loops


def test_in_a_ring_of_two_routers_each_frame_passes_once(closing: ExitStack) -> None:
    first = opened(closing)
    there = first.ground.port
    # Two ways between them: each is a ground station to the other, twice.
    second = opened(closing, f"udpout://{LOOPBACK}:{there}", f"udpout://{LOOPBACK}:{there}")
    both = (first, second)
    ground = ring_party(closing, both, 255, 190, second.ground.port)
    craft = ring_party(closing, both, 1, 1, first.vehicles.port)
    for number in range(20):
        craft.say("ATTITUDE", time_boot_ms=number)
        ground.say("STATUSTEXT", text=b"%d" % number)
    first.send("HEARTBEAT", type=18)
    settle(both, craft, ground)
    until(
        both,
        lambda: ground.names().count("ATTITUDE") >= 20 and craft.names().count("STATUSTEXT") >= 20,
    )
    for _ in range(20):
        first.turn()
        second.turn()
    told = [m.time_boot_ms for m in ground.heard if m.get_type() == "ATTITUDE"]
    asked = [m.text for m in craft.heard if m.get_type() == "STATUSTEXT"]
    assert told == sorted(set(told))
    assert len(asked) == len(set(asked)) == 20
    dropped = [counts for one in both for _, counts in one.router.statistics.station_links()]
    assert sum(counts.duplicates for counts in dropped) > 0
    assert sum(counts.looped for counts in dropped) > 0
    assert sum(counts.spoofed for counts in dropped) == 0


# Recording


def test_what_passes_is_recorded_once(tmp_path: Path, closing: ExitStack) -> None:
    path = tmp_path / "flight.tlog"
    server = opened(closing, recorder=TlogWriter(path))
    craft, two = vehicle(closing, server, 1), vehicle(closing, server, 2)
    ground, other = station(closing, server), station(closing, server, 254)
    frames = [
        craft.say("ATTITUDE"),
        ground.say("COMMAND_LONG", target_system=1, target_component=1),
        ground.say("STATUSTEXT", text=b"to all"),
    ]
    lost = ground.say("COMMAND_LONG", target_system=9, target_component=1)
    server.send("SYSTEM_TIME", time_unix_usec=7)
    settle(server, craft, two, ground, other)
    server.router.flush()
    packets = [packet for _, packet in TlogReader(path)]
    assert [packets.count(frame) for frame in frames] == [1, 1, 1]
    assert lost not in packets
    ours = [m for p in packets for m in Codec(9, 9).decode(p) if m.get_srcComponent() == 191]
    assert len(ours) == 1


def test_each_message_is_counted_once_alone_and_among_others(
    server: Server, closing: ExitStack
) -> None:
    craft = vehicle(closing, server, 1)
    frames = [craft.codec.encode(make(name)) for name in ("ATTITUDE", "HEARTBEAT", "ATTITUDE")]
    craft.send(b"".join(frames))
    settle(server, craft)
    assert server.router.statistics.of_system(1).frames == 5
    station(closing, server)
    craft.send(b"".join(frames))
    settle(server, craft)
    assert server.router.statistics.of_system(1).frames == len(server.received) == 9


# MAVLink 1


def speak_1(server: Server, party: Party) -> None:
    """Have a party be known for MAVLink 1."""
    heartbeat = make("HEARTBEAT", type=2, autopilot=3)
    if party.codec._source[1] == 190:
        heartbeat = make("HEARTBEAT", type=6, autopilot=8)
    for _ in range(MAVLINK_1_HEARTBEATS):
        frame = in_mavlink_1(party.codec.encode(heartbeat))
        assert frame[0] == 0xFE
        party.send(frame)
    codec = [e.codec for e in server.router._table.endpoints if party.codec._source in e.sources]
    until(server, lambda: codec[0].speaks_1)


def test_a_vehicle_of_mavlink_1_hears_a_station_of_mavlink_2_in_mavlink_1(
    server: Server, closing: ExitStack
) -> None:
    old, new = vehicle(closing, server, 1), vehicle(closing, server, 2)
    ground = station(closing, server)
    speak_1(server, old)
    command = ground.say(
        "COMMAND_LONG", target_system=1, target_component=1, command=400, param1=1.0
    )
    count = ground.say("MISSION_COUNT", target_system=1, target_component=1, count=3)
    beyond = [
        ground.say("MISSION_COUNT", target_system=1, count=3, mission_type=1),
        ground.say("ODOMETRY", x=1.0),
    ]
    signer = Codec(255, 190, Signing(bytes(32), lambda: 1.7e9))
    beyond.append(signer.encode(make("COMMAND_LONG", target_system=1, command=401)))
    ground.send(beyond[-1])
    until(server, lambda: old.has(*beyond))
    assert old.has(in_mavlink_1(command), in_mavlink_1(count))
    assert not {command, count} & set(old.raw)
    (heard,) = [m for m in old.heard if m.get_type() == "COMMAND_LONG" and m.command == 400]
    assert (heard.target_component, heard.param1, heard.get_srcSystem()) == (1, 1.0, 255)
    ((_, counts),) = server.router.statistics.station_links()
    assert counts.beyond_mavlink_1 == len(beyond)
    until(server, lambda: new.has(beyond[1]))  # to all, unmodified where MAVLink 2 is spoken
    assert old.codec.statistics.bad_crc == 0


def test_a_station_of_mavlink_1_hears_a_vehicle_of_mavlink_2_in_mavlink_1(
    server: Server, closing: ExitStack
) -> None:
    craft, old = vehicle(closing, server, 1), station(closing, server)
    speak_1(server, old)
    sent = [craft.say("ATTITUDE", time_boot_ms=n, roll=0.1) for n in range(3)]
    until(server, lambda: old.has(*map(in_mavlink_1, sent)))
    assert not set(sent) & set(old.raw)
    odometry = craft.say("ODOMETRY", x=1.0)
    until(server, lambda: old.has(odometry))


def test_a_frame_in_mavlink_1_that_comes_back_is_dropped(
    server: Server, closing: ExitStack
) -> None:
    old, ground = vehicle(closing, server, 1), station(closing, server)
    speak_1(server, old)
    frame = in_mavlink_1(ground.say("COMMAND_LONG", target_system=0, command=400))
    until(server, lambda: old.has(frame))
    old.send(frame)
    settle(server, old)
    assert "COMMAND_LONG" not in [m.get_type() for m in server.received]
    assert server.router.statistics.of_system(1).duplicates == 1
