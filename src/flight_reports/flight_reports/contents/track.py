"""Recorded track and setpoints of a vehicle. No ROS."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flight_logs.frames.records import Records
from flight_logs.vehicles import Source, of_vehicle
from flight_reports.contents.log_reader import ESTIMATORS, SETPOINTS, Floats, LogContents
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.positions.frame_finder import PAIR_AGE_S, FrameFinder
from mavlink_vehicle.positions.frames import Geodetic, LocalFrame
from mavlink_vehicle.profiles import GENERIC, profile_for

# Standing still, a position wanders; it has moved when it is this far from where it was.
_MOVED_M = 0.3
_HOME_AT_SEA_M = 0.005
_UNCONFIRMED = (
    "The vehicle's estimator confirms no position in this log; the positions are shown as they "
    "were sent."
)
_POSITION_IGNORED = 0b111
_VELOCITY_IGNORED = 0b111 << 3


@dataclass(frozen=True)
class TrackSamples:
    """Vectors and their times: shape (n,) in s, shape (n, 3), NED."""

    time_s: Floats
    vectors_ned: Floats

    def at(self, time_s: Floats) -> Floats:
        """Return the vectors at some times, interpolated linearly between those reported."""
        return np.stack(
            [np.interp(time_s, self.time_s, part) for part in self.vectors_ned.T], axis=-1
        )


@dataclass(frozen=True)
class Track:
    """Track of a vehicle. Lengths in metres, times in seconds.

    Attributes:
        time_s: shape (n,), since the log's first packet; n is 0 without a position.
        position_enu_m: shape (n, 3), in the map frame.
        velocity_ned_m_s: shape (n, 3).
        height_m: shape (n,), above `height_reference`.
        height_reference: "home" or "the first position".
        frame: the local frame that the map is made of; None where its origin is not known.
        remarks: sentences on what is not as usual about it.
    """

    time_s: Floats
    position_enu_m: Floats
    velocity_ned_m_s: Floats
    height_m: Floats
    height_reference: str
    frame: LocalFrame | None = None
    remarks: tuple[str, ...] = ()

    @property
    def ground_speed_m_s(self) -> Floats:
        """Speed over the ground, shape (n,)."""
        speed: Floats = np.hypot(*self.velocity_ned_m_s[:, :2].T)
        return speed

    @property
    def has_velocity(self) -> bool:
        """Whether the log has velocities: some have positions only, and zeros instead."""
        return bool(self.velocity_ned_m_s.any()) or self.length_m == 0.0

    @property
    def length_m(self) -> float:
        """Distance flown in three dimensions, without position noise at rest."""
        if not len(self.time_s):
            return 0.0
        total_m, here = 0.0, self.position_enu_m[0]
        for place in self.position_enu_m:
            step_m = float(np.linalg.norm(place - here))
            if step_m >= _MOVED_M:
                total_m, here = total_m + step_m, place
        return total_m

    def at(self, time_s: float) -> tuple[float, float, float] | None:
        """Return the position (ENU, m) at a time, None before the first."""
        index = int(np.searchsorted(self.time_s, time_s, side="right")) - 1
        if index < 0:
            return None
        east_m, north_m, up_m = self.position_enu_m[index].tolist()
        return east_m, north_m, up_m


@dataclass(frozen=True)
class Figures:
    """The figures of a flight: those of the page, of the plot and of the demo.

    Attributes:
        duration_s: of the log, from its first packet to its last.
        distance_m: flown in three dimensions, without position noise at rest.
        highest_m: the greatest height above `height_reference`.
        height_reference: "home" or "the first position".
        fastest_m_s: the greatest speed over the ground; None if the log has no velocity.
    """

    duration_s: float
    distance_m: float
    highest_m: float
    height_reference: str
    fastest_m_s: float | None


def figures(contents: LogContents, track: Track) -> Figures | None:
    """Return the figures of a flight; None without a position."""
    if not len(track.time_s):
        return None
    return Figures(
        contents.duration_s,
        track.length_m,
        float(track.height_m.max()),
        track.height_reference,
        float(track.ground_speed_m_s.max()) if track.has_velocity else None,
    )


def read_track(contents: LogContents, vehicle: Source) -> Track:
    """Return the track of a vehicle, in the map frame if its origin is known.

    A position counts as in the server (`VehicleState.position_valid`, `MapFrame`): if the
    estimator confirms it, and not before the first local position. Where a log has no confirmed
    position, they are shown as they were sent, with a remark.
    """
    local = contents.of("LOCAL_POSITION_NED", vehicle)
    places = contents.of("GLOBAL_POSITION_INT", vehicle)
    remarks: tuple[str, ...] = ()
    if places is not None:
        valid = (places["lat"] != 0) | (places["lon"] != 0)
        if local is not None:
            # An ArduCopter sends a place before its estimator has one, but no local position.
            valid &= places["time_s"] >= local["time_s"][0] - PAIR_AGE_S
        confirmed = _confirmed(contents, vehicle, places["time_s"])
        if (valid & confirmed).any():
            valid &= confirmed
        elif valid.any():
            remarks = (_UNCONFIRMED,)
        places = places[valid] if valid.any() else None
    if places is None:
        return _local_track(local)
    frame, remark = _frame(contents, vehicle, places, local)
    return Track(
        places["time_s"],
        enu_m(places["lat"] * 1e-7, places["lon"] * 1e-7, places["alt"] * 1e-3, frame),
        np.stack([places[name] * 0.01 for name in ("vx", "vy", "vz")], axis=-1),
        *_heights(places),
        frame,
        (*remarks, remark) if remark else remarks,
    )


def _heights(places: Records) -> tuple[Floats, str]:
    """Return the heights, and their reference.

    An ArduPilot without a home, or a rover before arming, counts from sea level (observed); what
    never has another value is not set.
    """
    altitude_m, above_m = places["alt"] * 1e-3, places["relative_alt"] * 1e-3
    home_m = altitude_m - above_m
    known = np.abs(home_m) > _HOME_AT_SEA_M
    if not places["relative_alt"].any() or not known.any():
        return altitude_m - altitude_m[0], "the first position"
    first_home_m = home_m[np.argmax(known)]
    return np.where(known, above_m, altitude_m - first_home_m), "home"


def enu_m(
    latitude_deg: Floats, longitude_deg: Floats, altitude_m: Floats, frame: LocalFrame
) -> Floats:
    """Return places in the map frame, shape (n, 3), as `MapFrame.enu` counts them."""
    rows = zip(latitude_deg.tolist(), longitude_deg.tolist(), altitude_m.tolist(), strict=True)
    ned = np.array([frame.ned_m(place) for place in rows]).reshape(-1, 3)
    return ned[:, [1, 0, 2]] * (1.0, 1.0, -1.0)


def laid_into(track: Track, frame: LocalFrame) -> Track:
    """Return a track that knows its frame in another one, place by place."""
    own = track.frame
    if own is None or own == frame or not len(track.time_s):
        return track
    ned = track.position_enu_m[:, [1, 0, 2]] * (1.0, 1.0, -1.0)
    places = np.array([own.geodetic((row[0], row[1], row[2])) for row in ned.tolist()])
    moved = enu_m(places[:, 0], places[:, 1], places[:, 2], frame)
    return replace(track, position_enu_m=moved, frame=frame)


def read_setpoints(
    contents: LogContents, vehicle: Source, frame: LocalFrame | None
) -> tuple[TrackSamples, TrackSamples]:
    """Return position setpoints (NED about the map's origin, m) and velocity setpoints (NED, m/s).

    Those in frames that turn or move with the vehicle are left out.
    """
    positions, velocities = [], []
    for name in SETPOINTS:
        records = contents.records.get(name)
        if records is None:
            continue
        chosen = records[records["target_system"] == vehicle[0]]
        chosen = chosen[np.isin(chosen["coordinate_frame"], _FRAMES[name])]
        placed = chosen[(chosen["type_mask"] & _POSITION_IGNORED) == 0]
        if len(placed) and (ned := _setpoint_ned(name, placed, frame)) is not None:
            positions.append((placed["time_s"], ned))
        moving = chosen[(chosen["type_mask"] & _VELOCITY_IGNORED) == 0]
        if len(moving):
            velocities.append((moving["time_s"], _vectors(moving, "vx", "vy", "vz")))
    return _joined(positions), _joined(velocities)


def local_samples(contents: LogContents, vehicle: Source) -> tuple[TrackSamples, TrackSamples]:
    """Return the positions (NED, m) and velocities (NED, m/s) of LOCAL_POSITION_NED."""
    local = contents.of("LOCAL_POSITION_NED", vehicle)
    if local is None:
        return _joined([]), _joined([])
    return (
        TrackSamples(local["time_s"], _vectors(local, "x", "y", "z")),
        TrackSamples(local["time_s"], _vectors(local, "vx", "vy", "vz")),
    )


_FRAMES = {
    "SET_POSITION_TARGET_LOCAL_NED": (mavlink.MAV_FRAME_LOCAL_NED,),
    "SET_POSITION_TARGET_GLOBAL_INT": (
        mavlink.MAV_FRAME_GLOBAL,
        mavlink.MAV_FRAME_GLOBAL_INT,
    ),
}


def _setpoint_ned(name: str, records: Records, frame: LocalFrame | None) -> Floats | None:
    if name == "SET_POSITION_TARGET_LOCAL_NED":
        return _vectors(records, "x", "y", "z")
    if frame is None:
        return None
    altitude_m = records["alt"].astype(np.float64)
    enu = enu_m(records["lat_int"] * 1e-7, records["lon_int"] * 1e-7, altitude_m, frame)
    return enu[:, [1, 0, 2]] * (1.0, 1.0, -1.0)


def _vectors(records: Records, *names: str) -> Floats:
    return np.stack([records[name].astype(np.float64) for name in names], axis=-1)


def _joined(parts: list[tuple[Floats, Floats]]) -> TrackSamples:
    if not parts:
        return TrackSamples(np.zeros(0), np.zeros((0, 3)))
    time_s = np.concatenate([part[0] for part in parts])
    vectors = np.concatenate([part[1] for part in parts])
    chosen = np.argsort(time_s, kind="stable")
    chosen = chosen[np.isfinite(vectors[chosen]).all(axis=1)]
    return TrackSamples(time_s[chosen], vectors[chosen])


def _local_track(local: Records | None) -> Track:
    if local is None:
        nothing = np.zeros((0, 3))
        return Track(np.zeros(0), nothing, nothing, np.zeros(0), "the first position")
    ned = _vectors(local, "x", "y", "z")
    return Track(
        local["time_s"],
        ned[:, [1, 0, 2]] * (1.0, 1.0, -1.0),
        _vectors(local, "vx", "vy", "vz"),
        ned[0, 2] - ned[:, 2],
        "the first position",
        None,
        ("The log has no valid global position; the map uses the vehicle's local frame.",),
    )


def _confirmed(contents: LogContents, vehicle: Source, time_s: Floats) -> NDArray[np.bool_]:
    """Return at which times the estimator confirmed a position, by its latest report.

    Before the first report it counts as confirmed, unless no report of the log confirms any.
    """
    reports = [
        reported for name in ESTIMATORS if (reported := contents.of(name, vehicle)) is not None
    ]
    if not reports:
        return np.ones(len(time_s), dtype=np.bool_)
    reported_s = np.concatenate([reported["time_s"] for reported in reports])
    flags = np.concatenate([reported["flags"].astype(np.int64) for reported in reports])
    order = np.argsort(reported_s, kind="stable")
    good = (flags[order] & mavlink.ESTIMATOR_POS_HORIZ_ABS) != 0
    latest = np.searchsorted(reported_s[order], time_s, side="right") - 1
    confirmed: NDArray[np.bool_] = np.where(latest < 0, good.any(), good[np.maximum(latest, 0)])
    return confirmed


def _frame(
    contents: LogContents, vehicle: Source, places: Records, local: Records | None
) -> tuple[LocalFrame, str]:
    """Return the local frame that the map is made of, and a sentence if it isn't the vehicle's."""
    heartbeats = contents.of("HEARTBEAT", vehicle)
    profile = GENERIC
    if heartbeats is not None:
        last = of_vehicle(heartbeats)[-1]
        profile = profile_for(int(last["autopilot"]), int(last["type"]))
    finder = FrameFinder(profile.projection)
    reported = contents.of("GPS_GLOBAL_ORIGIN", vehicle)
    if reported is not None:
        reported = reported[(reported["latitude"] != 0) | (reported["longitude"] != 0)]
    if reported is not None and len(reported):
        finder.take_origin(_place(reported[0], "latitude", "longitude", "altitude"))
    if local is not None and finder.wants_pairs:
        _take_pairs(finder, places, local)
    remark = ""
    if finder.frame is None:
        finder.take_origin(_place(places[0], "lat", "lon", "alt"))
        remark = "The log has no map origin; the first position is the origin."
    frame = finder.frame
    assert frame is not None
    return frame, remark


def _place(record: Records, latitude: str, longitude: str, altitude: str) -> Geodetic:
    return (
        float(record[latitude]) * 1e-7,
        float(record[longitude]) * 1e-7,
        float(record[altitude]) * 1e-3,
    )


def _take_pairs(finder: FrameFinder, places: Records, local: Records) -> None:
    """Give pairs of global and local positions as `MapFrame` does, while there is more to learn.

    Whichever of the two comes is paired with the latest of the other.
    """
    time_s = np.concatenate([places["time_s"], local["time_s"]])
    here = there = -1
    for index in np.argsort(time_s, kind="stable").tolist():
        if not finder.wants_pairs:
            return
        if index < len(places):
            here = index
        else:
            there = index - len(places)
        if here < 0 or there < 0:
            continue
        place, position = places[here], local[there]
        later_s = 1e-3 * (int(place["time_boot_ms"]) - int(position["time_boot_ms"]))
        if max(abs(later_s), abs(place["time_s"] - position["time_s"])) > PAIR_AGE_S:
            continue
        north_m, east_m, down_m = (
            float(position[axis]) + later_s * float(position[speed])
            for axis, speed in (("x", "vx"), ("y", "vy"), ("z", "vz"))
        )
        finder.pair(_place(place, "lat", "lon", "alt"), (north_m, east_m, down_m))
