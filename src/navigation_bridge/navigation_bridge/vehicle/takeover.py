"""Attribution of mode changes not requested here: pilot, or kind of failsafe. No ROS.

The mode, the state and the text that show a failsafe's kind come in any order, up to a second
apart. So the server stops sending at once, and decides after that time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from mavlink_vehicle.events import FailsafeKind
from mavlink_vehicle.state.failsafe import failsafe_words
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.state.warning_signs import Failsafe
from navigation_core.outcomes import OutcomeCode

# FENCE_STATUS and SYS_STATUS come every half second, HEARTBEAT every second.
_JUDGE_S = 1.0
# MAV_STATE (common.xml) of a vehicle in a failsafe.
_MAV_STATE_CRITICAL = 5


@dataclass(frozen=True)
class Takeover:
    """A mode change not requested by this server.

    Attributes:
        mode_name: the mode; empty if unchanged, but the vehicle was sent elsewhere.
        seen_s: time at which it was seen.
        by: a sentence about the ground station that requested it; empty if none was seen.
        failsafe: the last failsafe since then. A PX4 whose stream comes back leaves it at once
            (observed).
        overtaken: sentences about the mode having been overtaken by a request of this server;
            empty if it was not.
        restored: whether it is the vehicle's mode all the same.
        mode: HEARTBEAT.custom_mode of the mode; 0 where it is not the vehicle's.
        chosen: whether somebody has chosen it, as a PX4 reports (CURRENT_MODE). What the vehicle
            does then, as when the sticks are let go that have taken it, came after that.
    """

    mode_name: str
    seen_s: float
    by: str = ""
    failsafe: Failsafe | None = None
    overtaken: str = ""
    restored: bool = True
    mode: int = 0
    chosen: bool = False

    def watched(self, state: VehicleState) -> Takeover:
        """Return it with the active failsafe, and with what the vehicle reports as chosen."""
        chosen = self.chosen or state.intended_mode == self.mode != 0
        failsafe = state.failsafe or self.failsafe
        if chosen == self.chosen and failsafe == self.failsafe:
            return self
        return replace(self, chosen=chosen, failsafe=failsafe)

    def judge(self, state: VehicleState, now: float) -> tuple[OutcomeCode, str] | None:
        """Return the origin of the change as a code and a sentence; None while unclear."""
        if now - self.seen_s < _JUDGE_S:
            return None  # an older sign may be known before the relevant one
        failsafe = state.failsafe or self.failsafe
        fails = failsafe is not None or state.system_status >= _MAV_STATE_CRITICAL
        if self.chosen or not fails:
            changed = f"The mode changed to {self.mode_name}, not requested by this server"
            changed = changed if self.mode_name else "The vehicle was redirected"
            left = "; control stays with the pilot until a new goal arrives."
            words = [changed + (left if self.restored else "."), self.overtaken, self.by]
            return OutcomeCode.PILOT_OVERRIDE, " ".join(filter(None, words))
        said = failsafe_words(state, failsafe, self.seen_s)
        mode = self.mode_name
        text = f"A vehicle failsafe changed the mode to {mode}"
        text += "; control stays with it." if self.restored else "."
        if self.overtaken:
            text += f" {self.overtaken}"
        if failsafe is not None and failsafe.text not in said:
            text += f" Evidence: {failsafe.text}."
        if said:
            text += f" The autopilot reported: {'; '.join(dict.fromkeys(said))}."
        return failsafe_code(failsafe), text


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
