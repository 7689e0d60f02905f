"""Which class runs which personality. Part of `simulation` (the same layer)."""

from __future__ import annotations

from mavlink_sitl.autopilot.copter import Copter
from mavlink_sitl.autopilot.personality import Personality

_CLASSES: dict[str, type[Copter]] = {"copter": Copter}


def firmware_class(personality: Personality) -> type[Copter]:
    """The firmware that goes with a personality."""
    return _CLASSES[personality.kind]
