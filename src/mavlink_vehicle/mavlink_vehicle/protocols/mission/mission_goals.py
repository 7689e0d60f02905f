"""Starts the stored mission and selects its current item."""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.events import OperationKind
from mavlink_vehicle.protocols.operations.command import Address, CommandRequest
from mavlink_vehicle.protocols.operations.operation_goals import ModeGoal, StateGoal
from mavlink_vehicle.state.reducer import VehicleState


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
class MissionModeGoal(ModeGoal):
    """HEARTBEAT shows the mission's mode, which starts the mission."""

    kind: OperationKind = OperationKind.START_MISSION

    def hint(self, state: VehicleState) -> str | None:
        """Say that the vehicle has judged its mission: a real PX4 tells it in no other way."""
        mission = state.mission
        if (
            mission is None
            or not mission.total
            or mission.state != mavlink.MISSION_STATE_NO_MISSION
        ):
            return super().hint(state)
        return (
            "MISSION_CURRENT reports that the stored mission will not be flown; check its "
            "take-off, its landing (MIS_TKO_LAND_REQ) and the fence"
        )


@dataclass(frozen=True)
class SetCurrentRequest(CommandRequest):
    """MISSION_SET_CURRENT, which is answered by MISSION_CURRENT only."""

    def message(self, address: Address, confirmation: int) -> Message:
        """Build the message."""
        return make(
            "MISSION_SET_CURRENT",
            target_system=address.target_system,
            target_component=address.target_component,
            seq=int(self.params[0]),
        )


@dataclass(frozen=True)
class CurrentItemGoal(StateGoal):
    """MISSION_CURRENT shows this item, counted as the vehicle counts."""

    seq: int
    by_message: bool = False
    kind = OperationKind.SET_CURRENT_ITEM

    @property
    def wish(self) -> str:
        """The item."""
        return f"to {self.seq}"

    @property
    def request(self) -> CommandRequest:
        """MAV_CMD_DO_SET_MISSION_CURRENT, or the message."""
        make_request = SetCurrentRequest if self.by_message else CommandRequest
        return make_request(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (float(self.seq),))

    def reached(self, state: VehicleState) -> bool:
        """Return whether it is the current one."""
        return state.mission is not None and state.mission.current == self.seq
