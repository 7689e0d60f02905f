"""The vehicle side against the simulated ArduCopter: good links, bad links, pilots, reboots."""

from __future__ import annotations

import math
from functools import partial

import pytest

from mavlink_sitl import LinkFaults
from mavlink_vehicle.codec import Message, make, message_id, with_source
from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.events import (
    ArmedChanged,
    HeartbeatLost,
    HeartbeatRegained,
    LandedState,
    ModeChanged,
    OperationFinished,
    OperationResult,
    StatusTextReceived,
    StreamClosed,
    VehicleDiscovered,
    VehicleRebooted,
)
from mavlink_vehicle.vehicle import DEFAULT_RATES_HZ, SetpointNed, VehicleConfig
from tests.support.flights.vehicle_pair import BAD_RADIO, WORSE_RADIO, VehiclePair

pytestmark = pytest.mark.wide


ACHIEVED, REFUSED = OperationResult.ACHIEVED, OperationResult.REFUSED
CANCELLED, LINK_LOST = OperationResult.CANCELLED, OperationResult.LINK_LOST

# Twice in a row three HEARTBEATs may be lost when a fifth is; that is not what is tested.
PATIENT = VehicleConfig(heartbeat_timeout_s=8.0)
LINKS = {
    "good": None,
    "bad": BAD_RADIO,
    "reordering": WORSE_RADIO,
    "terrible": LinkFaults(loss=0.4, duplicate=0.3, delay_s=0.5, jitter_s=0.5),
}


def fly_up(pair: VehiclePair, height_m: float = 5.0) -> None:
    vehicle = pair.vehicle
    for operation in (
        partial(vehicle.change_mode, "GUIDED"),
        vehicle.arm,
        partial(vehicle.take_off, height_m),
    ):
        end = pair.finish(operation(pair.now))
        assert end.result is ACHIEVED, end.reason


def height_m(pair: VehiclePair) -> float:
    return -float(pair.simulation.truth.position_ned_m[0][2])


def taking_off(pair: VehiclePair, height_above_home_m: float) -> int:
    pair.finish(pair.vehicle.change_mode("GUIDED", pair.now))
    pair.finish(pair.vehicle.arm(pair.now))
    return pair.vehicle.take_off(height_above_home_m, pair.now)


def test_discovery_brings_the_telemetry_at_its_rates() -> None:
    pair = VehiclePair().ready()
    (found,) = pair.all(VehicleDiscovered)
    assert (found.system_id, found.profile_name) == (1, "ArduCopter")
    pair.run_for(5.0)
    received = dict.fromkeys(("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "ATTITUDE"), 0)
    receive = pair.vehicle.receive

    def count(message: Message, now: float) -> None:
        name = message.get_type()
        if name in received:
            received[name] += 1
        receive(message, now)

    pair.vehicle.receive = count  # type: ignore[method-assign]
    pair.run_for(10.0)
    for name, number in received.items():
        assert number == pytest.approx(10.0 * DEFAULT_RATES_HZ[name], rel=0.1), name
    state = pair.vehicle.state
    assert state.firmware_version is not None
    assert state.origin is not None
    assert state.battery is not None
    assert state.battery.remaining is not None
    assert state.battery.remaining > 0.9


@pytest.mark.parametrize("name", LINKS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_whole_flight_over_any_link(name: str, seed: int) -> None:
    pair = VehiclePair(seed, LINKS[name], PATIENT).ready()
    vehicle = pair.vehicle
    fly_up(pair)
    assert height_m(pair) > 4.3
    assert vehicle.state.landed_state is LandedState.IN_AIR

    vehicle.setpoints.open(pair.now)
    target = (8.0, 4.0, -6.0)
    end_s = pair.now + 25.0
    while pair.now < end_s:
        vehicle.send_setpoint(SetpointNed(position_ned_m=target, yaw_ned_rad=0.5), pair.now)
        pair.run_for(0.05)
    position = pair.simulation.truth.position_ned_m[0]
    assert math.dist(position, target) < 1.0
    assert vehicle.setpoints.statistics.sent > 400
    vehicle.setpoints.close()

    assert pair.finish(vehicle.change_mode("LAND", pair.now)).result is ACHIEVED
    pair.run_until(lambda: not vehicle.state.armed, 90.0)
    assert vehicle.state.landed_state is LandedState.ON_GROUND
    assert pair.all(ArmedChanged)[-1] == ArmedChanged(armed=False, requested=False)
    for change in pair.all(ModeChanged):
        assert change.requested, change
    assert not pair.all(VehicleRebooted)


@pytest.mark.parametrize("name", LINKS)
def test_setpoints_are_rejected_while_they_would_do_harm(name: str) -> None:
    pair = VehiclePair(4, LINKS[name], PATIENT).ready()
    vehicle = pair.vehicle
    setpoint = SetpointNed(position_ned_m=(0.0, 0.0, -5.0))
    with pytest.raises(SetpointError, match="closed"):
        vehicle.send_setpoint(setpoint, pair.now)
    vehicle.setpoints.open(pair.now)
    with pytest.raises(SetpointError, match="change to GUIDED first"):
        vehicle.send_setpoint(setpoint, pair.now)
    pair.finish(vehicle.change_mode("GUIDED", pair.now))
    with pytest.raises(SetpointError, match="disarmed"):
        vehicle.send_setpoint(setpoint, pair.now)
    pair.finish(vehicle.arm(pair.now))
    operation = vehicle.take_off(3.0, pair.now)
    with pytest.raises(SetpointError, match="is taking off"):
        vehicle.send_setpoint(setpoint, pair.now)
    assert pair.finish(operation).result is ACHIEVED
    for bad in (math.nan, math.inf, -math.inf, 1e9):
        with pytest.raises(SetpointError, match="finite"):
            vehicle.send_setpoint(SetpointNed(position_ned_m=(0.0, bad, -5.0)), pair.now)
    assert "SET_POSITION_TARGET_LOCAL_NED" not in pair.names_sent()
    vehicle.send_setpoint(setpoint, pair.now)
    pair.flush()
    assert pair.names_sent().count("SET_POSITION_TARGET_LOCAL_NED") == 1


@pytest.mark.parametrize("name", LINKS)
def test_a_rejection_brings_the_autopilots_reasons(name: str) -> None:
    pair = VehiclePair(5, LINKS[name], PATIENT).ready()
    vehicle = pair.vehicle
    pair.finish(vehicle.change_mode("GUIDED", pair.now))
    pair.copter.lose_gps()
    pair.run_for(20.0)
    end = pair.finish(vehicle.arm(pair.now))
    assert end.result is REFUSED
    assert "COMPONENT_ARM_DISARM was answered FAILED" in end.reason
    if name == "good":  # on a bad link the text may be lost
        assert '"Arm: GPS 1: Bad fix"' in end.reason
    assert not vehicle.state.armed


def test_a_take_off_that_is_not_armed_for_is_rejected() -> None:
    pair = VehiclePair().ready()
    pair.finish(pair.vehicle.change_mode("GUIDED", pair.now))
    end = pair.finish(pair.vehicle.take_off(5.0, pair.now))
    assert end.result is REFUSED
    assert "NAV_TAKEOFF was answered FAILED" in end.reason


def test_unknown_modes_and_impossible_heights_are_rejected_at_once() -> None:
    pair = VehiclePair().ready()
    vehicle = pair.vehicle
    for operation, words in (
        (vehicle.change_mode("HOVER", pair.now), "has no mode 'HOVER'; its modes are ACRO"),
        (vehicle.take_off(math.nan, pair.now), "not above the ground"),
        (vehicle.take_off(-1.0, pair.now), "not above the ground"),
    ):
        end = pair.finish(operation)
        assert end.result is REFUSED
        assert words in end.reason


def test_what_is_already_so_is_achieved_without_a_command() -> None:
    pair = VehiclePair().ready()
    pair.finish(pair.vehicle.change_mode("GUIDED", pair.now))
    pair.run_for(10.0)
    pair.sent.clear()
    assert pair.finish(pair.vehicle.change_mode("GUIDED", pair.now)).result is ACHIEVED
    assert pair.finish(pair.vehicle.disarm(pair.now)).result is ACHIEVED
    assert "COMMAND_LONG" not in pair.names_sent()


def test_without_a_vehicle_operations_end_at_once() -> None:
    pair = VehiclePair()
    pair.simulation.link.silent = True
    end = pair.finish(pair.vehicle.arm(pair.now))
    assert end.result is LINK_LOST
    assert "No vehicle has been detected" in end.reason


@pytest.mark.parametrize("name", LINKS)
@pytest.mark.parametrize("mode", ["LOITER", "LAND", "STABILIZE"])
def test_the_pilots_mode_change_is_not_ours_and_closes_the_stream(name: str, mode: str) -> None:
    pair = VehiclePair(6, LINKS[name], PATIENT).ready()
    vehicle = pair.vehicle
    fly_up(pair)
    vehicle.setpoints.open(pair.now)
    pair.run_for(7.0)
    pair.events.clear()
    assert pair.copter.pilot_mode_change(mode)
    pair.run_until(lambda: bool(pair.all(ModeChanged)), 10.0)
    (change,) = pair.all(ModeChanged)
    assert change.name == mode
    assert not change.requested
    assert pair.all(StreamClosed)
    with pytest.raises(SetpointError, match=r"closed|must not be sent"):
        vehicle.send_setpoint(SetpointNed(position_ned_m=(0.0, 0.0, -5.0)), pair.now)


def test_the_pilot_switching_back_is_not_ours() -> None:
    pair = VehiclePair().ready()
    fly_up(pair)
    pair.copter.pilot_throttle(1500)
    pair.finish(pair.vehicle.change_mode("LOITER", pair.now))
    pair.run_for(0.5)
    pair.events.clear()
    assert pair.copter.pilot_mode_change("GUIDED")
    pair.run_for(2.0)
    assert [(c.name, c.requested) for c in pair.all(ModeChanged)] == [("GUIDED", False)]


def test_a_take_off_that_the_pilot_cuts_short_ends_and_is_not_repeated() -> None:
    pair = VehiclePair().ready()
    operation = taking_off(pair, 20.0)
    pair.run_until(lambda: height_m(pair) > 2.0)
    pair.copter.pilot_mode_change("LAND")
    end = pair.finish(operation)
    assert end.result is CANCELLED
    assert "LAND" in end.reason
    assert not pair.all(ModeChanged)[-1].requested


@pytest.mark.parametrize("name", LINKS)
def test_a_mode_change_that_showed_up_late_is_still_ours(name: str) -> None:
    pair = VehiclePair(8, LINKS[name], PATIENT).ready()
    vehicle = pair.vehicle
    operation = vehicle.change_mode("GUIDED", pair.now)
    pair.flush()
    vehicle.operations.abandon(pair.now)
    assert pair.finish(operation).result is CANCELLED
    pair.run_for(4.0)
    for change in pair.all(ModeChanged):
        assert change.requested


def test_going_back_at_once_waits_for_what_is_on_its_way() -> None:
    pair = VehiclePair(9, LinkFaults(delay_s=0.5)).ready()
    vehicle = pair.vehicle
    fly_up(pair)
    pair.run_for(10.0)
    first = vehicle.change_mode("BRAKE", pair.now)
    pair.run_for(0.05)
    second = vehicle.change_mode("GUIDED", pair.now)
    assert pair.finish(first).result is CANCELLED
    assert pair.finish(second).result is ACHIEVED
    pair.run_for(3.0)
    assert vehicle.mode_name == "GUIDED"
    assert all(change.requested for change in pair.all(ModeChanged))


@pytest.mark.parametrize("name", LINKS)
def test_a_new_operation_ends_the_one_under_way_first(name: str) -> None:
    pair = VehiclePair(10, LINKS[name], PATIENT).ready()
    vehicle = pair.vehicle
    pair.finish(vehicle.change_mode("GUIDED", pair.now))
    first = vehicle.arm(pair.now)
    second = vehicle.disarm(pair.now)
    pair.flush()
    ends = [e for e in pair.all(OperationFinished) if e.operation_id in (first, second)]
    assert ends[0].operation_id == first
    assert ends[0].result is CANCELLED
    pair.finish(second)
    pair.run_for(5.0)
    assert not vehicle.state.armed
    assert vehicle.operations.operation_id is None


@pytest.mark.parametrize("name", LINKS)
def test_after_a_reboot_the_rates_are_asked_for_again(name: str) -> None:
    pair = VehiclePair(11, LINKS[name], PATIENT).ready()
    vehicle = pair.vehicle
    pair.run_for(5.0)
    pair.reboot()
    pair.run_until(lambda: bool(pair.all(VehicleRebooted)), 30.0)
    pair.run_for(20.0)
    position = vehicle.state.global_position
    assert position is not None
    assert pair.now - position.time_s < 1.5
    assert len(pair.all(VehicleRebooted)) == 1
    assert vehicle.heartbeats.alive


@pytest.mark.parametrize("name", ["good", "bad"])
def test_a_restart_in_the_middle_of_a_take_off_ends_it(name: str) -> None:
    pair = VehiclePair(12, LINKS[name], PATIENT).ready()
    vehicle = pair.vehicle
    pair.finish(vehicle.change_mode("GUIDED", pair.now))
    pair.finish(vehicle.arm(pair.now))
    operation = vehicle.take_off(20.0, pair.now)
    pair.run_until(lambda: height_m(pair) > 3.0)
    pair.copter.power_cycle()
    end = pair.finish(operation)
    if name == "bad" and end.result is CANCELLED:
        # The HEARTBEAT with the mode after the restart came before the sign of the restart.
        assert "switched to STABILIZE" in end.reason
        pair.run_until(lambda: bool(pair.all(VehicleRebooted)))
    else:
        assert end.result is LINK_LOST
        assert "the autopilot restarted" in end.reason
    assert len(pair.all(VehicleRebooted)) == 1
    pair.run_for(15.0)
    assert len(pair.all(VehicleRebooted)) == 1
    assert vehicle.state.local_position is not None


@pytest.mark.parametrize("silence_s", [1.0, 3.0, 6.0])
def test_a_silence_while_commanding_only_delays(silence_s: float) -> None:
    pair = VehiclePair(13).ready()
    vehicle = pair.vehicle
    for operation in (partial(vehicle.change_mode, "GUIDED"), vehicle.arm):
        started = operation(pair.now)
        pair.simulation.link.silent = True
        pair.run_for(silence_s)
        pair.simulation.link.silent = False
        end = pair.finish(started)
        assert end.result is ACHIEVED, end.reason
    assert all(change.requested for change in pair.all(ModeChanged))


def test_silence_is_lost_and_a_return_is_regained_with_telemetry() -> None:
    pair = VehiclePair().ready()
    vehicle = pair.vehicle
    pair.simulation.link.silent = True
    pair.run_for(10.0)
    (lost,) = pair.all(HeartbeatLost)
    assert lost.silent_s == pytest.approx(3.0, abs=0.2)
    assert not vehicle.heartbeats.alive
    asked = pair.names_sent().count("COMMAND_LONG")
    pair.run_for(10.0)
    assert pair.names_sent().count("COMMAND_LONG") == asked  # nobody would hear it
    pair.simulation.link.silent = False
    pair.run_for(5.0)
    assert pair.all(HeartbeatRegained) == [HeartbeatRegained(rebooted=False)]
    assert vehicle.heartbeats.alive
    assert pair.names_sent().count("COMMAND_LONG") > asked


def test_an_operation_into_silence_ends_as_a_lost_link() -> None:
    pair = VehiclePair().ready()
    pair.simulation.link.silent = True
    end = pair.finish(pair.vehicle.change_mode("GUIDED", pair.now))
    assert end.result is LINK_LOST
    assert "no HEARTBEAT" in end.reason


def test_a_take_off_survives_a_short_silence() -> None:
    pair = VehiclePair().ready()
    operation = taking_off(pair, 10.0)
    pair.run_for(1.0)
    pair.simulation.link.silent = True
    pair.run_for(6.0)
    pair.simulation.link.silent = False
    assert pair.finish(operation).result is ACHIEVED


def test_other_systems_on_the_link_change_nothing() -> None:
    pair = VehiclePair().ready()
    state = pair.vehicle.state
    for system, component in ((255, 190), (1, 154), (2, 1), (1, 191)):
        for message in (
            make("HEARTBEAT", type=6, autopilot=3, base_mode=209, custom_mode=17),
            make("COMMAND_ACK", command=400, target_system=1, target_component=191),
            make("STATUSTEXT", severity=1, text="boo"),
        ):
            pair.vehicle.receive(with_source(message, system, component), pair.now)
    assert pair.vehicle.state is state


def test_a_rejected_message_is_asked_for_once_and_not_nagged_for() -> None:
    """The simulated ArduPilot has none of the last two, and says so to all stations each time."""
    rates = {**DEFAULT_RATES_HZ, "ODOMETRY": 5.0, "WHEEL_DISTANCE": 1.0, "HYGROMETER_SENSOR": 1.0}
    ranges = {"OBSTACLE_DISTANCE": 10.0, "DISTANCE_SENSOR": 10.0}
    config = VehicleConfig(message_rates_hz=rates, optional_rates_hz=ranges)
    pair = VehiclePair(config=config).ready()
    pair.run_for(120.0)
    asked = asked_for(pair)
    for name in ("ODOMETRY", "OBSTACLE_DISTANCE"):
        assert message_id(name) not in asked  # the profile knows that ArduPilot has none
    assert {asked.count(number) for number in set(asked)} == {1}
    refused = pair.vehicle.rates.refusals
    assert refused.items() >= {"WHEEL_DISTANCE": "DENIED", "HYGROMETER_SENSOR": "DENIED"}.items()
    texts = [e.text for e in pair.all(StatusTextReceived) if "No ap_message" in e.text]
    assert len(texts) == len(set(texts)) == len(refused)


def asked_for(pair: VehiclePair) -> list[int]:
    """Return the messages whose rate was asked for, once for each time."""
    return [
        int(message.param1)
        for _, message in pair.sent
        if message.get_type() == "COMMAND_LONG" and message.command == 511
    ]
