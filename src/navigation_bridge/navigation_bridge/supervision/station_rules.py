"""Rules for the effect of ground station actions on a goal, as pure functions. No ROS."""

from __future__ import annotations

from enum import Enum, auto

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import LandedState, StationAct, StationActed
from mavlink_vehicle.profiles import ModePacking, Profile
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import StationPause
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.vehicle.traits import traits_of
from navigation_core.tasks.observation import VehicleMode

STOPS = frozenset({StationAct.CLEARED_MISSION, StationAct.REPLACED_MISSION, StationAct.PAUSED})
"""Acts that stop a vehicle."""


class Consequence(Enum):
    """Effect of an act on a goal."""

    NOTE = auto()
    """Logged only; names the ground station if the mode changes."""
    CANCEL = auto()
    PAUSE = auto()
    GO_ON = auto()


def consequence(
    acted: StationActed, goal: ActiveGoal, on_pause: StationPause, vehicle: Vehicle
) -> Consequence:
    """Return the effect of an act on a goal.

    A landing and a return continue whatever happens to the mission, and through a pause that the
    vehicle does not obey: with an empty battery they keep it safe. A vehicle on the ground cannot
    be paused: it must not take off.
    """
    act = acted.act
    if goal.ending:
        return Consequence.NOTE
    if act is StationAct.CONTINUED:
        goes_on = goal.paused_by and not starts_mission(acted, goal, vehicle.profile)
        return Consequence.GO_ON if goes_on else Consequence.NOTE
    if goal.plan is None or act not in STOPS:
        return Consequence.NOTE
    if act is StationAct.REPLACED_MISSION:
        return Consequence.NOTE if goal.mission is None else Consequence.CANCEL
    if act is StationAct.PAUSED and on_pause is StationPause.PAUSE and is_under_way(goal, vehicle):
        return Consequence.PAUSE
    return Consequence.CANCEL


def takes_vehicle(acted: StationActed) -> bool:
    """Whether the act makes the vehicle hold, or sends it elsewhere, in whatever mode.

    An ArduPilot does both in the mode in which it follows setpoints.
    """
    return acted.act is StationAct.PAUSED or acted.command == mavlink.MAV_CMD_DO_REPOSITION


def act_sentence(acted: StationActed) -> str:
    """Return a sentence with system, act and command."""
    who = "An unknown ground station"
    if acted.station is not None:
        who = f"Ground station {acted.station[0]}/{acted.station[1]}"
    return f"{who} {acted.act.value} ({acted.how})."


def starts_mission(acted: StationActed, goal: ActiveGoal, profile: Profile | None) -> bool:
    """Whether the act starts the stored mission during a goal without a mission."""
    if goal.mission is not None:
        return False
    if acted.command == mavlink.MAV_CMD_MISSION_START:
        return True
    mode = None if profile is None else profile.mode_number(profile.mission_mode)
    return mode is not None and acted.mode == mode


def sends_elsewhere(acted: StationActed, goal: ActiveGoal, vehicle: Vehicle) -> bool:
    """Whether the act sends the vehicle elsewhere in its present mode.

    MAVSDK's `goto_location` makes a PX4 hold first, and then sends it to the target. That stop
    alone is a pause; but a ground station that pauses a vehicle and then sends it somewhere flies
    it, whatever mode has been seen by now.
    """
    if acted.act is not StationAct.CHANGED_MODE or acted.command != mavlink.MAV_CMD_DO_REPOSITION:
        return False
    if goal.paused_by or goal.cancelled_by_pause:
        return True
    if acted.mode is not None:
        return acted.mode == vehicle.state.custom_mode
    # An ArduPilot goes there without a mode change; a PX4 rejects it.
    profile = vehicle.profile
    whole = profile is not None and profile.mode_packing is ModePacking.WHOLE
    return whole and vehicle.in_control_mode


def is_under_way(goal: ActiveGoal, vehicle: Vehicle) -> bool:
    """Whether it drives, or flies after the take-off (in a mission, during it, too)."""
    if vehicle.profile is None or not traits_of(vehicle.profile).flies:
        return True
    state = vehicle.state.landed_state
    return state is not LandedState.ON_GROUND and (
        goal.mission is not None or state is not LandedState.TAKEOFF
    )


def stays_paused(goal: ActiveGoal) -> bool:
    """Whether the pause service keeps it out of the mode in which the vehicle flies by itself."""
    return goal.paused_by_client and goal.mission is not None


def working_mode(goal: ActiveGoal) -> VehicleMode:
    """Return the mode in which a goal is flown."""
    return VehicleMode.CONTROL if goal.mission is None else VehicleMode.MISSION


def note_text(acted: StationActed) -> str:
    """Return the text for the recording."""
    who = "?" if acted.station is None else f"{acted.station[0]}/{acted.station[1]}"
    return f"station {who} {acted.how}"
