"""Outcome codes for the failsafes of the vehicle. No ROS."""

from __future__ import annotations

from mavlink_vehicle.events import FailsafeKind
from mavlink_vehicle.state.warning_signs import Failsafe
from navigation_core.outcomes import OutcomeCode

_CODES = {
    FailsafeKind.BATTERY: OutcomeCode.FAILSAFE_BATTERY,
    FailsafeKind.FENCE: OutcomeCode.FAILSAFE_FENCE,
    FailsafeKind.RC: OutcomeCode.FAILSAFE_RC,
    FailsafeKind.GCS: OutcomeCode.FAILSAFE_GCS,
    FailsafeKind.GPS: OutcomeCode.FAILSAFE_GPS,
    FailsafeKind.OFFBOARD: OutcomeCode.FAILSAFE_OFFBOARD,
}

FAILSAFE_CODES = frozenset({OutcomeCode.VEHICLE_FAILSAFE, *_CODES.values()})
"""Outcome codes of goals ended by a failsafe of the vehicle."""


def failsafe_code(failsafe: Failsafe | None) -> OutcomeCode:
    """Return the code for a failsafe; ``VEHICLE_FAILSAFE`` if its kind is unknown."""
    if failsafe is None:
        return OutcomeCode.VEHICLE_FAILSAFE
    return _CODES.get(failsafe.kind, OutcomeCode.VEHICLE_FAILSAFE)
