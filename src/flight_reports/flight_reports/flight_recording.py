"""Flight data of a tlog for pictures and videos, from any recorder.

The messages go through the code that flies (the vehicle, the map frame, the obstacle
map), so a recording shows what the server knew at the time. A recording of the server has
notes, too (:mod:`navigation_bridge.notes`): goals, plans, progress. For a recording of another
program :attr:`FlightRecording.remarks` names what is missing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flight_logs.errors import LogError
from flight_logs.frames.packets import iterate_packets
from flight_logs.vehicles import Source
from flight_reports.contents.log_reader import POSITIONS, Floats, LogContents, read_contents
from flight_reports.contents.track import Figures, Track, figures, read_track
from flight_reports.recorded_events import TEXT, Teller
from flight_reports.timeline import Timeline
from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.positions import frames
from mavlink_vehicle.ranges import RangesMeasured
from navigation_bridge import notes
from navigation_bridge.configuration.settings import ObstacleConfig
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.recording.recorded_notes import RecordedGoal
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import NOTHING, Obstacles

# How often what the map holds is kept: enough for a film.
_LOOK_PERIOD_S = 0.2


class NoFlightError(ValueError):
    """The recording contains no flight; the text says why."""


@dataclass(frozen=True)
class FlightRecording:
    """One vehicle's flight. Times are seconds since its first position; lengths metres.

    Attributes:
        vehicle: for people: "ArduPilot copter, system 1".
        remarks: sentences: what is not in the recording, and what was chosen.
        figures: distance, height and more, as on the page of a report.
        times_s: shape (N,), of the positions.
        positions_enu_m: shape (N, 3), in the map frame.
        yaws_enu_rad: shape (N,).
        speeds_m_s: shape (N,), over the ground.
        goals: those that lead to a place, as they were accepted.
        all_goals: all of them, with what became of each.
        plans: the planned paths.
        replans: number of replans because of obstacles.
        distance_m: remaining length of the path.
        time_left_s: estimated time that remains.
        battery_percent: from 0 to 100.
        status: what the server's goal does, or that it ended; without notes, the mode.
        warnings: what the vehicle said, from warnings upwards.
        obstacles: the map's obstacles, from the sensors.
    """

    vehicle: str
    remarks: tuple[str, ...]
    figures: Figures
    times_s: NDArray[np.float64]
    positions_enu_m: NDArray[np.float64]
    yaws_enu_rad: NDArray[np.float64]
    speeds_m_s: NDArray[np.float64]
    goals: Timeline[RecordedGoal]
    all_goals: tuple[RecordedGoal, ...]
    plans: Timeline[tuple[Vector3, ...]]
    replans: Timeline[int]
    distance_m: Timeline[float]
    time_left_s: Timeline[float]
    battery_percent: Timeline[float]
    status: Timeline[str]
    warnings: Timeline[str]
    obstacles: Timeline[Obstacles]

    @property
    def duration_s(self) -> float:
        """Time from the first to the last position."""
        return float(self.times_s[-1])


def read_recording(path: Path, system: int | None = None) -> FlightRecording:
    """Read the flight of a vehicle in a tlog that has its position.

    It is that of the system, else the best known vehicle, and of several such the first.

    Raises:
        NoFlightError: there is no such file, or no position in it.
    """
    try:
        contents = read_contents(path)
        packets = list(iterate_packets(path))
    except LogError as error:
        raise NoFlightError(str(error)) from error
    vehicle, candidates = _choose(contents, system)
    systems = {number for number, _ in candidates}
    if vehicle is None:
        wanted = "a vehicle" if system is None else f"system {system}"
        others = f"; it contains system {_listed(systems)}" if systems else ""
        raise NoFlightError(f"{path} contains no position of {wanted}{others}.")
    track = read_track(contents, vehicle)
    measured = figures(contents, track)
    if measured is None:
        raise NoFlightError(f"{path} contains no valid position of system {vehicle[0]}.")
    start_s = contents.begun_unix_s + float(track.time_s[0])
    reader, codec = _Reader(vehicle, systems - {vehicle[0]}, start_s), Codec(255, 190)
    for unix_s, data in packets:
        for message in codec.decode(data):
            reader.take(unix_s, message)
    return reader.recording(track, measured, [_remark(vehicle, systems), *track.remarks])


def _choose(contents: LogContents, system: int | None) -> tuple[Source | None, list[Source]]:
    """Return the best known vehicle (of a system) with a position, and all vehicles with one."""
    first_s: dict[Source, float] = {}
    for name in POSITIONS:
        for source in contents.sources():
            records = contents.of(name, source)
            if records is not None and name == POSITIONS[0]:
                records = records[(records["lat"] != 0) | (records["lon"] != 0)]
            if records is not None and len(records):
                time_s = float(records["time_s"][0])
                first_s[source] = min(time_s, first_s.get(source, time_s))
    ranks = contents.vehicles()
    placed = sorted(first_s, key=lambda source: (-ranks.get(source, 0), first_s[source], source))
    candidates = [source for source in placed if source in ranks] or placed
    wanted = [source for source in candidates if system in (None, source[0])]
    return (wanted[0] if wanted else None), candidates


def _remark(chosen: Source, systems: set[int]) -> str:
    others = systems - {chosen[0]}
    if not others:
        return ""
    return f"System {chosen[0]} is drawn; the recording also contains system {_listed(others)}."


def _listed(systems: set[int]) -> str:
    return ", ".join(str(system) for system in sorted(systems))


class _Reader:
    """Follows one vehicle through a recording: its events, and what its sensors see."""

    def __init__(self, vehicle: Source, other_systems: set[int], start_s: float) -> None:
        self._teller = Teller(vehicle, other_systems, self._take_event)
        # The readings of sensors are placed in the server's own map frame.
        self._map_frame = MapFrame()
        self._feed = ObstacleFeed(self._teller.vehicle, self._map_frame, ObstacleConfig())
        self._obstacles: list[tuple[float, Obstacles]] = []
        self._yaws_enu_rad: list[tuple[float, float]] = []
        self._start_s = start_s
        self._time_s = 0.0

    def take(self, unix_s: float, message: Message) -> None:
        """Process the next message of the recording."""
        if unix_s < self._start_s and message.get_srcComponent() == notes.COMPONENT_ID:
            return
        # A clock that was set while recording must not turn a picture round.
        self._time_s = max(self._time_s, unix_s - self._start_s)
        before = self._teller.vehicle.state
        self._teller.take(self._time_s, message)
        state = self._teller.vehicle.state
        self._look_at_map()
        if state is before:
            return
        self._map_frame.update(state)
        if state.attitude is not None and state.attitude is not before.attitude:
            yaw_enu_rad = frames.yaw_ned_to_enu(state.attitude.yaw_ned_rad)
            self._yaws_enu_rad.append((self._time_s, yaw_enu_rad))

    def _take_event(self, time_s: float, event: VehicleEvent) -> None:
        if isinstance(event, RangesMeasured):
            self._feed.take_ranges(event, time_s)

    def _look_at_map(self) -> None:
        seen, shown = self._feed.look().sensed, self._obstacles
        latest = shown[-1] if shown else (-math.inf, NOTHING)
        if seen is not latest[1] and self._time_s - latest[0] >= _LOOK_PERIOD_S:
            shown.append((self._time_s, seen))

    def recording(self, track: Track, measured: Figures, remarks: Sequence[str]) -> FlightRecording:
        """Return the recording of a track, which has a position."""
        times_s = track.time_s - track.time_s[0]
        retold = self._teller.retold
        noted, name = retold.noted, retold.name or "vehicle"
        status = noted.status or [(time_s, f"mode {mode}") for time_s, mode in retold.modes]
        warnings = [
            (moment.time_s, moment.text) for moment in retold.moments if moment.kind == TEXT
        ]
        return FlightRecording(
            vehicle=f"{name}, system {retold.state.system_id}",
            remarks=tuple(remark for remark in [*remarks, *self._lacking()] if remark),
            figures=measured,
            times_s=times_s,
            positions_enu_m=track.position_enu_m,
            yaws_enu_rad=self._yaws_at(times_s),
            speeds_m_s=track.ground_speed_m_s,
            goals=Timeline.of([(g.accepted_s, g) for g in noted.goals if g.targets_enu_m]),
            all_goals=tuple(noted.goals),
            plans=Timeline.of(noted.plans),
            replans=Timeline.of(noted.replans),
            distance_m=Timeline.of(noted.distance_m),
            time_left_s=Timeline.of(noted.time_left_s),
            battery_percent=Timeline.of(retold.battery),
            status=Timeline.of(status),
            warnings=Timeline.of(warnings),
            obstacles=Timeline.of(self._obstacles),
        )

    def _yaws_at(self, times_s: Floats) -> Floats:
        """Return the latest yaw at some times; north where it is not known."""
        known = np.array(self._yaws_enu_rad or [(0.0, frames.yaw_ned_to_enu(0.0))])
        latest = np.searchsorted(known[:, 0], times_s, side="right") - 1
        yaws: Floats = known[np.maximum(latest, 0), 1]
        return yaws

    def _lacking(self) -> list[str]:
        lacking = []
        if not self._teller.retold.noted.status:
            lacking.append("goals, plans and distances (navigation_server --tlog records them)")
        if not self._teller.retold.battery:
            lacking.append("the battery")
        return [f"Not in this recording: {', '.join(lacking)}."] if lacking else []
