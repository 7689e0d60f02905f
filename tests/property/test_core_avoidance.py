"""Flights among obstacles that appear, stay, move and vanish: they end without a collision."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacle_shapes import Box, Cylinder, KnownObstacle
from navigation_core.mapping.obstacles import NOTHING, Obstacles
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.goto import GotoConfig, GotoGoal, fly_to
from navigation_core.tasks.flying.route import fly_route
from navigation_core.tasks.intents import Fly
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig, FlightTerms
from navigation_core.tasks.waypoint import Route, RouteWaypoint
from tests.support.models.point_mass import PointMass, fly

CONFIG = GotoConfig()
AVOIDANCE = AvoidanceConfig(heights_m=(1.0, 12.0), blocked_timeout_s=10.0)
START: Vector3 = (0.0, 0.0, 5.0)
# Stopping from full speed takes 9 m, the time before the brake acts and the tracking included.
SEEN_WITHIN_M = 11.0
LOOK_S = 0.1


@dataclass(frozen=True)
class Thing:
    """Something in the way, from a time on and perhaps not for ever."""

    shape: KnownObstacle
    appears_s: float
    vanishes_s: float


def _number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


places = st.tuples(_number(-5.0, 50.0), _number(-15.0, 15.0))
tops = st.sampled_from([4.0, 8.0, math.inf])
shapes = st.builds(
    Cylinder, st.just("post"), places, _number(0.2, 2.5), st.just(-1.0), tops
) | st.builds(
    Box,
    st.just("box"),
    places,
    st.tuples(_number(0.1, 8.0), _number(0.1, 8.0)),
    _number(-math.pi, math.pi),
    st.just(-1.0),
    tops,
)
# Most are there from the beginning and stay; the vehicle learns of them as it comes near.
moments = st.just(0.0) | _number(0.0, 20.0)
ends = st.just(math.inf) | _number(1.0, 30.0)
things = st.builds(Thing, shapes, moments, ends)


class Sight:
    """The sensor's view of the things, and how near the vehicle truly is to them."""

    def __init__(self, vehicle: PointMass, things: list[Thing]) -> None:
        """Prepare."""
        self.vehicle = vehicle
        self.things = [(thing, Obstacles.of((thing.shape,))) for thing in things]
        self.nearest_m = math.inf
        self._known: frozenset[int] = frozenset()
        self._real: set[int] = set()
        self._looked_s = -math.inf

    def look(self, elapsed_s: float) -> None:
        """Take note of the truth, and tell the vehicle what is seen."""
        place = np.array([self.vehicle.position])
        for index, (thing, shape) in enumerate(self.things):
            clearance_m = float(shape.clearance_m(place)[0])
            if not thing.appears_s <= elapsed_s < thing.vanishes_s:
                self._real.discard(index)
            elif index not in self._real and (elapsed_s == 0.0 or clearance_m > SEEN_WITHIN_M):
                self._real.add(index)  # One that drops out of the sky before it is not fair.
            if index in self._real:
                self.nearest_m = min(self.nearest_m, clearance_m)
        if elapsed_s - self._looked_s < LOOK_S - 1e-6:
            return
        self._looked_s = elapsed_s
        known = frozenset(
            index
            for index in self._real
            if index in self._known
            or float(self.things[index][1].clearance_m(place)[0]) <= SEEN_WITHIN_M + 1.0
        )
        if known != self._known:
            self._known = known
            seen = tuple(self.things[index][0].shape for index in sorted(known))
            self.vehicle.obstacles = Obstacles.of(seen) if seen else NOTHING


def _sane(things: list[Thing]) -> list[Thing]:
    """Leave out what stands where the flight begins."""
    start = np.array([START])
    room_m = AVOIDANCE.plan_clearance_m
    return [t for t in things if float(Obstacles.of((t.shape,)).clearance_m(start)[0]) > room_m]


def _hovering() -> PointMass:
    return PointMass(position=START, armed=True, in_control=True, airborne=True)


def _assert_safe(task: SetpointFlight, things: list[Thing]) -> OutcomeCode:
    vehicle = _hovering()
    sight = Sight(vehicle, _sane(things))
    flight = fly(task, vehicle, sight.look, time_max_s=400.0)
    assert sight.nearest_m > AVOIDANCE.vehicle_radius_m
    code = flight.outcome.code
    assert code in (OutcomeCode.SUCCESS, OutcomeCode.NO_PATH)
    assert flight.outcome.message
    if code is OutcomeCode.SUCCESS:
        assert flight.outcome.final_error_m is not None
        assert flight.outcome.final_error_m <= CONFIG.arrival_radius_m
    for _, _, answer in flight.steps:
        if isinstance(answer, Fly):
            assert all(math.isfinite(number) for number in answer.setpoint.position_enu_m)
    return code


@pytest.mark.wide
@settings(max_examples=15, deadline=None, suppress_health_check=list(HealthCheck))
@given(things=st.lists(things, min_size=1, max_size=14))
def test_a_flight_to_a_point_hits_nothing_and_ends(things: list[Thing]) -> None:
    _assert_safe(
        fly_to(GotoGoal((45.0, 0.0, 5.0)), FlightTerms(CONFIG, avoidance=AVOIDANCE)), things
    )


@pytest.mark.wide
@settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    things=st.lists(things, min_size=1, max_size=10),
    waypoints=st.lists(
        st.builds(
            RouteWaypoint,
            st.tuples(_number(0.0, 45.0), _number(-12.0, 12.0), _number(3.0, 9.0)),
            st.sampled_from([0.5, 2.0]),
            st.sampled_from([0.0, 0.0, 1.0]),
        ),
        min_size=1,
        max_size=4,
    ),
)
def test_a_route_hits_nothing_and_ends(things: list[Thing], waypoints: list[RouteWaypoint]) -> None:
    _assert_safe(
        fly_route(Route(tuple(waypoints)), FlightTerms(CONFIG, avoidance=AVOIDANCE)), things
    )
