"""The vehicle side against the simulated PX4 multicopter: OFFBOARD, its stream, its home."""

from __future__ import annotations

import dataclasses
import math

import pytest

from mavlink_sitl import GeoPoint, LinkFaults
from mavlink_sitl import VehicleConfig as SimulatedVehicleConfig
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.events import (
    FailsafeBegan,
    FailsafeEnded,
    FailsafeKind,
    ModeChanged,
    OperationResult,
    StatusTextReceived,
    StreamClosed,
)
from mavlink_vehicle.profiles.px4 import COPTER
from mavlink_vehicle.vehicle import SetpointNed, VehicleConfig
from tests.support.flights.vehicle_pair import BAD_RADIO, VehiclePair

pytestmark = pytest.mark.wide


ACHIEVED, REFUSED = OperationResult.ACHIEVED, OperationResult.REFUSED
HOME = GeoPoint(47.397743, 8.545594, 488.0)
NORTH = SetpointNed(velocity_ned_m_s=(2.0, 0.0, 0.0))
PATIENT = VehicleConfig(heartbeat_timeout_s=8.0)


def px4_pair(
    seed: int = 1, faults: LinkFaults | None = None, config: VehicleConfig | None = None
) -> VehiclePair:
    simulated = SimulatedVehicleConfig(
        autopilot="px4", home=HOME, ready_after_s=1.0, faults=faults, links=("onboard",)
    )
    return VehiclePair(seed, faults, config, simulated).ready()


def achieve(pair: VehiclePair, operation_id: int) -> None:
    end = pair.finish(operation_id)
    assert end.result is ACHIEVED, end.reason


def stream(pair: VehiclePair, seconds: float, setpoint: SetpointNed = NORTH) -> None:
    end_s = pair.now + seconds
    while pair.now < end_s:
        pair.vehicle.send_setpoint(setpoint, pair.now)
        pair.run_for(0.05)


def stream_until_finished(pair: VehiclePair, operation_id: int) -> OperationResult:
    for _ in range(400):
        if pair.vehicle.operations.operation_id != operation_id:
            break
        stream(pair, 0.05)
    return pair.finish(operation_id, 1.0).result


def fly_up(pair: VehiclePair, height_m: float = 10.0) -> None:
    achieve(pair, pair.vehicle.arm(pair.now))
    achieve(pair, pair.vehicle.take_off(height_m, pair.now))


def in_offboard(pair: VehiclePair) -> None:
    fly_up(pair)
    pair.vehicle.setpoints.open(pair.now)
    assert stream_until_finished(pair, pair.vehicle.take_control(pair.now)) is ACHIEVED


def height_m(pair: VehiclePair) -> float:
    return -float(pair.simulation.truth.position_ned_m[0][2])


@pytest.mark.night
def test_a_rate_that_the_firmware_does_not_reach_is_asked_for_once() -> None:
    """CURRENT_MODE comes at 2 Hz at most, and MISSION_CURRENT at 1 Hz, whatever is asked for."""
    pair = px4_pair()
    pair.run_for(120.0)
    asked = [
        int(message.param1)
        for _, message in pair.sent
        if message.get_type() == "COMMAND_LONG" and message.command == 511
    ]
    assert {436, 42} <= set(asked)
    assert {asked.count(number) for number in set(asked)} == {1}
    assert not pair.vehicle.rates.refusals


@pytest.mark.parametrize(
    ("seed", "faults"), [(1, None), (2, BAD_RADIO), (3, LinkFaults(loss=0.2, delay_s=0.2))]
)
def test_a_whole_flight(seed: int, faults: LinkFaults | None) -> None:
    pair = px4_pair(seed, faults, PATIENT)
    vehicle = pair.vehicle
    assert vehicle.profile is COPTER
    fly_up(pair)
    assert height_m(pair) == pytest.approx(10.0, abs=1.5)
    assert vehicle.mode_name in ("AUTO.TAKEOFF", "AUTO.LOITER")

    vehicle.setpoints.open(pair.now)
    assert stream_until_finished(pair, vehicle.take_control(pair.now)) is ACHIEVED
    assert vehicle.in_control_mode
    north_m = pair.simulation.truth.position_ned_m[0][0]
    stream(pair, 6.0)
    assert pair.simulation.truth.position_ned_m[0][0] - north_m > 6.0

    # The stream continues until the mode shows, else PX4 would call it lost.
    assert stream_until_finished(pair, vehicle.hold(pair.now)) is ACHIEVED
    pair.run_for(6.0)
    assert math.hypot(*pair.simulation.truth.velocity_ned_m_s[0][:2]) < 0.5
    assert not vehicle.setpoints.is_open

    achieve(pair, vehicle.land(pair.now))
    pair.run_until(lambda: not vehicle.state.armed, 90.0)
    pair.run_for(3.0)
    assert all(change.requested for change in pair.all(ModeChanged)), pair.all(ModeChanged)
    assert not pair.all(FailsafeBegan)


def test_offboard_is_not_asked_for_before_the_stream_has_run() -> None:
    pair = px4_pair()
    fly_up(pair)
    pair.run_for(3.0)
    end = pair.finish(pair.vehicle.take_control(pair.now))
    assert end.result is REFUSED
    assert "only while setpoints are received" in end.reason
    pair.vehicle.setpoints.open(pair.now)
    end = pair.finish(pair.vehicle.take_control(pair.now))
    assert end.result is OperationResult.LATE
    assert "setpoints were not streamed without a gap within 10.0 s" in end.reason
    modes = [m for _, m in pair.sent if m.get_type() == "COMMAND_LONG" and m.command == 176]
    assert not modes


def test_the_command_goes_out_when_the_stream_has_run_long_enough() -> None:
    pair = px4_pair()
    fly_up(pair)
    pair.vehicle.setpoints.open(pair.now)
    begin_s = pair.now
    assert stream_until_finished(pair, pair.vehicle.take_control(pair.now)) is ACHIEVED
    (sent_s,) = [t for t, m in pair.sent if m.get_type() == "COMMAND_LONG" and m.command == 176]
    assert 1.2 - 1e-9 <= sent_s - begin_s < 1.4


def test_a_mode_change_that_only_the_first_acknowledgement_accepts_is_rejected() -> None:
    pair = px4_pair()
    fly_up(pair)
    pair.run_for(3.0)
    end = pair.finish(pair.vehicle.change_mode("OFFBOARD", pair.now))
    assert end.result is REFUSED
    assert "DO_SET_MODE was answered TEMPORARILY_REJECTED" in end.reason


def test_a_mode_that_is_shown_but_cannot_run_is_not_achieved() -> None:
    pair = px4_pair(config=dataclasses.replace(PATIENT, operation_timeout_s=4.0))
    end = pair.finish(pair.vehicle.change_mode("OFFBOARD", pair.now))
    assert end.result is OperationResult.TIMED_OUT
    assert "OFFBOARD is selected but cannot run now (system_status 0)" in end.reason
    assert not pair.vehicle.in_control_mode


def test_a_stream_that_stops_is_an_offboard_failsafe_and_never_starts_again() -> None:
    pair = px4_pair()
    vehicle = pair.vehicle
    in_offboard(pair)
    stream(pair, 2.0)
    pair.run_until(lambda: bool(pair.all(FailsafeBegan)), 5.0)
    assert pair.all(FailsafeBegan)[0].kind is FailsafeKind.OFFBOARD
    assert not pair.all(ModeChanged)[-1].requested
    assert pair.all(StreamClosed)
    with pytest.raises(SetpointError, match="closed"):
        vehicle.send_setpoint(NORTH, pair.now)
    pair.run_until(lambda: not vehicle.state.armed, 120.0)
    pair.run_for(2.0)
    assert pair.all(FailsafeEnded)


def test_the_ground_stations_hold_ends_control_and_the_stream() -> None:
    pair = px4_pair()
    in_offboard(pair)
    assert pair.copter.pilot_mode_change("AUTO.LOITER")
    for _ in range(40):
        if not pair.vehicle.setpoints.is_open:
            break
        stream(pair, 0.05)
    change = pair.all(ModeChanged)[-1]
    assert (change.name, change.requested) == ("AUTO.LOITER", False)
    assert not pair.vehicle.setpoints.is_open
    pair.run_for(5.0)
    assert pair.vehicle.mode_name == "AUTO.LOITER"


def test_a_take_off_needs_an_armed_vehicle_and_its_height_is_above_sea_level() -> None:
    pair = px4_pair()
    end = pair.finish(pair.vehicle.take_off(10.0, pair.now))
    assert end.result is REFUSED
    assert "is disarmed; arm it first" in end.reason
    fly_up(pair, 12.0)
    (command,) = [m for _, m in pair.sent if m.get_type() == "COMMAND_LONG" and m.command == 22]
    assert command.param7 == pytest.approx(HOME.altitude_amsl_m + 12.0, abs=2.0)
    assert math.isnan(command.param5)


def test_our_heartbeat_is_a_ground_stations_so_that_texts_come() -> None:
    pair = px4_pair()
    achieve(pair, pair.vehicle.arm(pair.now))
    pair.run_for(1.0)
    assert any("Armed by" in text.text for text in pair.all(StatusTextReceived))

    onboard = mavlink.MAV_TYPE_ONBOARD_CONTROLLER
    pair = px4_pair(config=VehicleConfig(heartbeat_type=onboard))
    achieve(pair, pair.vehicle.arm(pair.now))
    pair.run_for(1.0)
    assert not pair.all(StatusTextReceived)


def test_a_mode_shows_within_a_quarter_second_by_current_mode() -> None:
    """HEARTBEAT comes strictly once a second."""
    pair = px4_pair()
    fly_up(pair)
    pair.run_for(3.0)
    for mode in ("AUTO.RTL", "AUTO.LOITER") * 2:
        begin_s = pair.now
        assert pair.copter.pilot_mode_change(mode)
        pair.run_until(lambda mode=mode: pair.vehicle.mode_name == mode, 2.0)  # type: ignore[misc]
        assert pair.now - begin_s < 0.3
