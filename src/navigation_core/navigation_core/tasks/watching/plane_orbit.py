"""Has a plane circle a point for a number of laps: sent there with a radius, it circles itself."""

from __future__ import annotations

import math
from dataclasses import replace

from navigation_core.geometry import Vector3, subtract, wrap_angle
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.conditions import located, measured_speed
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Wait
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.phased_task import Answer
from navigation_core.tasks.phases import STOPPING, Phase
from navigation_core.tasks.progress import OrbitProgress, Progress, Status
from navigation_core.tasks.traits import Traits
from navigation_core.tasks.watching.plane import FlyPlane
from navigation_core.tasks.waypoint import Route, RouteWaypoint

__all__ = ["FlyPlaneOrbit"]

# The plane circles until its laps are counted, not for a time.
_WHOLE_DAY_S = 86400.0
# Slower planes than this are rare; until it flies, and against the wind, the time left counts so.
_SLOW_M_S = 7.5
# Laps count within this share of the radius: a plane may come from the centre.
_NEAR_SHARE = 0.35
# A circle that does not get round by this much in this time, and that of a radius, is none.
_STUCK_AFTER_S, _STUCK_RAD = 90.0, math.radians(45.0)


class FlyPlaneOrbit(FlyPlane):
    """The task of a plane's circle: sent to the centre, it goes round by itself."""

    def __init__(
        self,
        waypoint: RouteWaypoint,
        circle_m: float,
        laps: float,
        config: GotoConfig,
        traits: Traits,
        takeoff_height_m: float,
    ) -> None:
        """Prepare.

        Args:
            waypoint: the centre, and the airspeed.
            circle_m: radius, negative clockwise.
            laps: above 0; infinite for until it is cancelled.
            config: tolerances and limits of time.
            traits: what the plane can do.
            takeoff_height_m: height above the ground that a take-off is asked for.
        """
        centre = replace(waypoint, hold_time_s=_WHOLE_DAY_S)
        super().__init__(Route((centre,)), config, traits, takeoff_height_m, circle_m)
        self._centre_enu_m: Vector3 = waypoint.position_enu_m
        self._turn_rad = math.tau * laps
        self._sign = math.copysign(1.0, circle_m)
        self._radius_m = abs(circle_m)
        self._flown_rad = 0.0
        self._bearing_rad: float | None = None
        self._round_s, self._round_rad = 0.0, 0.0
        self._handlers[Phase.SETTLING] = self._go_round

    def _go(self, phase: Phase, now: float) -> None:
        super()._go(phase, now)
        self._bearing_rad, self._round_s = None, now

    def _go_round(self, observation: Observation, now: float) -> Answer:
        """Count the laps."""
        answer = self._circle(observation, now)
        known = located(observation, self._config.position_stale_s)
        if known is None or not isinstance(answer, Wait):
            return answer
        east_m, north_m, _ = subtract(known.state.position_enu_m, self._centre_enu_m)
        bearing_rad = math.atan2(north_m, east_m)
        near = abs(math.hypot(east_m, north_m) - self._radius_m) <= _NEAR_SHARE * self._radius_m
        if self._bearing_rad is not None and near:
            self._flown_rad += self._sign * wrap_angle(bearing_rad - self._bearing_rad)
        self._bearing_rad = bearing_rad
        if self._flown_rad >= self._turn_rad:
            self._flown_rad = self._turn_rad
            text = f"Went round {self._turn_rad / math.tau:g} times; the plane circles on."
            return self._over(OutcomeCode.SUCCESS, text, observation)
        if self._flown_rad > self._round_rad + _STUCK_RAD:
            self._round_s, self._round_rad = now, self._flown_rad
        stuck_s = _STUCK_AFTER_S + self._radius_m / _SLOW_M_S
        if now - self._round_s > stuck_s:
            text = f"The vehicle has not gone round for {stuck_s:.0f} s."
            return self._over(OutcomeCode.TIMEOUT, text, observation)
        return answer

    def progress(self, observation: Observation, now: float) -> Progress:
        """Return the progress to the end of the laps; without a number, of the present one."""
        progress, place = super().progress(observation, now), observation.position_enu_m
        flown_rad = max(self._flown_rad, 0.0)
        error_m = math.nan
        if place is not None and self._phase is Phase.SETTLING:
            error_m = math.dist(place[:2], self._centre_enu_m[:2]) - self._radius_m
        orbit = OrbitProgress(flown_rad / math.tau, error_m)
        if self._phase in STOPPING:
            return replace(progress, route=None, orbit=orbit)
        left_rad = self._turn_rad - flown_rad
        if math.isinf(left_rad):
            left_rad = math.tau - flown_rad % math.tau
        left_m = progress.distance_remaining_m + left_rad * self._radius_m
        goes_round = self._phase is Phase.SETTLING and progress.status is Status.HOLDING
        return replace(
            progress,
            status=Status.NAVIGATING if goes_round else progress.status,
            distance_remaining_m=left_m,
            time_remaining_s=left_m / max(measured_speed(observation) or 0.0, _SLOW_M_S),
            route=None,
            orbit=orbit,
        )
