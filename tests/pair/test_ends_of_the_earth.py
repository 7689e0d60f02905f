"""Goals across the date line, beside the poles and beside latitude and longitude 0."""

from __future__ import annotations

import pytest

from mavlink_sitl import GeoPoint, VehicleConfig
from navigation_bridge.goals.requests import ReturnRequest
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


@pytest.mark.night_but_first
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize(
    ("latitude", "longitude"),
    [(16.0, 179.99995), (-16.0, -180.0), (89.9999, 0.0), (-90.0, 120.0), (1e-7, 0.0)],
)
def test_goals_are_flown_and_returned_from(
    latitude: float, longitude: float, autopilot: str
) -> None:
    home = GeoPoint(latitude, longitude, 30.0)
    flight = SimulatedFlight(
        simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0, home=home)
    )
    flight.ready().run_for(4.0)
    for x, y in ((30.0, 20.0), (-30.0, -20.0)):
        end = flight.run_to_end(flight.send(x, y, 6.0, speed=5.0))
        assert end.code is OutcomeCode.SUCCESS, end.message
        (east_m, north_m, _), _ = flight.truth()
        assert (east_m, north_m) == pytest.approx((x, y), abs=1.5)
    end = flight.run_to_end(flight.start(ReturnRequest()))
    assert end.code is OutcomeCode.SUCCESS, end.message
    (east_m, north_m, _), _ = flight.truth()
    assert (east_m, north_m) == pytest.approx((0.0, 0.0), abs=1.5)
