"""Failsafes: their signs, their kinds, and when they are reported."""

from __future__ import annotations

import pytest

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import FailsafeBegan, FailsafeEnded, FailsafeKind, VehicleEvent
from mavlink_vehicle.protocols.monitoring.failsafe_watch import FailsafeWatch
from mavlink_vehicle.state.failsafe import failsafe_words
from mavlink_vehicle.state.reducer import VehicleState, reduce
from mavlink_vehicle.state.warning_signs import Failsafe
from tests.support.messages.autopilot_messages import AutopilotMessages

GUIDED, RTL = 4, 6
OFFBOARD, PX4_RTL = 0x00060000, 0x05040000
PX4 = mavlink.MAV_AUTOPILOT_PX4
CRITICAL, EMERGENCY = mavlink.MAV_STATE_CRITICAL, mavlink.MAV_STATE_EMERGENCY
say = AutopilotMessages()


def after(
    *messages: Message, state: VehicleState | None = None, now: float = 100.0
) -> VehicleState:
    """Return the state of a vehicle that was told these, a hundredth of a second apart."""
    state = state or reduce(VehicleState(), say.heartbeat(GUIDED, armed=True, status=4), now - 1.0)
    for number, message in enumerate(messages):
        state = reduce(state, message, now + 0.01 * number)
    return state


def text(words: str, severity: int = 4) -> Message:
    return say("STATUSTEXT", severity=severity, text=words)


def critical(mode: int = RTL) -> Message:
    return say.heartbeat(mode, armed=True, status=CRITICAL)


@pytest.mark.parametrize(
    ("words", "severity", "kind"),
    [
        ("Battery Failsafe", 4, FailsafeKind.BATTERY),
        ("GCS Failsafe", 4, FailsafeKind.GCS),
        ("Radio Failsafe", 4, FailsafeKind.RC),
        ("EKF variance", 2, FailsafeKind.GPS),
        ("EKF Failsafe: changed to LAND Mode", 2, FailsafeKind.GPS),
        ("Circle fence breached", 4, FailsafeKind.FENCE),
        ("Low battery\t", 2, FailsafeKind.BATTERY),
        ("Critical battery\t", 2, FailsafeKind.BATTERY),
        ("Connection to ground station lost\t", 6, FailsafeKind.GCS),
        ("Geofence violation", 2, FailsafeKind.FENCE),
    ],
)
@pytest.mark.parametrize("text_first", [True, False])
def test_the_texts_tell_the_kind_in_either_order(
    words: str, severity: int, kind: FailsafeKind, text_first: bool
) -> None:
    messages = [text(words, severity), critical()]
    state = after(*(messages if text_first else reversed(messages)))
    assert state.failsafe is not None
    assert state.failsafe.kind is kind
    assert state.failsafe.text == words.strip()


@pytest.mark.parametrize(
    "words",
    ["PreArm: Battery failsafe", "Arm: Battery 1 low voltage failsafe", "GCS Failsafe Cleared"],
)
def test_texts_of_the_arming_checks_and_of_an_end_report_no_kind(words: str) -> None:
    state = after(text(words), critical())
    assert state.failsafe is not None
    assert state.failsafe.kind is FailsafeKind.OTHER


def test_an_old_text_says_nothing_about_a_new_failsafe() -> None:
    state = after(text("Radio Failsafe"), now=50.0)
    state = after(critical(), state=state)
    assert state.failsafe is not None
    assert state.failsafe.kind is FailsafeKind.OTHER


@pytest.mark.parametrize("status", [CRITICAL, EMERGENCY])
def test_a_critical_status_counts_only_while_armed(status: int) -> None:
    """An ArduCopter says CRITICAL on, when it has landed after a failsafe."""
    state = after(say.heartbeat(RTL, armed=True, status=status))
    assert state.failsafe is not None
    state = after(say.heartbeat(RTL, armed=False, status=status), state=state, now=101.0)
    assert state.failsafe is None


def test_a_breached_fence_counts_although_the_status_is_active() -> None:
    state = after(say("FENCE_STATUS", breach_status=1, breach_type=3))
    assert state.failsafe is not None
    assert state.failsafe.kind is FailsafeKind.FENCE
    assert after(say("FENCE_STATUS", breach_status=0), state=state).failsafe is None
    fence = mavlink.MAV_SYS_STATUS_GEOFENCE
    state = after(say("SYS_STATUS", onboard_control_sensors_enabled=fence))
    assert state.failsafe is not None
    assert state.failsafe.kind is FailsafeKind.FENCE
    assert after(say("SYS_STATUS", onboard_control_sensors_enabled=0)).failsafe is None


def test_a_fence_that_is_switched_off_after_a_breach_is_breached_no_more() -> None:
    """By parameter, the firmware keeps the health bit of the breach; FENCE_STATUS falls silent."""
    enabled = say("SYS_STATUS", onboard_control_sensors_enabled=mavlink.MAV_SYS_STATUS_GEOFENCE)
    disabled = say("SYS_STATUS", onboard_control_sensors_enabled=0)
    state = after(enabled)
    assert state.failsafe is not None
    assert after(disabled, state=state, now=101.0).failsafe is None
    state = after(enabled, say("FENCE_STATUS", breach_status=1))
    assert after(disabled, state=state, now=104.0).failsafe is None


def test_a_fence_that_only_reports_is_not_taken_for_one_that_is_switched_off() -> None:
    """With FENCE_ACTION 0 SYS_STATUS does not call it enabled, but FENCE_STATUS continues."""
    breach = say("FENCE_STATUS", breach_status=1)
    state = after(breach)
    for second in range(101, 110):
        disabled = say("SYS_STATUS", onboard_control_sensors_enabled=0)
        state = after(breach, disabled, state=state, now=float(second))
        assert state.failsafe is not None
        assert state.failsafe.since_s == 100.0


def test_without_a_text_the_charge_state_or_the_estimator_decides() -> None:
    battery = say("BATTERY_STATUS", voltages=[65535] * 10, charge_state=2)
    state = after(battery, critical())
    assert state.failsafe is not None
    assert state.failsafe.kind is FailsafeKind.BATTERY
    well = say("EKF_STATUS_REPORT", flags=0x33F)
    state = after(well, say("EKF_STATUS_REPORT", flags=0xA7), critical())
    assert state.failsafe is not None
    assert state.failsafe.kind is FailsafeKind.GPS


def test_a_low_charge_state_of_an_ardupilot_counts_although_the_status_is_active() -> None:
    """ArduRover's HEARTBEAT is CRITICAL for its links and its estimator alone."""
    low = say("BATTERY_STATUS", voltages=[65535] * 10, charge_state=2)
    state = after(low)
    assert state.system_status == mavlink.MAV_STATE_ACTIVE
    assert state.failsafe is not None
    assert state.failsafe.kind is FailsafeKind.BATTERY
    assert px4_state(low).failsafe is None, "it may only warn"


def px4_state(*messages: Message) -> VehicleState:
    start = reduce(VehicleState(), say.heartbeat(OFFBOARD, True, 4, autopilot=PX4), 99.0)
    return after(*messages, state=start)


def current_mode(mode: int, intended: int) -> Message:
    return say("CURRENT_MODE", custom_mode=mode, intended_custom_mode=intended)


def test_px4_flying_another_mode_than_the_chosen_one_is_a_failsafe() -> None:
    """Intended OFFBOARD, custom RTL: how the loss of the stream looks."""
    state = px4_state(current_mode(PX4_RTL, OFFBOARD))
    assert state.custom_mode == PX4_RTL
    assert state.failsafe is not None
    assert state.failsafe.kind is FailsafeKind.OTHER, "the stream may have been kept"
    assert px4_state(current_mode(PX4_RTL, PX4_RTL)).failsafe is None  # somebody chose RTL
    assert px4_state(current_mode(PX4_RTL, 0)).failsafe is None  # not told


# Texts of a PX4 on its own simulator, in OFFBOARD with the stream kept.
RADIO = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
PX4_HOLD = 0x03040000


def sys_status(radio: bool) -> Message:
    health = 0x0120C83F | (RADIO if radio else 0)
    return say(
        "SYS_STATUS",
        onboard_control_sensors_enabled=0x0201402F,
        onboard_control_sensors_health=health,
    )


def px4_critical(mode: int) -> Message:
    return say.heartbeat(mode, True, CRITICAL, autopilot=PX4)


def battery(charge_state: int) -> Message:
    return say("BATTERY_STATUS", voltages=[65535] * 10, charge_state=charge_state)


def kind_of(*messages: Message) -> FailsafeKind:
    failsafe = px4_state(*messages).failsafe
    assert failsafe is not None
    return failsafe.kind


FELL_BACK = (current_mode(PX4_HOLD, OFFBOARD), px4_critical(PX4_HOLD))
ACTIVATED = text("Failsafe activated: entering Hold for 5 seconds\t", 2)


def test_a_px4_whose_sticks_are_lost_shows_it_after_it_has_acted() -> None:
    seen = (sys_status(True), ACTIVATED, *FELL_BACK, sys_status(False))
    assert kind_of(*seen) is FailsafeKind.RC
    assert kind_of(sys_status(False), *FELL_BACK, sys_status(False)) is FailsafeKind.OTHER, (
        "without a radio the bit is never set"
    )


def test_a_px4_that_loses_its_fix_is_known_by_that_before_it_acts() -> None:
    fix, none = (say("GPS_RAW_INT", fix_type=kind) for kind in (3, 0))
    assert kind_of(fix, none, ACTIVATED, *FELL_BACK) is FailsafeKind.GPS
    assert kind_of(none, *FELL_BACK) is FailsafeKind.OTHER, "it never had one"


def test_what_began_last_before_a_failsafe_is_what_it_is_about() -> None:
    low = battery(2)
    assert kind_of(sys_status(True), low, *FELL_BACK, sys_status(False)) is FailsafeKind.RC
    assert kind_of(sys_status(True), sys_status(False), low, *FELL_BACK) is FailsafeKind.BATTERY
    worse = (battery(2), sys_status(True), sys_status(False), battery(3))
    assert kind_of(*worse, *FELL_BACK) is FailsafeKind.BATTERY
    lost = (say("GPS_RAW_INT", fix_type=3), say("GPS_RAW_INT", fix_type=0))
    state = after(*FELL_BACK, state=px4_state(*lost), now=150.0)
    assert state.failsafe is not None
    assert state.failsafe.kind is FailsafeKind.OTHER, "that was half a minute before"


def test_words_name_the_kind_only_where_nothing_shows_it() -> None:
    words = text("Connection to ground station lost\t", 6)
    assert kind_of(words, *FELL_BACK) is FailsafeKind.GCS
    assert kind_of(sys_status(True), words, *FELL_BACK, sys_status(False)) is FailsafeKind.RC


def test_quoted_is_what_warns_or_names_the_kind() -> None:
    state = px4_state(
        text("Takeoff detected\t", 6),
        text("Connection to ground station lost\t", 6),
        text("PreArm: Battery failsafe"),
        *FELL_BACK,
        text("Failsafe activated\t", 2),
        text("RTL: land at destination\t", 6),
    )
    assert failsafe_words(state, state.failsafe, 100.0) == [
        "Connection to ground station lost",
        "Failsafe activated",
    ]
    assert failsafe_words(state, None, 100.0) == ["Failsafe activated"]


def test_a_lost_current_mode_makes_no_failsafe_of_a_chosen_mode() -> None:
    state = px4_state(
        current_mode(OFFBOARD, OFFBOARD), say.heartbeat(PX4_RTL, True, 4, autopilot=PX4)
    )
    assert state.failsafe is None


def drain(watch: FailsafeWatch) -> list[VehicleEvent]:
    events = []
    while (event := watch.next_event()) is not None:
        events.append(event)
    return events


def test_a_known_kind_is_reported_at_once_and_an_unknown_one_waits_for_its_text() -> None:
    watch = FailsafeWatch()
    watch.start(0.0)
    watch.observe(Failsafe(1.0, FailsafeKind.RC, "Radio Failsafe"), 1.0)
    assert drain(watch) == [FailsafeBegan(FailsafeKind.RC, "Radio Failsafe")]
    watch.observe(None, 5.0)
    assert drain(watch) == [FailsafeEnded(FailsafeKind.RC)]

    watch.observe(Failsafe(9.0, FailsafeKind.OTHER, "critical"), 9.0)
    assert drain(watch) == []
    assert watch.deadline_s == 9.5
    watch.observe(Failsafe(9.0, FailsafeKind.GCS, "GCS Failsafe"), 9.1)
    assert drain(watch) == [FailsafeBegan(FailsafeKind.GCS, "GCS Failsafe")]
    assert watch.deadline_s is None
    watch.observe(Failsafe(9.0, FailsafeKind.BATTERY, "Battery Failsafe"), 12.0)
    assert drain(watch) == [FailsafeBegan(FailsafeKind.BATTERY, "Battery Failsafe")]


def test_a_failsafe_without_a_text_is_reported_when_the_text_has_had_its_time() -> None:
    watch = FailsafeWatch()
    watch.observe(Failsafe(9.0, FailsafeKind.OTHER, "critical"), 9.0)
    watch.handle_timer(9.4)
    assert drain(watch) == []
    watch.handle_timer(9.5)
    assert drain(watch) == [FailsafeBegan(FailsafeKind.OTHER, "critical")]


def test_a_failsafe_that_is_over_before_it_was_reported_is_not_reported() -> None:
    watch = FailsafeWatch()
    watch.observe(Failsafe(9.0, FailsafeKind.OTHER, "critical"), 9.0)
    watch.observe(None, 9.2)
    watch.handle_timer(10.0)
    assert drain(watch) == []
    assert watch.deadline_s is None
