from __future__ import annotations

import dataclasses
import math

import pytest

from mavlink_vehicle.codec import Message, mavlink, with_source
from mavlink_vehicle.events import LandedState
from mavlink_vehicle.state.reducer import VehicleState, reduce
from tests.support.messages.autopilot_messages import AutopilotMessages

BOTH_UNKNOWN = 65535


@pytest.fixture
def autopilot() -> AutopilotMessages:
    return AutopilotMessages()


def after(*messages: Message, state: VehicleState | None = None) -> VehicleState:
    state = state or VehicleState()
    for number, message in enumerate(messages):
        state = reduce(state, message, 100.0 + number)
    return state


def test_the_first_autopilot_that_is_heard_is_the_vehicle(autopilot: AutopilotMessages) -> None:
    station = AutopilotMessages(255, 190).heartbeat(
        autopilot=mavlink.MAV_AUTOPILOT_INVALID, vehicle_type=mavlink.MAV_TYPE_GCS
    )
    gimbal = AutopilotMessages(1, 154).heartbeat()
    tracker = AutopilotMessages(9, 1).heartbeat(autopilot=mavlink.MAV_AUTOPILOT_INVALID)
    nothing = VehicleState()
    for message in (station, gimbal, tracker):
        assert reduce(nothing, message, 1.0) is nothing
    state = after(autopilot.heartbeat(mode=4, armed=True, status=4))
    assert (state.system_id, state.component_id) == (1, 1)
    assert state.armed
    assert (state.custom_mode, state.system_status) == (4, 4)
    assert state.last_heartbeat_s == 100.0


def test_what_others_say_changes_nothing(autopilot: AutopilotMessages) -> None:
    state = after(autopilot.heartbeat())
    for system, component in ((2, 1), (1, 191), (255, 190), (1, 154)):
        for message in (
            autopilot.heartbeat(armed=True),
            autopilot.position(1.0),
            autopilot("STATUSTEXT", severity=2, text="boo"),
            autopilot("BATTERY_STATUS", battery_remaining=5),
        ):
            assert reduce(state, with_source(message, system, component), 1.0) is state


def test_messages_without_meaning_here_give_back_the_same_object(
    autopilot: AutopilotMessages,
) -> None:
    state = after(autopilot.heartbeat())
    for name in ("PARAM_VALUE", "RAW_IMU", "COMMAND_ACK", "MISSION_COUNT", "VFR_HUD"):
        assert reduce(state, autopilot(name), 1.0) is state


def test_the_state_is_frozen(autopilot: AutopilotMessages) -> None:
    state = after(autopilot.heartbeat(), autopilot.position(1.0))
    with pytest.raises(dataclasses.FrozenInstanceError):
        state.armed = True  # type: ignore[misc]
    assert dataclasses.replace(state, armed=True).armed
    assert state == dataclasses.replace(state)


def test_a_position_comes_in_si_units(autopilot: AutopilotMessages) -> None:
    message = autopilot(
        "GLOBAL_POSITION_INT", time_boot_ms=5000, lat=-353632610, lon=1491652300, alt=584070,
        relative_alt=-120, vx=100, vy=-200, vz=50, hdg=35300,
    )  # fmt: skip
    position = after(autopilot.heartbeat(), message).global_position
    assert position is not None
    assert position.latitude_deg == pytest.approx(-35.363261)
    assert position.longitude_deg == pytest.approx(149.165230)
    assert position.altitude_amsl_m == pytest.approx(584.07)
    assert position.relative_altitude_m == pytest.approx(-0.12)
    assert position.velocity_ned_m_s == pytest.approx((1.0, -2.0, 0.5))
    assert position.heading_ned_rad == pytest.approx(math.radians(-7.0))
    assert position.time_s == 101.0


def test_no_position_is_not_a_place_in_the_gulf_of_guinea(autopilot: AutopilotMessages) -> None:
    nowhere = autopilot("GLOBAL_POSITION_INT", time_boot_ms=100, lat=0, lon=0, hdg=36000)
    state = after(autopilot.heartbeat(), nowhere)
    assert state.global_position is None
    assert not state.position_valid
    state = after(autopilot.position(1.0), state=state)
    assert state.position_valid
    assert state.global_position is not None
    state = after(autopilot("GLOBAL_POSITION_INT", time_boot_ms=1100), state=state)
    assert not state.position_valid


def test_unknown_markers_become_none(autopilot: AutopilotMessages) -> None:
    state = after(
        autopilot.heartbeat(),
        autopilot("GLOBAL_POSITION_INT", lat=1, lon=1, hdg=BOTH_UNKNOWN),
        autopilot(
            "GPS_RAW_INT", fix_type=1, eph=BOTH_UNKNOWN, epv=BOTH_UNKNOWN, satellites_visible=255
        ),
        autopilot(
            "BATTERY_STATUS", voltages=[BOTH_UNKNOWN] * 10, current_battery=-1,
            current_consumed=-1, battery_remaining=-1,
        ),
        autopilot("HOME_POSITION", latitude=1, longitude=1, x=math.nan, y=math.nan, z=math.nan),
        autopilot("LOCAL_POSITION_NED", x=math.nan),
        autopilot("ATTITUDE", roll=math.nan),
        autopilot("SYS_STATUS", battery_remaining=-1, current_battery=-1),
    )  # fmt: skip
    assert state.global_position is not None
    assert state.global_position.heading_ned_rad is None
    assert state.gps == (101.0 + 1, 1, *[None] * 11)
    battery = state.battery
    assert battery is not None
    assert (battery.remaining, battery.voltage_v, battery.current_a) == (None, None, None)
    assert battery.consumed_ah is None
    assert state.home is not None
    assert state.home.position_ned_m is None
    assert state.local_position is None
    assert state.attitude is None
    assert state.prearm_ok is None


def test_batteries(autopilot: AutopilotMessages) -> None:
    state = after(
        autopilot.heartbeat(),
        autopilot("SYS_STATUS", voltage_battery=12500, current_battery=150, battery_remaining=80),
    )
    battery = state.battery
    assert battery is not None
    assert (battery.voltage_v, battery.current_a, battery.remaining) == (12.5, 1.5, 0.8)
    assert battery.from_summary
    cells = [4100, 4050, 4000] + [BOTH_UNKNOWN] * 7
    state = after(
        autopilot("BATTERY_STATUS", voltages=cells, battery_remaining=79, current_battery=-1),
        autopilot("SYS_STATUS", voltage_battery=1, battery_remaining=1),  # says less
        state=state,
    )
    battery = state.battery
    assert battery is not None
    assert battery.voltage_v == pytest.approx(12.15)
    assert (battery.remaining, battery.current_a) == (0.79, None)
    assert not battery.from_summary
    state = after(autopilot("BATTERY_STATUS", battery_remaining=0), state=state)
    assert state.battery is not None
    assert state.battery.remaining == 0.0  # empty is not unknown


def test_px4_unknown_current(autopilot: AutopilotMessages) -> None:
    message = autopilot("BATTERY_STATUS", current_battery=-100, current_consumed=-15)
    px4 = autopilot.heartbeat(autopilot=mavlink.MAV_AUTOPILOT_PX4)
    for heartbeat, current_a in ((px4, None), (autopilot.heartbeat(), -1.0)):
        battery = after(heartbeat, message).battery
        assert battery is not None
        assert battery.current_a == current_a
        assert battery.consumed_ah is None


@pytest.mark.parametrize(
    ("flags", "valid"),
    # As the real ArduCopter sent them: flying, after 8 s without GPS, and after 15 s.
    [(0x33F, True), (0x25, False), (0xA7, False)],
)
def test_the_estimator_decides_whether_a_position_counts(
    autopilot: AutopilotMessages, flags: int, valid: bool
) -> None:
    state = after(
        autopilot.heartbeat(),
        autopilot.position(1.0),
        autopilot("LOCAL_POSITION_NED", time_boot_ms=1000, x=1.0),
        autopilot("EKF_STATUS_REPORT", flags=flags),
    )
    assert state.position_valid is valid


def test_px4_at_rest_has_a_position(autopilot: AutopilotMessages) -> None:
    state = after(
        autopilot.heartbeat(autopilot=mavlink.MAV_AUTOPILOT_PX4),
        autopilot.position(1.0),
        autopilot("ESTIMATOR_STATUS", flags=0x3FF),
    )
    assert state.position_valid


def test_late_samples_are_dropped(autopilot: AutopilotMessages) -> None:
    state = after(autopilot.heartbeat(), autopilot.position(10.0, height_m=5.0))
    late = autopilot.position(9.5, height_m=4.0)
    assert reduce(state, late, 200.0) is state
    attitude = autopilot("ATTITUDE", time_boot_ms=9700, yaw=1.0)  # another message may be older
    assert reduce(state, attitude, 200.0).attitude is not None
    assert reduce(state, attitude, 200.0).boot_time_ms == 10_000


def test_a_restart_voids_what_was_measured(autopilot: AutopilotMessages) -> None:
    state = after(
        autopilot.heartbeat(armed=True),
        autopilot.position(300.0),
        autopilot("LOCAL_POSITION_NED", time_boot_ms=300_000, x=5.0),
        autopilot("HOME_POSITION", latitude=1, longitude=1),
        autopilot("GPS_GLOBAL_ORIGIN", latitude=1, longitude=1),
        autopilot("EXTENDED_SYS_STATE", landed_state=2),
    )
    assert state.boot_count == 0
    assert state.landed_state is LandedState.IN_AIR
    state = reduce(state, autopilot("SYSTEM_TIME", time_boot_ms=1500), 110.0)
    assert state.boot_count == 0
    state = reduce(state, autopilot("SCALED_PRESSURE", time_boot_ms=1501), 110.0)
    state = reduce(state, autopilot("ATTITUDE", time_boot_ms=1510), 110.01)
    assert state.boot_count == 1
    assert state.global_position is None
    assert state.local_position is None
    assert state.home is None
    assert state.origin is None
    assert state.landed_state is LandedState.UNDEFINED
    state = reduce(state, autopilot.position(2.0), 110.5)
    assert state.boot_count == 1
    assert state.position_valid


def test_after_a_restart_a_position_is_not_valid_before_the_estimator_has_said_so(
    autopilot: AutopilotMessages,
) -> None:
    """A real ArduCopter 3.5.7 reported its last place for 0.7 s before it reported none."""
    local = autopilot("LOCAL_POSITION_NED", time_boot_ms=2000, x=5.0)
    before = after(
        autopilot.heartbeat(),
        autopilot.position(300.0),
        autopilot("EKF_STATUS_REPORT", flags=831),
    )
    assert before.position_valid
    state = reduce(reduce(before, local, 110.0), autopilot.position(2.0), 110.0)
    assert state.boot_count == 1
    assert state.global_position is not None
    assert not state.position_valid
    assert not after(autopilot("EKF_STATUS_REPORT", flags=229), state=state).position_valid
    assert after(autopilot("EKF_STATUS_REPORT", flags=831), state=state).position_valid


def test_the_end_of_the_millisecond_counter_is_not_a_restart(
    autopilot: AutopilotMessages,
) -> None:
    end = autopilot("SYSTEM_TIME", time_boot_ms=2**32 - 100)
    state = after(autopilot.heartbeat(), end, autopilot("SYSTEM_TIME", time_boot_ms=50))
    assert state.boot_count == 0
    assert state.boot_time_ms == 2**32 + 50


def test_versions(autopilot: AutopilotMessages) -> None:
    for number, text in (
        (0x04070000, "4.7.0-dev"),
        (0x011100FF, "1.17.0"),
        (0x040602C0, "4.6.2-rc"),
    ):
        message = autopilot("AUTOPILOT_VERSION", flight_sw_version=number, capabilities=0xFBEF)
        state = after(autopilot.heartbeat(), message)
        assert state.firmware_version == text
        assert state.capabilities == 0xFBEF
    assert after(autopilot.heartbeat(), autopilot("AUTOPILOT_VERSION")).firmware_version is None


def test_prearm_follows_the_health_bit(autopilot: AutopilotMessages) -> None:
    bit = mavlink.MAV_SYS_STATUS_PREARM_CHECK
    for health, expected in ((0, False), (bit, True)):
        message = autopilot(
            "SYS_STATUS",
            onboard_control_sensors_present=bit,
            onboard_control_sensors_health=health,
        )
        assert after(autopilot.heartbeat(), message).prearm_ok is expected


def test_an_unheard_of_landed_state_is_undefined(autopilot: AutopilotMessages) -> None:
    state = after(autopilot.heartbeat(), autopilot("EXTENDED_SYS_STATE", landed_state=2))
    state = after(autopilot("EXTENDED_SYS_STATE", landed_state=99), state=state)
    assert state.landed_state is LandedState.UNDEFINED


def test_texts_come_whole_and_the_last_twenty_stay(autopilot: AutopilotMessages) -> None:
    long = "Requested rate for message ID 30 too fast. Increase SCHED_LOOP_RATE"
    state = after(
        autopilot.heartbeat(),
        autopilot("STATUSTEXT", severity=4, text=long[:50], id=7, chunk_seq=0),
        autopilot("STATUSTEXT", severity=4, text=long[50:], id=7, chunk_seq=1),
    )
    (text,) = state.status_texts
    assert (text.severity, text.text) == (4, long)
    for number in range(30):
        message = autopilot("STATUSTEXT", severity=6, text=f"text {number}\t")
        state = after(message, message, state=state)  # each packet arrives twice
    assert [t.text for t in state.status_texts] == [f"text {n}" for n in range(10, 30)]
    assert state.texts.count == 31


FIRST = "Arming denied: Resolve system health failures first\t"


@pytest.mark.parametrize("backwards", [False, True])
def test_the_first_text_of_a_px4_is_whole_though_its_id_is_0(
    autopilot: AutopilotMessages, backwards: bool
) -> None:
    """It counts its texts from 0 on each link, and every text has a number."""
    chunks = [
        autopilot("STATUSTEXT", severity=2, text=FIRST[:50], id=0, chunk_seq=0),
        autopilot("STATUSTEXT", severity=2, text=FIRST[50:], id=0, chunk_seq=1),
    ]
    if backwards:
        chunks.reverse()
    state = after(autopilot.heartbeat(autopilot=mavlink.MAV_AUTOPILOT_PX4))
    for chunk in chunks:
        state = reduce(reduce(state, chunk, 101.0), chunk, 101.0)  # each packet arrives twice
    assert [t.text for t in state.status_texts] == [FIRST.strip()]
    second = autopilot("STATUSTEXT", severity=6, text="Armed by external command\t", id=1)
    state = reduce(state, second, 101.1)
    assert [t.text for t in state.status_texts][1:] == ["Armed by external command"]


def test_a_text_of_fifty_bytes_with_the_id_0_is_whole(autopilot: AutopilotMessages) -> None:
    """A PX4's; the next text, or the patience, shows that nothing continues it."""
    full = "PreArm: Need Position Estimate, this has 50 bytes."
    assert len(full) == 50
    beat = autopilot.heartbeat(autopilot=mavlink.MAV_AUTOPILOT_PX4)
    state = after(beat, autopilot("STATUSTEXT", severity=2, text=full))
    assert not state.status_texts
    state = after(autopilot("STATUSTEXT", severity=2, text=full.upper()), state=state)
    assert [t.text for t in state.status_texts] == [full]
    state = reduce(state, beat, 103.0)
    assert [t.text for t in state.status_texts] == [full, full.upper()]


def test_a_text_of_fifty_bytes_of_an_ardupilot_is_not_waited_with(
    autopilot: AutopilotMessages,
) -> None:
    full = "Auto mission changed but failed to restart command"
    assert len(full) == 50
    first, second = (autopilot("STATUSTEXT", severity=2, text=full) for _ in range(2))
    state = after(autopilot.heartbeat(), first, first)  # the packet arrives twice
    assert [t.text for t in state.status_texts] == [full]
    state = after(second, state=state)
    assert [t.text for t in state.status_texts] == [full, full]


def test_a_text_with_a_lost_chunk_is_given_out_with_a_gap(autopilot: AutopilotMessages) -> None:
    state = after(
        autopilot.heartbeat(),
        autopilot("STATUSTEXT", severity=4, text="tail of the story", id=3, chunk_seq=1),
    )
    assert not state.status_texts
    state = reduce(state, autopilot.heartbeat(), 103.0)
    assert [t.text for t in state.status_texts] == ["[...]tail of the story"]


def test_the_wind_is_that_of_either_firmware(autopilot: AutopilotMessages) -> None:
    """WIND has the direction that it comes from, WIND_COV a velocity."""
    state = after(autopilot.heartbeat())
    assert state.wind_ned_m_s is None
    from_east = after(autopilot("WIND", direction=90.0, speed=4.0, speed_z=0.5), state=state)
    assert from_east.wind_ned_m_s == pytest.approx((0.0, -4.0, 0.5))
    to_east = after(autopilot("WIND_COV", wind_x=0.0, wind_y=4.0, wind_z=math.nan), state=state)
    assert to_east.wind_ned_m_s == pytest.approx((0.0, 4.0, 0.0))
    for unknown in (
        autopilot("WIND_COV", wind_x=math.nan),
        autopilot("WIND", direction=math.inf),
        autopilot("WIND", direction=90.0, speed=math.nan),
    ):
        assert after(unknown, state=to_east).wind_ned_m_s == to_east.wind_ned_m_s
