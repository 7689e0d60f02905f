"""Where a recorded vehicle was, and where it was told to be. No ROS."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drone_navigation.map_frame import Geodetic
from drone_navigation.report_log import ESTIMATORS, SETPOINTS, Floats, LogContents
from drone_navigation.report_rates import Source
from drone_navigation.report_tracking import Samples
from flight_logs.records import Records
from mavlink_vehicle import frames
from mavlink_vehicle.codec import mavlink

# GLOBAL_POSITION_INT and LOCAL_POSITION_NED that are this near in time describe one moment.
_PAIR_AGE_S = 0.1
# Standing still, a position wanders; it has moved when it is this far from where it was.
_MOVED_M = 0.3
_POSITION_IGNORED = 0b111
_VELOCITY_IGNORED = 0b111 << 3


@dataclass(frozen=True)
class Track:
    """Where a vehicle was. Lengths in metres, times in seconds.

    Attributes:
        time_s: shape (n,); n is 0 without a position.
        position_enu_m: shape (n, 3), in the map frame.
        velocity_ned_m_s: shape (n, 3).
        origin: of the map frame; None in the vehicle's own local frame.
        remark: a sentence on the frame where it isn't the server's map frame; else empty.
    """

    time_s: Floats
    position_enu_m: Floats
    velocity_ned_m_s: Floats
    origin: Geodetic | None = None
    remark: str = ""

    @property
    def ground_speed_m_s(self) -> Floats:
        """Speed over the ground, shape (n,)."""
        speed: Floats = np.hypot(*self.velocity_ned_m_s[:, :2].T)
        return speed

    @property
    def length_m(self) -> float:
        """The way that was flown, in three dimensions; wandering while standing is left out."""
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


def read_track(contents: LogContents, vehicle: Source) -> Track:
    """Return where a vehicle was, in the map frame if the log tells its origin."""
    local = contents.of("LOCAL_POSITION_NED", vehicle)
    places = contents.of("GLOBAL_POSITION_INT", vehicle)
    if places is not None:
        valid = (places["lat"] != 0) | (places["lon"] != 0)
        if local is not None:
            # An ArduCopter tells a place before its estimator has one, but no local position.
            valid &= places["time_s"] >= local["time_s"][0] - _PAIR_AGE_S
        valid &= _stood_by(contents, vehicle, places["time_s"])
        places = places[valid] if valid.any() else None
    if places is None:
        return _local_track(local)
    origin, remark = _origin(contents, vehicle, places, local)
    return Track(
        places["time_s"],
        enu_m(places["lat"] * 1e-7, places["lon"] * 1e-7, places["alt"] * 1e-3, origin),
        np.stack([places[name] * 0.01 for name in ("vx", "vy", "vz")], axis=-1),
        origin,
        remark,
    )


def enu_m(
    latitude_deg: Floats, longitude_deg: Floats, altitude_m: Floats, origin: Geodetic
) -> Floats:
    """Return places in the map frame, shape (n, 3), as `MapFrame.enu` counts them."""
    rows = zip(latitude_deg.tolist(), longitude_deg.tolist(), altitude_m.tolist(), strict=True)
    ned = [(*frames.geodetic_to_ned(a, b, c, origin)[:2], c - origin[2]) for a, b, c in rows]
    return np.array([(east, north, up) for north, east, up in ned]).reshape(-1, 3)


def read_setpoints(
    contents: LogContents, vehicle: Source, origin: Geodetic | None
) -> tuple[Samples, Samples]:
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
        if len(placed) and (ned := _setpoint_ned(name, placed, origin)) is not None:
            positions.append((placed["time_s"], ned))
        moving = chosen[(chosen["type_mask"] & _VELOCITY_IGNORED) == 0]
        if len(moving):
            velocities.append((moving["time_s"], _vectors(moving, "vx", "vy", "vz")))
    return _joined(positions), _joined(velocities)


def local_samples(contents: LogContents, vehicle: Source) -> tuple[Samples, Samples]:
    """Return what LOCAL_POSITION_NED tells: positions (NED, m) and velocities (NED, m/s)."""
    local = contents.of("LOCAL_POSITION_NED", vehicle)
    if local is None:
        return _joined([]), _joined([])
    return (
        Samples(local["time_s"], _vectors(local, "x", "y", "z")),
        Samples(local["time_s"], _vectors(local, "vx", "vy", "vz")),
    )


_FRAMES = {
    "SET_POSITION_TARGET_LOCAL_NED": (mavlink.MAV_FRAME_LOCAL_NED,),
    "SET_POSITION_TARGET_GLOBAL_INT": (
        mavlink.MAV_FRAME_GLOBAL,
        mavlink.MAV_FRAME_GLOBAL_INT,
    ),
}


def _setpoint_ned(name: str, records: Records, origin: Geodetic | None) -> Floats | None:
    if name == "SET_POSITION_TARGET_LOCAL_NED":
        return _vectors(records, "x", "y", "z")
    if origin is None:
        return None
    altitude_m = records["alt"].astype(np.float64)
    enu = enu_m(records["lat_int"] * 1e-7, records["lon_int"] * 1e-7, altitude_m, origin)
    return enu[:, [1, 0, 2]] * (1.0, 1.0, -1.0)


def _vectors(records: Records, *names: str) -> Floats:
    return np.stack([records[name].astype(np.float64) for name in names], axis=-1)


def _joined(parts: list[tuple[Floats, Floats]]) -> Samples:
    if not parts:
        return Samples(np.zeros(0), np.zeros((0, 3)))
    time_s = np.concatenate([part[0] for part in parts])
    vectors = np.concatenate([part[1] for part in parts])
    chosen = np.argsort(time_s, kind="stable")
    chosen = chosen[np.isfinite(vectors[chosen]).all(axis=1)]
    return Samples(time_s[chosen], vectors[chosen])


def _local_track(local: Records | None) -> Track:
    if local is None:
        return Track(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)))
    ned = _vectors(local, "x", "y", "z")
    return Track(
        local["time_s"],
        ned[:, [1, 0, 2]] * (1.0, 1.0, -1.0),
        _vectors(local, "vx", "vy", "vz"),
        None,
        "The log has no valid global position: the map is in the vehicle's own local frame.",
    )


def _stood_by(contents: LogContents, vehicle: Source, time_s: Floats) -> NDArray[np.bool_]:
    """Tell at which times the estimator stood by its position, as far as it says anything."""
    stood = np.ones(len(time_s), dtype=np.bool_)
    for name in ESTIMATORS:
        told = contents.of(name, vehicle)
        if told is not None:
            latest = np.searchsorted(told["time_s"], time_s, side="right") - 1
            good = (told["flags"] & mavlink.ESTIMATOR_POS_HORIZ_ABS) != 0
            stood &= (latest < 0) | good[np.maximum(latest, 0)]
    return stood


def _origin(
    contents: LogContents, vehicle: Source, places: Records, local: Records | None
) -> tuple[Geodetic, str]:
    """Return the origin of the map, and a sentence if it isn't the vehicle's own."""
    told = contents.of("GPS_GLOBAL_ORIGIN", vehicle)
    if told is not None:
        told = told[(told["latitude"] != 0) | (told["longitude"] != 0)]
    if told is not None and len(told):
        first = told[0]
        place = (float(first["latitude"]), float(first["longitude"]), float(first["altitude"]))
        return (place[0] * 1e-7, place[1] * 1e-7, place[2] * 1e-3), ""
    if local is not None and (pair := _from_pair(places, local)) is not None:
        return pair, ""
    lat, lon, alt = (float(places[name][0]) for name in ("lat", "lon", "alt"))
    remark = "The log doesn't tell the map's origin: the map begins at the first position."
    return (lat * 1e-7, lon * 1e-7, alt * 1e-3), remark


def _from_pair(places: Records, local: Records) -> Geodetic | None:
    """Return the origin that a local and a global position of one moment give."""
    nearest = np.clip(np.searchsorted(local["time_s"], places["time_s"]), 0, len(local) - 1)
    pairs = np.flatnonzero(np.abs(local["time_s"][nearest] - places["time_s"]) <= _PAIR_AGE_S)
    if not len(pairs):
        return None
    place, there = places[pairs[0]], local[nearest[pairs[0]]]
    here = (float(place["lat"]) * 1e-7, float(place["lon"]) * 1e-7, float(place["alt"]) * 1e-3)
    back = (-float(there["x"]), -float(there["y"]), 0.0)
    latitude_deg, longitude_deg, _ = frames.ned_to_geodetic(back, here)
    return latitude_deg, longitude_deg, here[2] + float(there["z"])
