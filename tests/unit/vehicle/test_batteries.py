"""BATTERY_STATUS with all its markers, and the battery that decides."""

from __future__ import annotations

import pytest

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.state.health import battery_is_low
from mavlink_vehicle.state.reducer import VehicleState, reduce
from mavlink_vehicle.state.telemetry import Battery
from tests.support.messages.autopilot_messages import AutopilotMessages

MAKE = AutopilotMessages()
UNKNOWN_MV = 65535
LOW, CRITICAL, FAILED, UNHEALTHY = 2, 3, 5, 6
PROPULSION, AVIONICS, PAYLOAD = 2, 3, 4


def status(number: int = 0, percent: int = 80, **fields: object) -> Message:
    values = {"voltages": [12600] + [UNKNOWN_MV] * 9, "temperature": 32767, **fields}
    return MAKE("BATTERY_STATUS", id=number, battery_remaining=percent, **values)


def summary(percent: int) -> Message:
    return MAKE("SYS_STATUS", voltage_battery=12000, current_battery=-1, battery_remaining=percent)


def after(
    *messages: Message, state: VehicleState | None = None, now: float = 100.0, armed: bool = False
) -> VehicleState:
    state = reduce(VehicleState(), MAKE.heartbeat(armed=armed), now) if state is None else state
    for message in messages:
        state = reduce(state, message, now)
    return state


def only(**fields: object) -> Battery:
    (battery,) = after(status(**fields)).batteries  # type: ignore[arg-type]
    return battery


@pytest.mark.parametrize(
    ("voltages", "ext", "voltage_v", "cells_v"),
    [
        ([UNKNOWN_MV] * 10, [0] * 4, None, ()),
        ([0] * 10, [0] * 4, None, ()),
        ([16200] + [UNKNOWN_MV] * 9, [0] * 4, 16.2, ()),  # the pack, as both firmwares do
        ([16200] + [0] * 9, [0] * 4, 16.2, ()),
        ([4100, 4000, 3900] + [UNKNOWN_MV] * 7, [0] * 4, 12.0, (4.1, 4.0, 3.9)),
        ([4100, 0, 3900] + [0] * 7, [0] * 4, 8.0, (4.1, 3.9)),
        ([4000] * 10, [4000, 4000, 0, 0], 48.0, (4.0,) * 12),
        ([4000] * 10, [UNKNOWN_MV] * 4, 40.0, (4.0,) * 10),
        ([65534, 14466] + [UNKNOWN_MV] * 8, [0] * 4, 80.0, ()),  # a pack of 80 V
        ([65534, 65534, 1000] + [UNKNOWN_MV] * 7, [0] * 4, 132.068, ()),
    ],
)
def test_voltages(
    voltages: list[int], ext: list[int], voltage_v: float | None, cells_v: tuple[float, ...]
) -> None:
    battery = only(voltages=voltages, voltages_ext=ext)
    assert battery.voltage_v == (None if voltage_v is None else pytest.approx(voltage_v))
    assert battery.cell_voltages_v == cells_v


@pytest.mark.parametrize(
    ("field", "value", "attribute", "expected"),
    [
        ("current_battery", -1, "current_a", None),
        ("current_battery", -100, "current_a", -1.0),  # PX4's unknown is a current elsewhere
        ("current_battery", 0, "current_a", 0.0),
        ("current_battery", 1234, "current_a", 12.34),
        ("current_consumed", -1, "consumed_ah", None),
        ("current_consumed", -38, "consumed_ah", None),
        ("current_consumed", 0, "consumed_ah", 0.0),
        ("current_consumed", 1500, "consumed_ah", 1.5),
        ("temperature", 32767, "temperature_c", None),
        ("temperature", 2512, "temperature_c", 25.12),
        ("temperature", -500, "temperature_c", -5.0),
        ("percent", -1, "remaining", None),
        ("percent", 0, "remaining", 0.0),
        ("percent", 100, "remaining", 1.0),
        ("percent", 120, "remaining", None),
        ("time_remaining", 0, "time_remaining_s", None),
        ("time_remaining", 600, "time_remaining_s", 600.0),
        ("charge_state", 0, "charge_state", 0),
        ("charge_state", 6, "charge_state", 6),
        ("battery_function", AVIONICS, "function", AVIONICS),
        ("type", 3, "chemistry", 3),
        ("mode", 2, "mode", 2),
        ("fault_bitmask", 5, "faults", 5),
    ],
)
def test_each_field(field: str, value: int, attribute: str, expected: float | None) -> None:
    found = getattr(only(**{field: value}), attribute)
    assert found == (expected if expected is None else pytest.approx(expected))


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_worst_of_several_decides(order: tuple[int, int]) -> None:
    reports = {0: status(0, 90, charge_state=1), 1: status(1, 4, charge_state=CRITICAL)}
    state = after(*(reports[number] for number in order))
    assert [battery.battery_id for battery in state.batteries] == [0, 1]
    assert state.battery is not None
    assert (state.battery.battery_id, state.battery.remaining) == (1, 0.04)
    assert battery_is_low(state.battery)
    state = after(status(1, 95, charge_state=1), state=state)
    assert state.battery is not None
    assert (state.battery.battery_id, state.battery.remaining) == (0, 0.9)
    assert not battery_is_low(state.battery)


def test_the_lowest_charge_counts_beside_the_worst_state() -> None:
    state = after(status(0, 30), status(1, 60, charge_state=LOW), status(2, -1))
    assert state.battery is not None
    assert state.battery.charge_state == LOW
    assert state.battery.remaining == 0.3


@pytest.mark.parametrize(
    ("function", "percent", "charge_state", "remaining", "low"),
    [
        (0, 4, CRITICAL, 0.04, True),
        (1, 4, 1, 0.04, False),
        (PROPULSION, 4, LOW, 0.04, True),
        (AVIONICS, 4, 1, 0.9, False),
        (AVIONICS, 4, CRITICAL, 0.9, True),
        (PAYLOAD, 4, CRITICAL, 0.9, False),
        (PAYLOAD, 0, FAILED, 0.9, False),
        (0, -1, UNHEALTHY, 0.9, False),
        (0, -1, FAILED, 0.9, True),
    ],
)
def test_only_what_the_flight_needs_decides(
    function: int, percent: int, charge_state: int, remaining: float, low: bool
) -> None:
    other = status(1, percent, charge_state=charge_state, battery_function=function)
    battery = after(status(0, 90, charge_state=1), other).battery
    assert battery is not None
    assert battery.remaining == remaining
    assert battery_is_low(battery) is low


def test_a_payload_alone_leaves_the_battery_unknown() -> None:
    assert after(status(1, 4, battery_function=PAYLOAD)).battery is None


def test_a_battery_taken_out_on_the_ground_counts_no_more() -> None:
    state = after(status(0, 90), status(1, 4, charge_state=CRITICAL))
    assert battery_is_low(after(status(0, 90), state=state, now=110.0).battery)
    state = after(status(0, 90), state=state, now=120.0)
    assert [battery.battery_id for battery in state.batteries] == [0]
    assert state.battery is not None
    assert state.battery.remaining == 0.9


def test_a_battery_that_falls_silent_in_flight_keeps_its_last_word() -> None:
    state = after(status(0, 90), status(1, 4, charge_state=CRITICAL), armed=True)
    state = after(status(0, 89), state=state, now=160.0)
    assert battery_is_low(state.battery)


def test_the_summary_counts_only_without_reports_of_batteries() -> None:
    state = after(summary(70))
    assert state.battery is not None
    assert state.battery.from_summary
    state = after(status(0, 80), summary(5), state=state)
    assert state.battery is not None
    assert state.battery.remaining == 0.8  # it says less
    state = after(status(0, -1), summary(100), state=state)
    assert state.battery is not None
    # An ArduPilot that has not measured its battery yet (tlogs of its start).
    assert (state.battery.remaining, state.battery.voltage_v) == (None, 12.6)
    state = after(status(0, 80), state=state)
    state = after(summary(40), state=state, now=130.0)  # BATTERY_STATUS has ended
    assert state.battery is not None
    assert state.battery.remaining == 0.4


def test_px4s_own_marker_of_an_unknown_current() -> None:
    px4 = reduce(VehicleState(), MAKE.heartbeat(autopilot=mavlink.MAV_AUTOPILOT_PX4), 1.0)
    (battery,) = after(status(current_battery=-100), state=px4).batteries
    assert battery.current_a is None
