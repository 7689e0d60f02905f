"""Flies a circle: to its nearest tangent, round for a number of laps, and to rest on it.

The flight is cut into sections that each end at rest. One leads straight, or around obstacles, to
where the circle is entered along its tangent; the next one goes round. Where obstacles stand on
the circle, a section ends before them, and the next one leads to the first point behind them at
which the circle is free again. A flight that was interrupted comes back to the circle, and its laps
are counted on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from navigation_core.geometry import Vector3, wrap_angle
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.itinerary import Section
from navigation_core.tasks.goto_config import GotoGoal
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.leading.path_follower import cruise_limits
from navigation_core.tasks.leading.ring_path import RingPart, RingYaw, free_turn_rad
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.progress import OrbitProgress, Progress
from navigation_core.trajectories.ring import Ring

__all__ = ["Orbit", "OrbitItinerary", "fly_orbit"]

# Less than this is not worth a section of its own: the circle counts as blocked there.
_LEAST_TURN_RAD = math.radians(10.0)
# Steps in which a place to come back to the circle is looked for.
_SEARCH_RAD = math.radians(5.0)
# At the end of a part the vehicle may be this many arrival radii behind its setpoint.
_SHORT_ARRIVALS = 3.0
# A vehicle that comes back to the circle this far behind where it left it has drifted back.
_BACK_RAD = math.radians(60.0)


@dataclass(frozen=True)
class Orbit:
    """A circle and how often it is flown.

    Attributes:
        ring: the circle, with its direction; it is expected to have been checked.
        laps: above 0; infinite for until it is cancelled.
        yaw: the yaw on the circle.
        yaw_enu_rad: the yaw that is kept, if one is.
        max_speed_m_s: maximum ground speed; None for the configured one.
    """

    ring: Ring
    laps: float
    yaw: RingYaw
    yaw_enu_rad: float
    max_speed_m_s: float | None = None


class OrbitItinerary:
    """The sections of a circle. See :class:`~navigation_core.tasks.flying.itinerary.Itinerary`."""

    def __init__(self, orbit: Orbit, terms: FlightTerms, from_enu_m: Vector3) -> None:
        """Prepare; the arguments are those of :func:`fly_orbit`."""
        self._orbit = orbit
        self._ring = orbit.ring
        self._avoidance = terms.avoidance
        self._limits = cruise_limits(terms.config.limits, orbit.max_speed_m_s, terms.traits)
        self._arrival_rad = (
            max(terms.config.arrival_radius_m, terms.traits.arrival_radius_m) / orbit.ring.radius_m
        )
        self._from_enu_m = from_enu_m
        self._turn_rad = math.tau * orbit.laps
        # How far it has gone round, and the most of that: wind may push it back.
        self._flown_rad = self._most_rad = 0.0
        # Where the circle was left, or will be entered, and the part of it that is flown.
        self._angle_rad: float | None = None
        self._entry_rad = 0.0
        # Where it is to be entered. A vehicle that is blown about while it searches for a path
        # keeps to it, or no search would end; nor does it go round a circle that is free nowhere.
        self._approach_rad: float | None = None
        self._is_entered = False
        self._part: RingPart | None = None
        self._part_flown_rad = 0.0

    # --- sections --------------------------------------------------------------------

    def begin_section(self, observation: Observation | None = None) -> Section:
        """Return the next part of the circle, or what leads to it."""
        place, obstacles = self._from_enu_m, None
        if observation is not None and self._avoidance is not None:
            obstacles = observation.obstacles
        if observation is not None and observation.position_enu_m is not None:
            place = observation.position_enu_m
        left_rad = self._turn_rad - self._flown_rad
        entered, self._is_entered = self._is_entered, False
        if entered:
            turn_rad = self._free_rad(self._entry_rad, min(left_rad, math.tau), obstacles)
            if turn_rad >= min(left_rad, math.tau):
                return self._round(left_rad)
            if turn_rad >= _LEAST_TURN_RAD:
                return self._round(turn_rad)
            first_rad = self._entry_rad
        else:
            first_rad = self._ring.entry_rad(place)
        self._part = None
        self._entry_rad = self._choose_entry_rad(first_rad, obstacles)
        return Section(self._goal(self._entry_rad), settles=False)

    def _round(self, turn_rad: float) -> Section:
        """Return a part of the circle, from where it was entered."""
        orbit = self._orbit
        part = RingPart(self._ring, self._entry_rad, turn_rad, orbit.yaw, orbit.yaw_enu_rad)
        self._part, self._part_flown_rad, self._approach_rad = part, 0.0, None
        self._angle_rad = self._entry_rad
        end_rad = turn_rad if math.isfinite(turn_rad) else 0.0
        goal = self._goal(self._entry_rad + self._ring.sign * end_rad)
        is_last = turn_rad >= self._turn_rad - self._flown_rad
        return Section(goal, part=part, settles=is_last)

    def _goal(self, angle_rad: float) -> GotoGoal:
        orbit, place = self._orbit, self._ring.point(angle_rad)
        part = RingPart(self._ring, angle_rad, 0.0, orbit.yaw, orbit.yaw_enu_rad)
        return GotoGoal(place, wrap_angle(part.yaw_at(place)), orbit.max_speed_m_s)

    def _free_rad(self, from_rad: float, turn_rad: float, obstacles: Obstacles | None) -> float:
        """Return how far the circle is free from an angle on, with room to stop."""
        if self._avoidance is None or obstacles is None:
            return turn_rad
        clearance_m = self._avoidance.plan_clearance_m
        return free_turn_rad(self._ring, from_rad, turn_rad, obstacles, clearance_m)

    def _choose_entry_rad(self, first_rad: float, obstacles: Obstacles | None) -> float:
        """Return the first angle from which on the circle is free; the last one while that is."""
        angles_rad = first_rad + self._ring.sign * np.arange(0.0, math.tau, _SEARCH_RAD)
        kept_rad = [] if self._approach_rad is None else [self._approach_rad]
        for angle_rad in kept_rad + [float(angle_rad) for angle_rad in angles_rad]:
            if self._free_rad(angle_rad, _LEAST_TURN_RAD, obstacles) >= _LEAST_TURN_RAD:
                self._approach_rad = angle_rad
                return angle_rad
        if self._approach_rad is None:
            self._approach_rad = first_rad
        return self._approach_rad

    # --- what was flown ---------------------------------------------------------------

    def note_place(self, position_enu_m: Vector3 | None, passed: int, leaves: bool) -> bool:
        """Count how far the vehicle has gone round."""
        if position_enu_m is None or self._part is None or self._angle_rad is None:
            return False
        angle_rad = self._ring.angle_rad(position_enu_m)
        turned_rad = self._ring.sign * wrap_angle(angle_rad - self._angle_rad)
        self._angle_rad = angle_rad
        self._flown_rad += turned_rad
        self._part_flown_rad += turned_rad
        self._most_rad = min(max(self._most_rad, self._flown_rad), self._turn_rad)
        return False

    def point_to_meet(self) -> int | None:
        """Nothing is to be met on the way."""
        return None

    def arrive(self, error_m: float) -> Outcome | None:
        """Enter the circle, continue behind a stop on it, or end after the last lap."""
        part = self._part
        if part is None:
            self._enter()
            return None
        self._part = None
        if self._part_flown_rad < part.turn_rad - _SHORT_ARRIVALS * self._arrival_rad:
            return None  # it was stopped near the end of a lap that it had not flown
        end_rad = part.from_rad + self._ring.sign * part.turn_rad
        self._flown_rad += part.turn_rad - self._part_flown_rad
        self._angle_rad = self._entry_rad = end_rad
        if self._flown_rad < self._turn_rad - self._arrival_rad:
            self._is_entered = True
            return None
        self._most_rad = self._turn_rad
        text = f"Went round {self._orbit.laps:g} times, and is {error_m:.2f} m from the end."
        return Outcome(OutcomeCode.SUCCESS, text, error_m)

    def _enter(self) -> None:
        """Count on from where the circle was left: what lies between was gone round, too."""
        if self._angle_rad is not None:
            turned_rad = self._ring.sign * (self._entry_rad - self._angle_rad)
            turned_rad = (turned_rad + _BACK_RAD) % math.tau - _BACK_RAD
            self._flown_rad = min(self._flown_rad + turned_rad, self._turn_rad - self._arrival_rad)
        self._is_entered = True

    def total(
        self, progress: Progress, position_enu_m: Vector3 | None, is_straight: bool
    ) -> Progress:
        """Return the progress of the whole flight; without a number of laps, to the lap's end."""
        left_rad = self._turn_rad - self._most_rad
        if math.isinf(left_rad):
            left_rad = math.tau - self._most_rad % math.tau
        left_m = max(left_rad, 0.0) * self._ring.radius_m
        left_s = left_m / self._limits.speed_horizontal_m_s
        error_m = math.nan
        if self._part is not None:
            if position_enu_m is not None:
                error_m = self._ring.error_m(position_enu_m)
            progress = replace(progress, distance_remaining_m=0.0, time_remaining_s=0.0)
        return replace(
            progress,
            distance_remaining_m=progress.distance_remaining_m + left_m,
            time_remaining_s=progress.time_remaining_s + left_s,
            orbit=OrbitProgress(self._most_rad / math.tau, error_m),
        )


def fly_orbit(orbit: Orbit, terms: FlightTerms, from_enu_m: Vector3) -> SetpointFlight:
    """Return the flight along a circle.

    Args:
        orbit: what to fly.
        terms: how to fly.
        from_enu_m: where the vehicle is, in the map frame.
    """
    return SetpointFlight(OrbitItinerary(orbit, terms, from_enu_m), terms)
