"""Each firmware's rules for transfers of missions, fences and rally points, as data.

From the recordings: `copter_auto_cleared`, `rover_auto`, `px4/mission_clear` and
`px4/probe_ground`, and from what else was seen of the real firmwares.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from mavlink_sitl.autopilot.plans.plan_commands import FENCE, NAMES, WITH_HEADING
from mavlink_sitl.autopilot.plans.plans import Cmd, PlanType

PX4_DEVICES = frozenset((
    187, 196, 200, 203, 204, 205, 206, 211, 214, 260, 530, 531, 532, 1000, 1001, 2000, 2001, 2003,
    2500, 2501, 3000, 42600,
))  # fmt: skip
"""Items for devices on a vehicle: PX4 takes them, and passes them without effect here"""


@dataclass(frozen=True)
class PlanRules:
    """The rules of one firmware.

    Attributes:
        home_first: item 0 of a mission is home, whatever was sent as such.
        asks_for_int: an upload is asked for with MISSION_REQUEST_INT, else MISSION_REQUEST.
        retry_s: time after which an item that does not come is requested again.
        timeout_s: time after which the upload ends without it.
        timeout_text: the text then.
        timeout_result: the MISSION_ACK then, or None for silence.
        in_place: items of missions and rally points are stored as they come, so that an upload
            that ends early leaves a mixture, while a fence is checked and stored as a whole; else
            the old list stays until the new one is complete.
        locked_in_auto: MISSION_CLEAR_ALL in AUTO is an error while it is armed.
        clears_all_types: MISSION_CLEAR_ALL of type 255 is known.
        identified: MISSION_ACK, MISSION_COUNT and MISSION_CURRENT carry the list's identity.
        capacity: most items of each list.
        too_many_text: what is said about more of them.
        received_text: what is said about a complete mission.
        bad_item_text: what is said about an item that is rejected.
        not_in_list_text: what is said when the current item is to be one that does not exist.
        commands: the items that are taken, by list.
        frames: the frames that are taken.
        by_frame: where the frame says which items are taken, whatever the list and whatever
            numbers are in them; it then counts instead of `commands` and `frames`.
        stored_frames: frames that become others.
        keeps_nan: whether NaN in param4 is given back.
        used_params: the numbers, 1 to 7, of those that a command uses; others that are set are a
            fault of the item. A command that is not there may have any.
    """

    home_first: bool = True
    asks_for_int: bool = False
    retry_s: float = 1.0
    timeout_s: float = 8.0
    timeout_text: str = "Mission upload timeout"
    timeout_result: int | None = 15
    in_place: bool = True
    locked_in_auto: bool = True
    clears_all_types: bool = False
    identified: bool = False
    capacity: tuple[int, int, int] = (650, 84, 20)
    too_many_text: str = "Only {capacity} items are supported"
    received_text: str = "Flight plan received"
    bad_item_text: str = ""
    not_in_list_text: str = ""
    commands: dict[PlanType, frozenset[int]] = field(
        default_factory=lambda: {
            PlanType.MISSION: frozenset(NAMES),
            PlanType.FENCE: FENCE,
            PlanType.RALLY: frozenset((Cmd.RALLY_POINT,)),
        }
    )
    frames: frozenset[int] = frozenset((0, 2, 3, 5, 6, 10, 11))
    by_frame: dict[int, frozenset[int]] | None = None
    stored_frames: dict[int, int] = field(default_factory=lambda: {5: 0, 6: 3, 11: 10})
    keeps_nan: bool = False
    used_params: Mapping[int, frozenset[int]] = field(default_factory=dict)


ARDUPILOT_PLANS = PlanRules()

_PX4_PLACES = (
    WITH_HEADING - {Cmd.SPLINE, Cmd.LOITER_TURNS}
    | FENCE
    | {Cmd.SET_ROI, Cmd.SET_ROI_LOCATION, Cmd.RALLY_POINT}
)
_PX4_DEEDS = PX4_DEVICES | {
    Cmd.RTL, Cmd.DELAY, Cmd.CONDITION_DELAY, Cmd.CONDITION_DISTANCE, Cmd.JUMP, Cmd.CHANGE_SPEED,
    Cmd.SET_HOME, Cmd.LAND_START, Cmd.SET_ROI_NONE, Cmd.SET_ROI,
}  # fmt: skip
"""PX4's items with a place, in a global frame, and those without, in the frame MISSION. An
upload of most was seen, the others are read in the firmware; LOITER_TURNS, splines, CONDITION_YAW
and DO_SET_SERVO are rejected."""

PX4_PLANS = PlanRules(
    home_first=False,
    asks_for_int=True,
    retry_s=0.25,
    timeout_s=5.0,
    timeout_text="Operation timeout\t",
    timeout_result=None,
    in_place=False,
    locked_in_auto=False,
    clears_all_types=True,
    identified=True,
    received_text="",
    bad_item_text="IGN MISSION_ITEM: Invalid item\t",
    not_in_list_text="WPM: WP CURR CMD: Not in list\t",
    by_frame={2: _PX4_DEEDS, **dict.fromkeys((0, 3, 5, 6), _PX4_PLACES)},
    stored_frames={3: 6, 5: 0},
    keeps_nan=True,
)
