"""Routing table that decides where frames are forwarded. Pure: time is an argument.

These are the rules of https://mavlink.io/en/guide/routing.html, and those of
docs/ground_stations.md about ground stations and loops.
"""

from __future__ import annotations

from typing import Generic, TypeVar

from mavlink_vehicle.io.endpoints import Endpoint, Heard, Source

EndpointT = TypeVar("EndpointT", bound=Endpoint)

ROUTE_EXPIRY_S = 30.0
"""Silence after which a route expires (all components send HEARTBEAT at 1 Hz)."""

MEMORY_S = 1.0
"""Minimum time for which a frame is remembered, to recognize it on another route."""

MAX_SOURCES = 256
"""Maximum routes of an endpoint; beyond that, the longest silent one is forgotten."""

_MAX_REMEMBERED = 8192
_MAX_VEHICLE_SOURCES = 4096


class RoutingTable(Generic[EndpointT]):
    """Routes learned from received frames, and the forwarding decisions.

    Attributes:
        endpoints: all known endpoints, in order of appearance.
        ours: the ids that we send from.
    """

    def __init__(self) -> None:
        """Start without endpoints."""
        self.endpoints: list[EndpointT] = []
        self.ours: set[Source] = set()
        self._routes: dict[Source, EndpointT] = {}
        self._endpoints_of: dict[Source, tuple[EndpointT, ...]] = {}
        self._vehicle_systems: set[int] = set()
        self._vehicle_sources: set[Source] = set()
        self._frames: dict[bytes, EndpointT | None] = {}
        self._earlier_frames: dict[bytes, EndpointT | None] = {}
        self._next_generation_s = 0.0

    def add(self, endpoint: EndpointT) -> None:
        """Add an endpoint."""
        self.endpoints.append(endpoint)

    def remove(self, endpoint: EndpointT) -> None:
        """Remove an endpoint and its routes."""
        self.endpoints.remove(endpoint)
        for source, heard in endpoint.sources.items():
            if heard.current:
                self._unroute(source, heard)

    def expire(self, now: float) -> None:
        """Remove expired routes."""
        for endpoint in self.endpoints:
            for source, heard in endpoint.sources.items():
                if heard.current and now - heard.heard_s > ROUTE_EXPIRY_S:
                    self._unroute(source, heard)

    def claim(self, source: Source) -> None:
        """Record that we send from `source`."""
        if source in self.ours:
            return
        self.ours.add(source)
        if source in self._routes:
            self._unroute(source, self._routes[source].sources[source])

    def protect(self, system: int) -> None:
        """Reserve the ids that vehicle links have heard of this system.

        It is a vehicle, as it sent an autopilot's HEARTBEAT on a vehicle link; no ground station
        may use its ids.
        """
        self._vehicle_systems.add(system)

    def admit(self, endpoint: EndpointT, frame: bytes, source: Source, now: float) -> bool:
        """Learn from a received frame; False if it must be dropped, which is counted."""
        if source in self.ours:
            self._refuse_ours(endpoint, frame)
            return False
        if len(self.endpoints) > 1:
            first = self._frames.get(frame) or self._earlier_frames.get(frame)
            if first is not None and first is not endpoint:
                endpoint.counts.duplicates += 1
                return False
            if endpoint.station and self._belongs_to_vehicle(source):
                endpoint.counts.spoofed += 1
                return False
            self._remember(frame, endpoint, now)
        elif endpoint.station and self._belongs_to_vehicle(source):
            endpoint.counts.spoofed += 1
            return False
        heard = endpoint.sources.get(source)
        if heard is None or not heard.current:
            heard = self._learn(endpoint, source)
        heard.frames += 1
        heard.heard_s = now
        return True

    def remember_ours(self, frame: bytes, now: float) -> None:
        """Remember a frame that we send, to recognize it when it comes back."""
        self._remember(frame, None, now)

    def remember_form(self, frame: bytes, origin: EndpointT, now: float) -> None:
        """Remember another form of a frame that is passed on, to recognize its return."""
        self._remember(frame, origin, now)

    def destinations(self, origin: EndpointT, system: int, component: int) -> list[EndpointT]:
        """Return the endpoints that a frame from `origin` is forwarded to.

        Args:
            origin: the endpoint that it came from; it is never sent back.
            system: for which system it is meant; 0 for all.
            component: for which component of that system; 0 for all.
        """
        if system == 0:
            return [e for e in self.endpoints if (e.station or origin.station) and e is not origin]
        if (system, component) in self.ours:
            return []
        return [e for e in self.endpoints_to(system, component) if e is not origin]

    def destinations_of_ours(
        self, source_system: int, system: int, component: int
    ) -> list[EndpointT]:
        """Return the endpoints for a message of our own.

        Args:
            source_system: the system that it is sent from: a vehicle's, or one of our own.
            system: for which system it is meant; 0 for all.
            component: for which component of that system; 0 for all.
        """
        found = list(self.endpoints_to(system or source_system, component if system else 0))
        if system:
            return found or [e for e in self.endpoints if not e.station]
        vehicles = [e for e in found if not e.station]
        return [e for e in self.endpoints if e.station or not vehicles or e in vehicles]

    def endpoints_to(self, system: int, component: int) -> tuple[EndpointT, ...]:
        """Return where a component was heard, or else where its system was."""
        target = (system, component)
        endpoints = self._endpoints_of.get(target)
        if endpoints is None:
            exact = self._routes.get(target)
            of_system = (e for (number, _), e in self._routes.items() if number == system)
            endpoints = tuple(dict.fromkeys(of_system)) if exact is None else (exact,)
            self._endpoints_of[target] = endpoints
        return endpoints

    def _refuse_ours(self, endpoint: EndpointT, frame: bytes) -> None:
        if endpoint.station and frame not in self._frames and frame not in self._earlier_frames:
            endpoint.counts.spoofed += 1
        else:
            endpoint.counts.looped += 1

    def _belongs_to_vehicle(self, source: Source) -> bool:
        return source[0] in self._vehicle_systems and source in self._vehicle_sources

    def _remember(self, frame: bytes, endpoint: EndpointT | None, now: float) -> None:
        if now >= self._next_generation_s or len(self._frames) >= _MAX_REMEMBERED:
            self._earlier_frames, self._frames = self._frames, {}
            self._next_generation_s = now + MEMORY_S
        self._frames[frame] = endpoint

    def _learn(self, endpoint: EndpointT, source: Source) -> Heard:
        """Set the route to a source to the endpoint that has just heard it."""
        before = self._routes.get(source)
        if before is not None:
            before.sources[source].current = False
        heard = endpoint.sources.get(source)
        if heard is None:
            if len(endpoint.sources) >= MAX_SOURCES:
                self._forget_quietest(endpoint)
            heard = endpoint.sources[source] = Heard()
        heard.current = True
        self._routes[source] = endpoint
        self._endpoints_of.clear()
        if not endpoint.station and len(self._vehicle_sources) < _MAX_VEHICLE_SOURCES:
            self._vehicle_sources.add(source)
        return heard

    def _forget_quietest(self, endpoint: EndpointT) -> None:
        source, heard = min(endpoint.sources.items(), key=lambda item: item[1].heard_s)
        if heard.current:
            self._unroute(source, heard)
        del endpoint.sources[source]

    def _unroute(self, source: Source, heard: Heard) -> None:
        heard.current = False
        del self._routes[source]
        self._endpoints_of.clear()
