"""Remote ID of the vehicle and its operator, for a transponder on the vehicle: OPEN_DRONE_ID_*.

The autopilot passes the messages on to its transponder, which reports by OPEN_DRONE_ID_ARM_STATUS
whether it has all that it needs. Rates are those of ASTM F3411: where the operator is once a
second, what does not change every third second.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.profiles import Profile, VehicleKind
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.service import Conversation, SendingRank, VehicleService
from mavlink_vehicle.state.vehicle_state import VehicleState

__all__ = ["OperatorFix", "RemoteId", "RemoteIdSender", "TransponderStatus", "fix_fault"]

_ARM_STATUS = mavlink.MAVLink_open_drone_id_arm_status_message
_EPOCH_2019_S = 1_546_300_800.0
_UINT32 = 1 << 32
_NO_ID = [0] * 20
_UNKNOWN_M = -1000.0
_FIXED = mavlink.MAV_ODID_OPERATOR_LOCATION_TYPE_FIXED
_LIVE = mavlink.MAV_ODID_OPERATOR_LOCATION_TYPE_LIVE_GNSS
# Every third second.
_IDENTITY_TURNS = 3
_AIRCRAFT = {
    VehicleKind.PLANE: mavlink.MAV_ODID_UA_TYPE_AEROPLANE,
    VehicleKind.COPTER: mavlink.MAV_ODID_UA_TYPE_HELICOPTER_OR_MULTIROTOR,
}


@dataclass(frozen=True)
class RemoteId:
    """The identity that is sent; empty texts, and None, are not.

    Attributes:
        serial_number: of the vehicle, at most 20 ASCII characters (ANSI/CTA-2063-A).
        operator_id: of the operator, as the authority gave it, at most 20 ASCII characters.
        description: of the flight, at most 23 ASCII characters.
        operator: latitude and longitude in degrees, and altitude in metres above the ellipsoid, of
            where the operator stands.
    """

    serial_number: str = ""
    operator_id: str = ""
    description: str = ""
    operator: tuple[float, float, float] | None = None

    @property
    def is_empty(self) -> bool:
        """Whether nothing is to be sent."""
        return self == RemoteId()


@dataclass(frozen=True)
class TransponderStatus:
    """The last report of a transponder.

    Attributes:
        fault: why it is not ready; empty if it is.
        heard_s: when it was heard, by our time.
    """

    fault: str
    heard_s: float


@dataclass(frozen=True)
class OperatorFix:
    """A measured position of an operator who moves.

    Attributes:
        latitude_deg: WGS-84.
        longitude_deg: WGS-84.
        altitude_m: above the ellipsoid; NaN if it is not known.
        heard_s: when it was heard, by our time.
    """

    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    heard_s: float


def fix_fault(latitude_deg: float, longitude_deg: float) -> str:
    """Return why this is no position of an operator, as a sentence; empty if it is one."""
    if abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0:
        return ""
    return f"latitude {latitude_deg:g}, longitude {longitude_deg:g} degrees is no position."


class RemoteIdSender(VehicleService):
    """Sends the identity while the vehicle is heard.

    Attributes:
        status: the last report of a transponder; None without one.
        operator: the last measured position of the operator, which is sent instead of the fixed
            one; None before the first.
    """

    rank = SendingRank.DATA
    handles = (_ARM_STATUS,)
    hears_companions = True

    def __init__(self) -> None:
        """Begin without a vehicle."""
        super().__init__()
        self.status: TransponderStatus | None = None
        self.operator: OperatorFix | None = None
        self._conversation: Conversation | None = None
        self._turn = 0

    def offer(self, identity: RemoteId, unix_s: float) -> None:
        """Send what is due, once a second, unless there is nobody to send it to.

        Args:
            identity: what is sent.
            unix_s: time since 1970, UTC; before 2019 it counts as unknown.
        """
        conversation = self._conversation
        if conversation is None:
            return
        if self._turn == 0:
            self.outbox += _identities(identity, conversation)
        self._turn = (self._turn + 1) % _IDENTITY_TURNS
        fix = self.operator
        if fix is not None:
            place = (fix.latitude_deg, fix.longitude_deg, fix.altitude_m)
            self.outbox.append(_system(place, conversation.address, unix_s, _LIVE))
        elif identity.operator is not None:
            self.outbox.append(_system(identity.operator, conversation.address, unix_s, _FIXED))

    def receive(self, message: Message, now: float) -> None:
        """Take a report of the transponder."""
        if isinstance(message, _ARM_STATUS):
            is_ready = message.status == mavlink.MAV_ODID_ARM_STATUS_GOOD_TO_ARM
            fault = "" if is_ready else message.error or "no reason given"
            self.status = TransponderStatus(fault, now)

    def vehicle_came(self, conversation: Conversation, now: float) -> None:
        """Begin to send, with what does not change."""
        self._conversation, self._turn = conversation, 0

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Send nothing."""
        self._conversation = None

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Send nothing, and forget its transponder."""
        self._conversation = self.status = None


def _identities(identity: RemoteId, conversation: Conversation) -> list[Message]:
    """Return what does not change; what is empty is left out."""
    to = _receiver(conversation.address)
    messages = []
    if identity.serial_number:
        uas_id = identity.serial_number.encode("ascii").ljust(20, b"\0")
        messages.append(
            make(
                "OPEN_DRONE_ID_BASIC_ID",
                **to,
                id_type=mavlink.MAV_ODID_ID_TYPE_SERIAL_NUMBER,
                ua_type=_aircraft(conversation.profile),
                uas_id=list(uas_id),
            )
        )
    if identity.operator_id:
        messages.append(
            make(
                "OPEN_DRONE_ID_OPERATOR_ID",
                **to,
                operator_id_type=mavlink.MAV_ODID_OPERATOR_ID_TYPE_CAA,
                operator_id=identity.operator_id,
            )
        )
    if identity.description:
        messages.append(
            make(
                "OPEN_DRONE_ID_SELF_ID",
                **to,
                description_type=mavlink.MAV_ODID_DESC_TYPE_TEXT,
                description=identity.description,
            )
        )
    return messages


def _receiver(address: Address) -> dict[str, int | list[int]]:
    """Return the fields of every message that say for whom it is."""
    return {
        "target_system": address.target_system,
        "target_component": address.target_component,
        "id_or_mac": _NO_ID,
    }


def _system(
    operator: tuple[float, float, float], address: Address, unix_s: float, kind: int
) -> Message:
    """Return where the operator is."""
    latitude_deg, longitude_deg, altitude_m = operator
    return make(
        "OPEN_DRONE_ID_SYSTEM",
        **_receiver(address),
        operator_location_type=kind,
        classification_type=mavlink.MAV_ODID_CLASSIFICATION_TYPE_UNDECLARED,
        operator_latitude=round(latitude_deg * 1e7),
        operator_longitude=round(longitude_deg * 1e7),
        area_count=1,
        area_ceiling=_UNKNOWN_M,
        area_floor=_UNKNOWN_M,
        operator_altitude_geo=altitude_m if math.isfinite(altitude_m) else _UNKNOWN_M,
        timestamp=max(int(unix_s - _EPOCH_2019_S), 0) % _UINT32,
    )


def _aircraft(profile: Profile) -> int:
    return _AIRCRAFT.get(profile.kind, mavlink.MAV_ODID_UA_TYPE_OTHER)
