"""The autopilot's fitness to fly, by its own reports."""

from __future__ import annotations

import pytest

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.state.health import arming_faults, battery_is_low, estimator_faults
from mavlink_vehicle.state.reducer import VehicleState, reduce
from tests.support.messages.autopilot_messages import AutopilotMessages

say = AutopilotMessages()
PX4 = mavlink.MAV_AUTOPILOT_PX4
ARDUPILOT = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
PREARM = mavlink.MAV_SYS_STATUS_PREARM_CHECK


def after(*messages: Message, autopilot: int = ARDUPILOT) -> VehicleState:
    state = reduce(VehicleState(), say.heartbeat(autopilot=autopilot), 0.0)
    for message in messages:
        state = reduce(state, message, 1.0)
    return state


def failing() -> Message:
    return say("SYS_STATUS", onboard_control_sensors_present=PREARM)


@pytest.mark.parametrize("flags", [0x33F, 0x37F, 0x3FF])
def test_the_flags_of_recorded_flights_are_healthy(flags: int) -> None:
    assert estimator_faults(after(say("EKF_STATUS_REPORT", flags=flags))) == ()
    px4 = after(say("ESTIMATOR_STATUS", flags=flags), autopilot=PX4)
    assert estimator_faults(px4) == ()


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (0x25, "no horizontal velocity and no horizontal position"),
        (0xA7, "no horizontal position"),
        (0x33E, "no attitude"),
        (0x33F | 0x8000, "GPS glitches"),
    ],
)
def test_what_the_estimator_lacks_is_named(flags: int, words: str) -> None:
    (fault,) = estimator_faults(after(say("EKF_STATUS_REPORT", flags=flags)))
    assert words in fault


def test_the_bit_for_gps_glitches_is_another_one_on_px4() -> None:
    px4 = after(say("ESTIMATOR_STATUS", flags=0x33F | 0x400), autopilot=PX4)
    assert estimator_faults(px4) == ("the estimator reports GPS glitches",)
    assert estimator_faults(after(say("EKF_STATUS_REPORT", flags=0x33F | 0x400))) == ()


@pytest.mark.parametrize(("fix_type", "healthy"), [(0, True), (1, False), (2, False), (3, True)])
def test_a_gps_that_is_there_must_have_a_3d_fix(fix_type: int, healthy: bool) -> None:
    faults = estimator_faults(after(say("GPS_RAW_INT", fix_type=fix_type)))
    assert (faults == ()) is healthy


def test_reasons_against_arming_count_while_the_check_fails_and_they_are_recent() -> None:
    text = say("STATUSTEXT", severity=2, text="PreArm: Battery 1 low voltage failsafe")
    state = after(failing(), text, text)
    assert arming_faults(state, 2.0) == ("PreArm: Battery 1 low voltage failsafe",)
    assert arming_faults(state, 60.0) == ()
    passing = say(
        "SYS_STATUS", onboard_control_sensors_present=PREARM, onboard_control_sensors_health=PREARM
    )
    assert arming_faults(after(failing(), text, passing), 2.0) == ()
    assert arming_faults(after(failing()), 2.0) == ()


@pytest.mark.parametrize("words", ["PreArm: Mode requires mission", "Arm: RTL mode not armable"])
def test_a_mode_that_forbids_arming_is_no_reason_as_it_will_be_left(words: str) -> None:
    assert arming_faults(after(failing(), say("STATUSTEXT", severity=2, text=words)), 2.0) == ()


def test_a_low_battery_is_what_the_autopilot_says() -> None:
    for charge_state, low in ((0, False), (1, False), (2, True), (3, True), (6, False)):
        message = say(
            "BATTERY_STATUS", voltages=[12000] * 1 + [65535] * 9, charge_state=charge_state
        )
        assert battery_is_low(after(message).battery) is low
    assert not battery_is_low(None)
