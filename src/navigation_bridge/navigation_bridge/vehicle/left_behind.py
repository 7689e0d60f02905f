"""What a server that stops leaves behind, in a sentence. Pure."""

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
    """How a vehicle stands, and whether somebody has to look after it."""

    sentence: str
    needs_attention: bool


def what_is_left(vehicle: Vehicle) -> WhatIsLeft:
    """Return how a vehicle stands as its server stops, as far as it is known.

    A vehicle that is not heard may do anything: it always needs attention.
    """
    if not vehicle.discovered:
        return WhatIsLeft("Server stopped. No vehicle was heard.", False)
    state = vehicle.state
    place = _PLACES.get(state.landed_state)
    where = place or "where it is (in the air or on the ground: unknown)"
    armed = "armed" if state.armed else "disarmed"
    facts = f"{where}, {armed}, in mode {vehicle.mode_name}"
    if not vehicle.connected:
        text = f"Server stopped. The vehicle is not heard; when last heard it was {facts}."
        return WhatIsLeft(text, True)
    return WhatIsLeft(f"Server stopped. It leaves the vehicle {facts}.", state.armed)
