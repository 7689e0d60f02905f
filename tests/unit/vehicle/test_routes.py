"""The forwarding rules of frames; no sockets, and time is an argument."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mavlink_vehicle.io.endpoints import Endpoint, TokenBucket, count_frames
from mavlink_vehicle.io.routes import (
    MAX_SOURCES,
    MEMORY_S,
    ROUTE_EXPIRY_S,
    RoutingTable,
)

OURS = (1, 191)
STATION = (255, 190)


class Network:
    """Two vehicles and two ground stations around a table; all have been heard at time 0."""

    def __init__(self) -> None:
        self.table: RoutingTable[Endpoint] = RoutingTable()
        self.one, self.two = Endpoint(station=False), Endpoint(station=False)
        self.ground, self.other = Endpoint(station=True), Endpoint(station=True)
        self.frames = 0
        self.table.claim(OURS)
        for endpoint in (self.one, self.two, self.ground, self.other):
            self.table.add(endpoint)
        for system, endpoint in ((1, self.one), (2, self.two)):
            self.hear(endpoint, (system, 1))
            self.table.protect(system)
        self.hear(self.ground, STATION)
        self.hear(self.other, (254, 190))

    def hear(self, endpoint: Endpoint, source: tuple[int, int], now: float = 0.0) -> bool:
        """Let a frame come that never came before."""
        self.frames += 1
        return self.table.admit(endpoint, b"frame %d" % self.frames, source, now)


# Where frames go


def test_what_a_vehicle_says_to_all_goes_to_the_stations_and_to_no_other_vehicle() -> None:
    net = Network()
    assert net.table.destinations(net.one, 0, 0) == [net.ground, net.other]


def test_what_a_station_says_to_all_goes_to_all_but_itself() -> None:
    net = Network()
    assert net.table.destinations(net.ground, 0, 0) == [net.one, net.two, net.other]


def test_a_command_goes_only_to_the_vehicle_that_it_is_for() -> None:
    net = Network()
    assert net.table.destinations(net.ground, 2, 1) == [net.two]
    assert net.table.destinations(net.ground, 2, 0) == [net.two]


def test_an_answer_goes_only_to_the_station_that_it_is_for() -> None:
    net = Network()
    assert net.table.destinations(net.one, *STATION) == [net.ground]


def test_a_vehicle_reaches_another_vehicle_only_by_name() -> None:
    net = Network()
    assert net.table.destinations(net.one, 2, 1) == [net.two]


def test_a_component_that_was_not_heard_is_looked_for_where_its_system_is() -> None:
    net = Network()
    assert net.table.destinations(net.ground, 2, 154) == [net.two]
    net.hear(net.other, (2, 154))  # a camera of the vehicle on a link of its own
    assert net.table.destinations(net.ground, 2, 154) == [net.other]
    assert net.table.destinations(net.ground, 2, 0) == [net.two, net.other]


def test_what_is_for_a_system_that_nobody_has_heard_goes_nowhere() -> None:
    net = Network()
    assert net.table.destinations(net.ground, 77, 1) == []


def test_what_is_for_us_is_not_passed_on() -> None:
    net = Network()
    assert net.table.destinations(net.ground, *OURS) == []


def test_what_is_for_the_system_where_it_came_from_does_not_go_back() -> None:
    net = Network()
    assert net.table.destinations(net.one, 1, 1) == []


# Frames of our own


def test_our_setpoints_go_only_to_their_vehicle() -> None:
    net = Network()
    assert net.table.destinations_of_ours(1, 2, 1) == [net.two]


def test_what_we_send_to_a_vehicle_that_was_not_heard_goes_to_all_vehicle_links() -> None:
    net = Network()
    assert net.table.destinations_of_ours(3, 3, 1) == [net.one, net.two]


def test_our_heartbeat_goes_to_the_vehicle_that_it_speaks_for_and_to_all_stations() -> None:
    net = Network()
    assert net.table.destinations_of_ours(2, 0, 0) == [net.two, net.ground, net.other]


def test_our_heartbeat_goes_everywhere_while_its_vehicle_was_not_heard() -> None:
    net = Network()
    assert net.table.destinations_of_ours(3, 0, 0) == net.table.endpoints


def test_our_answer_to_a_station_goes_to_that_station() -> None:
    net = Network()
    assert net.table.destinations_of_ours(1, *STATION) == [net.ground]


# Frames that are dropped


def test_our_own_frames_that_come_back_are_dropped_as_looped() -> None:
    net = Network()
    net.table.remember_ours(b"ours", 0.0)
    assert not net.table.admit(net.ground, b"ours", OURS, 0.1)
    assert not net.hear(net.one, OURS)  # by a vehicle that repeats what it hears
    assert (net.ground.counts.looped, net.one.counts.looped) == (1, 1)
    assert net.ground.counts.spoofed == 0


def test_a_station_that_sends_in_our_name_is_dropped_as_spoofed() -> None:
    net = Network()
    assert not net.hear(net.ground, OURS)
    assert (net.ground.counts.spoofed, net.ground.counts.looped) == (1, 0)


def test_a_station_that_sends_in_a_vehicles_name_is_dropped_as_spoofed() -> None:
    net = Network()
    assert not net.hear(net.ground, (1, 1))
    assert net.ground.counts.spoofed == 1
    assert net.table.destinations(net.other, 1, 1) == [net.one]  # the way to it has not moved
    net.table.remove(net.two)
    net.table.remove(net.other)
    net.table.remove(net.one)
    assert not net.hear(net.ground, (1, 1))  # and not when it alone is left


def test_a_vehicle_takes_its_name_back_from_a_station_that_used_it_before() -> None:
    table: RoutingTable[Endpoint] = RoutingTable()
    vehicle, station = Endpoint(station=False), Endpoint(station=True)
    table.add(vehicle)
    table.add(station)
    assert table.admit(station, b"early", (1, 1), 0.0)
    assert table.admit(vehicle, b"true", (1, 1), 1.0)
    table.protect(1)
    assert table.endpoints_to(1, 1) == (vehicle,)
    assert not table.admit(station, b"late", (1, 1), 2.0)


def test_a_ground_station_that_is_also_heard_by_a_vehicles_radio_may_speak() -> None:
    net = Network()
    net.hear(net.one, (253, 190))
    assert net.hear(net.other, (253, 190))
    assert net.table.endpoints_to(253, 190) == (net.other,)


def test_the_same_frame_by_another_route_is_a_duplicate_and_teaches_nothing() -> None:
    net = Network()
    assert net.table.admit(net.one, b"twice", (1, 1), 5.0)
    assert not net.table.admit(net.two, b"twice", (1, 1), 5.1)
    assert not net.table.admit(net.ground, b"twice", (1, 1), 5.1)  # a ring, not a forgery
    assert (net.two.counts.duplicates, net.ground.counts.duplicates) == (1, 1)
    assert net.ground.counts.spoofed == 0
    assert net.table.endpoints_to(1, 1) == (net.one,)


def test_the_same_frame_again_from_the_same_place_is_sent_twice_on_purpose() -> None:
    net = Network()
    assert net.table.admit(net.ground, b"again", STATION, 0.0)
    assert net.table.admit(net.ground, b"again", STATION, 0.1)


def test_a_forged_frame_does_not_make_the_true_one_a_duplicate() -> None:
    net = Network()
    assert not net.table.admit(net.ground, b"HEARTBEAT of the vehicle", (1, 1), 0.0)
    assert net.table.admit(net.one, b"HEARTBEAT of the vehicle", (1, 1), 0.1)


def test_frames_are_forgotten_after_a_while() -> None:
    net = Network()
    assert net.table.admit(net.one, b"beat", (1, 1), 0.0)
    for turn in range(1, 4):
        net.hear(net.one, (1, 1), turn * MEMORY_S)
    assert net.table.admit(net.two, b"beat", (1, 1), 3.0 * MEMORY_S)


# Changes of the network


def test_a_vehicle_that_restarts_on_another_port_is_reached_there() -> None:
    net = Network()
    reborn = Endpoint(station=False)
    net.table.add(reborn)
    assert net.hear(reborn, (1, 1))
    assert net.table.destinations_of_ours(1, 1, 1) == [reborn]
    assert net.table.destinations_of_ours(1, 0, 0) == [net.ground, net.other, reborn]


def test_a_silent_system_is_no_longer_reached_but_its_name_stays_its_own() -> None:
    net = Network()
    net.hear(net.two, (2, 1), ROUTE_EXPIRY_S)
    net.table.expire(ROUTE_EXPIRY_S + 1.0)
    assert net.table.endpoints_to(1, 1) == ()
    assert net.table.endpoints_to(2, 1) == (net.two,)
    assert not net.hear(net.ground, (1, 1), ROUTE_EXPIRY_S + 2.0)
    assert net.hear(net.one, (1, 1), ROUTE_EXPIRY_S + 3.0)
    assert net.table.endpoints_to(1, 1) == (net.one,)


def test_who_was_heard_at_an_endpoint_goes_with_it() -> None:
    net = Network()
    net.table.remove(net.ground)
    assert net.table.destinations(net.one, *STATION) == []
    assert net.table.destinations(net.one, 0, 0) == [net.other]


def test_an_id_that_becomes_ours_is_no_longer_sent_to() -> None:
    net = Network()
    net.hear(net.ground, (1, 192))
    net.table.claim((1, 192))
    assert net.table.endpoints_to(1, 0) == (net.one,)
    assert not net.hear(net.ground, (1, 192))


def test_a_station_with_endless_names_is_forgotten_in_part_and_others_are_not() -> None:
    net = Network()
    for number in range(2 * MAX_SOURCES):
        net.hear(net.ground, (100 + number // 250, 1 + number % 250), 1.0 + number)
    assert len(net.ground.sources) == MAX_SOURCES
    assert net.table.endpoints_to(1, 1) == (net.one,)
    assert net.table.endpoints_to(254, 190) == (net.other,)
    assert net.table.endpoints_to(100, 1) == ()


# In general

IDS = st.integers(0, 3)
SOURCES = st.tuples(st.integers(1, 3), st.integers(1, 2))
FRAMES = st.tuples(st.integers(0, 3), SOURCES, IDS, IDS, st.integers(0, 5))


@given(st.lists(st.booleans(), min_size=4, max_size=4), st.lists(FRAMES, max_size=60))
def test_never_back_never_twice_and_by_name_only_to_where_it_was_heard(
    stations: list[bool], frames: list[tuple[int, tuple[int, int], int, int, int]]
) -> None:
    """With any sequence of senders: frames are known by source, target and number."""
    table: RoutingTable[Endpoint] = RoutingTable()
    endpoints = [Endpoint(station) for station in stations]
    for endpoint in endpoints:
        table.add(endpoint)
    table.claim((3, 2))
    heard: dict[int, set[int]] = {index: set() for index in range(4)}
    delivered: dict[bytes, int] = {}
    for now, (index, source, system, component, number) in enumerate(frames):
        frame = repr((source, system, component, number)).encode()
        origin = endpoints[index]
        if not table.admit(origin, frame, source, 0.01 * now):
            continue
        heard[index].add(source[0])
        if not origin.station and source[1] == 1:
            table.protect(source[0])
        assert delivered.setdefault(frame, index) == index
        found = table.destinations(origin, system, component)
        assert origin not in found
        assert len(set(map(id, found))) == len(found)
        for endpoint in found:
            if system:
                assert system in heard[endpoints.index(endpoint)]
            else:
                assert endpoint.station or origin.station
        for endpoint in table.destinations_of_ours(3, system, component):
            spoken_of = system in heard[endpoints.index(endpoint)]
            assert not system or spoken_of or not endpoint.station


CHANGES = st.one_of(
    st.tuples(st.just("frame"), st.integers(0, 3), SOURCES),
    st.tuples(st.just("remove"), st.integers(0, 3), SOURCES),
    st.tuples(st.just("expire"), st.integers(0, 3), SOURCES),
    st.tuples(st.just("claim"), st.integers(0, 3), SOURCES),
)


@given(st.lists(CHANGES, max_size=60))
def test_routes_lead_only_to_endpoints_that_are_there_and_have_heard_who_is_meant(
    changes: list[tuple[str, int, tuple[int, int]]],
) -> None:
    table: RoutingTable[Endpoint] = RoutingTable()
    here = [Endpoint(station=index > 1) for index in range(4)]
    for endpoint in here:
        table.add(endpoint)
    for now, (what, index, source) in enumerate(changes):
        if what == "frame":
            table.admit(here[index], b"%d" % now, source, 10.0 * now)
        elif what == "remove":
            table.remove(here[index])
            here[index] = Endpoint(station=index > 1)
            table.add(here[index])
        elif what == "expire":
            table.expire(10.0 * now)
        else:
            table.claim(source)
        for system in (1, 2, 3):
            for component in (0, 1, 2):
                ways = table.endpoints_to(system, component)
                assert all(way in here for way in ways)
                assert all(any(who[0] == system for who in way.sources) for way in ways)
                exact = [way for way in ways if (system, component) in way.sources]
                if (system, component) in table.ours:
                    assert not any(way.sources[system, component].current for way in exact)


# Floods


def test_a_bucket_lets_a_burst_through_and_then_its_rate() -> None:
    bucket = TokenBucket(rate_hz=10.0, burst=5.0)
    assert [bucket.take(1, 100.0) for _ in range(7)] == [True] * 5 + [False] * 2
    assert bucket.take(1, 100.11)
    assert not bucket.take(1, 100.12)
    assert bucket.take(5, 200.0)
    assert not bucket.take(6, 300.0)  # more than it ever holds


@given(st.lists(st.tuples(st.floats(0.0, 0.5), st.integers(1, 20)), max_size=100))
def test_a_bucket_never_lets_more_through_than_its_rate_and_one_burst(
    takes: list[tuple[float, int]],
) -> None:
    bucket, now, passed = TokenBucket(rate_hz=20.0, burst=30.0), 0.0, 0
    for pause_s, count in takes:
        now += pause_s
        passed += count if bucket.take(count, now) else 0
        assert passed <= 30.0 + 20.0 * now + 1e-6


def test_frames_are_counted_without_looking_closely() -> None:
    version_1 = bytes([0xFE, 3, 0, 1, 1, 0, 1, 2, 3, 0, 0])
    version_2 = bytes([0xFD, 3, 0, 0, 0, 1, 1, 0, 0, 0, 1, 2, 3, 0, 0])
    signed = bytes([0xFD, 3, 1, *version_2[3:], *range(13)])
    assert count_frames(b"") == 0
    assert count_frames(version_1 + version_2 + signed + version_1) == 4
    assert count_frames(b"no frame at all") == 1


@given(st.binary(max_size=500))
def test_counting_takes_anything(data: bytes) -> None:
    assert 0 <= count_frames(data) <= len(data)
