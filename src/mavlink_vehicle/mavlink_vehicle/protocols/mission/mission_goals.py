"""Starts the stored mission."""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import OperationKind
from mavlink_vehicle.protocols.operations.command import CommandRequest
from mavlink_vehicle.protocols.operations.operation_goals import ModeGoal
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
        """Say that the vehicle has judged its mission: a real PX4 reports it in no other way."""
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
