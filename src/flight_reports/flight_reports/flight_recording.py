"""Flight data of a tlog for pictures and videos, from any recorder.

The messages go through the code that flies (the vehicle, the map frame, the obstacle
map), so a recording shows what the server knew at the time. A recording of the server has
notes, too (:mod:`navigation_bridge.notes`): goals, plans, progress. What a recording of
another program lacks is said in :attr:`FlightRecording.remarks`.
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
from flight_reports.recorded_events import TEXT, Source, Teller
from flight_reports.timeline import Timeline
from mavlink_vehicle.codec import Codec, Message, mavlink
from mavlink_vehicle.events import VehicleEvent
from mavlink_vehicle.ranges import RangesMeasured
from navigation_bridge import notes
from navigation_bridge.configuration.settings import ObstacleConfig
from navigation_bridge.obstacles.obstacle_feed import ObstacleFeed
from navigation_bridge.recording.recorded_frames import FromFirstPosition, LocalOnly, PoseFrame
from navigation_bridge.recording.recorded_notes import RecordedGoal
from navigation_bridge.vehicle.map_frame import MapFrame, MapPose
from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacles import NOTHING, Obstacles

# How often what the map holds is kept: enough for a film.
_LOOK_PERIOD_S = 0.2
_POSITIONS = ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED")
_Stamped = tuple[float, Message]


class NoFlightError(ValueError):
    """The recording contains no flight; the text says why."""


@dataclass(frozen=True)
class FlightRecording:
    """One vehicle's flight. Times are seconds since its first position; lengths metres.

    Attributes:
        vehicle: for people: "ArduPilot copter, system 1".
        remarks: sentences: what is not in the recording, and what was chosen.
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
        obstacles: what the map held, as the sensors told.
    """

    vehicle: str
    remarks: tuple[str, ...]
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
    """Read the flight of a vehicle in a tlog that tells a position: a system's, or the first.

    Raises:
        NoFlightError: there is no such file, or no position in it.
    """
    try:
        codec = Codec(source_system=255, source_component=190)
        messages = [
            (time_s, message)
            for time_s, data in iterate_packets(path)
            for message in codec.decode(data)
        ]
    except LogError as error:
        raise NoFlightError(str(error)) from error
    vehicle, candidates = _choose(messages, system)
    systems = {number for number, _ in candidates}
    if vehicle is None:
        wanted = "a vehicle" if system is None else f"system {system}"
        told = f"; it contains system {_listed(systems)}" if systems else ""
        raise NoFlightError(f"{path} contains no position of {wanted}{told}.")
    for frame, remark in (
        (MapFrame(), ""),
        (FromFirstPosition(), "The recording has no map origin; the first position is the origin."),
        (LocalOnly(), "The recording has no global position; drawn in the vehicle's local frame."),
    ):
        reader = _Reader(vehicle, systems - {vehicle[0]}, frame)
        for time_s, message in messages:
            reader.take(time_s, message)
        if reader.poses:
            return reader.recording([_remark(vehicle, systems), remark])
    raise NoFlightError(f"{path} contains no valid position of system {vehicle[0]}.")


def _choose(messages: Sequence[_Stamped], system: int | None) -> tuple[Source | None, list[Source]]:
    """Return the first autopilot (of a system) with a position, and all such autopilots."""
    autopilots: set[Source] = set()
    placed: dict[Source, None] = {}
    for _, message in messages:
        source = (message.get_srcSystem(), message.get_srcComponent())
        kind = message.get_type()
        if kind == "HEARTBEAT" and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID:
            autopilots.add(source)
        elif kind == "LOCAL_POSITION_NED" or (
            kind == "GLOBAL_POSITION_INT" and (message.lat or message.lon)
        ):
            placed.setdefault(source)
    candidates = [source for source in placed if source in autopilots] or list(placed)
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
    """Follows one vehicle through a recording, and places it in the map frame."""

    def __init__(self, vehicle: Source, other_systems: set[int], frame: PoseFrame) -> None:
        self.poses: list[tuple[float, MapPose, float]] = []
        self._teller = Teller(vehicle, other_systems, self._take_event)
        self._frame = frame
        # What sensors see is placed in the server's own map frame.
        self._feed: ObstacleFeed | None = None
        if isinstance(frame, MapFrame):
            self._feed = ObstacleFeed(self._teller.vehicle, frame, ObstacleConfig())
        self._obstacles: list[tuple[float, Obstacles]] = []
        self._start_s: float | None = None
        self._time_s = 0.0

    def take(self, unix_s: float, message: Message) -> None:
        """Process the next message of the recording."""
        if self._start_s is not None:
            # A clock that was set while recording must not turn a picture round.
            self._time_s = max(self._time_s, unix_s - self._start_s)
        elif message.get_srcComponent() == notes.COMPONENT_ID:
            return
        before = self._teller.vehicle.state
        self._teller.take(self._time_s, message)
        state = self._teller.vehicle.state
        self._look_at_map()
        if state is before:
            return
        self._frame.update(state)
        if message.get_type() in _POSITIONS:
            self._take_position(unix_s, message.get_type())

    def _take_position(self, unix_s: float, kind: str) -> None:
        state = self._teller.vehicle.state
        if kind != _POSITIONS[0] and state.global_position is not None:
            return
        pose = self._frame.pose(state)
        if pose is None:
            return
        if self._start_s is None:
            self._start_s = unix_s
        velocity_ned_m_s = (0.0, 0.0, 0.0)
        if state.global_position is not None:
            velocity_ned_m_s = state.global_position.velocity_ned_m_s
        elif state.local_position is not None:
            velocity_ned_m_s = state.local_position.velocity_ned_m_s
        self.poses.append((self._time_s, pose, math.hypot(*velocity_ned_m_s[:2])))

    def _take_event(self, time_s: float, event: VehicleEvent) -> None:
        if self._feed is not None and isinstance(event, RangesMeasured):
            self._feed.take_ranges(event, time_s)

    def _look_at_map(self) -> None:
        if self._feed is None or self._start_s is None:
            return
        seen, shown = self._feed.sensed, self._obstacles
        latest = shown[-1] if shown else (-math.inf, NOTHING)
        if seen is not latest[1] and self._time_s - latest[0] >= _LOOK_PERIOD_S:
            shown.append((self._time_s, seen))

    def recording(self, remarks: Sequence[str]) -> FlightRecording:
        """Return the recording, which must have a pose."""
        told = self._teller.retold
        noted, name = told.noted, told.name or "vehicle"
        status = noted.status or [(time_s, f"mode {mode}") for time_s, mode in told.modes]
        warnings = [(moment.time_s, moment.text) for moment in told.moments if moment.kind == TEXT]
        return FlightRecording(
            vehicle=f"{name}, system {told.state.system_id}",
            remarks=tuple(remark for remark in [*remarks, *self._lacking()] if remark),
            times_s=np.array([time_s for time_s, _, _ in self.poses]),
            positions_enu_m=np.array([pose.position_enu_m for _, pose, _ in self.poses]),
            yaws_enu_rad=np.array([pose.yaw_enu_rad for _, pose, _ in self.poses]),
            speeds_m_s=np.array([speed for _, _, speed in self.poses]),
            goals=Timeline.of([(g.accepted_s, g) for g in noted.goals if g.targets_enu_m]),
            all_goals=tuple(noted.goals),
            plans=Timeline.of(noted.plans),
            replans=Timeline.of(noted.replans),
            distance_m=Timeline.of(noted.distance_m),
            time_left_s=Timeline.of(noted.time_left_s),
            battery_percent=Timeline.of(told.battery),
            status=Timeline.of(status),
            warnings=Timeline.of(warnings),
            obstacles=Timeline.of(self._obstacles),
        )

    def _lacking(self) -> list[str]:
        lacking = []
        if not self._teller.retold.noted.status:
            lacking.append("goals, plans and distances (navigation_server --tlog records them)")
        if not self._teller.retold.battery:
            lacking.append("the battery")
        return [f"Not in this recording: {', '.join(lacking)}."] if lacking else []
