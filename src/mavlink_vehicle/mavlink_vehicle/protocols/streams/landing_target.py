"""Position of a target on which the vehicle lands, as LANDING_TARGET.

An ArduCopter takes it along its own axes (MAV_FRAME_BODY_FRD), a PX4 in its local frame
(MAV_FRAME_LOCAL_NED). https://mavlink.io/en/messages/common.html#LANDING_TARGET
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.positions.frames import Vector3
from mavlink_vehicle.profiles.profile import LandingTargetRules
from mavlink_vehicle.protocols.service import SendingRank, VehicleService

__all__ = ["LandingTargetSender", "SeenTarget"]

# Farther away nothing is landed on, and the position is an error.
_FARTHEST_M = 200.0
_LEVEL = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class SeenTarget:
    """A target at one moment.

    Attributes:
        measured_s: when it was measured, on the steady clock.
        local_ned_m: its position in the autopilot's local frame.
        body_frd_m: its position from the vehicle, along the vehicle's axes.
    """

    measured_s: float
    local_ned_m: Vector3
    body_frd_m: Vector3


class LandingTargetSender(VehicleService):
    """Sends each position of a target once."""

    rank = SendingRank.DATA
    asked_directly = True

    def __init__(self) -> None:
        """Begin without a target."""
        super().__init__()
        self._sent_s = -math.inf

    def offer(self, seen: SeenTarget, rules: LandingTargetRules) -> bool:
        """Send a position that is newer than the last one; return whether it was sent.

        One with a number that is not finite, or farther than 200 m away, is not.
        """
        away_m = math.hypot(*seen.body_frd_m)
        sound = all(map(math.isfinite, (seen.measured_s, *seen.local_ned_m, away_m)))
        if not sound or not 0.0 < away_m <= _FARTHEST_M or seen.measured_s <= self._sent_s:
            return False
        self._sent_s = seen.measured_s
        self.outbox.append(_landing_target(seen, rules.frame, away_m))
        return True


def _landing_target(seen: SeenTarget, frame: int, away_m: float) -> Message:
    forward, right, down = seen.body_frd_m
    x, y, z = seen.body_frd_m if frame == mavlink.MAV_FRAME_BODY_FRD else seen.local_ned_m
    return make(
        "LANDING_TARGET",
        time_usec=round(seen.measured_s * 1e6),
        target_num=0,
        frame=frame,
        angle_x=math.atan2(right, down),
        angle_y=math.atan2(-forward, down),
        distance=away_m,
        size_x=0.0,
        size_y=0.0,
        x=x,
        y=y,
        z=z,
        q=list(_LEVEL),
        type=mavlink.LANDING_TARGET_TYPE_VISION_OTHER,
        position_valid=1,
    )
