"""Reservations between servers: whatever is lost, two volumes that meet are not both agreed to."""

from __future__ import annotations

import random

import numpy as np
import pytest

from navigation_core.tasks.traffic.crowds import first_blocked
from navigation_core.tasks.traffic.entries import Ask, Claimant, Rank, wait_for
from navigation_core.tasks.traffic.negotiation import (
    LISTEN_S,
    SILENCE_MAX_S,
    Negotiation,
    PeerState,
)
from navigation_core.tasks.traffic.reservations import TrafficReservations
from navigation_core.tasks.traffic.volumes import NOWHERE, Separation, Volume, densified

SEPARATION = Separation(5.0, 3.0, 2.0)
STEP_S = 0.2


class Server:
    """A server with one vehicle that goes along a line."""

    def __init__(
        self, name: str, rank: int, start: tuple[float, float], end: tuple[float, float]
    ) -> None:
        """Stand at the start."""
        self.vehicle = f"{name}1"
        self.reservations = TrafficReservations(SEPARATION)
        self.negotiation = Negotiation(self.reservations, name, 1)
        points, _ = densified(np.array([(*start, 5.0), (*end, 5.0)]), np.zeros(2))
        self.path = Volume.along(points, 1.0, 0.5)
        self.reservations.entry(self.vehicle).rank = Rank(Claimant.GOAL, float(rank), self.vehicle)
        self.place = self.granted = 0
        self.reservations.stand(self.vehicle, self.path.part(0, 1), 0.0)
        self.reach = NOWHERE

    def step(self, now: float) -> PeerState:
        """Continue by one point if that is granted, ask for more, and say so."""
        if self.granted > self.place + 1:
            self.place += 1
        rest = self.path.part(self.place)
        ask = Ask(
            rest,
            np.linspace(0.0, STEP_S * (len(rest) - 1), len(rest)),
            max(self.granted - self.place, 0),
            min(8, len(rest)),
            min(8, len(rest)),
            self.path,
            self.place,
        )
        if now > 0.1:
            grant = self.reservations.extend(self.vehicle, ask, rest.part(0, 1), now)
            self.granted = self.place + grant.granted
        self.negotiation.look(now)
        return self.negotiation.state({self.vehicle: (NOWHERE, self.reach)}, now)

    @property
    def used(self) -> Volume:
        """The volume that its vehicle may use."""
        return self.reservations.entry(self.vehicle).used


def crossing(seed: int = 0) -> tuple[Server, Server]:
    """Return two servers whose vehicles' lines cross."""
    ranks = [1, 2]
    random.Random(seed).shuffle(ranks)
    return (
        Server("/a", ranks[0], (-20.0, 0.0), (20.0, 0.0)),
        Server("/b", ranks[1], (0.0, -20.0), (0.0, 20.0)),
    )


def run(
    servers: tuple[Server, Server], seed: int, steps: int, loss: float, cut: tuple[int, int]
) -> None:
    """Let both continue over a network that loses, delays and doubles, and is cut for a while."""
    rng = random.Random(seed)
    flying: list[tuple[int, Server, PeerState]] = []
    for tick in range(steps):
        now = tick * STEP_S
        for server, other in (servers, servers[::-1]):
            state = server.step(now)
            is_cut = cut[0] <= tick < cut[1]
            copies = [tick + rng.randrange(4) for _ in range(rng.choice((1, 1, 2)))]
            arrive = [at for at in copies if not is_cut and rng.random() >= loss]
            flying += [(at, other, state) for at in arrive]
        due = [one for one in flying if one[0] <= tick]
        flying = [one for one in flying if one[0] > tick]
        rng.shuffle(due)
        for _, receiver, state in due:
            receiver.negotiation.receive(state, now)
        assert not servers[0].used.meets(servers[1].used, SEPARATION).any(), f"at {now:.1f} s"


@pytest.mark.parametrize("seed", range(12))
def test_two_volumes_are_never_used_at_once_and_both_arrive(seed: int) -> None:
    servers = crossing(seed)
    run(servers, seed, 400, 0.3, (0, 0))
    assert [one.place for one in servers] == [len(one.path) - 2 for one in servers] or all(
        one.place >= len(one.path) - 2 for one in servers
    )


@pytest.mark.parametrize("seed", range(12))
def test_a_cut_network_never_makes_two_use_one_volume(seed: int) -> None:
    servers = crossing(seed)
    begin = 12 + seed
    run(servers, seed, 100, 0.1, (begin, 100))
    # Cut for good: nobody goes beyond what was agreed to before.
    assert any(one.place < len(one.path) - 2 for one in servers)


@pytest.mark.parametrize("seed", range(6))
def test_both_continue_when_the_network_is_back(seed: int) -> None:
    servers = crossing(seed)
    run(servers, seed, 500, 0.1, (12, 120))
    assert all(one.place >= len(one.path) - 2 for one in servers)


def test_nothing_is_used_before_others_had_time_to_be_heard() -> None:
    server, _ = crossing()
    for tick in range(int(LISTEN_S / STEP_S)):
        server.step(tick * STEP_S)
    assert server.place == 0
    for tick in range(10, 40):
        server.step(tick * STEP_S)
    assert server.place > 0


def test_an_expected_server_must_have_been_heard() -> None:
    server, other = crossing()
    server.negotiation = Negotiation(server.reservations, "/a", 1, ["/b"])
    for tick in range(40):
        server.step(tick * STEP_S)
    assert server.place == 0
    entry = server.reservations.entry(server.vehicle)
    assert entry.waiting is not None
    assert entry.waiting.whom == "/b"
    for tick in range(40, 80):
        now = tick * STEP_S
        other.negotiation.receive(server.step(now), now)
        server.negotiation.receive(other.step(now), now)
    assert server.place > 0


def test_a_silent_server_keeps_its_volume_and_what_it_may_do_alone() -> None:
    server, other = crossing()
    alone = Volume.along(np.array([(10.0, -20.0, 5.0)]), 1.0, 0.5)
    state = other.negotiation.state({other.vehicle: (alone, NOWHERE)}, 0.0)
    server.negotiation.receive(state, 0.0)
    server.negotiation.look(SILENCE_MAX_S + 0.1)
    entry = server.reservations.entries[other.vehicle]
    assert len(entry.held)
    assert entry.whole.meets(alone, SEPARATION).any()
    server.negotiation.look(1e6)
    assert other.vehicle in server.reservations.entries


def test_who_can_never_get_near_need_not_agree() -> None:
    server, other = crossing()
    other.reach = Volume.along(np.array([(5000.0, 0.0, 0.0)]), 500.0, 1e4)
    server.negotiation.receive(other.step(0.0), 0.0)
    for tick in range(60):
        server.step(tick * STEP_S)
    assert server.place > 20


def test_a_restarted_server_must_agree_again() -> None:
    server, other = crossing()
    for tick in range(20):
        now = tick * STEP_S
        server.negotiation.receive(other.step(now), now)
        other.negotiation.receive(server.step(now), now)
    again = Negotiation(TrafficReservations(SEPARATION), "/b", 2)
    server.negotiation.receive(again.state({}, 4.0), 4.0)
    place = server.granted
    for tick in range(20, 40):
        server.step(tick * STEP_S)
    assert server.granted == place


def test_who_flew_alone_stops_when_another_server_is_found_late() -> None:
    server, other = crossing()
    for tick in range(20):
        server.step(tick * STEP_S)
    assert server.place < server.granted
    other.place = 20  # it stands where the lines cross
    other.reservations.stand(other.vehicle, other.path.part(20, 21), 5.0)
    state = other.negotiation.state({other.vehicle: (NOWHERE, NOWHERE)}, 5.0)
    server.negotiation.receive(state, 5.0)
    place = server.place
    for tick in range(26, 60):
        server.step(tick * STEP_S)
        assert not server.used.meets(other.used, SEPARATION).any()
    assert server.place <= place + 1


def test_the_time_that_a_server_did_not_run_is_no_time_to_hear_others() -> None:
    server, _ = crossing()
    server.step(0.0)
    server.negotiation.look(30.0)
    server.step(30.0)
    assert server.granted == 0
    for tick in range(20):
        server.step(30.0 + tick * STEP_S)
    assert server.granted > 0


def test_a_server_that_the_network_knows_of_is_listened_for() -> None:
    server, _ = crossing()
    for tick in range(15):
        server.step(tick * STEP_S)
    assert server.reservations.agreement is None
    server.negotiation.find(1)
    assert server.reservations.agreement is server.negotiation
    # It may be one that was killed: nobody waits for it for ever.
    for tick in range(15, 30):
        server.negotiation.find(1)
        server.step(tick * STEP_S)
    assert server.reservations.agreement is None


def test_one_that_had_to_make_room_and_found_none_leaves_it_to_those_of_other_servers() -> None:
    first, last = crossing()
    entry = last.reservations.entry(last.vehicle)
    for server, other in ((first, last), (last, first)):
        server.step(0.0)
        own = server.reservations.entry(server.vehicle)
        own.waiting = wait_for(None, other.vehicle, "which holds what is ahead", 0.0)
        own.moves = True
    entry.stuck_until_s = 5.0

    def must(now: float) -> bool:
        state = last.negotiation.state({last.vehicle: (NOWHERE, NOWHERE)}, now)
        first.negotiation.receive(state, now)
        return first.reservations.must_give_way(first.vehicle, now)

    assert first.reservations.entry(first.vehicle).rank < entry.rank
    assert must(1.0)
    assert not must(6.0)


def too_near(first: tuple[float, float], last: tuple[float, float]) -> tuple[Server, Server]:
    """Return servers whose vehicles are 0.2 m too near, as by drifting, and where they go."""
    return Server("/a", 1, (0.0, 0.0), first), Server("/b", 2, (6.8, 0.0), last)


@pytest.mark.parametrize(
    ("first", "last", "moves"),
    [
        ((-20.0, 0.0), (26.8, 0.0), (True, True)),
        ((-20.0, 0.0), (-13.2, 0.0), (True, True)),
        ((0.0, 20.0), (6.8, -20.0), (True, True)),
        ((20.0, 0.0), (26.8, 0.0), (True, True)),
        ((20.0, 0.0), (-13.2, 0.0), (False, False)),
        ((20.0, 2.0), (-13.2, 2.0), (False, False)),
    ],
)
def test_two_that_are_too_near_get_away_from_each_other_but_never_nearer(
    first: tuple[float, float], last: tuple[float, float], moves: tuple[bool, bool]
) -> None:
    servers = too_near(first, last)
    for tick in range(300):
        now = tick * STEP_S
        states = [server.step(now) for server in servers]
        for server, state in zip(servers, states[::-1], strict=True):
            server.negotiation.receive(state, now)
        gap_m = np.linalg.norm(
            servers[0].path.points_m[servers[0].place] - servers[1].path.points_m[servers[1].place]
        )
        assert gap_m > 6.79, f"at {now:.1f} s"
    arrived = tuple(one.place >= len(one.path) - 2 for one in servers)
    assert arrived == moves


def test_one_beside_anothers_path_does_not_fly_along_it_towards_that() -> None:
    """The path is granted, so that the other vehicle comes along it."""
    first = Server("/a", 1, (0.0, 0.0), (40.0, 0.0))
    last = Server("/b", 2, (20.0, 2.0), (-20.0, 2.0))
    for tick in range(60):
        now = tick * STEP_S
        state = first.step(now)
        if tick < 12:
            aside = Volume.along(np.array([(20.0, 12.0, 5.0)]), 1.0, 0.5)
            last.reservations.stand(last.vehicle, aside, now)
            reply = last.negotiation.state({last.vehicle: (NOWHERE, NOWHERE)}, now)
        else:
            reply = last.step(now)
            assert not last.granted or first.place > 22
        last.negotiation.receive(state, now)
        first.negotiation.receive(reply, now)
    assert first.place > 22


def test_a_wish_that_another_vehicle_has_got_into_is_given_up() -> None:
    """Otherwise neither is known to wait for the other, and none of them makes room."""
    first = Server("/a", 1, (0.0, 0.0), (40.0, 0.0))
    last = Server("/b", 2, (20.0, 2.0), (-20.0, 2.0))
    aside = Volume.along(np.array([(20.0, 12.0, 5.0)]), 1.0, 0.5)
    for tick in range(60):
        now = tick * STEP_S
        state = first.step(now)
        if tick < 10:  # it is far away, and its server hears nothing
            last.reservations.stand(last.vehicle, aside, now)
            reply = last.negotiation.state({last.vehicle: (NOWHERE, NOWHERE)}, now)
            first.negotiation.receive(reply, now)
        else:  # it was carried nearer
            reply = last.step(now)
            last.negotiation.receive(state, now)
            first.negotiation.receive(reply, now)
    waits = [one.reservations.entry(one.vehicle).waiting for one in (first, last)]
    assert [wait.whom for wait in waits if wait is not None] == [last.vehicle, first.vehicle]


def test_a_path_out_is_one_also_where_positions_are_rounded() -> None:
    points = np.array([(0.0, 0.0, 5.0 + 0.25 * step) for step in range(20)])
    points[:, 2] += np.random.default_rng(1).uniform(-1e-4, 1e-4, len(points))
    points[:, 0] += np.random.default_rng(2).uniform(-1e-4, 1e-4, len(points))
    held = Volume.along(np.array([(6.8, 0.0, 5.0)]), 1.0, 0.5)
    up = Volume.along(points, 1.0, 0.5)
    assert first_blocked(up, held, SEPARATION) is None
    towards = Volume.along(points + np.linspace(0.0, 0.5, 20)[:, None] * (1.0, 0.0, 0.0), 1.0, 0.5)
    assert first_blocked(towards, held, SEPARATION) is not None
