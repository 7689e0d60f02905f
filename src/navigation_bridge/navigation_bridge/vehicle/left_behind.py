"""Final state of the vehicle in a sentence, for a server that stops. Pure."""

from __future__ import annotations

from typing import NamedTuple

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.vehicle.traits import drives

__all__ = ["WhatIsLeft", "what_is_left"]

_PLACES = {
    LandedState.ON_GROUND: "on the ground",
    LandedState.IN_AIR: "in the air",
    LandedState.TAKEOFF: "taking off",
    LandedState.LANDING: "landing",
}


class WhatIsLeft(NamedTuple):
    """Final state of a vehicle, and whether it needs attention."""

    sentence: str
    needs_attention: bool


def what_is_left(vehicle: Vehicle, is_recorded: bool = False) -> WhatIsLeft:
    """Return the state of a vehicle when its server stops, as far as known.

    A vehicle that is not heard always needs attention, one of a recording never.

    Args:
        vehicle: the vehicle.
        is_recorded: whether a recording was played in its place.
    """
    if is_recorded:
        return WhatIsLeft("Server stopped. A recording was played; no vehicle is left.", False)
    if vehicle.profile is None:
        return WhatIsLeft("Server stopped. No vehicle was found.", False)
    state = vehicle.state
    armed = "armed" if state.armed else "disarmed"
    facts = f"{armed}, in mode {vehicle.mode_name}"
    if not drives(vehicle.profile):
        place = _PLACES.get(state.landed_state, "airborne or on the ground (unknown)")
        facts = f"{place}, {facts}"
    if not vehicle.heartbeats.alive:
        text = f"Server stopped. The vehicle is silent; last known state: {facts}."
        return WhatIsLeft(text, True)
    return WhatIsLeft(f"Server stopped. Vehicle left {facts}.", state.armed)
