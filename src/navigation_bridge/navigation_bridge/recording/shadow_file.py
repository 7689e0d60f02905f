"""Reader of the YAML file of ``--shadow-goals``. No ROS."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from navigation_bridge.configuration.checked_values import (
    FLAG,
    InvalidValueError,
    Kind,
    RecordMember,
    either,
    items,
    number,
    one_of,
    record,
    whole,
    words,
)
from navigation_bridge.configuration.checked_yaml import read_yaml
from navigation_bridge.configuration.parameter_values import ConfigurationError
from navigation_bridge.configuration.text_files import read_text
from navigation_bridge.goals.requests import (
    ActKind,
    ActRequest,
    AltitudeReference,
    LandRequest,
    NavigateRequest,
    OrbitRequest,
    OrbitYaw,
    PointMode,
    Request,
    ReturnRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_bridge.names import (
    ACTION_NAME,
    ACTION_NAMES,
    FRAME_BASE_LINK,
    FRAME_MAP,
    FRAME_WGS84,
    LAND_ACTION_NAME,
    ORBIT_ACTION_NAME,
    RETURN_ACTION_NAME,
    TAKEOFF_ACTION_NAME,
    WAYPOINTS_ACTION_NAME,
)
from navigation_core.geometry import Vector3

# The numbers of Waypoint.msg.
_REFERENCES = {
    0: None,
    1: AltitudeReference.AMSL,
    2: AltitudeReference.HOME,
    3: AltitudeReference.GROUND,
}


class ShadowGoalsError(ConfigurationError):
    """A shadow goal file is invalid; the message says where and why."""


@dataclass(frozen=True)
class ShadowGoal:
    """A goal to run against a recording.

    Attributes:
        at_s: time at which it is sent, in seconds from the recording's beginning.
        action: name of its action.
        request: the request.
        cancel_at_s: time at which it is cancelled, or None.
    """

    at_s: float
    action: str
    request: Request
    cancel_at_s: float | None = None

    def __post_init__(self) -> None:
        """Check that the cancel follows the goal."""
        if self.cancel_at_s is not None and self.cancel_at_s < self.at_s:
            raise InvalidValueError("is before at_s.", "cancel_at_s")


def _quaternion(
    x: float = 0.0, y: float = 0.0, z: float = 0.0, w: float = 1.0
) -> tuple[float, float, float, float]:
    """Return a quaternion with the defaults of geometry_msgs/Quaternion."""
    return x, y, z, w


def _vector(x: float, y: float, z: float) -> Vector3:
    return x, y, z


def _navigate(
    target_pose: tuple[tuple[Vector3, tuple[float, float, float, float]], str],
    avoid_obstacles: bool = False,
    max_speed: float = 0.0,
) -> NavigateRequest:
    (position, orientation), frame_id = target_pose
    return NavigateRequest(
        frame_id=frame_id,
        position=position,
        orientation_xyzw=orientation,
        avoid_obstacles=avoid_obstacles,
        max_speed_m_s=max_speed,
    )


def _act(target: Vector3 = (0.0, 0.0, 0.0), **more: object) -> ActRequest:
    make: Callable[..., ActRequest] = ActRequest
    return make(target=target, **more)


def _waypoint(
    position: Vector3, use_yaw: bool = False, yaw_enu_rad: float = 0.0, **more: object
) -> WaypointRequest:
    make: Callable[..., WaypointRequest] = WaypointRequest
    return make(position, yaw_enu_rad=yaw_enu_rad if use_yaw else None, **more)


def _orbit(
    centre: tuple[tuple[Vector3, tuple[float, float, float, float]], str],
    radius: float,
    height: float = math.nan,
    laps: float = 0.0,
    max_speed: float = 0.0,
    yaw_mode: OrbitYaw = OrbitYaw.CENTRE,
    avoid_obstacles: bool = False,
) -> OrbitRequest:
    (position, _), frame_id = centre
    return OrbitRequest(
        frame_id, position, radius, height, laps, max_speed, yaw_mode, avoid_obstacles
    )


_IDENTITY = _quaternion()
_NUMBER, _NEEDED, _FLAG = (
    RecordMember(number()),
    RecordMember(number(), required=True),
    RecordMember(FLAG),
)
_SPEED_M_S = RecordMember(number(), name="max_speed")
_POSITION = record(_vector, x=_NEEDED, y=_NEEDED, z=_NEEDED)
_POSE = record(
    lambda position, orientation=_IDENTITY: (position, orientation),
    position=RecordMember(_POSITION, required=True),
    orientation=RecordMember(record(_quaternion, x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)),
)
_HEADER = record(
    lambda frame_id="": frame_id,
    frame_id=RecordMember(either("", FRAME_MAP, FRAME_BASE_LINK, FRAME_WGS84)),
)
_TARGET = record(
    lambda pose, header="": (pose, header),
    header=RecordMember(_HEADER),
    pose=RecordMember(_POSE, required=True),
)
_ACT = record(
    _act,
    kind=RecordMember(
        words({each.value: each for each in ActKind}),
        required=True,
        text="PHOTO 0, TRIGGER_DISTANCE 1, POINT 2, GRIPPER 3, SERVO 4, WAIT 5.",
    ),
    required=_FLAG,
    distance_m=RecordMember(number(), name="distance"),
    point=RecordMember(
        words({each.value: each for each in PointMode}),
        text="POINT_ANGLE 0, POINT_POSITION 1, POINT_NEUTRAL 2.",
    ),
    pitch_rad=RecordMember(number(), name="pitch"),
    yaw_rad=RecordMember(number(), name="yaw"),
    yaw_locked=_FLAG,
    target=RecordMember(_POSITION),
    grabs=RecordMember(
        words({0: False, 1: True}), name="gripper", text="GRIPPER_RELEASE 0, GRIPPER_GRAB 1."
    ),
    channel=RecordMember(whole(0, 255)),
    pulse_us=RecordMember(whole(0, 65_535), name="pulse"),
    duration_s=RecordMember(number(), name="duration"),
)
_WAYPOINT = record(
    _waypoint,
    position=RecordMember(_POSITION, required=True),
    altitude_reference=RecordMember(
        words(_REFERENCES),
        name="frame",
        text="FRAME_MAP 0, FRAME_GEODETIC_AMSL 1, FRAME_GEODETIC_ABOVE_HOME 2, "
        "FRAME_GEODETIC_ABOVE_GROUND 3.",
    ),
    acceptance_radius_m=RecordMember(number(), name="acceptance_radius"),
    hold_time_s=RecordMember(number(), name="hold_time"),
    use_yaw=_FLAG,
    yaw_enu_rad=RecordMember(number(), name="yaw"),
    max_speed_m_s=_SPEED_M_S,
    acts=RecordMember(items(_ACT, 0, 10_000)),
)
_GOALS: Mapping[str, Kind[Request]] = {
    ACTION_NAME: record(
        _navigate,
        target_pose=RecordMember(_TARGET, required=True),
        avoid_obstacles=_FLAG,
        max_speed=_NUMBER,
    ),
    WAYPOINTS_ACTION_NAME: record(
        WaypointsRequest,
        waypoints=RecordMember(items(_WAYPOINT, 1, 10_000), required=True),
        by_mission=RecordMember(
            words({0: False, 1: True}),
            name="execution",
            text="EXECUTION_SETPOINTS 0, EXECUTION_MISSION 1.",
        ),
        laps=RecordMember(whole(0, 65_535)),
        max_speed_m_s=_SPEED_M_S,
        avoid_obstacles=_FLAG,
        yaw_rate_rad_s=RecordMember(number(), name="yaw_rate"),
    ),
    ORBIT_ACTION_NAME: record(
        _orbit,
        centre=RecordMember(_TARGET, required=True),
        radius=RecordMember(number(), required=True),
        height=_NUMBER,
        laps=_NUMBER,
        max_speed=_NUMBER,
        yaw_mode=RecordMember(
            words({each.value: each for each in OrbitYaw}),
            text="YAW_CENTRE 0, YAW_TANGENT 1, YAW_KEEP 2.",
        ),
        avoid_obstacles=_FLAG,
    ),
    TAKEOFF_ACTION_NAME: record(lambda height=0.0: TakeoffRequest(height), height=_NUMBER),
    LAND_ACTION_NAME: record(LandRequest),
    RETURN_ACTION_NAME: record(ReturnRequest),
}
_WITH_TARGETS = (ACTION_NAME, WAYPOINTS_ACTION_NAME, ORBIT_ACTION_NAME)


def _entry(action: str) -> Kind[ShadowGoal]:
    def made(
        at_s: float, request: Request | None = None, cancel_at_s: float | None = None
    ) -> ShadowGoal:
        return ShadowGoal(at_s, action, request or _GOALS[action].read({}), cancel_at_s)

    return record(
        made,
        at_s=RecordMember(
            number(0), True, text="Time in the recording, in seconds from its start."
        ),
        cancel_at_s=RecordMember(
            number(0), text="Time of the cancel, in seconds from the start of the recording."
        ),
        request=RecordMember(_GOALS[action], action in _WITH_TARGETS, "goal"),
    )


FILE = record(
    lambda goals: tuple(sorted(goals, key=lambda goal: goal.at_s)),
    goals=RecordMember(
        items(
            one_of("action", {action: _entry(action) for action in ACTION_NAMES}, label="action"),
            1,
            1000,
        ),
        required=True,
    ),
)
"""Of a file of shadow goals; `goal` has the fields of `ros2 action send_goal`"""


def read_shadow_goals(path: Path) -> tuple[ShadowGoal, ...]:
    """Read a shadow goal file; goals are ordered by time.

    Raises:
        ShadowGoalsError: it cannot be read, or is no file of shadow goals.
    """
    text = read_text(path, ShadowGoalsError)
    return read_yaml(text, str(path), FILE, ShadowGoalsError)
