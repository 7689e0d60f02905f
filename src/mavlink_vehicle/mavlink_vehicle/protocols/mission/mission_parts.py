"""Parts that the mission transfers have in common."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.mission_items import MissionType
from mavlink_vehicle.protocols.operations.command import Address

ACCEPTED = mavlink.MAV_MISSION_ACCEPTED
CANCELLED = mavlink.MAV_MISSION_OPERATION_CANCELLED

_SENTENCES = {
    mavlink.MAV_MISSION_ERROR: "the autopilot answered ERROR, as ArduPilot does in AUTO",
    mavlink.MAV_MISSION_UNSUPPORTED_FRAME: "the autopilot does not support the frame of an item",
    mavlink.MAV_MISSION_UNSUPPORTED: "the autopilot does not support an item's command or the list",
    mavlink.MAV_MISSION_NO_SPACE: "the autopilot has no space for that many items",
    mavlink.MAV_MISSION_INVALID: "the autopilot considers an item invalid",
    mavlink.MAV_MISSION_INVALID_PARAM1: "the autopilot does not accept param1 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM2: "the autopilot does not accept param2 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM3: "the autopilot does not accept param3 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM4: "the autopilot does not accept param4 of an item",
    mavlink.MAV_MISSION_INVALID_PARAM5_X: "the autopilot does not accept the latitude of an item",
    mavlink.MAV_MISSION_INVALID_PARAM6_Y: "the autopilot does not accept the longitude of an item",
    mavlink.MAV_MISSION_INVALID_PARAM7: "the autopilot does not accept the altitude of an item",
    mavlink.MAV_MISSION_INVALID_SEQUENCE: "the autopilot has no item of that number",
    mavlink.MAV_MISSION_DENIED: "the autopilot denied it; another ground station may be using it",
    CANCELLED: "the autopilot cancelled the transfer because items did not arrive",
}

BUSY_SENTENCE = "the autopilot is busy, possibly with another ground station's transfer"


def ack_sentence(result: int) -> str:
    """Return what a MAV_MISSION_RESULT other than ACCEPTED means."""
    return _SENTENCES.get(result, f"the autopilot answered MAV_MISSION_RESULT {result}")


class TransferResult(enum.Enum):
    """The result of a transfer."""

    DONE = "the vehicle acknowledged it"
    REFUSED = "the vehicle refused it"
    UNSURE = "all was sent, but not clearly acknowledged; reading back tells"
    UNANSWERED = "no answer came"
    GIVEN_UP = "the vehicle gave it up, because too little came"
    BUSY = "the vehicle was at another station's transfer all the time"


@dataclass(frozen=True)
class TransferTiming:
    """Timeouts and retries of a transfer.

    Attributes:
        timeout_s: time to the next repetition of what is not answered.
        retries: repetitions after the first sending, of each message separately. At 40 % loss both
            ways an exchange fails 64 times in 100, so that 20 repetitions fail once in 10,000
            and a mission of 50 exchanges once in 200; with 12 it was every sixth.
    """

    timeout_s: float = 0.5
    retries: int = 20

    @property
    def silence_s(self) -> float:
        """The longest silence of a vehicle that sends requests itself."""
        return self.timeout_s * (self.retries + 1)


def concerns(message: Message, address: Address, mission_type: MissionType) -> bool:
    """Return whether a message of the mission service is the autopilot's, for us, of this list."""
    return (
        address.answers(message)
        and address.is_for_us(message)
        and message.mission_type == mission_type
    )
