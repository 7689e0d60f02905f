"""Final state of the vehicle in a sentence, for a server that stops. Pure."""

from __future__ import annotations

from typing import NamedTuple

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.vehicle import Vehicle

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


def what_is_left(vehicle: Vehicle) -> WhatIsLeft:
    """Return the state of a vehicle when its server stops, as far as known.

    A vehicle that is not heard always needs attention.
    """
    if vehicle.profile is None:
        return WhatIsLeft("Server stopped. No vehicle was found.", False)
    state = vehicle.state
    place = _PLACES.get(state.landed_state)
    where = place or "airborne or on the ground (unknown)"
    armed = "armed" if state.armed else "disarmed"
    facts = f"{where}, {armed}, in mode {vehicle.mode_name}"
    if not vehicle.heartbeats.alive:
        text = f"Server stopped. The vehicle is silent; last known state: {facts}."
        return WhatIsLeft(text, True)
    return WhatIsLeft(f"Server stopped. Vehicle left {facts}.", state.armed)
