"""Fleets whose servers hang, are slow, start late and hear each other badly, in simulated time.

A server that hangs is one that is stopped, or whose machine is: its vehicles fly on, and what they
and other servers send waits for it.
"""

from __future__ import annotations

import heapq
import itertools
import math
import random
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from mavlink_sitl import VehicleConfig
from navigation_bridge.goals.requests import NavigateRequest, ReturnRequest
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.traffic.negotiation import Negotiation, PeerState
from tests.fleets.flown import Craft, FlownFleet, homes
from tests.support.flights.peer_states import moved_state

# Maximum number of states that a subscription keeps while its server does not run, and of datagrams
# that the driver reads in a turn.
_DEPTH, _DATAGRAMS = 20, 64
_STATE_PERIOD_S = 0.2

CIRCLE_MAX_S = 10.0
"""How long vehicles may wait for each other in a circle, after the last hang"""


@dataclass(frozen=True)
class Network:
    """The fate of the states that servers send each other.

    Attributes:
        loss: the share that is lost.
        doubled: the share that comes twice.
        late_s: the longest delay.
        found_s: when two servers find each other, after the start of the second.
    """

    loss: float = 0.0
    doubled: float = 0.0
    late_s: float = 0.01
    found_s: float = 0.2


@dataclass
class Server:
    """A server as a process.

    Attributes:
        starts_s: when it is started.
        turn_s: how long each turn of its loop takes.
        runs_from_s: when it runs again.
        inbox: states of others that it has not read yet.
        sent_s: when it sent its own last.
        epoch_s: what its machine's clock shows at time 0.
    """

    starts_s: float = 0.0
    turn_s: float = 0.0
    runs_from_s: float = -math.inf
    inbox: deque[tuple[int, PeerState]] = field(default_factory=lambda: deque(maxlen=_DEPTH))
    sent_s: float = -math.inf
    epoch_s: float = 0.0
    is_started: bool = False


class HangingFleet(FlownFleet):
    """A fleet of several servers, each of which can hang."""

    def __init__(
        self,
        vehicles: Sequence[VehicleConfig],
        belongs: Sequence[int],
        servers: Sequence[Server],
        network: Network,
        seed: int = 1,
        **parameters: Any,
    ) -> None:
        """Prepare; ``belongs[i]`` is the server of vehicle ``i``."""
        self.servers = list(servers)
        self._network = network
        self._chance = random.Random(seed)
        self._flying: list[tuple[float, int, int, int, PeerState]] = []
        self._order = itertools.count()
        self._unread: dict[int, deque[bytes]] = {}
        self.last_hang_s = -math.inf
        super().__init__(vehicles, seed, belongs, **parameters)
        for index, server in enumerate(self.servers):
            self.traffic[index].epoch_s = server.epoch_s
        self.on_tick = self._run_servers

    def stop(self, server: int, seconds: float) -> None:
        """Let a server hang."""
        one = self.servers[server]
        one.runs_from_s = max(one.runs_from_s, self.now + seconds)
        self.last_hang_s = max(self.last_hang_s, one.runs_from_s)

    def _serve(self, craft: Craft) -> None:
        # The vehicle talks into the buffers of the machine.
        link = self.simulation.vehicles[craft.row].link
        unread = self._unread.setdefault(craft.row, deque(maxlen=4000))
        unread.extend(link.read_datagrams())

    def _run_servers(self, now: float) -> None:
        while self._flying and self._flying[0][0] <= now:
            _, _, sender, receiver, state = heapq.heappop(self._flying)
            if self.servers[receiver].is_started:
                self.servers[receiver].inbox.append((sender, state))
        for index, server in enumerate(self.servers):
            if now < server.starts_s or now < server.runs_from_s:
                continue
            if index in self.dead:
                continue
            server.runs_from_s = now + server.turn_s * self._chance.uniform(0.3, 1.0)
            self._turn(index, server, now)

    def _turn(self, index: int, server: Server, now: float) -> None:
        """Do what a driver does in a turn: posted work, messages, timers, sending."""
        traffic = self.traffic[index]
        if not server.is_started:
            server.is_started = True
            name = f"/server{index}"
            traffic.negotiation = Negotiation(traffic.reservations, name, 1, now=now)
        assert traffic.negotiation is not None
        while server.inbox:
            sender, state = server.inbox.popleft()
            if traffic.earth is not None:
                moved = moved_state(state, self.traffic[sender], traffic)
                traffic.negotiation.receive(moved, now)
        if now - server.sent_s >= _STATE_PERIOD_S - 1e-6:
            server.sent_s = now
            traffic.look(now)
            if traffic.earth is not None:
                self._send(index, traffic.negotiation.state(traffic.alone(), now), now)
        for craft in self.crafts:
            if craft.server == index:
                self._turn_of(craft, now)

    def _turn_of(self, craft: Craft, now: float) -> None:
        link, bridge = self.simulation.vehicles[craft.row].link, craft.bridge
        unread = self._unread.get(craft.row, deque())
        for _ in range(min(len(unread), _DATAGRAMS)):
            for message in craft.codec.decode(unread.popleft()):
                bridge.receive(message, now)
        deadline = bridge.next_deadline()
        if deadline is not None and deadline <= now:
            bridge.handle_timer(now)
        for message in bridge.messages_to_send():
            link.write(craft.codec.encode(message))
        while (output := bridge.next_output()) is not None:
            craft.outputs.append((now, output))

    def _send(self, index: int, state: PeerState, now: float) -> None:
        network = self._network
        for other, receiver in enumerate(self.servers):
            if other == index:
                continue
            later_s = max(receiver.starts_s, self.servers[index].starts_s)
            if now < later_s + network.found_s:
                continue
            for _ in range(2 if self._chance.random() < network.doubled else 1):
                if self._chance.random() >= network.loss:
                    at_s = now + self._chance.uniform(0.0, network.late_s)
                    heapq.heappush(self._flying, (at_s, next(self._order), index, other, state))

    def idle(self) -> bool:
        """Whether no goal is active."""
        return all(craft.bridge.goals.active is None for craft in self.crafts)


@dataclass(frozen=True)
class Flight:
    """How a scenario went.

    Attributes:
        share: the least true separation, as a share of the demanded one.
        text: what it was, and how it went.
        waited_s: the longest time of vehicles that waited for each other, after the last hang.
        codes: how goals ended.
    """

    share: float
    text: str
    waited_s: float = 0.0
    codes: tuple[str, ...] = ()


class Hangs:
    """Hangs of all servers of a fleet, one after the other, at any phase."""

    def __init__(self, fleet: HangingFleet, chance: random.Random, longest_s: float) -> None:
        """Prepare; begins now."""
        self._fleet, self._chance, self._longest_s = fleet, chance, longest_s
        self._next_s = [self._later(fleet.now) for _ in fleet.servers]

    def _later(self, now: float) -> float:
        return now + self._chance.expovariate(1.0 / 6.0)

    def look(self) -> None:
        """Stop the servers that hang from now on."""
        for index, next_s in enumerate(self._next_s):
            if self._fleet.now >= next_s:
                hang_s = self._chance.uniform(0.1, self._longest_s)
                self._fleet.stop(index, hang_s)
                self._next_s[index] = self._later(self._fleet.now + hang_s)


def sent_to_one_that_hovers(seed: int) -> Flight:
    """Fly one server's vehicle to where another server's vehicle hovers, on a bad day."""
    chance = random.Random(seed)
    firmware = chance.choice(("ardupilot", "ardupilot", "px4"))
    quick = firmware == "ardupilot" and chance.random() < 0.5
    apart_m, height_m = chance.choice((12.0, 20.0, 30.0)), chance.choice((4.0, 6.0))
    vehicles = [
        VehicleConfig(
            home=home, ready_after_s=1.0, autopilot=firmware,
            parameters={"GUID_TIMEOUT": 1.0} if quick else {},
        )
        for home in homes([(0.0, 0.0), (apart_m, 0.0)], firmware=firmware)
    ]  # fmt: skip
    clocks = (0.0, -3600.0, 86_400.0)
    late_s = chance.choice((0.0, 0.0, 16.0))
    servers = [
        Server(epoch_s=chance.choice(clocks)),
        Server(starts_s=late_s, epoch_s=chance.choice(clocks)),
    ]
    network = Network(
        loss=chance.choice((0.0, 0.0, 0.3, 0.7)), doubled=0.2,
        late_s=chance.choice((0.01, 0.3, 1.5)), found_s=chance.choice((0.2, 0.2, 1.9, 4.0, 8.0)),
    )  # fmt: skip
    fleet = HangingFleet(vehicles, (0, 1), servers, network, seed)
    hovers, flies = fleet.crafts
    fleet.run_until(lambda: hovers.bridge.pose is not None, 60.0)
    fleet.run_for(1.0)
    fleet.go(hovers, 0.0, 0.0, height_m)
    fleet.run_until(lambda: bool(hovers.ends()) and flies.bridge.pose is not None, 60.0)
    for server in servers:
        server.turn_s = chance.choice((0.0, 0.0, 0.05, 0.3, 0.3, 0.6))
    sent: str | Rejection = ""
    end_s = fleet.now + 10.0
    place = fleet.place(flies, chance.choice((0.0, 0.0, 1.0)), 0.0, height_m)
    while fleet.now < end_s:
        sent = fleet.send(flies, NavigateRequest("map", place, (0.0,) * 4, False, 0.0))
        if isinstance(sent, str):
            break
        fleet.run_for(0.5)
    longest_s = chance.choice((0.0, 0.5, 2.0, 5.0, 30.0))
    hangs = Hangs(fleet, chance, longest_s)
    end_s = fleet.now + 70.0
    while fleet.now < end_s and not (flies.ends() and flies.bridge.goals.active is None):
        if longest_s and fleet.now > end_s - 60.0:
            hangs.look()
        fleet.tick()
    text = (
        f"seed {seed} {firmware} quick={quick} apart={apart_m} late={late_s} "
        f"turns={[one.turn_s for one in servers]} {network} hang={longest_s} "
        f"{flies.statuses()[-3:]} worst {fleet.least_share:.2f} {fleet.worst}"
    )
    codes = tuple(end.code.value for _, end in flies.ends())
    return Flight(fleet.least_share, text, 0.0, codes)


class CircleWatch:
    """For how long vehicles wait for each other in a circle, since the last hang."""

    def __init__(self, fleet: HangingFleet) -> None:
        """Watch from now on."""
        self._fleet = fleet
        self._since_s: float | None = None
        self.longest_s = 0.0
        self.who = ""

    def look(self) -> None:
        """Look for a circle now."""
        fleet = self._fleet
        waits: dict[str, str] = {}
        for craft in fleet.crafts:
            entry = fleet.traffic[craft.server].reservations.entries.get(craft.name)
            status = craft.statuses()[-1:]
            if entry is not None and entry.waiting and status == ["WAITING_FOR_TRAFFIC"]:
                waits[craft.name] = entry.waiting.whom
        circle = next((one for one in waits if _comes_back(one, waits)), "")
        if not circle:
            self._since_s = None
            return
        if self._since_s is None:
            self._since_s = fleet.now
        waited_s = fleet.now - max(self._since_s, fleet.last_hang_s)
        if waited_s > self.longest_s:
            self.longest_s, self.who = waited_s, f"{circle} of {waits} until {fleet.now:.0f} s"


def _comes_back(name: str, waits: dict[str, str]) -> bool:
    at = waits[name]
    for _ in waits:
        if at == name:
            return True
        at = waits.get(at, "")
    return False


def swapped_and_returned(seed: int, servers: int = 1) -> Flight:
    """Let copters swap places while their servers hang, and then all return at once."""
    chance = random.Random(seed)
    places = [(0.0, 0.0), (12.0, 0.0), (6.0, 10.0)]
    quick = chance.random() < 0.5
    vehicles = [
        VehicleConfig(
            home=home, ready_after_s=1.0, parameters={"GUID_TIMEOUT": 1.0} if quick else {}
        )
        for home in homes(places)
    ]
    processes = [Server() for _ in range(servers)]
    belongs = [row % servers for row in range(len(places))]
    fleet = HangingFleet(vehicles, belongs, processes, Network(), seed)
    fleet.ready()
    fleet.run_for(2.0)
    for craft, (east, north) in zip(fleet.crafts, places, strict=True):
        fleet.go(craft, east, north, 5.0)
    fleet.run_to_end(60.0)
    turn = chance.choice((0, 1))
    targets = [places[1], places[0], places[2]] if turn else [*places[1:], places[0]]
    for craft, (east, north) in zip(fleet.crafts, targets, strict=True):
        fleet.go(craft, east, north, 5.0)
    for process in processes:
        process.turn_s = chance.choice((0.0, 0.05, 0.3, 0.6))
    longest_s = chance.choice((0.3, 1.0, 3.0, 10.0))
    hangs, watch = Hangs(fleet, chance, longest_s), CircleWatch(fleet)
    end_s = fleet.now + 300.0
    troubled_until_s = fleet.now + 25.0
    while fleet.now < end_s and not fleet.idle():
        if fleet.now < troubled_until_s:
            hangs.look()
        elif fleet.now >= fleet.last_hang_s:
            for process in processes:
                process.turn_s = 0.0
        fleet.tick()
        watch.look()
    swapped_s = fleet.now
    for craft in fleet.crafts:
        fleet.send(craft, ReturnRequest())
    end_s = fleet.now + 300.0
    while fleet.now < end_s and not fleet.idle():
        fleet.tick()
        watch.look()
    codes = tuple(end.code.value for craft in fleet.crafts for _, end in craft.ends())
    text = (
        f"seed {seed} servers={servers} quick={quick} turn={turn} hang={longest_s} "
        f"swapped {swapped_s:.0f} returned {fleet.now - swapped_s:.0f} "
        f"circle {watch.longest_s:.1f} {watch.who} worst {fleet.least_share:.2f} {fleet.worst}"
    )
    return Flight(fleet.least_share, text, watch.longest_s, codes)


def swapped_between_servers(seed: int) -> Flight:
    """Let copters of a server each swap places while these hang, and then all return."""
    return swapped_and_returned(seed, servers=3)
