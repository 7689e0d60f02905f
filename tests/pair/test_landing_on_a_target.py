"""Landings on a target that a camera sees, with both firmwares: how near, and what without it."""

from __future__ import annotations

import math
import statistics
from dataclasses import replace

import pytest

from mavlink_sitl import VehicleConfig
from navigation_bridge.goals.requests import LandRequest
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.landing_flight import CAMERA, LandingFlight
from tests.support.flights.simulated_flight import SimulatedFlight

FIRMWARES = pytest.mark.parametrize(
    "autopilot", ["ardupilot", pytest.param("px4", marks=pytest.mark.wide)]
)
LAND = LandRequest("/target")
REQUIRED = replace(LAND, target_required=True)


@FIRMWARES
def test_it_lands_on_the_target_in_wind(autopilot: str) -> None:
    flight = LandingFlight(autopilot, wind_m_s=5.0)
    (end,) = flight.ends(flight.land(REQUIRED))
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert flight.off_m < 0.3
    assert end.final_error_m == pytest.approx(flight.off_m, abs=0.3)


@FIRMWARES
def test_a_target_that_is_seen_late_is_where_it_was_when_the_picture_was_taken(
    autopilot: str,
) -> None:
    def errors_m(delay_s: float) -> list[float]:
        camera = replace(CAMERA, noise=0.0, loss=0.0, delay_s=delay_s)
        flight = LandingFlight(autopilot, (12.0, 0.0, 0.0), camera=camera)
        return flight.passed_errors_m(24.0)

    prompt_m, late_m = errors_m(0.0), errors_m(0.1)
    assert len(late_m) > 30
    # At 3 m/s it flies 0.3 m in that time; its own estimate lags behind by 0.1 m.
    assert statistics.median(late_m) == pytest.approx(statistics.median(prompt_m), abs=0.02)
    assert statistics.median(late_m) < 0.15


@FIRMWARES
def test_without_the_target_that_is_required_it_holds(autopilot: str) -> None:
    flight = LandingFlight(autopilot)
    flight.is_covered = True
    (end,) = flight.ends(flight.land(REQUIRED))
    assert end.code is OutcomeCode.NO_LANDING_TARGET
    assert end.message == (
        "NO_LANDING_TARGET: The target has not been seen for 10 s. The vehicle holds."
    )
    flight.run_for(5.0)
    assert flight.truth()[0][2] > 9.0


def test_without_a_target_that_is_not_required_it_lands_where_it_is() -> None:
    flight = LandingFlight()
    flight.is_covered = True
    (end,) = flight.ends(flight.land(LAND))
    assert end.code is OutcomeCode.SUCCESS
    assert "has not been seen for 10 s. It landed where it was." in end.message
    assert math.isnan(end.final_error_m or math.nan)
    assert math.hypot(*flight.truth()[0][:2]) < 0.5


@pytest.mark.night
@FIRMWARES
def test_a_target_that_vanishes_is_searched_again_from_the_height_asked_for(
    autopilot: str,
) -> None:
    flight = LandingFlight(autopilot)
    goal_id = flight.start(replace(REQUIRED, retries=1, search_height_m=9.5))
    while flight.truth()[0][2] > 5.0:
        flight.look()
        flight.run_for(0.1)
    highest_m = 0.0
    for _ in range(150):
        flight.run_for(0.1)
        highest_m = max(highest_m, flight.truth()[0][2])
    assert highest_m == pytest.approx(9.5, abs=0.7)
    end_s = flight.now + 100.0
    while not flight.ends(goal_id):
        assert flight.now < end_s
        flight.look()
        flight.run_for(0.1)
    (end,) = flight.ends(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert flight.off_m < 0.3


@pytest.mark.night_but_first
@FIRMWARES
def test_a_target_that_stays_away_ends_as_the_goal_asked(autopilot: str) -> None:
    flight = LandingFlight(autopilot)
    flight.covered_below_m = 4.0
    (end,) = flight.ends(flight.land(replace(REQUIRED, retries=1)))
    assert end.code is OutcomeCode.NO_LANDING_TARGET
    assert "lost 2 times" in end.message
    flight.run_for(5.0)
    assert flight.truth()[0][2] > 1.5


def test_a_lost_target_that_is_not_required_is_not_waited_for() -> None:
    flight = LandingFlight()
    flight.covered_below_m = 4.0
    (end,) = flight.ends(flight.land(LAND))
    assert end.code is OutcomeCode.SUCCESS
    assert "lost once. It landed where it was." in end.message


@FIRMWARES
def test_a_cancelled_landing_holds(autopilot: str) -> None:
    flight = LandingFlight(autopilot)
    goal_id = flight.start(REQUIRED)
    for _ in range(60):
        flight.look()
        flight.run_for(0.1)
    assert flight.bridge.goals.cancel(goal_id, flight.now)
    (end,) = [flight.run_to_end(goal_id)]
    assert end.code is OutcomeCode.CANCELED, end.message
    assert flight.truth()[0][2] > 3.0


BAD = {
    "NaN": (replace(LAND, search_height_m=math.nan), "INVALID_NUMBER", "is nan; every"),
    "no topic": (LandRequest(target_required=True), "INVALID_TARGET", "target_topic"),
    "no name": (LandRequest("/not a name"), "INVALID_TARGET", "/not a name"),
    "another type": (
        replace(LAND, topic_types=("std_msgs/msg/String",)), "INVALID_TARGET", "std_msgs/msg/String"
    ),
    "too high": (replace(LAND, search_height_m=1e6), "OUTSIDE_VOLUME", "Where it searches"),
}  # fmt: skip


def test_what_makes_no_sense_is_rejected() -> None:
    flight = LandingFlight()
    for request, code, text in BAD.values():
        rejection = flight.check(request)
        assert rejection is not None
        assert rejection.code.value == code, rejection
        assert text in rejection.message


def test_a_vehicle_that_ignores_targets_is_told_what_it_lacks() -> None:
    flight = LandingFlight(parameters={"PLND_ENABLED": 1.0})
    rejection = flight.check(LAND)
    assert rejection is not None
    assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
    assert "set PLND_TYPE to 1" in rejection.message
    assert flight.check(LandRequest()) is None


def test_a_plane_lands_on_no_target() -> None:
    plane = VehicleConfig(vehicle="plane", autopilot="px4", ready_after_s=1.0)
    rejection = SimulatedFlight(simulated=plane).ready().check(LAND)
    assert rejection is not None
