"""The links of a router, the endpoints of their peers, and their counters."""

from __future__ import annotations

import math

from mavlink_vehicle.codec import Codec
from mavlink_vehicle.io.endpoints import Endpoint, LinkStatistics, TokenBucket
from mavlink_vehicle.io.links import Link, Peer

STATION_FRAMES_HZ, STATION_BURST = 500.0, 1000.0
"""Frames that a ground station may send: several times what uploads and joysticks need."""

NEIGHBOUR_FRAMES_HZ, NEIGHBOUR_BURST = 3000.0, 6000.0
"""Frames that a vehicle may send that shares its port with others: thirty times its telemetry."""


class PeerEndpoint(Endpoint):
    """A peer of a link, with its own codec."""

    def __init__(self, port: Port, peer: Peer, codec: Codec) -> None:
        """Begin with nothing heard."""
        super().__init__(port.station)
        self.link = port.link
        self.peer = peer
        self.codec = codec
        rate_hz, burst = NEIGHBOUR_FRAMES_HZ, NEIGHBOUR_BURST
        if port.station:
            rate_hz, burst = STATION_FRAMES_HZ, STATION_BURST
        self.bucket = TokenBucket(rate_hz, burst)

    def send(self, frame: bytes) -> None:
        """Send a frame there, and count it."""
        if self.link.send(frame, self.peer):
            self.counts.sent += 1
        else:
            self.counts.unsent += 1

    def statistics(self) -> LinkStatistics:
        """Return what the codec and the router have counted."""
        total = LinkStatistics()
        total.add(self.codec.statistics)
        total.add(self.counts)
        return total

    def statistics_of(self, system: int) -> LinkStatistics:
        """Return what of its counts is of one system; what has no sender is of all."""
        total = self.statistics()
        total.frames = sum(h.frames for (number, _), h in self.sources.items() if number == system)
        total.lost = {source: n for source, n in total.lost.items() if source[0] == system}
        return total

    def systems(self) -> set[int]:
        """Return the systems that were heard there."""
        return {system for system, _ in self.sources}


class Port:
    """A link, and the endpoints that its peers are.

    Attributes:
        link: it.
        station: whether ground stations are there, not vehicles.
        endpoints: those of the peers that are there now.
        peers: the link's peers when that was last looked at.
        gone: counts of the endpoints that are no longer there.
        strangers: of those, counts of the endpoints by which nobody was heard.
        resume_s: it isn't read before, because of a flood.
    """

    def __init__(self, link: Link, station: bool) -> None:
        """Begin with no peer."""
        self.link = link
        self.station = station
        self.endpoints: dict[Peer, PeerEndpoint] = {}
        self.peers: tuple[Peer, ...] = ()
        self.gone = LinkStatistics()
        self.strangers = LinkStatistics()
        self.resume_s = -math.inf

    def statistics(self) -> LinkStatistics:
        """Return the counts of all its endpoints, those that are gone included."""
        total = LinkStatistics()
        total.add(self.gone)
        for endpoint in self.endpoints.values():
            total.add(endpoint.statistics())
        return total


class RouterStatistics:
    """Counters since the start; read them on the router's thread.

    Attributes:
        gone: counts of the endpoints that are no longer there, by vehicle.
    """

    def __init__(self, vehicle_ports: list[Port], station_ports: list[Port]) -> None:
        """Look at these ports from now on."""
        self._vehicle_ports = vehicle_ports
        self._station_ports = station_ports
        self.gone: dict[int, LinkStatistics] = {}

    def vehicle_links(self) -> list[tuple[str, LinkStatistics]]:
        """Return URL and counts of each vehicle link."""
        return [(port.link.description, port.statistics()) for port in self._vehicle_ports]

    def station_links(self) -> list[tuple[str, LinkStatistics]]:
        """Return URL and counts of each station link."""
        return [(port.link.description, port.statistics()) for port in self._station_ports]

    def of_system(self, system: int) -> LinkStatistics:
        """Return the counts of a vehicle's endpoints; of all vehicle links for system 0.

        Peers that were never understood on the vehicle's link, as for lack of the key, count, too.
        """
        total = LinkStatistics()
        if system == 0:
            for _, statistics in self.vehicle_links():
                total.add(statistics)
            return total
        total.add(self.gone.get(system, LinkStatistics()))
        for port in self._vehicle_ports:
            endpoints = port.endpoints.values()
            heard = [endpoint for endpoint in endpoints if system in endpoint.systems()]
            for endpoint in heard:
                total.add(endpoint.statistics_of(system))
            if heard:
                total.add(port.strangers)
                for endpoint in endpoints:
                    if not endpoint.sources:
                        total.add(endpoint.statistics())
        return total
