"""The checks that goals share by which a vehicle is steered. No ROS."""

from __future__ import annotations

from mavlink_vehicle.events import LandedState
from navigation_bridge.snapshot import LocatedSnapshot
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection

__all__ = ["check_steered"]


def check_steered(snapshot: LocatedSnapshot, what: str, ability: str) -> Rejection | None:
    """Return why this vehicle cannot be steered now, or None.

    Args:
        snapshot: what is known.
        what: what never starts the vehicle, for sentences: "following".
        ability: what a plane cannot: "follow a target"; empty if it can.
    """
    traits, state = snapshot.traits, snapshot.state
    if not traits.hovers and ability:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE, f"A {traits.name} cannot {ability}; send it targets."
        )
    if not traits.flies and not state.armed:
        return Rejection(
            OutcomeCode.NOT_FLYING,
            f"The {traits.name} is disarmed, and {what} never arms; arm it first.",
        )
    in_air = state.armed and state.landed_state is LandedState.IN_AIR
    if traits.flies and not in_air:
        return Rejection(
            OutcomeCode.NOT_FLYING,
            "The vehicle does not report that it is in the air, taking off and landing excepted, "
            f"and {what} never takes off; take off first.",
        )
    return None
