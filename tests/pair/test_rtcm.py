"""RTCM corrections from the bridge to the GPS receiver of a simulated vehicle."""

from __future__ import annotations

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.protocols.streams.rtcm import RtcmError
from navigation_bridge.requests.gps_corrections import GpsCorrections
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.unit.vehicle.test_rtcm import rtcm

pytestmark = pytest.mark.wide_but_first


@pytest.mark.parametrize(
    ("autopilot", "release"), [("ardupilot", ""), ("px4", ""), ("px4", "px4-1.18")]
)
def test_corrections_reach_the_receiver(autopilot: str, release: str) -> None:
    simulated = VehicleConfig(autopilot=autopilot, firmware=release, ready_after_s=1.0)
    flight = SimulatedFlight(simulated=simulated)
    messages = [rtcm(size, size) for size in (25, 180, 360, 540, 720, 613)]
    with pytest.raises(RtcmError, match="no connection"):
        flight.bridge.feature(GpsCorrections).send(messages[0], flight.now)
    flight.ready()
    flight.bridge.feature(GpsCorrections).send(b"".join(messages), flight.now)
    flight.run_for(2.0)
    given = flight.simulation.vehicles[0].corrections
    assert b"".join(given) == b"".join(messages)
    if autopilot == "ardupilot" or release:
        assert given == messages
