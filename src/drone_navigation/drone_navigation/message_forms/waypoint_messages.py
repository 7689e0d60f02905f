"""Waypoints as messages."""

from __future__ import annotations

from custom_interfaces.msg import Waypoint, WaypointAct
from navigation_bridge.goals.requests import ActRequest, AltitudeReference, WaypointRequest

__all__ = ["waypoint_message"]

_FRAMES = {
    None: Waypoint.FRAME_MAP,
    AltitudeReference.AMSL: Waypoint.FRAME_GEODETIC_AMSL,
    AltitudeReference.HOME: Waypoint.FRAME_GEODETIC_ABOVE_HOME,
    AltitudeReference.GROUND: Waypoint.FRAME_GEODETIC_ABOVE_GROUND,
}


def waypoint_message(waypoint: WaypointRequest) -> Waypoint:
    """Return the message of a waypoint whose acts are of known kinds."""
    message = Waypoint(frame=_FRAMES[waypoint.altitude_reference])
    message.position.x, message.position.y, message.position.z = waypoint.position
    message.acceptance_radius = waypoint.acceptance_radius_m
    message.hold_time = waypoint.hold_time_s
    message.use_yaw = waypoint.yaw_enu_rad is not None
    message.yaw = waypoint.yaw_enu_rad or 0.0
    message.max_speed = waypoint.max_speed_m_s
    message.acts = [_act(act) for act in waypoint.acts]
    return message


def _act(act: ActRequest) -> WaypointAct:
    message = WaypointAct(
        required=act.required,
        distance=act.distance_m,
        pitch=act.pitch_rad,
        yaw=act.yaw_rad,
        yaw_locked=act.yaw_locked,
        channel=act.channel,
        pulse=act.pulse_us,
        duration=act.duration_s,
    )
    # Acts from a file, or of a survey, have none of the unknown numbers of a message.
    assert act.kind is not None
    assert act.point is not None
    message.kind, message.point = act.kind.value, act.point.value
    message.gripper = WaypointAct.GRIPPER_GRAB if act.grabs else WaypointAct.GRIPPER_RELEASE
    message.target.x, message.target.y, message.target.z = act.target
    return message
