"""The vehicle side against simulated rovers, boats and planes."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import VehicleConfig as SimulatedVehicleConfig
from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.events import (
    FailsafeBegan,
    LandedState,
    ModeChanged,
    OperationResult,
    StatusTextReceived,
)
from mavlink_vehicle.vehicle import SetpointNed
from tests.support.flights.vehicle_pair import VehiclePair

pytestmark = pytest.mark.wide


ACHIEVED, REFUSED = OperationResult.ACHIEVED, OperationResult.REFUSED


def pair_of(vehicle: str, **options: object) -> VehiclePair:
    simulated = SimulatedVehicleConfig(vehicle=vehicle, ready_after_s=1.0, **options)  # type: ignore[arg-type]
    pair = VehiclePair(1, None, None, simulated).ready()
    pair.events.clear()  # the mode in which it started
    return pair


def achieve(pair: VehiclePair, operation_id: int, timeout_s: float = 120.0) -> None:
    end = pair.finish(operation_id, timeout_s)
    assert end.result is ACHIEVED, end.reason


def truth(pair: VehiclePair) -> tuple[float, float, float]:
    north_m, east_m, down_m = pair.simulation.truth.position_ned_m[0]
    return float(north_m), float(east_m), float(down_m)


def speed_m_s(pair: VehiclePair) -> float:
    return math.hypot(*(float(v) for v in pair.simulation.truth.velocity_ned_m_s[0][:2]))


def stream(pair: VehiclePair, seconds: float, setpoint: SetpointNed) -> None:
    end_s = pair.now + seconds
    while pair.now < end_s:
        pair.vehicle.send_setpoint(setpoint, pair.now)
        pair.run_for(0.05)


def driving(kind: str) -> VehiclePair:
    pair = pair_of(kind)
    achieve(pair, pair.vehicle.take_control(pair.now))
    achieve(pair, pair.vehicle.arm(pair.now))
    pair.vehicle.setpoints.open(pair.now)
    return pair


@pytest.mark.parametrize("kind", ["rover", "boat"])
def test_a_ground_vehicle_follows_a_velocity_with_its_heading(kind: str) -> None:
    pair = driving(kind)
    # Position, yaw and acceleration are left out: they would be refused or win over it.
    stream(
        pair,
        12.0,
        SetpointNed((900.0, 0.0, 0.0), (0.0, 1.5, 0.0), (0.1, 0.1, 0.0), yaw_ned_rad=0.0),
    )
    attitude = pair.vehicle.state.attitude
    assert attitude is not None
    assert attitude.yaw_ned_rad == pytest.approx(math.pi / 2, abs=0.3)
    assert speed_m_s(pair) == pytest.approx(1.5, abs=0.4)
    assert not [t for t in pair.all(StatusTextReceived) if "Ignoring" in t.text]
    achieve(pair, pair.vehicle.hold(pair.now))
    assert not pair.vehicle.setpoints.is_open
    pair.run_for(8.0)
    assert speed_m_s(pair) < 0.5
    assert all(change.requested for change in pair.all(ModeChanged))


def test_a_rover_stops_by_itself_when_the_stream_ends() -> None:
    """ArduRover: three seconds on, then it stops, with a text."""
    pair = driving("rover")
    stream(pair, 10.0, SetpointNed(velocity_ned_m_s=(2.0, 0.0, 0.0)))
    begin_m, begin_s = truth(pair)[0], pair.now
    pair.run_until(lambda: speed_m_s(pair) < 0.05, 20.0)
    assert 3.0 < pair.now - begin_s < 9.0
    assert 6.0 < truth(pair)[0] - begin_m < 12.0
    assert any("target not received" in text.text for text in pair.all(StatusTextReceived))


def test_a_disarmed_rover_gets_no_setpoint_that_it_would_act_on_when_armed() -> None:
    pair = pair_of("rover")
    achieve(pair, pair.vehicle.take_control(pair.now))
    pair.vehicle.setpoints.open(pair.now)
    with pytest.raises(SetpointError, match="disarmed"):
        pair.vehicle.send_setpoint(SetpointNed(velocity_ned_m_s=(1.0, 0.0, 0.0)), pair.now)
    achieve(pair, pair.vehicle.arm(pair.now))
    pair.run_for(4.0)
    assert math.hypot(*truth(pair)[:2]) < 0.3


def flying_plane() -> VehiclePair:
    pair = pair_of("plane")
    achieve(pair, pair.vehicle.arm(pair.now))
    achieve(pair, pair.vehicle.take_off(40.0, pair.now))
    return pair


def test_a_plane_takes_off_by_its_mode_and_goes_where_it_is_sent() -> None:
    pair = flying_plane()
    vehicle = pair.vehicle
    assert vehicle.mode_name == "TAKEOFF"
    assert -truth(pair)[2] > 35.0
    assert vehicle.state.landed_state in (LandedState.TAKEOFF, LandedState.IN_AIR)
    state = vehicle.state
    assert state.home is not None
    home = state.home
    operation = vehicle.reposition(
        home.latitude_deg + 0.004, home.longitude_deg, home.altitude_amsl_m + 60.0, pair.now, 80.0
    )
    achieve(pair, operation)
    assert vehicle.mode_name == "GUIDED"
    target_north_m = 0.004 * 111_195.0
    pair.run_until(
        lambda: abs(math.hypot(truth(pair)[0] - target_north_m, truth(pair)[1]) - 80.0) < 25.0,
        180.0,
    )
    pair.run_for(40.0)
    north_m, east_m, down_m = truth(pair)
    assert math.hypot(north_m - target_north_m, east_m) == pytest.approx(80.0, abs=30.0)
    assert -down_m == pytest.approx(60.0, abs=6.0)
    achieve(pair, vehicle.change_speed(18.0, pair.now))
    achieve(pair, vehicle.return_to_launch(pair.now))
    assert all(change.requested for change in pair.all(ModeChanged))
    assert not pair.all(FailsafeBegan)


def test_a_plane_that_levels_out_at_its_own_height_has_taken_off() -> None:
    """ArduPlane climbs to TKOFF_ALT (50 m, and some metres over it), whatever is asked for."""
    pair = pair_of("plane")
    achieve(pair, pair.vehicle.arm(pair.now))
    achieve(pair, pair.vehicle.take_off(90.0, pair.now))
    assert -truth(pair)[2] == pytest.approx(50.0, abs=10.0)


def test_a_plane_rejects_unsupported_goals() -> None:
    pair = pair_of("plane")
    vehicle = pair.vehicle
    for operation, words in (
        (vehicle.land(pair.now), "has no mode for this"),
        (vehicle.take_off(40.0, pair.now), "is disarmed"),
        (vehicle.reposition(0.0, 0.0, 0.0, pair.now), "is disarmed"),
    ):
        end = pair.finish(operation)
        assert end.result is REFUSED
        assert words in end.reason
    achieve(pair, vehicle.take_control(pair.now))
    achieve(pair, vehicle.arm(pair.now))
    vehicle.setpoints.open(pair.now)
    with pytest.raises(SetpointError, match="sent to targets by reposition"):
        vehicle.send_setpoint(SetpointNed(position_ned_m=(1.0, 0.0, -50.0)), pair.now)
