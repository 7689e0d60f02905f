"""The vehicles' bodies, as pure functions over lanes.

Each `step` takes the state, a command, where it matters the wind (speed of the air, NED m/s), the
height of the ground or of the water (NED down, m), the time to pass (s), the model and the
arithmetic (`array_ops.Ops`). It returns the state that much later.
"""

from __future__ import annotations

from typing import TypeVar

from mavlink_sitl.array_ops import Lane, Ops

S = TypeVar("S")


def at_rest(state: type[S], yaw_rad: Lane, o: Ops) -> S:
    """Vehicles standing at their origins with motors off, in the form of a model's state."""
    zero, form = o.full(0.0), state.__annotations__
    lanes = {**dict.fromkeys(form, zero), "yaw_rad": yaw_rad, "on_ground": zero == zero}
    return state(**lanes)
