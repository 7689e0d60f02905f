"""The vehicle side against the simulated PX4 rover, boat and plane."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import VehicleConfig as SimulatedVehicleConfig
from mavlink_vehicle.events import FailsafeBegan, FailsafeKind, ModeChanged, OperationResult
from mavlink_vehicle.vehicle import SetpointNed
from tests.support.flights.vehicle_pair import VehiclePair

pytestmark = pytest.mark.wide


EAST = SetpointNed((900.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.1, 0.0, 0.0), yaw_ned_rad=0.0)


def pair_of(vehicle: str) -> VehiclePair:
    simulated = SimulatedVehicleConfig(
        vehicle=vehicle, autopilot="px4", ready_after_s=1.0, links=("onboard",)
    )
    return VehiclePair(1, None, None, simulated).ready()


def achieve(pair: VehiclePair, operation_id: int, timeout_s: float = 120.0) -> None:
    end = pair.finish(operation_id, timeout_s)
    assert end.result is OperationResult.ACHIEVED, end.reason


def stream(pair: VehiclePair, seconds: float) -> None:
    end_s = pair.now + seconds
    while pair.now < end_s:
        pair.vehicle.send_setpoint(EAST, pair.now)
        pair.run_for(0.05)


def speed_m_s(pair: VehiclePair) -> float:
    return math.hypot(*(float(v) for v in pair.simulation.truth.velocity_ned_m_s[0][:2]))


@pytest.mark.parametrize("kind", ["rover", "boat"])
def test_a_ground_vehicle_drives_by_velocity_until_the_stream_ends(kind: str) -> None:
    pair = pair_of(kind)
    vehicle = pair.vehicle
    achieve(pair, vehicle.arm(pair.now))
    vehicle.setpoints.open(pair.now)
    operation = vehicle.take_control(pair.now)
    stream(pair, 3.0)
    achieve(pair, operation, 0.1)
    stream(pair, 12.0)
    # Commanded 2.0 m/s, the rover of the firmware's own simulator drives 2.3.
    assert speed_m_s(pair) == pytest.approx(2.3 if kind == "rover" else 2.0, abs=0.2)
    attitude = vehicle.state.attitude
    assert attitude is not None
    assert attitude.yaw_ned_rad == pytest.approx(math.pi / 2, abs=0.2)
    assert all(change.requested for change in pair.all(ModeChanged))
    pair.run_until(lambda: bool(pair.all(FailsafeBegan)), 3.0)
    assert pair.all(FailsafeBegan)[0].kind is FailsafeKind.OFFBOARD
    assert not vehicle.in_control_mode
    assert not vehicle.setpoints.is_open


@pytest.mark.night
def test_a_plane_takes_off_and_goes_where_it_is_sent() -> None:
    pair = pair_of("plane")
    vehicle = pair.vehicle
    achieve(pair, vehicle.arm(pair.now))
    achieve(pair, vehicle.take_off(50.0, pair.now), 150.0)
    home = vehicle.state.home
    assert home is not None
    place = (home.latitude_deg + 0.004, home.longitude_deg, home.altitude_amsl_m + 60.0)
    achieve(pair, vehicle.reposition(*place, pair.now, 80.0))
    pair.run_for(60.0)
    north_m, east_m, down_m = (float(v) for v in pair.simulation.truth.position_ned_m[0])
    assert math.hypot(north_m - 0.004 * 111_195.0, east_m) == pytest.approx(80.0, abs=30.0)
    assert -down_m == pytest.approx(60.0, abs=4.0)
    achieve(pair, vehicle.change_speed(17.0, pair.now))
    achieve(pair, vehicle.return_to_launch(pair.now))
    assert all(change.requested for change in pair.all(ModeChanged))
    assert not pair.all(FailsafeBegan)
