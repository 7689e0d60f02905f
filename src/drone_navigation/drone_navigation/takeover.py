"""Who changed the mode, when nobody here did: a pilot, or a failsafe of which kind. No ROS.

The mode, the state and the words that tell a failsafe's kind come in any order, up to a second
apart. So the server falls silent at once, and judges when the kind is known or the time is up.
"""

from __future__ import annotations

from dataclasses import dataclass

from drone_navigation.failsafes import failsafe_code
from mavlink_vehicle.events import FailsafeKind
from mavlink_vehicle.failsafe import TEXT_AGE_S
from mavlink_vehicle.vehicle_state import VehicleState
from navigation_core.outcomes import OutcomeCode

# FENCE_STATUS and SYS_STATUS come every half second, HEARTBEAT every second.
_JUDGE_S = 1.0
# MAV_STATE (common.xml): what a vehicle in a failsafe says.
_MAV_STATE_CRITICAL = 5


@dataclass(frozen=True)
class Takeover:
    """A change of mode that nobody here asked for.

    Attributes:
        mode_name: the mode; empty when it is the same, but the vehicle was sent elsewhere.
        seen_s: when it was seen.
        by: a sentence that says which station asked for it; empty if none was seen to.
    """

    mode_name: str
    seen_s: float
    by: str = ""

    def judge(self, state: VehicleState, now: float) -> tuple[OutcomeCode, str] | None:
        """Say whose change it was, as a code and a sentence; None while it is not clear yet."""
        failsafe = state.failsafe
        known = failsafe is not None and failsafe.kind is not FailsafeKind.OTHER
        if not known and now - self.seen_s < _JUDGE_S:
            return None
        if failsafe is None and state.system_status < _MAV_STATE_CRITICAL:
            left = "control is left to the pilot until a new goal comes."
            changed = f"The mode became {self.mode_name}, which this server did not ask for;"
            words = [changed if self.mode_name else "The vehicle was sent elsewhere;", left]
            return OutcomeCode.PILOT_OVERRIDE, " ".join([*words, *filter(None, [self.by])])
        words = [
            text.text for text in state.status_texts[-2:] if text.time_s >= self.seen_s - TEXT_AGE_S
        ]
        said = f" It said: {'; '.join(words)}." if words else ""
        return failsafe_code(failsafe), (
            f"A failsafe of the vehicle changed the mode to {self.mode_name}; control is left to "
            f"it.{said}"
        )
