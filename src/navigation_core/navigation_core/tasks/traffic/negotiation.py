"""Reservations between servers: what is agreed, so that a cut network joins no two volumes.

Each server sends its whole state now and again: for each vehicle what it holds or would like to
hold, with a number that counts changes, and the numbers of the others' states that it agrees to.

1. A server may use a volume once every other server that it knows has agreed to it.
2. It agrees to a volume that keeps apart from all that its own vehicles hold or would like to
   hold. Where only a wish of its own is in the way, and the other vehicle has the better rank, it
   gives up the wish and agrees.
3. A volume that it has agreed to counts as held, until the other's later state gives it up.
4. When a server is heard for the first time, it has agreed to nothing: vehicles in flight stop, and
   continue with what both agree to.

So of two volumes that are in each other's way at most one is ever agreed to by both servers,
whatever is lost, delayed or doubled: whoever agreed second had the first among its reservations. A
server that is silent keeps the reservations that it sent last, and those that its vehicles need
without a link; it agrees to nothing meanwhile: vehicles of others continue within what they have.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from navigation_core.tasks.traffic.crowds import first_blocked
from navigation_core.tasks.traffic.entries import Entry, Intent, Rank, wait_for
from navigation_core.tasks.traffic.reservations import TrafficReservations
from navigation_core.tasks.traffic.volumes import NOWHERE, Array, Volume, joined

__all__ = ["Negotiation", "PeerState", "PeerVehicle"]

# Silence of a server after which what its vehicles may do without a link counts as held.
SILENCE_MAX_S = 1.5
# After its start, and when another one is found, a server listens for this time before a vehicle
# of its moves. Time that it did not run does not count.
LISTEN_S, _LISTEN_STEP_MAX_S = 2.0, 0.5


@dataclass(frozen=True, eq=False)
class PeerVehicle:
    """The state of one vehicle, as its server reports it.

    Attributes:
        name: its name among all servers.
        rank: its right of way.
        number: counts the changes of what it holds.
        held: what it holds or would like to hold, in the traffic frame.
        alone: what it may enter besides if its server falls silent.
        reach: where it can ever be sent; NOWHERE for anywhere.
        path: its announced path, or NOWHERE.
        after_s: time from the state until it is at each point of that.
        target: where its goal leads, or NOWHERE.
        moves: whether it is expected to leave what it holds, also if it has to give way.
        waits_for: the vehicle that it waits for; empty for none.
    """

    name: str
    rank: Rank
    number: int
    held: Volume
    alone: Volume
    reach: Volume
    path: Volume
    after_s: Array
    target: Volume
    moves: bool
    waits_for: str = ""


@dataclass(frozen=True, eq=False)
class PeerState:
    """A server's state.

    Attributes:
        server: its name.
        epoch: differs after each start of the server.
        sequence: counts its states.
        vehicles: all of its vehicles.
        agreed: for each other server, its epoch, and the number agreed to by vehicle.
    """

    server: str
    epoch: int
    sequence: int
    vehicles: tuple[PeerVehicle, ...]
    agreed: Mapping[str, tuple[int, Mapping[str, int]]]


@dataclass
class _Peer:
    """Another server, and what has been agreed with it.

    Attributes:
        state: what it said last.
        heard_s: when.
        agreed_to: the numbers of its vehicles' volumes that were agreed to.
        agrees: the numbers of our vehicles' volumes that it agrees to.
        vehicles: what it said last of each vehicle. One that it says nothing about any more, as
            after a restart until it is found, stays where it was.
        has_ended: whether it said that it ends.
    """

    state: PeerState
    heard_s: float
    agreed_to: dict[str, int] = field(default_factory=dict)
    agrees: dict[str, int] = field(default_factory=dict)
    vehicles: dict[str, PeerVehicle] = field(default_factory=dict)
    has_ended: bool = False


class Negotiation:
    """One server's part of the negotiation; it keeps the others' vehicles in the reservations."""

    def __init__(
        self,
        reservations: TrafficReservations,
        server: str,
        epoch: int,
        expected: Iterable[str] = (),
        now: float = 0.0,
    ) -> None:
        """Begin without having heard anybody.

        Args:
            reservations: of this server; it learns from here what must be agreed to.
            server: name of this server.
            epoch: of this start.
            expected: servers that must have been heard before anything is agreed.
            now: time in seconds; nothing is agreed before others had time to be heard.
        """
        self._reservations = reservations
        self._server = server
        self._epoch = epoch
        self._expected = frozenset(expected) - {server}
        self._peers: dict[str, _Peer] = {}
        self._sequence = 0
        self._own: set[str] = set()
        self._now = self._looked_s = now
        self._listened_s = 0.0
        self._found = 0
        reservations.agreement = self

    @property
    def peers(self) -> dict[str, float]:
        """When each other server was heard last."""
        return {name: peer.heard_s for name, peer in self._peers.items()}

    @property
    def missing(self) -> frozenset[str]:
        """The servers that are expected and were never heard."""
        return self._expected - set(self._peers)

    # --- asked by the reservations -----------------------------------------------------------

    def is_given(self, name: str, number: int, volume: Volume) -> bool:
        """Whether all servers whose vehicles may ever get near a volume agree to a wish."""
        if self.missing or self._listened_s < LISTEN_S:
            return False
        return all(
            peer.has_ended
            or peer.agrees.get(name, -1) >= number
            or not self._concerns(peer, volume)
            for peer in self._peers.values()
        )

    def missing_from(self, name: str) -> tuple[str, str]:
        """Return a server that has not agreed to a wish of a vehicle of ours, and why."""
        number = self._reservations.entry(name).number
        late = [one for one, peer in self._peers.items() if peer.agrees.get(name, -1) < number]
        if not self.missing and not late:
            return "other servers", "which may not have been heard yet"
        return min([*self.missing, *late]), "which has not agreed yet"

    def _concerns(self, peer: _Peer, volume: Volume) -> bool:
        separation = self._reservations.separation
        return not peer.vehicles or any(
            not len(one.reach) or bool(volume.meets(one.reach, separation).any())
            for one in peer.vehicles.values()
        )

    # --- what is sent and received -------------------------------------------------------------

    def state(self, alone: Mapping[str, tuple[Volume, Volume]], now: float) -> PeerState:
        """Return what to send now.

        Args:
            alone: for each vehicle of ours what it may enter if this server falls silent, and
                where it can ever be sent.
            now: time in seconds.
        """
        self._sequence += 1
        self._now = now
        self._own |= set(alone)
        vehicles = tuple(
            _vehicle_state(self._reservations.entry(name), *volumes, now)
            for name, volumes in alone.items()
        )
        agreed = {
            name: (peer.state.epoch, dict(peer.agreed_to)) for name, peer in self._peers.items()
        }
        return PeerState(self._server, self._epoch, self._sequence, vehicles, agreed)

    def receive(self, state: PeerState, now: float, ends: bool = False) -> None:
        """Take what another server says; a state that is older than the last one is ignored.

        Args:
            state: what it says.
            now: time in seconds.
            ends: whether it ends in order. Its vehicles stay where they are, closed, and it need
                not agree to anything any more.
        """
        if state.server == self._server:
            return
        peer = self._peers.get(state.server)
        if peer is not None and state.epoch == peer.state.epoch:
            if state.sequence <= peer.state.sequence:
                return
        elif peer is not None:
            # It has restarted: what it agreed to is forgotten, what it held counts until it says
            # where its vehicles are.
            peer.agreed_to.clear()
            peer.agrees.clear()
        if peer is None:
            for name in self._reservations.entries:
                if not any(name in other.vehicles for other in self._peers.values()):
                    self._reservations.renew(name)
            peer = self._peers[state.server] = _Peer(state, now)
            self._reservations.agreement = self
        peer.state, peer.heard_s = state, now
        epoch, numbers = state.agreed.get(self._server, (0, {}))
        if epoch == self._epoch:
            peer.agrees.update(numbers)
        peer.has_ended = ends
        for vehicle in state.vehicles:
            self._take(peer, vehicle, now)

    def find(self, servers: int) -> None:
        """Take how many other servers the network knows of; one that is new is listened for."""
        if servers > self._found:
            self._listened_s = 0.0
            self._reservations.agreement = self
        self._found = servers

    def look(self, now: float) -> None:
        """Close what the vehicles of silent servers may enter by themselves."""
        self._listened_s += min(now - self._looked_s, _LISTEN_STEP_MAX_S)
        self._now = self._looked_s = now
        is_alone = not self._peers and not self._expected
        if is_alone and self._listened_s >= LISTEN_S:
            self._reservations.agreement = None
        for peer in self._peers.values():
            if now - peer.heard_s <= SILENCE_MAX_S:
                continue
            for vehicle in peer.vehicles.values():
                entry = self._reservations.entry(vehicle.name)
                entry.kept, entry.moves = vehicle.alone, False
                entry.intent = entry.waiting = None

    def _take(self, peer: _Peer, vehicle: PeerVehicle, now: float) -> None:
        peer.vehicles[vehicle.name] = vehicle
        entry = self._reservations.entry(vehicle.name)
        entry.rank, entry.heard_s, entry.moves = vehicle.rank, now, vehicle.moves
        entry.kept = NOWHERE
        entry.target = vehicle.target if len(vehicle.target) else None
        entry.intent = None
        if len(vehicle.path):
            entry.intent = Intent(vehicle.path, now + vehicle.after_s)
        before, entry.waiting = entry.waiting, None
        if vehicle.waits_for:
            entry.waiting = wait_for(before, vehicle.waits_for, "as its server says", now)
        # Volumes that it holds by earlier agreement are in there, so all of it is closed to ours,
        # agreed to or not.
        entry.held = vehicle.held
        if self._agrees_to(vehicle):
            peer.agreed_to[vehicle.name] = vehicle.number

    def _agrees_to(self, vehicle: PeerVehicle) -> bool:
        """Whether a volume keeps apart from all that ours hold; wishes may be given up for it."""
        if not self._own:
            return False  # where our own vehicles are is not known yet
        for name in sorted(self._own):
            own = self._reservations.entry(name)
            if self._gets_into(vehicle, own.used, NOWHERE if own.keeps_by_wish else own.kept):
                return False
            if not self._gets_into(vehicle, own.held, own.kept):
                continue
            if own.rank < vehicle.rank:
                return False
            own.give_up_wish()
        return True

    def _gets_into(self, vehicle: PeerVehicle, held: Volume, kept: Volume) -> bool:
        """Whether a volume gets into what one of ours holds and keeps."""
        separation, count = self._reservations.separation, _held_of_path(vehicle)
        if not count:
            return bool(vehicle.held.meets(joined(held, kept), separation).any())
        found = (
            first_blocked(vehicle.path, held, separation),
            first_blocked(vehicle.path, kept, separation, is_kept=True),
        )
        return any(one is not None and one[0] < count for one in found)


def _held_of_path(vehicle: PeerVehicle) -> int:
    """Return how many points of the path that it flies a vehicle holds or would like to hold.

    Zero if it announces a volume for all of the time. What it holds besides the path is where it is
    and runs out to, whatever others agree to.
    """
    held, path = vehicle.held.table, vehicle.path.table
    if not len(vehicle.path) or vehicle.after_s[-1] <= vehicle.after_s[0]:
        return 0
    for begin in np.flatnonzero((held == path[:, :1]).all(axis=0)):
        count: int = held.shape[1] - int(begin)
        if count <= len(vehicle.path) and (held[:, begin:] == path[:, :count]).all():
            return count
    return 0


def _vehicle_state(entry: Entry, alone: Volume, reach: Volume, now: float) -> PeerVehicle:
    intent = entry.intent
    return PeerVehicle(
        name=entry.name,
        rank=entry.rank,
        number=entry.number,
        held=entry.whole,
        alone=alone,
        reach=reach,
        path=NOWHERE if intent is None else intent.volume,
        after_s=NOWHERE.radius_m if intent is None else intent.arrival_s - now,
        target=entry.target or NOWHERE,
        moves=entry.yields(now),
        waits_for="" if entry.waiting is None else entry.waiting.whom,
    )
