"""What the halves of the mission service have in common."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.mission_items import MissionType
from mavlink_vehicle.protocols.operations.command import Address

ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
CANCELLED = mavlink.MAV_MISSION_OPERATION_CANCELLED

_SENTENCES = {
    mavlink.MAV_MISSION_ERROR: "it answered ERROR, which an ArduPilot does in AUTO",
    mavlink.MAV_MISSION_UNSUPPORTED_FRAME: "it does not take the frame of an item",
    mavlink.MAV_MISSION_UNSUPPORTED: "it does not take the command of an item, or such a list",
    mavlink.MAV_MISSION_NO_SPACE: "it has no space for so many items",
    mavlink.MAV_MISSION_INVALID: "it takes one of the items for invalid",
    mavlink.MAV_MISSION_INVALID_PARAM1: "it does not take param1 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM2: "it does not take param2 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM3: "it does not take param3 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM4: "it does not take param4 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM5_X: "it does not take the latitude of an item",
    mavlink.MAV_MISSION_INVALID_PARAM6_Y: "it does not take the longitude of an item",
    mavlink.MAV_MISSION_INVALID_PARAM7: "it does not take the height of an item",
    mavlink.MAV_MISSION_INVALID_SEQUENCE: "it does not know an item of that number",
    mavlink.MAV_MISSION_DENIED: "it denied it; another ground station may be at it",
    CANCELLED: "it gave up the transfer, as the items did not come",
}

BUSY_SENTENCE = "it is busy, maybe with the transfer of another ground station"


def ack_sentence(result: int) -> str:
    """Say what a MAV_MISSION_RESULT other than ACCEPTED means."""
    return _SENTENCES.get(result, f"it answered MAV_MISSION_RESULT {result}")


class TransferResult(enum.Enum):
    """How a transfer ended."""

    DONE = "the vehicle acknowledged it"
    REFUSED = "the vehicle refused it"
    UNSURE = "all was sent, but not clearly acknowledged; reading back tells"
    UNANSWERED = "no answer came"
    GIVEN_UP = "the vehicle gave it up, because too little came"
    BUSY = "the vehicle was at another station's transfer all the time"


@dataclass(frozen=True)
class TransferTiming:
    """How patient a transfer is.

    Attributes:
        timeout_s: time to the next repetition of what is not answered.
        retries: repetitions after the first sending, of each message anew. At 40 % loss both
            ways an exchange fails 64 times in 100, so that 20 repetitions fail once in 10,000
            and a mission of 50 exchanges once in 200; with 12 it was every sixth.
    """

    timeout_s: float = 0.5
    retries: int = 20

    @property
    def silence_s(self) -> float:
        """How long a vehicle that asks by itself may be silent."""
        return self.timeout_s * (self.retries + 1)


def concerns(message: Message, address: Address, mission_type: MissionType) -> bool:
    """Tell whether a message of the mission service is the autopilot's, for us, of this list."""
    return (
        address.answers(message)
        and address.is_for_us(message)
        and message.mission_type == mission_type
    )
