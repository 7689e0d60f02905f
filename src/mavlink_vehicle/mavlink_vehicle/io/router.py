"""Routes between links and an application: decodes, encodes, forwards, records.

A router has *vehicle links* and *station links*. Each peer of a link is an endpoint with a
codec of its own, so that the garbage of one cannot hurt another on the same port. Frames that come
by a vehicle link are for the application; those that come by a station link are forwarded, and the
application may only overhear them. `RoutingTable` decides to whom a frame is sent.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

from mavlink_vehicle.codec import (
    Codec,
    Intake,
    Message,
    Received,
    in_mavlink_1,
    mavlink,
    target,
)
from mavlink_vehicle.io.endpoints import (
    Heard,
    LinkStatistics,
    Source,
    TokenBucket,
    count_frames,
)
from mavlink_vehicle.io.links import Link, Peer
from mavlink_vehicle.io.ports import PeerEndpoint, Port, RouterStatistics
from mavlink_vehicle.io.routes import RoutingTable
from mavlink_vehicle.io.tlog import TlogWriter
from mavlink_vehicle.state.identity import is_vehicle

MakeCodec: TypeAlias = Callable[[], Codec]
FindIntakes: TypeAlias = Callable[[int, int], Mapping[int, Intake]]

STATIONS_FRAMES_HZ, STATIONS_BURST = 2000.0, 4000.0
"""Frames that all ground stations together may send, however many there are."""

STATION_COPIES_HZ, STATION_COPIES_BURST = 4000.0, 1000.0
"""Frames of ground stations passed on to others of them, all together, each some 5 to 20 us of
work. Without it what every station says to all others grows with their square."""

VEHICLE_COPIES_HZ, VEHICLE_COPIES_BURST = 16_000.0, 4000.0
"""Frames of vehicles passed on to all ground stations together: a vehicle to 128 stations, or ten
vehicles to twelve. Those that came last got less than the others of 50 with less."""

_PAUSE_S = 0.005
_EXPIRY_CHECK_S = 1.0
_MAGIC_2 = 0xFD
_HEARTBEAT = mavlink.MAVLINK_MSG_ID_HEARTBEAT
_SETUP_SIGNING = mavlink.MAVLINK_MSG_ID_SETUP_SIGNING


class Router:
    """The MAVLink network of a server; used by one thread.

    Attributes:
        statistics: what was counted.
        find_intakes: returns what takes the measurements of a sender on a vehicle link straight
            from their frames, by message number; asked at its HEARTBEATs until it is known.
    """

    def __init__(
        self,
        vehicle_links: Sequence[Link],
        make_codec: MakeCodec,
        station_links: Sequence[Link] = (),
        recorder: TlogWriter | None = None,
        vehicles: int = 1,
    ) -> None:
        """Put them together.

        Args:
            vehicle_links: what leads to vehicles; the router closes them.
            make_codec: makes a codec for one more endpoint.
            station_links: what leads to ground stations; the router closes them.
            recorder: takes what passes vehicle links, both ways, and what ground stations
                send that is passed on; the router closes it.
            vehicles: how many are expected; a peer that speaks for several may send that many
                times as much.
        """
        self._vehicles = vehicles
        self._vehicle_ports = [Port(link, station=False) for link in vehicle_links]
        self._station_ports = [Port(link, station=True) for link in station_links]
        self._ports = [*self._vehicle_ports, *self._station_ports]
        self._make_codec = make_codec
        self.find_intakes: FindIntakes = _no_intakes
        self._recorder = recorder
        self._failure_reported = False
        self._table: RoutingTable[PeerEndpoint] = RoutingTable()
        self._unknown: list[bytes] = []
        self._stations_bucket = TokenBucket(STATIONS_FRAMES_HZ, STATIONS_BURST)
        self._copies_of_stations = TokenBucket(STATION_COPIES_HZ, STATION_COPIES_BURST)
        self._copies_of_vehicles = TokenBucket(VEHICLE_COPIES_HZ, VEHICLE_COPIES_BURST)
        self._now = 0.0
        self._next_expiry_s = -math.inf
        self.statistics = RouterStatistics(self._vehicle_ports, self._station_ports)
        for port in self._ports:
            self._follow_peers(port)

    @property
    def has_stations(self) -> bool:
        """Whether `overhear` may ever return something."""
        return bool(self._station_ports)

    def poll(self, now: float) -> float | None:
        """Let the links do what is due; return when to be called again, or None."""
        self._now = now
        if now >= self._next_expiry_s:
            self._next_expiry_s = now + _EXPIRY_CHECK_S
            self._table.expire(now)
        due_s = None
        for port in self._ports:
            time_s = port.link.poll(now)
            if port.resume_s > now:
                time_s = port.resume_s if time_s is None else min(time_s, port.resume_s)
            if time_s is not None and (due_s is None or time_s < due_s):
                due_s = time_s
        return due_s

    def filenos(self) -> tuple[int, ...]:
        """Return the file descriptors that become readable when something comes."""
        if len(self._ports) == 1:
            return self._ports[0].link.filenos()
        return tuple(
            number
            for port in self._ports
            if port.resume_s <= self._now
            for number in port.link.filenos()
        )

    def receive(self, now: float) -> list[Received]:
        """Return what came by vehicle links, a bounded number, and pass it on."""
        self._now = now
        messages: list[Received] = []
        for port in self._vehicle_ports:
            self._take(port, messages, now)
        return messages

    def overhear(self, now: float) -> list[Received]:
        """Return what came by station links, a bounded number, and pass it on."""
        messages: list[Received] = []
        for port in self._station_ports:
            if port.resume_s <= now:
                self._take(port, messages, now)
        return messages

    def send(self, message: Message) -> None:
        """Send a message of our own to where its target was heard, or to all vehicle links.

        One without a target goes to the vehicle it speaks for and to all ground stations.

        Raises:
            MessageError: it can't be encoded.
        """
        system, component = target(message)
        speaks_for = message._header.srcSystem if getattr(message, "source_is_set", False) else 0
        found = self._table.destinations_of_ours(speaks_for, system, component)
        recorded = self._recorder is None
        for endpoint in found:
            frame = endpoint.codec.encode(message)
            self._table.claim((frame[5], frame[6]))
            if self._station_ports:
                self._table.remember_ours(frame, self._now)
            if self._recorder is not None and not recorded:
                recorded = True
                self._recorder.write(frame)
            endpoint.send(frame)

    def flush(self) -> None:
        """Hand the recording to the operating system.

        Raises:
            LinkError: the recording has ended for lack of space or the like; raised once.
        """
        if self._recorder is None:
            return
        self._recorder.flush()
        if self._recorder.failure is not None and not self._failure_reported:
            self._failure_reported = True
            raise self._recorder.failure

    def close(self) -> None:
        """Close the links and the recording."""
        for port in self._ports:
            port.link.close()
        if self._recorder is not None:
            self._recorder.close()

    def _take(self, port: Port, messages: list[Received], now: float) -> None:
        """Receive from a link, and pass on."""
        link = port.link
        endpoint: PeerEndpoint | None = None
        last: Peer = None
        limited = alone = False
        for data, peer in link.receive():
            if endpoint is None or peer != last:
                last, endpoint = peer, port.endpoints.get(peer) or self._join(port, peer)
                limited = port.station or len(port.endpoints) > 1 or self._vehicles > 1
                alone = len(self._table.endpoints) == 1 and not port.station
            if limited and self._is_flooded(port, endpoint, data):
                continue
            sources = endpoint.sources
            for message in endpoint.codec.receive(data):
                # Most telemetry comes where there is nobody to pass it on to.
                number, heard = _of_one_source(message, sources)
                if alone and heard and heard.current and number != _HEARTBEAT:
                    heard.frames += 1
                    heard.heard_s = now
                    messages.append(message)
                elif self._pass(endpoint, message, now):
                    messages.append(message)
            if self._unknown:
                self._pass_unknown(endpoint, now)
        if link.peers is not port.peers:
            self._follow_peers(port)

    def _is_flooded(self, port: Port, endpoint: PeerEndpoint, data: bytes) -> bool:
        """Return whether data must be dropped because its sender sends too much."""
        count = count_frames(data)
        speakers = 1 if port.station else max(1, min(len(endpoint.sources), self._vehicles))
        if endpoint.bucket.take(count / speakers, self._now) and (
            not port.station or self._stations_bucket.take(count, self._now)
        ):
            return False
        endpoint.counts.throttled += count
        if port.station:
            port.resume_s = self._now + _PAUSE_S
        return True

    def _pass(self, origin: PeerEndpoint, message: Received, now: float) -> bool:
        if isinstance(message, tuple):
            return self._pass_measurement(origin, message[3], now)
        return self._pass_message(origin, message, now)

    def _pass_message(self, origin: PeerEndpoint, message: Message, now: float) -> bool:
        """Learn from a message, and pass it on; False if it must be dropped."""
        header, frame = message._header, message._msgbuf
        source = header.srcSystem, header.srcComponent
        if not self._table.admit(origin, frame, source, now):
            return False
        if (
            isinstance(message, mavlink.MAVLink_heartbeat_message)
            and not origin.station
            and is_vehicle(message.autopilot, message.type)
        ):
            self._table.protect(header.srcSystem)
            self._find_intakes_of(origin, source)
        # Only the next hop may learn a key by SETUP_SIGNING.
        if len(self._table.endpoints) > 1 and header.msgId != _SETUP_SIGNING:
            self._pass_on(origin, frame, *target(message))
        return True

    def _find_intakes_of(self, origin: PeerEndpoint, source: Source) -> None:
        """Have the measurements of a vehicle taken from their frames, once it is known."""
        sender = origin.sources[source]
        if not sender.takes:
            sender.grant(self.find_intakes(*source))
        if sender.takes:
            origin.codec.senders[source[0] | source[1] << 8] = sender

    def _pass_measurement(self, origin: PeerEndpoint, frame: bytes, now: float) -> bool:
        """Learn from the frame of a measurement, and pass it on; False if it must be dropped."""
        if not self._table.admit(origin, frame, (frame[5], frame[6]), now):
            return False
        if len(self._table.endpoints) > 1:
            self._pass_on(origin, frame, 0, 0)
        return True

    def _pass_unknown(self, origin: PeerEndpoint, now: float) -> None:
        """Forward frames that the dialect does not know, so without a known target: to all."""
        for frame in self._unknown:
            system, component = frame[5:7] if frame[0] == _MAGIC_2 else frame[3:5]
            if self._table.admit(origin, frame, (system, component), now):
                self._pass_on(origin, frame, 0, 0)
        self._unknown.clear()

    def _pass_on(self, origin: PeerEndpoint, frame: bytes, system: int, component: int) -> None:
        found = self._table.destinations(origin, system, component)
        copies = self._copies_of_stations if origin.station else self._copies_of_vehicles
        for endpoint in found:
            if endpoint.station and not copies.take(1, self._now):
                endpoint.counts.withheld += 1
                continue
            endpoint.send(self._as_spoken_by(endpoint, origin, frame))
        if found:
            origin.counts.forwarded += 1
            if origin.station and self._recorder is not None:
                self._recorder.write(frame)
        elif origin.station and system and (system, component) not in self._table.ours:
            origin.counts.unrouted += 1

    def _as_spoken_by(self, endpoint: PeerEndpoint, origin: PeerEndpoint, frame: bytes) -> bytes:
        """Return a frame in MAVLink 1 where only that is spoken, and it has such a form.

        OtherServers stay MAVLink 2: most autopilots that send MAVLink 1 hear both.
        """
        if not endpoint.codec.speaks_1 or frame[0] != _MAGIC_2:
            return frame
        form = in_mavlink_1(frame)
        if form:
            self._table.remember_form(form, origin, self._now)
            return form
        if not endpoint.station:
            origin.counts.beyond_mavlink_1 += 1
        return frame

    def _join(self, port: Port, peer: Peer) -> PeerEndpoint:
        codec = self._make_codec()
        codec.link_id = self._ports.index(port) % 256
        codec.unknown_observer = self._unknown.append
        if self._recorder is not None and not port.station:
            codec.frame_observer = self._recorder.write
        endpoint = port.endpoints[peer] = PeerEndpoint(port, peer, codec)
        self._table.add(endpoint)
        return endpoint

    def _follow_peers(self, port: Port) -> None:
        """Let the endpoints be the link's peers of now."""
        port.peers = peers = port.link.peers
        for peer in peers:
            if peer not in port.endpoints:
                self._join(port, peer)
        for peer in [peer for peer in port.endpoints if peer not in peers]:
            endpoint = port.endpoints.pop(peer)
            self._table.remove(endpoint)
            port.gone.add(endpoint.statistics())
            if not endpoint.sources:
                port.strangers.add(endpoint.statistics())
            if not port.station:
                for system in endpoint.systems():
                    gone = self.statistics.gone.setdefault(system, LinkStatistics())
                    gone.add(endpoint.statistics_of(system))


def _no_intakes(_system: int, _component: int) -> Mapping[int, Intake]:
    return {}


def _of_one_source(message: Received, sources: dict[Source, Heard]) -> tuple[int, Heard | None]:
    """Return number and source of a message; of a measurement any number but HEARTBEAT's."""
    if isinstance(message, tuple):
        heard = message[0]
        return -1, heard if isinstance(heard, Heard) else None
    header = message._header
    return header.msgId, sources.get((header.srcSystem, header.srcComponent))
