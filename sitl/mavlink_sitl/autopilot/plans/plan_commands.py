"""Properties of each mission command: its name in texts and its type."""

from __future__ import annotations

from mavlink_sitl.autopilot.plans.plans import Cmd

NAMES = {
    16: "WP", 17: "LoitUnlim", 18: "LoitTurns", 19: "LoitTime", 20: "RTL", 21: "Land",
    22: "Takeoff", 31: "LoitAltitude", 82: "SplineWP", 84: "VTOLTakeoff", 85: "VTOLLand",
    92: "GuidedEnable", 93: "Delay", 94: "PayloadPlace", 112: "CondDelay", 114: "CondDist",
    115: "CondYaw", 177: "Jump", 178: "ChangeSpeed", 179: "SetHome", 181: "SetRelay",
    182: "RepeatRelay", 183: "SetServo", 184: "RepeatServo", 188: "ReturnPathStart",
    189: "LandStart", 193: "PauseContinue", 194: "SetReverse", 195: "SetROI", 197: "SetROI",
    201: "SetROI", 203: "DigiCamCtrl", 205: "MountControl", 206: "SetCamTrigDst",
    207: "FenceEnable", 211: "Gripper", 213: "SetYawSpd", 217: "Scripting", 218: "AuxFunction",
    222: "GuidedLimits", 600: "Tag", 601: "JumpToTag",
    1000: "GimbalPitchYaw", 2000: "ImageStartCapture",
}  # fmt: skip
"""As 'Mission: 2 WP' says them: the items that an ArduPilot of any kind accepts (uploads in
`copter_mission_misc` and `rover_mission`); it passes over those that it cannot do"""

MOVING = frozenset((
    Cmd.WAYPOINT, Cmd.LOITER_UNLIM, Cmd.LOITER_TURNS, Cmd.LOITER_TIME, Cmd.RTL, Cmd.LAND,
    Cmd.TAKEOFF, Cmd.LOITER_TO_ALT, Cmd.SPLINE, Cmd.DELAY,
))  # fmt: skip
CONDITIONS = frozenset((Cmd.CONDITION_DELAY, Cmd.CONDITION_DISTANCE, Cmd.CONDITION_YAW))
"""Hold up what is to be done after them on the same way"""
UNTOLD = frozenset((181, 182, 183, 184, 203, 206, 211, 217, 218, 600, 1000, 2000))
"""Done by ArduPilot's mission library itself, which does not report them (seen in `plane_auto`)"""
WITH_HEADING = MOVING - {Cmd.RTL, Cmd.DELAY} | {Cmd.VTOL_TAKEOFF, Cmd.VTOL_LAND}
"""Items at a place, whose param4 is a heading: NaN is none"""
POLYGONS = frozenset((Cmd.POLYGON_INCLUSION, Cmd.POLYGON_EXCLUSION))
CIRCLES = frozenset((Cmd.CIRCLE_INCLUSION, Cmd.CIRCLE_EXCLUSION))
FENCE = POLYGONS | CIRCLES | {Cmd.FENCE_RETURN_POINT}
