"""Failsafes of the vehicle end a goal with their own codes, and nothing more moves it."""

from __future__ import annotations

import pytest

from mavlink_sitl import SimulatedVehicle, VehicleConfig
from mavlink_vehicle.codec import Codec, make, mavlink
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.goal import GoalFinished, LogLine
from navigation_bridge.goals.requests import LandRequest, ReturnRequest
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


MOVING = {"SET_POSITION_TARGET_LOCAL_NED", "COMMAND_LONG", "COMMAND_INT", "SET_MODE"}
RTL, LAND = {"RTL", "AUTO.RTL"}, {"LAND", "AUTO.LAND"}


def under_way(
    autopilot: str = "ardupilot",
    kind: str = "copter",
    parameters: dict[str, float] | None = None,
    battery_policy: str = "reject",
) -> tuple[SimulatedFlight, SimulatedVehicle, str]:
    """Return a flight on its way to a far target, its simulated vehicle, and the goal's id."""
    vehicle = VehicleConfig(
        autopilot=autopilot, vehicle=kind, ready_after_s=1.0, parameters=parameters or {}
    )
    flight = SimulatedFlight(simulated=vehicle, battery_policy=battery_policy).ready()
    goal = flight.send(70.0, 0.0, 6.0 if kind == "copter" else 0.0, speed=6.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(3.0)
    return flight, flight.simulation.vehicles[0], goal


def end_in_silence(flight: SimulatedFlight, goal: str, timeout_s: float = 30.0) -> GoalFinished:
    """Return the end of a goal after which nothing that moves the vehicle was sent."""
    flight.run_until(lambda: bool(flight.ends(goal)), timeout_s)
    ended_s = flight.now
    flight.run_for(5.0)
    late = [m for t, m in flight.sent if t > ended_s and m.get_type() in MOVING]
    asked = {m.command for m in late if m.get_type().startswith("COMMAND")}
    assert asked <= {511, 512}, "only telemetry may be asked for"
    assert not [m for m in late if not m.get_type().startswith("COMMAND")]
    (end,) = flight.ends(goal)
    return end


def test_a_low_battery_of_a_copter() -> None:
    flight, vehicle, goal = under_way(
        parameters={"BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 2.0, "BATT_LOW_TIMER": 3.0}
    )
    vehicle.set_battery_voltage(10.0)
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_BATTERY, end.message
    assert "RTL" in end.message
    assert "Battery" in end.message
    assert flight.vehicle.mode_name in RTL
    refused = flight.check(flight.request(1.0, 1.0, 5.0))
    assert refused is not None
    assert refused.code is OutcomeCode.FAILSAFE_BATTERY


def test_a_critical_battery_of_a_copter_lands_it() -> None:
    flight, vehicle, goal = under_way(
        parameters={"BATT_CRT_VOLT": 10.4, "BATT_FS_CRT_ACT": 1.0, "BATT_LOW_TIMER": 3.0}
    )
    vehicle.set_battery_voltage(10.0)
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_BATTERY, end.message
    assert flight.vehicle.mode_name in LAND


def test_a_lost_radio() -> None:
    flight, vehicle, goal = under_way(parameters={"FS_THR_ENABLE": 1.0})
    vehicle.lose_radio(True)
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_RC, end.message
    assert "Radio Failsafe" in end.message


def test_a_lost_gps() -> None:
    flight, vehicle, goal = under_way()
    vehicle.lose_gps()
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_GPS, end.message
    assert "EKF" in end.message


def test_a_breached_fence() -> None:
    """Pulled in under way: a setpoint would never lead out of it."""
    flight, vehicle, goal = under_way(
        parameters={"FENCE_TYPE": 3.0, "FENCE_RADIUS": 200.0, "AVOID_ENABLE": 0.0}
    )
    vehicle.parameters.set("FENCE_RADIUS", 5.0)
    vehicle.parameters.set("FENCE_ENABLE", 1.0)
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_FENCE, end.message
    assert "fence" in end.message.lower()


@pytest.mark.parametrize("kind", ["copter", "rover"])
def test_a_breach_is_over_when_the_fence_is_switched_off(kind: str) -> None:
    """The firmware then says nothing more of it, but in the health bit that stays."""
    fence = {"FENCE_TYPE": 2.0, "FENCE_RADIUS": 200.0}
    # A rover would drive back in before it is looked at.
    own = {"copter": {"AVOID_ENABLE": 0.0}, "rover": {"FENCE_ACTION": 2.0}}[kind]
    flight, vehicle, goal = under_way(kind=kind, parameters=fence | own)
    vehicle.parameters.set("FENCE_RADIUS", 5.0)
    vehicle.parameters.set("FENCE_ENABLE", 1.0)
    assert end_in_silence(flight, goal).code is OutcomeCode.FAILSAFE_FENCE
    refused = flight.check(flight.request(1.0, 1.0, 5.0 if kind == "copter" else 0.0))
    assert refused is not None
    assert refused.code is OutcomeCode.FAILSAFE_FENCE
    vehicle.parameters.set("FENCE_ENABLE", 0.0)
    flight.set_mode_as_pilot("LOITER")
    flight.simulation.vehicles[0].pilot_throttle(1500)
    flight.run_for(5.0)
    assert vehicle.firmware.fence.breached, "the firmware's own flag stays"
    assert flight.vehicle.state.failsafe is None
    end = flight.run_to_end(flight.send(1.0, 1.0, 5.0 if kind == "copter" else 0.0))
    assert end.code is OutcomeCode.SUCCESS, end.message


def test_a_battery_failsafe_that_only_warns_ends_the_goal_or_is_reported_as_configured() -> None:
    parameters = {"BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 0.0, "BATT_LOW_TIMER": 3.0}
    flight, vehicle, goal = under_way(parameters=parameters)
    vehicle.set_battery_voltage(10.0)
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.FAILSAFE_BATTERY, end.message
    assert flight.truth()[1] < 0.3, "it holds"
    flight, vehicle, goal = under_way(parameters=parameters, battery_policy="warn")
    vehicle.set_battery_voltage(10.0)
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "but took no action" in end.message
    lines = [line.text for line in flight.all(LogLine) if ": The vehicle reported a" in line.text]
    assert len(lines) == 1


def test_a_landing_and_a_return_are_never_ended_by_a_failsafe() -> None:
    parameters = {"BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 0.0, "BATT_LOW_TIMER": 3.0}
    flight, vehicle, _ = under_way(parameters=parameters)
    goal = flight.start(ReturnRequest())
    vehicle.set_battery_voltage(10.0)
    flight.run_for(8.0)
    assert not flight.ends(goal)
    goal = flight.start(LandRequest())
    assert flight.run_to_end(goal).code is OutcomeCode.SUCCESS


def test_a_landing_after_a_battery_return_does_not_say_that_the_vehicle_did_not_act() -> None:
    flight, vehicle, goal = under_way(
        parameters={"BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 2.0, "BATT_LOW_TIMER": 3.0}
    )
    vehicle.set_battery_voltage(10.0)
    assert end_in_silence(flight, goal).code is OutcomeCode.FAILSAFE_BATTERY
    end = flight.run_to_end(flight.start(LandRequest()))
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert "took no action" not in end.message
    assert "failsafe (" not in end.message


def test_the_rejection_after_the_end_of_the_server_names_the_hold_service_and_it_helps() -> None:
    flight, _, goal = under_way("px4")
    flight.link_up = False
    flight.run_for(4.0)
    flight.link_up = True
    end_in_silence(flight, goal)
    refused = flight.check(flight.request(1.0, 1.0, 5.0))
    assert refused is not None
    assert "hold service" in refused.message
    assert flight.serve(Service.HOLD).success
    flight.run_for(2.0)
    end = flight.run_to_end(flight.send(1.0, 1.0, 5.0))
    assert end.code is OutcomeCode.SUCCESS, end.message


def test_the_rejection_of_a_battery_return_does_not_ask_to_stop_it() -> None:
    flight, vehicle, goal = under_way(
        parameters={"BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 2.0, "BATT_LOW_TIMER": 3.0}
    )
    vehicle.set_battery_voltage(10.0)
    end_in_silence(flight, goal)
    refused = flight.check(flight.request(1.0, 1.0, 5.0))
    assert refused is not None
    assert "hold" not in refused.message


def test_a_lost_ground_station() -> None:
    """Somebody else's: our HEARTBEATs and setpoints do not count as the ground station's."""
    flight, _, goal = under_way(parameters={"FS_GCS_ENABLE": 1.0, "FS_GCS_TIMEOUT": 3.0})
    station = Codec(255, 190)
    for _ in range(4):
        beat = make("HEARTBEAT", type=mavlink.MAV_TYPE_GCS, autopilot=8)
        flight.simulation.link.write(station.encode(beat))
        flight.run_for(1.0)
        assert not flight.ends(goal)
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_GCS, end.message
    assert "GCS Failsafe" in end.message


def test_a_battery_failsafe_of_a_px4_that_only_warns() -> None:
    """The state stays ACTIVE; only the charge state shows it (observed)."""
    flight, vehicle, goal = under_way("px4", parameters={"COM_LOW_BAT_ACT": 0.0})
    vehicle.parameters.set("BAT_CRIT_THR", 0.95)
    vehicle.parameters.set("BAT_LOW_THR", 0.99)
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.FAILSAFE_BATTERY, end.message
    assert flight.truth()[1] < 0.3, "it holds"


def sticks(flight: SimulatedFlight) -> None:
    """Somebody holds the sticks, in the middle."""
    joystick = Codec(1, 255)
    flight.simulation.link.write(joystick.encode(make("MANUAL_CONTROL", target=1, z=500)))


@pytest.mark.parametrize("action", [1.0, 2.0, 3.0], ids=["hold", "return", "land"])
def test_sticks_that_a_px4_loses_while_the_stream_is_kept(action: float) -> None:
    """COM_FAIL_ACT_T: it holds for a while first."""
    flight, _, goal = under_way("px4", parameters={"NAV_RCL_ACT": action})
    for _ in range(20):
        sticks(flight)
        flight.run_for(0.1)
    assert not flight.ends(goal)
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_RC, end.message
    assert "Failsafe activated" in end.message
    assert "Takeoff detected" not in end.message


def test_a_fix_that_a_px4_loses_while_the_stream_is_kept() -> None:
    flight, vehicle, goal = under_way("px4")
    vehicle.lose_gps()
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.FAILSAFE_GPS, end.message


def test_a_ground_station_that_a_px4_loses_while_the_stream_is_kept() -> None:
    """Our HEARTBEAT is an onboard computer's here, so no text comes: nothing shows the kind."""
    parameters = {"NAV_DLL_ACT": 2.0, "COM_DL_LOSS_T": 5.0}
    simulated = VehicleConfig(autopilot="px4", ready_after_s=1.0, parameters=parameters)
    flight = SimulatedFlight(simulated=simulated, heartbeat_type="onboard").ready()
    station = Codec(255, 190)
    beat = make("HEARTBEAT", type=mavlink.MAV_TYPE_GCS, autopilot=8)
    goal = flight.send(70.0, 0.0, 6.0, speed=3.0)
    while flight.status(goal) != "NAVIGATING":
        flight.simulation.link.write(station.encode(beat))
        flight.run_for(1.0)
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.VEHICLE_FAILSAFE, end.message


def test_a_server_that_hung_has_lost_the_stream_itself() -> None:
    """The vehicle is heard all the time, but nothing goes out for a while."""
    flight, _, goal = under_way("px4")
    flight.hang_for(2.0)
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_OFFBOARD, end.message
    assert "gap" in end.message


def test_a_stream_that_comes_back_at_once_was_lost_anyway() -> None:
    """The PX4 takes up OFFBOARD again before it is clear whose change of mode it was."""
    flight, vehicle, goal = under_way("px4")
    flight.hang_for(1.3)
    assert vehicle.firmware.failsafe.active
    flight.bridge.handle_timer(flight.now)
    setpoint = make("SET_POSITION_TARGET_LOCAL_NED", target_system=1, target_component=1,
                    coordinate_frame=1, type_mask=0xDC7)  # fmt: skip
    for _ in range(30):
        flight.simulation.link.write(Codec(1, 195).encode(setpoint))
        flight.run_for(0.05)
    assert flight.vehicle.state.failsafe is None
    (end,) = flight.ends(goal)
    assert end.code is OutcomeCode.FAILSAFE_OFFBOARD, end.message


def test_a_stream_that_did_not_come_through_to_a_px4_copter() -> None:
    flight, _, goal = under_way("px4")
    flight.link_up = False
    flight.run_for(4.0)
    flight.link_up = True
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_OFFBOARD, end.message
    assert flight.vehicle.mode_name in RTL


def test_the_battery_of_a_px4_copter() -> None:
    flight, vehicle, goal = under_way(
        "px4", parameters={"COM_LOW_BAT_ACT": 3.0, "BAT_LOW_THR": 0.15, "BAT_CRIT_THR": 0.12}
    )
    vehicle.parameters.set("BAT_CRIT_THR", 0.95)
    vehicle.parameters.set("BAT_LOW_THR", 0.99)
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_BATTERY, end.message


def test_the_fence_of_a_px4_copter() -> None:
    flight, vehicle, goal = under_way("px4", parameters={"GF_ACTION": 3.0})
    vehicle.parameters.set("GF_MAX_HOR_DIST", 5.0)
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_FENCE, end.message


def test_the_failsafe_of_a_rover() -> None:
    flight, vehicle, goal = under_way(
        kind="rover",
        parameters={"BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 2.0, "BATT_LOW_TIMER": 3.0},
    )
    vehicle.set_battery_voltage(10.0)
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.FAILSAFE_BATTERY, end.message


@pytest.mark.parametrize("mode", ["LOITER", "RTL"])
def test_a_pilot_is_distinguished_from_a_failsafe(mode: str) -> None:
    flight, _, goal = under_way()
    flight.set_mode_as_pilot(mode)
    end = end_in_silence(flight, goal)
    assert end.code is OutcomeCode.PILOT_OVERRIDE, end.message
