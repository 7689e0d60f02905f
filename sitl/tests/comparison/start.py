"""The initial state of a recorded vehicle: type, position, parameters and state.

Most of it is explicit (HEARTBEAT, PARAM_VALUE, MISSION_ITEM_INT); some settings
are only known by what they did, and `_given_away` names these.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from comparison.other_links import NOTE, commanded_elsewhere
from comparison.recording import Recording, RecordingError, Timed
from mavlink_sitl.autopilot.plans.plans import PlanItem
from mavlink_sitl.config import DEFAULT_HEADING_DEG, DEFAULT_HOME, PERSONALITIES, VehicleConfig
from mavlink_sitl.dynamics.battery import BatteryModel
from mavlink_sitl.geodesy import GeoPoint, LocalFrame
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.missions.mission_items import from_message

KINDS = {1: "plane", 2: "copter", 10: "rover", 11: "boat", 13: "copter", 14: "copter", 15: "copter"}
"""By MAV_TYPE"""
READY_AFTER_S = {"rover": 42.11, "boat": 42.11, "plane": 20.52}
PX4_READY_AFTER_S = 4.4
"""How long the recorded firmwares took until their estimators used GPS; copters 41.64 s"""
BOOTED_S = 10.0
"""A recording that begins later is not one from power-up"""
STREAMS = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "EXTENDED_SYS_STATE")
UINT16_MAX = 0xFFFF
AUTO = 3
"""The mode's number in ArduCopter"""
ACTION_RTL, ACTION_LAND = 2, 1
"""BATT_FS_LOW_ACT"""

ARMED = dialect.MAV_MODE_FLAG_SAFETY_ARMED


@dataclass(frozen=True)
class Start:
    """A vehicle at the beginning of its recording.

    Attributes:
        mode: its custom mode.
        armed: whether the motors were on.
        position_ned_m: from the local origin; None when it is not reported at the beginning.
        mission: what it had on board already.
        interval_us: of the messages that came without having been asked for in the recording,
            by their numbers.
        notes: where these values come from, for readers of the comparison.
    """

    config: VehicleConfig
    mode: int
    armed: bool
    position_ned_m: tuple[float, float, float] | None
    mission: tuple[PlanItem, ...]
    interval_us: Mapping[int, float]
    notes: tuple[str, ...]

    @property
    def under_way(self) -> bool:
        """Whether somebody had already done something with it."""
        return self.armed or math.hypot(*(self.position_ned_m or (0.0,))) > 2.0


def start_of(recording: Recording, parameters: Mapping[str, float] | None = None) -> Start:
    """Find out how a vehicle was when its recording began.

    Raises:
        RecordingError: there is no such vehicle here.
    """
    beat = next(m for _, m in recording.of("HEARTBEAT"))
    kind = KINDS.get(beat.type)
    if kind is None or (kind, recording.autopilot) not in PERSONALITIES:
        name = dialect.enums["MAV_TYPE"].get(beat.type)
        said = name.name.removeprefix("MAV_TYPE_").lower() if name else f"vehicle {beat.type}"
        raise RecordingError(f"{said} with {recording.autopilot} is not supported")
    known = PERSONALITIES[kind, recording.autopilot].parameters
    names = {spec.name for spec in known}
    found = {**_told(recording), **_given_away(recording, kind), **(parameters or {})}
    values = {name: value for name, value in found.items() if name in names}
    unknown = sorted(set(parameters or {}) - names)
    if unknown:
        raise RecordingError(f"a {kind} with {recording.autopilot} has no parameter {unknown[0]}")
    defaults = {spec.name: spec.default for spec in known}
    notes = tuple(
        f"parameter {name} is {value:g}"
        for name, value in sorted(values.items())
        if not math.isclose(value, defaults[name], rel_tol=1e-6, abs_tol=1e-9)
    )
    return Start(
        _config(recording, kind, values),
        beat.custom_mode,
        bool(beat.base_mode & ARMED),
        _position(recording),
        _mission(recording),
        _unasked(recording),
        (
            *recording.notes,
            *notes,
            *_unknown_mission(recording),
            *([NOTE] if commanded_elsewhere(recording) else []),
        ),
    )


def _config(recording: Recording, kind: str, parameters: dict[str, float]) -> VehicleConfig:
    ready_s = _ready_after_s(recording, kind)
    onboard = dialect.MAVLINK_MSG_ID_HIGHRES_IMU in recording.said
    return VehicleConfig(
        vehicle=kind,
        autopilot=recording.autopilot,
        system_id=recording.own[0],
        heading_deg=_heading_deg(recording, ready_s),
        ready_after_s=ready_s,
        parameters=parameters,
        links=("onboard", "gcs") if onboard else ("gcs",),
        home=_origin(recording, kind, ready_s) or DEFAULT_HOME,
        # ArduPilot's default BATT_CAPACITY, with which they were recorded.
        battery=BatteryModel(capacity_mah=3300.0),
    )


def _heading_deg(recording: Recording, ready_s: float) -> float:
    """Where the nose points once the estimator knows; before, it says 0."""
    for kind, heading_deg in (
        ("ATTITUDE", lambda m: math.degrees(m.yaw)),
        ("GLOBAL_POSITION_INT", lambda m: m.hdg / 100.0),
    ):
        told = recording.of(kind)
        message = next((m for t, m in told if t > ready_s), told[-1][1] if told else None)
        if message is not None and math.isfinite(heading_deg(message)):
            return heading_deg(message)
    return DEFAULT_HEADING_DEG


def _ready_after_s(recording: Recording, kind: str) -> float:
    """When the estimator began to use GPS: ArduPilot says so."""
    usual_s = READY_AFTER_S.get(kind, 41.64)
    if recording.autopilot == "px4":
        return PX4_READY_AFTER_S
    said_s = first(
        recording.of("STATUSTEXT"), lambda m: bool(re.search(r"EKF. IMU0 is using GPS", m.text))
    )
    flew_s = first(recording.of("LOCAL_POSITION_NED"), lambda _: True)
    # After a loss of GPS it says so again.
    if said_s is not None and (flew_s is None or said_s < flew_s + 1.0):
        return max(said_s, 1.0)
    # Had it begun after the recording, it would have been said.
    return min(usual_s, max(recording.begin_s, 1.0)) if recording.begin_s > BOOTED_S else usual_s


def _origin(recording: Recording, kind: str, ready_s: float) -> GeoPoint | None:
    """Where the local frame begins: from a global and a local position of the same moment."""
    places = {m.time_boot_ms: m for _, m in recording.of("GLOBAL_POSITION_INT") if m.lat}
    pairs = [
        (time_s, local, places[local.time_boot_ms])
        for time_s, local in recording.of("LOCAL_POSITION_NED")
        if local.time_boot_ms in places
    ]
    if pairs:
        # Before it is ready, an estimator may be wrong by the height of the place.
        _, local, place = next((pair for pair in pairs if pair[0] > ready_s), pairs[-1])
        point = GeoPoint(place.lat / 1e7, place.lon / 1e7, place.alt / 1e3)
        frame = LocalFrame(point, PERSONALITIES[kind, recording.autopilot].projection)
        return _plausible(frame.to_geodetic(-local.x, -local.y, -local.z))
    for _, home in recording.of("GPS_GLOBAL_ORIGIN", "HOME_POSITION"):
        if home.latitude:
            return _plausible(
                GeoPoint(home.latitude / 1e7, home.longitude / 1e7, home.altitude / 1e3)
            )
    for place in places.values():
        up_m = place.relative_alt / 1e3
        return _plausible(GeoPoint(place.lat / 1e7, place.lon / 1e7, place.alt / 1e3 - up_m))
    return None


def _plausible(point: GeoPoint) -> GeoPoint | None:
    latitude, longitude, altitude = point
    inside = abs(latitude) <= 90.0 and abs(longitude) <= 180.0 and -1000.0 <= altitude <= 20000.0
    return point if inside else None


def _position(recording: Recording) -> tuple[float, float, float] | None:
    for time_s, message in recording.of("LOCAL_POSITION_NED"):
        if time_s < recording.begin_s + 2.0:
            return message.x, message.y, message.z
        break
    return None


def _told(recording: Recording) -> dict[str, float]:
    """The values of parameters before anybody changed them."""
    changed = {m.param_id for _, m in recording.sent if m.get_type() == "PARAM_SET"}
    first_set_s = {
        m.param_id: t for t, m in reversed(recording.sent) if m.get_type() == "PARAM_SET"
    }
    found: dict[str, float] = {}
    for time_s, message in recording.of("PARAM_VALUE"):
        name = message.param_id
        if name in found or (name in changed and time_s >= first_set_s[name]):
            continue
        value = message.param_value
        if recording.autopilot == "px4" and message.param_type != 9:
            value = float(struct.unpack("<i", struct.pack("<f", value))[0])
        if math.isfinite(value):
            found[name] = value
    return found


def _mission(recording: Recording) -> tuple[PlanItem, ...]:
    """The mission on board at the start: read back before any upload; empty if not complete."""
    uploads = [
        t for t, m in recording.sent if m.get_type() in ("MISSION_COUNT", "MISSION_CLEAR_ALL")
    ]
    items: dict[int, PlanItem] = {}
    for time_s, message in recording.of("MISSION_ITEM_INT", "MISSION_ITEM"):
        if time_s < min(uploads, default=math.inf) and not getattr(message, "mission_type", 0):
            items[message.seq] = from_message(message)
    whole = sorted(items) == list(range(len(items)))
    return tuple(items[seq] for seq in sorted(items)) if whole else ()


def _unknown_mission(recording: Recording) -> tuple[str, ...]:
    uploads = any(m.get_type() == "MISSION_COUNT" for _, m in recording.sent)
    told = next((m for _, m in recording.of("MISSION_CURRENT")), None)
    had = told is not None and 0 < getattr(told, "total", 0) < UINT16_MAX
    if uploads or not had or _mission(recording):
        return ()
    return ("its stored mission is not in the recording; it flies without one",)


def _unasked(recording: Recording) -> dict[int, float]:
    """Interval in us, by message id, of messages that came before the ground station asked."""
    asked_s = min(
        (
            t
            for t, m in recording.sent
            if m.get_type() == "REQUEST_DATA_STREAM"
            or getattr(m, "command", 0) == dialect.MAV_CMD_SET_MESSAGE_INTERVAL
        ),
        default=math.inf,
    )
    intervals = {}
    for kind in STREAMS:
        times = [t for t, _ in recording.of(kind)][:20]
        if len(times) > 1 and times[0] < min(asked_s, recording.begin_s + 3.0):
            number = getattr(dialect, f"MAVLINK_MSG_ID_{kind}")
            intervals[number] = 1e6 * max(times[-1] - times[0], 0.1) / (len(times) - 1)
    return intervals


# Settings that no message contains, concluded from their effects.


def _given_away(recording: Recording, kind: str) -> dict[str, float]:
    if recording.autopilot != "ardupilot":
        return {}
    found: dict[str, float] = {}
    if any(m.text.startswith("GCS Failsafe") for _, m in recording.of("STATUSTEXT")):
        found["FS_GCS_ENABLE"] = 1.0
    if _fence_was_on(recording):
        found["FENCE_ENABLE"] = 1.0
    if kind == "copter" and _armed_in_auto(recording):
        found["AUTO_OPTIONS"] = 3.0
    return {**found, **_battery_thresholds(recording)}


def _fence_was_on(recording: Recording) -> bool:
    """Before anybody switched it."""
    switched_s = first(
        recording.sent,
        lambda m: (
            getattr(m, "command", 0) == dialect.MAV_CMD_DO_FENCE_ENABLE
            or getattr(m, "param_id", "") == "FENCE_ENABLE"
        ),
    )
    return any(
        m.onboard_control_sensors_enabled & dialect.MAV_SYS_STATUS_GEOFENCE
        for t, m in recording.of("SYS_STATUS")
        if t < (math.inf if switched_s is None else switched_s)
    )


def _armed_in_auto(recording: Recording) -> bool:
    """Copters arm in AUTO only when AUTO_OPTIONS lets them."""
    armed = False
    for _, beat in recording.of("HEARTBEAT"):
        if beat.custom_mode == AUTO and beat.base_mode & ARMED and not armed:
            return True
        armed = armed or bool(beat.base_mode & ARMED)
    return False


def _battery_thresholds(recording: Recording) -> dict[str, float]:
    """The thresholds in V: at or above the voltage in the text; not known more exactly."""
    texts = [(t, m.text) for t, m in recording.of("STATUSTEXT")]
    acts = any(text == "Battery Failsafe" for _, text in texts)
    found: dict[str, float] = {}
    for word, name, action in (("low", "LOW", ACTION_RTL), ("critical", "CRT", ACTION_LAND)):
        said = re.compile(rf"Battery 1 is {word} ([0-9.]+)V")
        told = [(t, float(m[1])) for t, m in ((t, said.match(text)) for t, text in texts) if m]
        if not told:
            continue
        told_s, volts = told[0]
        found[f"BATT_{name}_VOLT"] = volts + 0.1
        if acts:
            found[f"BATT_FS_{name}_ACT"] = float(action)
        limit_mv = 1e3 * (volts + 0.1)
        below_s = next(
            (t for t, m in recording.of("SYS_STATUS") if 0 < m.voltage_battery <= limit_mv),
            first(recording.sent, lambda m: getattr(m, "param_id", "") == "SIM_BATT_VOLTAGE"),
        )
        if name == "LOW" and below_s is not None and below_s < told_s:
            found["BATT_LOW_TIMER"] = float(round(told_s - below_s))
    return found


def first(messages: Timed, holds: Callable[[Message], bool]) -> float | None:
    """The time of the first message."""
    return next((t for t, m in messages if holds(m)), None)
