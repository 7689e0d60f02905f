"""Values that tasks read from an observation."""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits


@dataclass(frozen=True)
class Located:
    """The position of a vehicle that is known, finite and recent.

    Attributes:
        position_enu_m: as it was reported, in the map frame.
        velocity_enu_m_s: the same.
        yaw_enu_rad: yaw.
        state: the state now, see :func:`measured_state`.
    """

    position_enu_m: Vector3
    velocity_enu_m_s: Vector3
    yaw_enu_rad: float
    state: KinematicState


def located(observation: Observation, age_max_s: float) -> Located | None:
    """Return position, velocity and yaw if they are known, finite and recent."""
    position, velocity = observation.position_enu_m, observation.velocity_enu_m_s
    yaw_rad = observation.yaw_enu_rad
    if position is None or velocity is None or yaw_rad is None:
        return None
    is_known = all(map(math.isfinite, (*position, *velocity, yaw_rad)))
    if not is_known or not observation.position_age_s <= age_max_s:
        return None
    return Located(position, velocity, yaw_rad, measured_state(observation))


def is_located(observation: Observation, age_max_s: float) -> bool:
    """Whether position, velocity and yaw are known, finite and recent."""
    return located(observation, age_max_s) is not None


def is_airborne(observation: Observation, height_min_m: float) -> bool:
    """Whether the vehicle flies: as it says, or by its height if it does not say."""
    if observation.airborne is not None:
        return observation.airborne
    position = observation.position_enu_m
    return position is not None and position[2] - observation.ground_enu_m > height_min_m


def can_move(observation: Observation, traits: Traits, height_min_m: float) -> bool:
    """Whether it can be led: what flies must be in the air, what drives only armed."""
    if not traits.flies:
        return observation.armed
    return observation.armed and is_airborne(observation, height_min_m)


def measured_state(observation: Observation) -> KinematicState:
    """Return the state where the vehicle is now, taken to be without acceleration.

    A position that is a little old is carried on at the measured velocity.

    Raises:
        ValueError: position or velocity is not known; ask :func:`is_located` first.
    """
    position, velocity = observation.position_enu_m, observation.velocity_enu_m_s
    if position is None or velocity is None:
        raise ValueError("The observation holds no position and velocity.")
    age_s = observation.position_age_s
    x, y, z = (place + speed * age_s for place, speed in zip(position, velocity, strict=True))
    return KinematicState((x, y, z), velocity)


def measured_speed(observation: Observation) -> float | None:
    """Return the measured speed, or None."""
    velocity: Vector3 | None = observation.velocity_enu_m_s
    return None if velocity is None else math.hypot(*velocity)
