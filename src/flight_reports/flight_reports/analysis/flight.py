"""One vehicle's flight with everything a report shows of it. No ROS."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from flight_logs.vehicles import Source, of_vehicle
from flight_reports.analysis.commands import SentCommand, commands
from flight_reports.analysis.link_quality import LinkQuality, link_quality
from flight_reports.analysis.sensed_obstacles import (
    Sensed,
    SensedClearance,
    read_clearance,
    read_sensed,
)
from flight_reports.analysis.tracking import Tracking, tracking
from flight_reports.contents.log_reader import REQUESTS, SETPOINTS, LogContents, Progress
from flight_reports.contents.track import (
    Figures,
    Track,
    TrackSamples,
    figures,
    local_samples,
    read_setpoints,
    read_track,
)
from flight_reports.recorded_events import Retold, Teller
from mavlink_vehicle.codec import mavlink
from navigation_bridge import notes

GAP_S = 3.0
"""Longer silences of the vehicle are reported; HEARTBEAT comes every second."""
_MOVING_M_S = 0.5
_PROGRESS_EVERY = 2000
_OFF_GROUND_M = 1.0
_NOTES = "notes of the recording server"


@dataclass(frozen=True)
class Speaker:
    """A sender of packets.

    Attributes:
        source: MAVLink system and component.
        what: for people, as it says of itself.
        link: quality of the link to the recorder, by its packets.
        requests: how many commands, modes and missions it sent to the vehicle.
        setpoints: how many setpoints.
    """

    source: Source
    what: str
    link: LinkQuality
    requests: int
    setpoints: int

    @property
    def is_recorder(self) -> bool:
        """True for the server's notes, which were never on a link."""
        return self.what == _NOTES


@dataclass(frozen=True)
class Flight:
    """Everything in a log about one vehicle. Times in seconds since the log's first packet.

    Attributes:
        contents: the log.
        source: the autopilot.
        track: where it was.
        retold: modes, battery, what happened, goals.
        speakers: who sent anything.
        commands: to this vehicle.
        setpoints: of positions, NED in m about the map's origin, while it followed setpoints.
        position_tracking: of position setpoints; None without.
        velocity_tracking: of velocity setpoints; None without.
    """

    contents: LogContents
    source: Source
    track: Track
    retold: Retold
    speakers: tuple[Speaker, ...]
    commands: tuple[SentCommand, ...]
    setpoints: TrackSamples
    position_tracking: Tracking | None
    velocity_tracking: Tracking | None

    @cached_property
    def clearance(self) -> SensedClearance:
        """Clearance by the vehicle's own scanner; empty without one."""
        return read_clearance(self.contents, self.source)

    @cached_property
    def sensed(self) -> Sensed | None:
        """Sensed obstacles; None without sensors, or if the log is too long."""
        return read_sensed(self.contents, self.source)

    @property
    def path(self) -> Path:
        """The log's file."""
        return self.contents.path

    @property
    def name(self) -> str:
        """Display name, such as "ArduPilot copter, system 1"."""
        return f"{self.retold.name or 'Vehicle'}, system {self.source[0]}"

    @property
    def link(self) -> LinkQuality:
        """Of the packets that came from the vehicle."""
        return next(s.link for s in self.speakers if s.source == self.source)

    @property
    def figures(self) -> Figures | None:
        """The figures of the flight; None without a position."""
        return figures(self.contents, self.track)

    @property
    def armed_s(self) -> float:
        """Time with armed motors."""
        ends = [time_s for time_s, _ in self.retold.armed[1:]] + [self.contents.duration_s]
        # Without a HEARTBEAT there is no time at which it is known.
        spans = zip(self.retold.armed, ends, strict=False)
        return sum(end_s - begin_s for (begin_s, armed), end_s in spans if armed)

    @property
    def goal_s(self) -> float | None:
        """Time of the acceptance of the first goal, or None."""
        goals = self.retold.noted.goals
        return goals[0].accepted_s if goals else None

    @property
    def takeoff_s(self) -> float | None:
        """Time of take-off, 1 m above the start, or None."""
        if not len(self.track.time_s):
            return None
        up_m = self.track.position_enu_m[:, 2]
        places = np.flatnonzero(up_m > up_m[0] + _OFF_GROUND_M)
        return float(self.track.time_s[places[0]]) if len(places) else None

    @property
    def moved_s(self) -> float | None:
        """Time of the first movement, or None."""
        places = np.flatnonzero(self.track.ground_speed_m_s > _MOVING_M_S)
        return float(self.track.time_s[places[0]]) if len(places) else None


def read_flights(
    contents: LogContents, system: int | None = None, progress: Progress | None = None
) -> list[Flight]:
    """Return the flights of the log's vehicles, or of the one with a system id.

    Args:
        contents: the log.
        system: MAVLink system id; None for all vehicles.
        progress: called now and then, with the bytes of the log done and all of them.
    """
    vehicles = sorted(contents.vehicles())
    chosen = [source for source in vehicles if system in (None, source[0])]
    systems = [number for number, _ in vehicles]
    tellers = {source: Teller(source, systems) for source in chosen}
    for count, (time_s, message) in enumerate(contents.messages()):
        if progress is not None and count % _PROGRESS_EVERY == 0:
            size = contents.counts.bytes
            progress(int(size * time_s / max(contents.duration_s, 1e-3)), size)
        for teller in tellers.values():
            teller.take(time_s, message)
    return [_flight(contents, source, teller.retold) for source, teller in tellers.items()]


def _flight(contents: LogContents, source: Source, retold: Retold) -> Flight:
    track = read_track(contents, source)
    positions, velocities = (
        _while_led(setpoints, retold) for setpoints in read_setpoints(contents, source, track.frame)
    )
    was_at, was_moving = local_samples(contents, source)
    return Flight(
        contents=contents,
        source=source,
        track=track,
        retold=retold,
        speakers=tuple(_speaker(contents, who, source, retold) for who in contents.sources()),
        commands=tuple(commands(contents, source)),
        setpoints=positions,
        position_tracking=tracking(positions, was_at, "m"),
        velocity_tracking=tracking(velocities, was_moving, "m/s"),
    )


def _while_led(setpoints: TrackSamples, retold: Retold) -> TrackSamples:
    """Return the setpoints that came while the vehicle followed setpoints."""
    if not retold.led:
        return setpoints
    times_s = np.array([time_s for time_s, _ in retold.led])
    led = np.array([led for _, led in retold.led])
    latest = np.searchsorted(times_s, setpoints.time_s, side="right") - 1
    kept = (latest >= 0) & led[np.maximum(latest, 0)]
    return TrackSamples(setpoints.time_s[kept], setpoints.vectors_ned[kept])


def _speaker(contents: LogContents, who: Source, vehicle: Source, retold: Retold) -> Speaker:
    packets = contents.packets
    restarts_s = [m.time_s for m in retold.moments if m.kind == "restart" and who == vehicle]
    own = packets[(packets["system"] == who[0]) & (packets["component"] == who[1])]
    return Speaker(
        source=who,
        what=_what(contents, who),
        link=link_quality(own, contents.duration_s, GAP_S, restarts_s),
        requests=_count(contents, REQUESTS, who, vehicle),
        setpoints=_count(contents, SETPOINTS, who, vehicle),
    )


def _count(contents: LogContents, names: tuple[str, ...], who: Source, vehicle: Source) -> int:
    if who == vehicle:
        return 0
    counts = [
        int((records["target_system"] == vehicle[0]).sum())
        for name in names
        if (records := contents.of(name, who)) is not None
    ]
    return sum(counts)


def _what(contents: LogContents, who: Source) -> str:
    heartbeats = contents.of("HEARTBEAT", who)
    if heartbeats is None:
        # Programs of others have this component id, too, but those send HEARTBEAT.
        return _NOTES if who[1] == notes.COMPONENT_ID else "no heartbeat"
    entry = mavlink.enums["MAV_TYPE"].get(int(of_vehicle(heartbeats)["type"][-1]))
    name = "unknown" if entry is None else entry.name
    return str(name.removeprefix("MAV_TYPE_").replace("_", " ").lower())
