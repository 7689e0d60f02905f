"""Properties of each mission command: its name in texts and its type."""

from __future__ import annotations

from mavlink_sitl.autopilot.plans.plans import Cmd

NAMES = {
    Cmd.WAYPOINT: "WP",
    Cmd.LOITER_UNLIM: "LoitUnlim",
    Cmd.LOITER_TURNS: "LoitTurns",
    Cmd.LOITER_TIME: "LoitTime",
    Cmd.RTL: "RTL",
    Cmd.LAND: "Land",
    Cmd.TAKEOFF: "Takeoff",
    Cmd.LOITER_TO_ALT: "LoitAltitude",
    Cmd.SPLINE: "SplineWP",
    Cmd.SET_REVERSE: "SetReverse",
    Cmd.DELAY: "Delay",
    Cmd.CONDITION_DELAY: "CondDelay",
    Cmd.CONDITION_DISTANCE: "CondDist",
    Cmd.CONDITION_YAW: "CondYaw",
    Cmd.JUMP: "Jump",
    Cmd.CHANGE_SPEED: "ChangeSpeed",
    Cmd.SET_HOME: "SetHome",
    Cmd.SET_SERVO: "SetServo",
    Cmd.SET_RELAY: "SetRelay",
    Cmd.REPEAT_SERVO: "RepeatServo",
    Cmd.REPEAT_RELAY: "RepeatRelay",
    Cmd.AUX_FUNCTION: "AuxFunction",
    Cmd.LAND_START: "LandStart",
    Cmd.SET_ROI: "SetROI",
    Cmd.SET_ROI_LOCATION: "SetROI",
    Cmd.SET_ROI_NONE: "SetROI",
    Cmd.DIGICAM_CONTROL: "DigiCamCtrl",
    Cmd.MOUNT_CONTROL: "MountControl",
    Cmd.CAMERA_DISTANCE: "SetCamTrigDst",
    Cmd.FENCE_ENABLE: "FenceEnable",
    Cmd.GRIPPER: "Gripper",
    Cmd.GUIDED_ENABLE: "GuidedEnable",
    Cmd.GUIDED_LIMITS: "GuidedLimits",
    Cmd.PAUSE_CONTINUE: "PauseContinue",
    Cmd.PAYLOAD_PLACE: "PayloadPlace",
    Cmd.RETURN_PATH_START: "ReturnPathStart",
    Cmd.SEND_SCRIPT_MESSAGE: "Scripting",
    Cmd.SET_YAW_SPEED: "SetYawSpd",
    Cmd.VTOL_LAND: "VTOLLand",
    Cmd.VTOL_TAKEOFF: "VTOLTakeoff",
    Cmd.JUMP_TAG: "Tag",
    Cmd.DO_JUMP_TAG: "JumpToTag",
}
"""As 'Mission: 2 WP' says them"""

MOVING = frozenset(
    (
        Cmd.WAYPOINT,
        Cmd.LOITER_UNLIM,
        Cmd.LOITER_TURNS,
        Cmd.LOITER_TIME,
        Cmd.RTL,
        Cmd.LAND,
        Cmd.TAKEOFF,
        Cmd.LOITER_TO_ALT,
        Cmd.SPLINE,
        Cmd.DELAY,
    )
)
CONDITIONS = frozenset((Cmd.CONDITION_DELAY, Cmd.CONDITION_DISTANCE, Cmd.CONDITION_YAW))
"""Hold up what is to be done after them on the same way"""
UNTOLD = frozenset(
    (
        Cmd.SET_SERVO,
        Cmd.SET_RELAY,
        Cmd.REPEAT_SERVO,
        Cmd.REPEAT_RELAY,
        Cmd.AUX_FUNCTION,
        Cmd.DIGICAM_CONTROL,
        Cmd.CAMERA_DISTANCE,
        Cmd.GRIPPER,
        Cmd.JUMP_TAG,
        Cmd.SEND_SCRIPT_MESSAGE,
    )
)
"""Done by ArduPilot's mission library itself, which does not report them (seen in `plane_auto`)"""
WITH_HEADING = MOVING - {Cmd.RTL, Cmd.DELAY} | {Cmd.VTOL_TAKEOFF, Cmd.VTOL_LAND}
"""Items at a place, whose param4 is a heading: NaN is none"""
POLYGONS = frozenset((Cmd.POLYGON_INCLUSION, Cmd.POLYGON_EXCLUSION))
CIRCLES = frozenset((Cmd.CIRCLE_INCLUSION, Cmd.CIRCLE_EXCLUSION))
FENCE = POLYGONS | CIRCLES | {Cmd.FENCE_RETURN_POINT}
