"""Events of the vehicle: frozen records, named in the past tense.

`Vehicle.next_event` hands them out in the order in which they came about.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import TypeAlias

from mavlink_vehicle.mission_items import MissionItem, MissionType
from mavlink_vehicle.ranges import RangesMeasured, RangesRefused

# Above it, digits of a float mean nothing.
_INTEGER_MAX = 1e15


class OperationKind(enum.Enum):
    """The kind of an operation requested of `Vehicle`."""

    CHANGE_MODE = "mode change"
    RESTORE_MODE = "restoring the mode"
    ARM = "arming"
    DISARM = "disarming"
    TAKE_OFF = "take-off"
    TAKE_CONTROL = "taking control"
    HOLD = "hold"
    LAND = "landing"
    RETURN_TO_LAUNCH = "return to launch"
    REPOSITION = "reposition"
    CHANGE_SPEED = "speed change"
    UPLOAD_MISSION = "mission upload"
    DOWNLOAD_MISSION = "mission download"
    CLEAR_MISSION = "clearing the mission"
    START_MISSION = "mission start"


class OperationResult(enum.Enum):
    """The result of an operation; each ends exactly once."""

    ACHIEVED = "achieved"
    """The vehicle's own state shows it; an acknowledgement alone never does."""
    REFUSED = "refused"
    """The autopilot declined, cannot do it, or gave it up by itself."""
    TIMED_OUT = "timed out"
    """Neither the state nor a rejection came in time."""
    CANCELLED = "cancelled"
    """We stopped it, or another mode was chosen meanwhile (by a pilot or a failsafe)."""
    LINK_LOST = "link lost"
    """Time ran out while no HEARTBEAT came, the autopilot rebooted, or there is no vehicle."""
    LATE = "late"
    """The server itself was too late: it did not ask, or the vehicle rejected it for that"""


class LandedState(enum.IntEnum):
    """MAV_LANDED_STATE of EXTENDED_SYS_STATE."""

    UNDEFINED = 0
    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


@dataclass(frozen=True)
class VehicleDiscovered:
    """The first HEARTBEAT of the autopilot arrived."""

    system_id: int
    component_id: int
    autopilot: int
    vehicle_type: int
    profile_name: str


@dataclass(frozen=True)
class ModeChanged:
    """HEARTBEAT shows another mode.

    Attributes:
        previous: custom_mode before.
        current: custom_mode now.
        name: name of the mode now.
        requested: whether an operation of ours asked for exactly this change, or the firmware
            made it by itself after its own take-off or landing. False means a pilot, a ground
            station or a failsafe did it.
    """

    previous: int
    current: int
    name: str
    requested: bool


@dataclass(frozen=True)
class ModeOvertaken:
    """A mode command of the server overtook, on its way, a mode that somebody else chose.

    Attributes:
        chosen: custom_mode of the pilot, the ground station or the failsafe.
        chosen_name: its name.
        current_name: name of the mode that our command brought, and that shows now.
    """

    chosen: int
    chosen_name: str
    current_name: str


@dataclass(frozen=True)
class ArmedChanged:
    """HEARTBEAT shows the motors armed or disarmed; `requested` as for `ModeChanged`."""

    armed: bool
    requested: bool


@dataclass(frozen=True)
class LandedChanged:
    """EXTENDED_SYS_STATE shows another landed state."""

    previous: LandedState
    current: LandedState


@dataclass(frozen=True)
class SystemStatusChanged:
    """HEARTBEAT shows another MAV_STATE; CRITICAL (5) is how a failsafe looks."""

    previous: int
    current: int


class FailsafeKind(enum.Enum):
    """The kind of a failsafe."""

    BATTERY = "battery"
    FENCE = "fence"
    RC = "rc"
    GCS = "gcs"
    GPS = "gps"
    OFFBOARD = "offboard"
    OTHER = "other"


@dataclass(frozen=True)
class FailsafeBegan:
    """The autopilot acts by itself; `text` is what shows it, in the autopilot's words if any.

    It comes up to half a second after the state shows it, as the text that names the kind may
    come after the HEARTBEAT.
    """

    kind: FailsafeKind
    text: str


@dataclass(frozen=True)
class FailsafeEnded:
    """The last reported failsafe is over, or the vehicle is disarmed."""

    kind: FailsafeKind


@dataclass(frozen=True)
class HeartbeatLost:
    """No HEARTBEAT for the configured time; `silent_s` is how long."""

    silent_s: float


@dataclass(frozen=True)
class HeartbeatRegained:
    """HEARTBEAT is back after `HeartbeatLost`.

    Attributes:
        rebooted: the first message with a boot time already shows a restart. A restart that
            is seen only later is reported by `VehicleRebooted`.
    """

    rebooted: bool


@dataclass(frozen=True)
class ExternalPosesStopped:
    """No external pose has been sent for `silent_s` seconds, after there were some."""

    silent_s: float


@dataclass(frozen=True)
class ExternalPosesResumed:
    """An external pose is sent again; `silent_s` is how long there was none."""

    silent_s: float


@dataclass(frozen=True)
class VehicleRebooted:
    """The autopilot's time since boot went back: it restarted and forgot its message rates."""

    boot_count: int


@dataclass(frozen=True)
class StatusTextReceived:
    """A STATUSTEXT, with its chunks put together; `severity` is MAV_SEVERITY (0 worst)."""

    text: str
    severity: int


@dataclass(frozen=True)
class StreamClosed:
    """The setpoint stream was closed by the interlock, for this reason."""

    reason: str


@dataclass(frozen=True)
class OperationFinished:
    """An operation ended; exactly one such event follows each that was started.

    Attributes:
        operation_id: what the method that started it returned.
        kind: what it was to do.
        result: how it ended.
        reason: a sentence, with the COMMAND_ACK result and the STATUSTEXTs since its start.
    """

    operation_id: int
    kind: OperationKind
    result: OperationResult
    reason: str


class StationAct(enum.Enum):
    """An action of another station on the autopilot."""

    CLEARED_MISSION = "cleared the mission"
    REPLACED_MISSION = "uploaded another mission"
    PAUSED = "paused the vehicle"
    CONTINUED = "resumed the vehicle"
    CHANGED_MODE = "changed the mode"
    CHANGED_ITEM = "selected another mission item"
    """The mission continues at another item; it is still ours."""


@dataclass(frozen=True)
class StationActed:
    """Somebody else on the MAVLink network took part in flying the vehicle.

    Attributes:
        act: what was done.
        station: MAVLink system and component id of who did it; None when nobody was seen to do
            it and only the vehicle (MISSION_CURRENT, or its words) shows that it was done.
        how: the message as text, for example "MISSION_CLEAR_ALL" or "DO_PAUSE_CONTINUE 0".
        mode: custom_mode that was asked for, or that a command leads to; None if it names none.
        command: MAV_CMD that asked for it; None when it was no command.
    """

    act: StationAct
    station: tuple[int, int] | None
    how: str
    mode: int | None = None
    command: int | None = None


@dataclass(frozen=True)
class StoodStill:
    """We did not run for so long that nothing is sent before the vehicle's mode is seen again."""

    gap_s: float


@dataclass(frozen=True)
class TwinHeard:
    """Another autopilot with the vehicle's ids is heard; `reason` is a sentence."""

    reason: str


@dataclass(frozen=True)
class EquipmentAnswered:
    """A request to a camera, a gimbal, a gripper or an output has ended.

    Attributes:
        number: of the request.
        failure: why it was not done, without a full stop; empty if the vehicle accepted it.
    """

    number: int
    failure: str


@dataclass(frozen=True)
class GimbalTurned:
    """The gimbal reports where it points.

    Attributes:
        time_s: when.
        pitch_rad: above the horizon.
        yaw_rad: clockwise, from the nose, or from north.
        from_north: whether the yaw is from north.
        control: MAVLink system and component in control; zeros for nobody, or unknown.
    """

    time_s: float
    pitch_rad: float
    yaw_rad: float
    from_north: bool
    control: tuple[int, int]


@dataclass(frozen=True)
class PhotoReported:
    """The camera reports a photo.

    Attributes:
        index: as the camera counts.
        success: whether it was taken.
        place: latitude and longitude in degrees, altitude above mean sea level in metres.
    """

    index: int
    success: bool
    place: tuple[float, float, float]


@dataclass(frozen=True)
class StoredListFinished:
    """The reading or writing of a fence or of rally points ended.

    Attributes:
        kind: which list.
        result: how it ended; a list that was written is ACHIEVED when it was read back.
        reason: a sentence, which says what is stored now.
        items: what is stored now; None while that is unknown.
    """

    kind: MissionType
    result: OperationResult
    reason: str
    items: tuple[MissionItem, ...] | None


@dataclass(frozen=True)
class Parameter:
    """A parameter of the autopilot; `type` is its MAV_PARAM_TYPE."""

    name: str
    value: float
    type: int

    @property
    def text(self) -> str:
        """The value as `parameter_text` writes it."""
        return parameter_text(self.value)


def parameter_text(value: float) -> str:
    """Return a parameter's value: integers in full, others in the digits of a float of 32 bits."""
    if float(value).is_integer() and 1.0 <= abs(value) < _INTEGER_MAX:
        return str(int(value))
    return f"{value:.9g}"


class ParameterChange(enum.Enum):
    """The result for a parameter that was to be read, or to get a value."""

    READ = "read"
    CHANGED = "changed"
    UNCHANGED = "it already had the value"
    UNKNOWN = "the autopilot does not know it"
    FAILED = "not changed"


@dataclass(frozen=True)
class ParameterOutcome:
    """The outcome of one parameter.

    Attributes:
        name: its name.
        change: what has become of it.
        reason: a sentence.
        old: what was read first; None where it was not read.
        new: what was read last.
    """

    name: str
    change: ParameterChange
    reason: str
    old: Parameter | None = None
    new: Parameter | None = None


@dataclass(frozen=True)
class ParametersFinished:
    """The reading or changing of parameters ended.

    Attributes:
        result: how it ended; changes are ACHIEVED when each was read back.
        reason: a sentence.
        parameters: all that were read, if all were to be.
        outcomes: one for each that was asked for by name.
    """

    result: OperationResult
    reason: str
    parameters: tuple[Parameter, ...] = ()
    outcomes: tuple[ParameterOutcome, ...] = ()


class LogMeans(enum.Enum):
    """The protocol by which logs are listed; they are downloaded as they were listed."""

    AUTO = "auto"
    """LOG_REQUEST_*, and MAVFTP if that is not answered."""
    LOG_REQUEST = "log_request"
    FTP = "ftp"


@dataclass(frozen=True)
class StoredLog:
    """One log in the autopilot's storage.

    Attributes:
        log_id: the autopilot's number for it. It can change when logs are erased.
        size_bytes: its size when it was listed; a log being written grows.
        time_utc_s: seconds since 1970 of its start (ArduPilot) or last change (PX4); 0: unknown.
        path: of its file, if MAVFTP listed it; it is then downloaded by MAVFTP. The numbers of a
            PX4's logs are then those of their names in order.
    """

    log_id: int
    size_bytes: int
    time_utc_s: int
    path: str = ""


@dataclass(frozen=True)
class LogsListed:
    """The autopilot's own logs, by number."""

    logs: tuple[StoredLog, ...]


@dataclass(frozen=True)
class LogChunkReceived:
    """The next bytes of a log that is being downloaded."""

    offset_bytes: int
    data: bytes


@dataclass(frozen=True)
class LogTransferEnded:
    """A list or a download of logs ended; exactly one such event follows each that was begun."""

    result: OperationResult
    reason: str


LogEvent: TypeAlias = LogsListed | LogChunkReceived | LogTransferEnded

VehicleEvent: TypeAlias = (
    VehicleDiscovered
    | ModeChanged
    | ModeOvertaken
    | ArmedChanged
    | LandedChanged
    | SystemStatusChanged
    | FailsafeBegan
    | FailsafeEnded
    | HeartbeatLost
    | HeartbeatRegained
    | ExternalPosesStopped
    | ExternalPosesResumed
    | VehicleRebooted
    | StatusTextReceived
    | StreamClosed
    | OperationFinished
    | StationActed
    | RangesMeasured
    | RangesRefused
    | StoodStill
    | TwinHeard
    | EquipmentAnswered
    | GimbalTurned
    | PhotoReported
    | StoredListFinished
    | ParametersFinished
    | LogEvent
)
