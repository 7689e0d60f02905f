"""Throttle, climb and bank of planes over lanes: the inner half of ArduPlane's energy control."""

from __future__ import annotations

from operator import attrgetter
from typing import NamedTuple

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.autopilot.control.control_state import packed
from mavlink_sitl.exchange import GRAVITY_M_S2
from mavlink_sitl.guidance import GlideGuidance


class GlideGains(NamedTuple):
    """The same for all lanes."""

    thrust_m_s2: float = 17.8
    """At full throttle"""
    drag_1_m: float = 0.0185
    """Assumed drag: deceleration in level flight over the airspeed squared, 1/m"""
    airspeed: float = 0.06
    airspeed_i: float = 0.01
    integrator_limit: float = 0.2
    bank_to_throttle: float = 0.08
    """TECS_RLL2THR"""
    climb_change_m_s2: float = 7.0
    full_throttle_in_s: float = 1.2
    climb_by_speed: float = 0.35
    """Largest sine of the climb angle"""


class GlideTargets(NamedTuple):
    """`GlideGuidance` as lanes."""

    fly: Lane
    manual: Lane
    throttle: Lane
    bank_rad: Lane
    climb_m_s: Lane
    airspeed_m_s: Lane
    least_throttle: Lane
    most_throttle: Lane


class GlideState(NamedTuple):
    """The state of the controllers; lanes."""

    climb_m_s: Lane
    integrator: Lane
    throttle: Lane


_STEADY = attrgetter(*GlideTargets._fields[2:])


def initial(o: Ops) -> GlideState:
    """Controllers at rest."""
    zero = o.full(0.0)
    return GlideState(zero, zero, zero)


def targets_of(guidance: list[GlideGuidance], o: Ops) -> GlideTargets:
    """The targets of each vehicle, one lane per field."""
    return packed(GlideTargets, _STEADY, guidance, o)


def step(
    state: GlideState, t: GlideTargets, airspeed: Lane, dt: float, k: GlideGains, o: Ops
) -> tuple[GlideState, Lane, Lane, Lane]:
    """One fixed step.

    Returns:
        The new state of the controllers, bank, climb and throttle.
    """
    change = k.climb_change_m_s2 * dt
    most = k.climb_by_speed * o.maximum(airspeed, 0.0)
    wanted = o.clip(t.climb_m_s, -most, most)
    climb = state.climb_m_s + o.clip(wanted - state.climb_m_s, -change, change)
    fast = o.maximum(airspeed, 5.0)
    error = t.airspeed_m_s - airspeed
    holding = t.fly * (t.least_throttle < t.most_throttle)
    limit = k.integrator_limit
    integrator = o.clip(state.integrator + k.airspeed_i * error * dt, -limit, limit) * holding
    drag = k.drag_1_m * t.airspeed_m_s * t.airspeed_m_s
    needed = (drag + GRAVITY_M_S2 * climb / fast) / k.thrust_m_s2
    upright = o.maximum(o.cos(t.bank_rad), 0.4)
    needed = needed + k.bank_to_throttle * (1.0 / (upright * upright) - 1.0)
    throttle = needed + k.airspeed * error + integrator
    throttle = o.clip(throttle, t.least_throttle, t.most_throttle)
    # The throttle opens slowly and closes at once.
    opening = dt / k.full_throttle_in_s
    throttle = o.minimum(throttle, state.throttle + opening) * t.fly
    throttle = throttle + t.manual * t.throttle
    active = o.maximum(t.fly, t.manual)
    state = GlideState(climb, integrator, throttle)
    return state, t.bank_rad * active, climb * active, throttle
