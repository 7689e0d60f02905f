"""Starting the stored mission, and choosing its current item."""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import OperationKind
from mavlink_vehicle.protocols.command import CommandRequest
from mavlink_vehicle.protocols.goals import ModeGoal, StateGoal
from mavlink_vehicle.state import VehicleState


@dataclass(frozen=True)
class MissionStartGoal(ModeGoal):
    """MAV_CMD_MISSION_START was acknowledged, and HEARTBEAT shows the mission's mode.

    The mode alone is not enough: an ArduCopter on the ground waits in AUTO for a raised
    throttle, which the command stands for.
    """

    kind: OperationKind = OperationKind.START_MISSION
    needs_ack = True

    @property
    def wish(self) -> str:
        """Nothing more to say."""
        return ""

    @property
    def request(self) -> CommandRequest:
        """MAV_CMD_MISSION_START; ArduPilot takes no first and last item."""
        return CommandRequest(mavlink.MAV_CMD_MISSION_START)


@dataclass(frozen=True)
class CurrentItemGoal(StateGoal):
    """MISSION_CURRENT shows this item, counted as the vehicle counts."""

    seq: int
    kind = OperationKind.SET_CURRENT_ITEM

    @property
    def wish(self) -> str:
        """The item."""
        return f"to {self.seq}"

    @property
    def request(self) -> CommandRequest:
        """MAV_CMD_DO_SET_MISSION_CURRENT."""
        return CommandRequest(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (float(self.seq),))

    def reached(self, state: VehicleState) -> bool:
        """Tell whether it is the current one."""
        return state.mission is not None and state.mission.current == self.seq
