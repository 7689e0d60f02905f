"""Range readings: OBSTACLE_DISTANCE and DISTANCE_SENSOR as rays; sans I/O.

The fields are described in common.xml (mavlink.io/en/messages/common.html). How firmwares fill
them was read in their sources, as facts:

- ArduPilot sends what its proximity sensors see as DISTANCE_SENSOR with ids from 10 on, one for
  each eighth of the horizon and one upwards. It sends no field of view with them; each is the
  nearest thing in its eighth. One that sees nothing has the reach itself as its distance.
- ArduPilot and PX4 send a rangefinder that looks down the same way, so where it looks counts.
- PX4 sends the OBSTACLE_DISTANCE that its collision prevention has fused, of 72 sectors.
"""

from __future__ import annotations

import enum
import math
import re
from dataclasses import dataclass
from functools import cache, lru_cache

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.positions.frames import Vector3

__all__ = [
    "RANGE_MESSAGES",
    "RangeAxes",
    "RangeMessage",
    "RangeReader",
    "RangeSource",
    "RangesMeasured",
    "RangesRefused",
]

_Scan = mavlink.MAVLink_obstacle_distance_message
_Beam = mavlink.MAVLink_distance_sensor_message
RangeMessage = _Scan | _Beam
RANGE_MESSAGES = (_Scan, _Beam)

_UNKNOWN_CM = 65535
_UNKNOWN_COVARIANCE = 255
_SIGNAL_INVALID = 1
_CUSTOM = mavlink.MAV_SENSOR_ROTATION_CUSTOM
_UNIT_TOLERANCE = 0.1
# ArduPilot's own sensors: the first id of its proximity sectors, and how wide those are.
_PROXIMITY_ID = 10
_PROXIMITY_WIDTH_RAD = math.radians(45.0)
_EIGHTHS = 8
# Garbage is different each time.
_REASONS_MAX = 20


class RangeAxes(enum.Enum):
    """The axes in which directions are given."""

    BODY = "body"
    """Forward, right, down of the vehicle, as it is tilted."""
    LEVEL = "level"
    """Forward along its heading, right, down; not tilted."""
    NORTH = "north"
    """North, east, down."""


# MAV_FRAME. The message's definition names GLOBAL (the default, aligned with north) and BODY_FRD;
# the others that are aligned with north or with the vehicle are taken by their own definition.
_AXES: dict[int, RangeAxes] = {
    mavlink.MAV_FRAME_GLOBAL: RangeAxes.NORTH,
    mavlink.MAV_FRAME_LOCAL_NED: RangeAxes.NORTH,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT: RangeAxes.NORTH,
    mavlink.MAV_FRAME_GLOBAL_INT: RangeAxes.NORTH,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: RangeAxes.NORTH,
    mavlink.MAV_FRAME_LOCAL_OFFSET_NED: RangeAxes.NORTH,
    mavlink.MAV_FRAME_BODY_FRD: RangeAxes.BODY,
    mavlink.MAV_FRAME_LOCAL_FRD: RangeAxes.LEVEL,
}


class RangeSource(enum.Enum):
    """The message that a reading came with."""

    OBSTACLE_DISTANCE = "OBSTACLE_DISTANCE"
    DISTANCE_SENSOR = "DISTANCE_SENSOR"


@dataclass(frozen=True)
class RangesMeasured:
    """The ranges in one message of a range sensor.

    Directions of a scan without a reading are left out. A beam without one is there, since its
    sensor is alive.

    Attributes:
        time_s: when it came.
        time_boot_s: the sender's time of it, since its boot or since 1970.
        component_id: who sent it.
        source: with which message.
        sensor_id: of a DISTANCE_SENSOR; 0 for a scan.
        sensor_type: MAV_DISTANCE_SENSOR.
        axes: of the directions.
        directions: unit vectors: forward (or north), right (or east), down.
        ranges_m: to the nearest thing in each direction; infinity: nothing within reach; NaN:
            nothing is known.
        range_min_m: the least that it can measure.
        range_max_m: its reach.
        width_rad: angle about the vertical that each of the readings stands for; 0: a thin ray,
            or not known.
        deviation_m: standard deviation; None when it is not given.
    """

    time_s: float
    time_boot_s: float
    component_id: int
    source: RangeSource
    sensor_id: int
    sensor_type: int
    axes: RangeAxes
    directions: tuple[Vector3, ...]
    ranges_m: tuple[float, ...]
    range_min_m: float
    range_max_m: float
    width_rad: float = 0.0
    deviation_m: float | None = None


@dataclass(frozen=True)
class RangesRefused:
    """A message of a range sensor makes no sense; reported once per kind of error."""

    reason: str


class RangeReader:
    """Reads the two messages; counts what makes no sense.

    Attributes:
        ignored: number of messages without a usable reading.
    """

    def __init__(self) -> None:
        """Start with nothing ignored."""
        self.ignored = 0
        self._reasons: set[str] = set()

    def read(self, message: RangeMessage, now: float) -> RangesMeasured | RangesRefused | None:
        """Return the ranges in a message of `RANGE_MESSAGES`, None for none."""
        try:
            return _scan(message, now) if isinstance(message, _Scan) else _beam(message, now)
        except _NoReadingError as error:
            self.ignored += 1
            if error.args:
                who = f"{message.get_type()} of component {message._header.srcComponent}"
                reason = f"{who} is ignored: {error}."
                if reason not in self._reasons and len(self._reasons) < _REASONS_MAX:
                    self._reasons.add(reason)
                    return RangesRefused(reason)
            return None


class _NoReadingError(Exception):
    """The message has no reading; with a reason if it should not have been sent like that."""


def _limits_m(message: RangeMessage) -> tuple[float, float]:
    low, high = message.min_distance, message.max_distance
    if high < low or high == 0:
        raise _NoReadingError(f"its max_distance of {high} cm is below its min_distance of {low}")
    return low / 100.0, high / 100.0


def _scan(message: _Scan, now: float) -> RangesMeasured:
    axes = _AXES.get(message.frame)
    if axes is None:
        raise _NoReadingError(
            f"its frame {message.frame} is relative to neither north nor the nose"
        )
    # A negative increment_f turns counter-clockwise (common.xml leaves it open).
    step_deg, offset_deg = message.increment_f or float(message.increment), message.angle_offset
    if not (math.isfinite(step_deg) and math.isfinite(offset_deg)) or step_deg == 0.0:
        raise _NoReadingError(
            f"its sectors are {step_deg} degrees wide, starting at {offset_deg} degrees"
        )
    all_directions = _sectors(step_deg, offset_deg, len(message.distances))
    directions, ranges_m = [], []
    for direction, distance_cm in zip(all_directions, message.distances, strict=False):
        if distance_cm != _UNKNOWN_CM:
            directions.append(direction)
            beyond = distance_cm > message.max_distance
            ranges_m.append(math.inf if beyond else distance_cm / 100.0)
    if not directions:
        raise _NoReadingError  # a PX4 that has fused nothing says just that
    low_m, high_m = _limits_m(message)
    return RangesMeasured(
        time_s=now,
        time_boot_s=message.time_usec * 1e-6,
        component_id=message._header.srcComponent,
        source=RangeSource.OBSTACLE_DISTANCE,
        sensor_id=0,
        sensor_type=message.sensor_type,
        axes=axes,
        directions=tuple(directions),
        ranges_m=tuple(ranges_m),
        range_min_m=low_m,
        range_max_m=high_m,
        width_rad=math.radians(min(abs(step_deg), 360.0)),
    )


@lru_cache(maxsize=8)
def _sectors(step_deg: float, offset_deg: float, count: int) -> tuple[Vector3, ...]:
    """Return the middles of the sectors; those that go round a second time are left out."""
    once = min(count, math.floor(360.0 / abs(step_deg) + 1e-3) or 1)
    bearings = [math.radians(offset_deg + i * step_deg) for i in range(once)]
    return tuple((math.cos(bearing), math.sin(bearing), 0.0) for bearing in bearings)


def _beam(message: _Beam, now: float) -> RangesMeasured:
    low_m, high_m = _limits_m(message)
    direction = _direction(message)
    distance_cm = message.current_distance
    invalid = message.signal_quality == _SIGNAL_INVALID or distance_cm == _UNKNOWN_CM
    if invalid or distance_cm < message.min_distance:
        range_m = math.nan  # too near to be measured is also what sensors without an echo say
    elif distance_cm >= message.max_distance:
        range_m = math.inf
    else:
        range_m = distance_cm / 100.0
    width_rad = message.horizontal_fov
    if not 0.0 < width_rad <= math.tau:
        width_rad = 0.0
        if message.id >= _PROXIMITY_ID and message.orientation < _EIGHTHS:
            width_rad = _PROXIMITY_WIDTH_RAD
    is_known = message.covariance not in (0, _UNKNOWN_COVARIANCE)
    return RangesMeasured(
        time_s=now,
        time_boot_s=message.time_boot_ms * 1e-3,
        component_id=message._header.srcComponent,
        source=RangeSource.DISTANCE_SENSOR,
        sensor_id=message.id,
        sensor_type=message.type,
        axes=RangeAxes.BODY,
        directions=(direction,),
        ranges_m=(range_m,),
        range_min_m=low_m,
        range_max_m=high_m,
        width_rad=width_rad,
        deviation_m=math.sqrt(message.covariance) / 100.0 if is_known else None,
    )


def _direction(message: _Beam) -> Vector3:
    """Return where a DISTANCE_SENSOR looks, in the body's axes: its own x axis, turned."""
    if message.orientation != _CUSTOM:
        known = _orientations().get(message.orientation)
        if known is None:
            raise _NoReadingError(f"its orientation {message.orientation} is not defined")
        return known
    w, x, y, z = message.quaternion
    length = math.sqrt(w * w + x * x + y * y + z * z)
    if not abs(length - 1.0) <= _UNIT_TOLERANCE:
        raise _NoReadingError("its orientation is CUSTOM and its quaternion is not a rotation")
    w, x, y, z = w / length, x / length, y / length, z / length
    return (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y))


@cache
def _orientations() -> dict[int, Vector3]:
    """Return where each MAV_SENSOR_ORIENTATION looks; their names say it.

    Roll turns a sensor about the axis it looks along, so only pitch and yaw matter.
    """
    directions: dict[int, Vector3] = {}
    for number, entry in mavlink.enums["MAV_SENSOR_ORIENTATION"].items():
        angles = {key: int(value) for key, value in re.findall(r"(PITCH|YAW)_(\d+)", entry.name)}
        pitch_rad = math.radians(angles.get("PITCH", 0))
        yaw_rad = math.radians(angles.get("YAW", 0))
        if number < _CUSTOM:
            directions[number] = (
                math.cos(pitch_rad) * math.cos(yaw_rad),
                math.cos(pitch_rad) * math.sin(yaw_rad),
                -math.sin(pitch_rad),
            )
    return directions
