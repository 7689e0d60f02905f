"""The real ArduCopter's observed answer to each command."""

from __future__ import annotations

import math

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import (
    ACCEPTED,
    AUTO,
    BRAKE,
    DENIED,
    FAILED,
    GUIDED,
    LAND,
    LOITER,
    RTL,
    STABILIZE,
    TEMPORARILY_REJECTED,
    UNSUPPORTED,
    GroundStation,
    copter,
    flying,
)

FORCE = 21196
ARM = mav.MAV_CMD_COMPONENT_ARM_DISARM
TAKEOFF = mav.MAV_CMD_NAV_TAKEOFF


@pytest.fixture
def ground() -> GroundStation:
    """A copter on the ground, ready, disarmed, in GUIDED."""
    station = copter().ready()
    assert station.mode(GUIDED) == ACCEPTED
    return station


def armed(station: GroundStation) -> bool:
    return station.vehicle.firmware.armed


def mode(station: GroundStation) -> int:
    return station.vehicle.firmware.mode.spec.number


# Arming.


def test_arm_and_arm_again_are_accepted(ground: GroundStation) -> None:
    assert ground.arm() == ACCEPTED
    assert ground.texts()[-1] == "Arming motors"
    assert ground.arm() == ACCEPTED
    assert ground.texts().count("Arming motors") == 1


def test_disarm_on_the_ground_and_when_disarmed_are_accepted(ground: GroundStation) -> None:
    assert ground.command(ARM, 0) == ACCEPTED
    ground.arm()
    assert ground.command(ARM, 0) == ACCEPTED
    assert ground.texts()[-1] == "Disarming motors"


@pytest.mark.parametrize(
    ("number", "name"), [(LAND, "LAND"), (RTL, "RTL"), (AUTO, "AUTO"), (BRAKE, "BRAKE")]
)
def test_modes_that_are_not_armable(ground: GroundStation, number: int, name: str) -> None:
    ground.mode(number)
    assert ground.arm() == FAILED
    assert ground.texts()[-1] == f"Arm: {name} mode not armable"
    assert ground.command(ARM, 1, FORCE) == FAILED


def test_no_takeoff_within_10_s_of_arming_disarms(ground: GroundStation) -> None:
    ground.arm()
    took = ground.run_until(lambda: not armed(ground), 15.0)
    assert took == pytest.approx(10.0, abs=0.2)
    assert ground.texts()[-1] == "Disarming motors"


def test_force_arms_against_the_checks() -> None:
    station = copter(ready_after_s=30.0)
    station.run(5.0)
    station.mode(GUIDED)
    assert station.arm() == FAILED
    assert station.command(ARM, 1, FORCE) == ACCEPTED


def test_disarm_in_the_air_fails_unless_forced_and_then_it_falls() -> None:
    station = flying(5.0)
    assert station.command(ARM, 0) == FAILED
    assert armed(station)
    assert station.command(ARM, 0, FORCE) == ACCEPTED
    station.run(3.0)
    assert station.position[2] == pytest.approx(0.0, abs=0.01)
    hit = [text for text in station.texts() if text.startswith("SIM Hit ground at")]
    assert 7.0 < float(hit[-1].split()[4]) < 10.0, "9.1 m/s recorded from 5 m"
    assert station.last("EXTENDED_SYS_STATE").landed_state == mav.MAV_LANDED_STATE_ON_GROUND


def test_run_prearm_checks(ground: GroundStation) -> None:
    assert ground.command(mav.MAV_CMD_RUN_PREARM_CHECKS) == ACCEPTED
    ground.arm()
    assert ground.command(mav.MAV_CMD_RUN_PREARM_CHECKS) == TEMPORARILY_REJECTED


# Modes.


def test_an_unknown_mode_fails_with_a_text(ground: GroundStation) -> None:
    assert ground.mode(99) == FAILED
    assert ground.texts()[-1] == "No such mode 99"
    assert ground.last("STATUSTEXT").severity == mav.MAV_SEVERITY_WARNING


def test_set_mode_without_the_custom_bit_is_denied(ground: GroundStation) -> None:
    assert ground.command(mav.MAV_CMD_DO_SET_MODE, 0, GUIDED) == DENIED


def test_the_old_set_mode_message_changes_the_mode_without_an_ack(ground: GroundStation) -> None:
    answers = ground.send(mav.MAVLink_set_mode_message(1, 1, LOITER))
    assert [m.get_type() for m in answers] == ["HEARTBEAT"]
    assert answers[0].custom_mode == LOITER


@pytest.mark.parametrize(
    ("command", "number"),
    [
        (mav.MAV_CMD_NAV_LAND, LAND),
        (mav.MAV_CMD_NAV_RETURN_TO_LAUNCH, RTL),
        (mav.MAV_CMD_NAV_LOITER_UNLIM, LOITER),
    ],
)
def test_nav_commands_change_the_mode_even_disarmed(
    ground: GroundStation, command: int, number: int
) -> None:
    assert ground.command(command) == ACCEPTED
    assert mode(ground) == number


def test_auto_without_a_mission_is_accepted_on_the_ground(ground: GroundStation) -> None:
    assert ground.mode(AUTO) == ACCEPTED


def test_auto_without_a_mission_fails_in_the_air() -> None:
    station = flying(5.0)
    assert station.mode(AUTO) == FAILED
    assert station.texts()[-1] == "Mode change to AUTO failed: init failed"
    assert mode(station) == GUIDED


def test_mission_start_without_a_mission_fails(ground: GroundStation) -> None:
    assert ground.command(mav.MAV_CMD_MISSION_START) == FAILED
    assert ground.texts()[-1] == "Mode change to AUTO failed: init failed"


# Take-off.


def test_takeoff_disarmed_fails(ground: GroundStation) -> None:
    assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10) == FAILED


def test_takeoff_in_another_mode_than_guided_fails(ground: GroundStation) -> None:
    ground.mode(STABILIZE)
    ground.arm()
    assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10) == FAILED


@pytest.mark.parametrize("height_m", [0.0, -5.0, 1e30])
def test_takeoff_to_an_impossible_height_fails(ground: GroundStation, height_m: float) -> None:
    ground.arm()
    result = ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, height_m)
    assert result in (FAILED, DENIED)


def test_takeoff_to_nan_is_rejected(ground: GroundStation) -> None:
    ground.arm()
    assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, math.nan) == DENIED


def test_takeoff_with_nan_in_the_fields_that_do_not_count(ground: GroundStation) -> None:
    ground.arm()
    nan = math.nan
    assert ground.command(TAKEOFF, 0, 0, 0, nan, nan, nan, 10) == ACCEPTED


def test_takeoff_while_flying_fails() -> None:
    assert flying(5.0).command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10) == FAILED


def test_takeoff_as_command_int_needs_frame_3(ground: GroundStation) -> None:
    ground.arm()
    assert ground.command_int(TAKEOFF, mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, z=10.0) == DENIED
    assert ground.command_int(TAKEOFF, mav.MAV_FRAME_GLOBAL, z=10.0) == DENIED
    assert ground.command_int(TAKEOFF, mav.MAV_FRAME_GLOBAL_RELATIVE_ALT, z=10.0) == ACCEPTED


# The rest.


def test_an_unknown_command_is_unsupported(ground: GroundStation) -> None:
    assert ground.command(31999) == UNSUPPORTED
    assert ground.command_int(31999, 6) == UNSUPPORTED


@pytest.mark.parametrize(
    "command",
    [
        mav.MAV_CMD_REQUEST_PROTOCOL_VERSION,
        mav.MAV_CMD_DO_ORBIT,
        mav.MAV_CMD_REQUEST_STORAGE_INFORMATION,
        mav.MAV_CMD_DO_SET_PARAMETER,
    ],
)
def test_unsupported_commands(ground: GroundStation, command: int) -> None:
    assert ground.command(command, 1) == UNSUPPORTED


def test_flight_termination_0_fails(ground: GroundStation) -> None:
    assert ground.command(mav.MAV_CMD_DO_FLIGHTTERMINATION, 0) == FAILED


def test_reposition_as_command_long_is_unsupported(ground: GroundStation) -> None:
    assert ground.command(mav.MAV_CMD_DO_REPOSITION, -1, 1, 0, 0, -35.36, 149.16, 10) == UNSUPPORTED


def test_reposition_as_command_int_is_accepted_even_on_the_ground(ground: GroundStation) -> None:
    ground.mode(STABILIZE)
    result = ground.command_int(
        mav.MAV_CMD_DO_REPOSITION, 6, -1, 1, 0, math.nan, x=-353632000, y=1491652000, z=10.0
    )
    assert result == ACCEPTED
    assert mode(ground) == GUIDED


def test_reposition_flies_there() -> None:
    station = flying(5.0)
    station.mode(LOITER)
    north_e7 = round(20.0 / 0.011131884502145034)
    assert (
        station.command_int(
            mav.MAV_CMD_DO_REPOSITION, 6, -1, 1, 0, 0, x=-353632610 + north_e7, y=1491652300, z=8.0
        )
        == ACCEPTED
    )
    station.run(15.0)
    north, east, down = station.position
    assert (north, east, down) == pytest.approx((20.0, 0.0, -8.0), abs=0.4)


def test_reposition_ignores_the_speed_and_the_heading_in_it() -> None:
    """Flown at WPNAV_SPEED, nose ahead: seen in `copter_guided_cmds`."""
    station = flying(5.0)
    x = -353632610 + round(30.0 / 0.011131884502145034)
    reposition = mav.MAV_CMD_DO_REPOSITION
    assert station.command_int(reposition, 6, 1.0, 1, 0, 1.57, x=x, y=1491652300, z=5.0) == ACCEPTED
    station.run(8.0)
    assert station.position[0] > 20.0
    assert abs(math.degrees(float(station.simulation.truth.yaw_rad[0]))) < 10.0


def test_reposition_outside_the_fence_fails() -> None:
    """Seen in `copter_fence3`: unlike a setpoint it is answered, and it stays where it is."""
    station = flying(5.0)
    station.vehicle.firmware.fence.enable(True)
    x = -353632610 + round(900.0 / 0.011131884502145034)
    result = station.command_int(mav.MAV_CMD_DO_REPOSITION, 6, -1, 1, x=x, y=1491652300, z=10.0)
    assert result == FAILED
    station.run(2.0)
    assert math.hypot(*station.velocity) < 0.5


def test_what_was_paused_in_guided_continues_to_the_same_place() -> None:
    """Seen in `copter_guided_cmds`."""
    station = flying(5.0)
    station.setpoint(0xDF8, position=(30.0, 0.0, -5.0))
    station.run(3.0)
    assert station.command(mav.MAV_CMD_DO_PAUSE_CONTINUE, 0) == ACCEPTED
    station.run(5.0)
    assert math.hypot(*station.velocity) < 0.3
    assert station.position[0] < 25.0
    assert station.command(mav.MAV_CMD_DO_PAUSE_CONTINUE, 1) == ACCEPTED
    station.run(12.0)
    assert station.position[0] == pytest.approx(30.0, abs=1.0)


@pytest.mark.parametrize(
    ("command", "param1", "result"),
    [
        (mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 0.0, FAILED),
        (mav.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 1.0, ACCEPTED),
        (mav.MAV_CMD_DO_SET_RELAY, 0.0, ACCEPTED),
        (mav.MAV_CMD_DO_REPEAT_SERVO, 9.0, ACCEPTED),
        (mav.MAV_CMD_DO_SET_CAM_TRIGG_DIST, 0.0, ACCEPTED),
        (mav.MAV_CMD_DO_DIGICAM_CONTROL, 0.0, ACCEPTED),
        (mav.MAV_CMD_VIDEO_START_CAPTURE, 0.0, FAILED),
        (mav.MAV_CMD_DO_MOUNT_CONTROL, 0.0, FAILED),
        (mav.MAV_CMD_MISSION_START, 1.0, DENIED),
    ],
)
def test_answers_of_copter_ground_cmds(
    ground: GroundStation, command: int, param1: float, result: int
) -> None:
    assert ground.command(command, param1) == result


def test_reposition_outside_guided_without_its_bit_is_denied() -> None:
    station = flying(5.0)
    station.mode(LOITER)
    result = station.command_int(
        mav.MAV_CMD_DO_REPOSITION, 6, -1, 0, x=-353632000, y=1491652000, z=10.0
    )
    assert result == DENIED
    assert mode(station) == LOITER


@pytest.mark.parametrize(
    "place",
    [
        {"x": 0, "y": 0, "z": 10.0},
        {"x": 910000000, "y": 1, "z": 10.0},
        {"x": -353632000, "y": 1491652000, "z": math.nan},
    ],
)
def test_reposition_to_nowhere_is_denied(ground: GroundStation, place: dict[str, float]) -> None:
    result = ground.command_int(
        mav.MAV_CMD_DO_REPOSITION,
        6,
        -1,
        1,
        x=int(place["x"]),
        y=int(place["y"]),
        z=place["z"],
    )
    assert result == DENIED


def test_change_speed_fails_on_the_ground_in_stabilize(ground: GroundStation) -> None:
    ground.mode(STABILIZE)
    assert ground.command(mav.MAV_CMD_DO_CHANGE_SPEED, 1, 3, -1) == FAILED


def test_change_speed_limits_guided_until_the_next_mode() -> None:
    station = flying(10.0)
    station.setpoint(0xDF8, (40.0, 0.0, -10.0))
    assert station.command(mav.MAV_CMD_DO_CHANGE_SPEED, 1, 2, -1) == ACCEPTED
    fastest = 0.0
    for _ in range(100):
        station.run(0.1)
        fastest = max(fastest, station.velocity[0])
    # The real one flies 3.5 % faster than a velocity setpoint of 2 m/s, too.
    assert 1.9 < fastest < 2.1
    station.mode(LOITER)
    station.mode(GUIDED)
    station.setpoint(0xDF8, (0.0, 0.0, -10.0))
    station.run(4.0)
    assert math.hypot(*station.velocity) > 3.0


@pytest.mark.parametrize("speed", [0.0, -3.0, math.nan])
def test_change_speed_to_nonsense_is_rejected(speed: float) -> None:
    assert flying(5.0).command(mav.MAV_CMD_DO_CHANGE_SPEED, 1, speed) in (FAILED, DENIED)


def test_set_home_here_and_get_home(ground: GroundStation) -> None:
    assert ground.command(mav.MAV_CMD_DO_SET_HOME, 1) == ACCEPTED
    before = len(ground.messages("HOME_POSITION"))
    assert ground.command(mav.MAV_CMD_GET_HOME_POSITION) == ACCEPTED
    assert len(ground.messages("HOME_POSITION")) == before + 1


def landed_elsewhere() -> GroundStation:
    """A copter that has landed by itself 10 m North and 5 m East of its home."""
    station = flying(5.0)
    station.setpoint(0xDF8, (10.0, 5.0, -5.0))
    station.run(12.0)
    station.mode(LAND)
    station.run_until(lambda: not armed(station), 30.0)
    return station


def test_arming_sets_home_to_where_the_vehicle_is() -> None:
    station = landed_elsewhere()
    station.mode(GUIDED)
    station.arm()
    home = station.last("HOME_POSITION")
    assert (home.x, home.y) == pytest.approx((10.0, 5.0), abs=0.5)


# Reboot.


def test_reboot_while_flying_fails() -> None:
    assert flying(5.0).command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == FAILED


def test_reboot_on_the_ground(ground: GroundStation) -> None:
    """Acknowledged, 1.2 s of silence, streams lost, time since boot back, parameters kept."""
    ground.run(0.2)
    ground.send(mav.MAVLink_param_set_message(1, 1, b"RTL_ALT", 2000.0, 9))
    assert ground.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == ACCEPTED
    before_ms = ground.last("ATTITUDE").time_boot_ms
    asked_s = ground.now_s
    ground.log.clear()
    first = ground.run_until(lambda: bool(ground.log), 5.0)
    assert first == pytest.approx(1.2, abs=0.1)
    assert ground.log[0][1].get_type() == "HEARTBEAT"
    assert ground.log[0][1].system_status == mav.MAV_STATE_BOOT
    assert ground.log[0][1].custom_mode == STABILIZE
    ground.run(5.0)
    assert {m.get_type() for _, m in ground.log} == {
        "HEARTBEAT",
        "STATUSTEXT",
        "HOME_POSITION",
        "GPS_GLOBAL_ORIGIN",
        "PARAM_VALUE",
    }
    ground.interval(30, 10.0)
    ground.run(0.2)
    assert ground.last("ATTITUDE").time_boot_ms < before_ms + (ground.now_s - asked_s) * 1000
    assert ground.last("ATTITUDE").time_boot_ms < 7000
    (value,) = ground.send(mav.MAVLink_param_request_read_message(1, 1, b"RTL_ALT", -1))
    assert value.param_value == 2000.0


def test_nothing_is_heard_or_answered_while_rebooting(ground: GroundStation) -> None:
    ground.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)
    ground.run(0.5)
    assert ground.command(mav.MAV_CMD_REQUEST_MESSAGE, 0) == -1


def test_the_local_origin_moves_to_where_the_firmware_starts() -> None:
    station = landed_elsewhere()
    station.command(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)
    station.run(3.0)
    station.ready()
    station.run(1.0)
    local = station.last("LOCAL_POSITION_NED")
    assert (local.x, local.y) == pytest.approx((0.0, 0.0), abs=0.3)
    assert station.position[:2] == pytest.approx((10.0, 5.0), abs=0.5)
    latitude = station.last("GLOBAL_POSITION_INT").lat
    assert latitude == pytest.approx(-353632610 + 10.0 / 0.0111318845, abs=50)


def test_a_firmware_that_crashes_in_flight_comes_back_disarmed_and_the_vehicle_falls() -> None:
    station = flying(10.0)
    station.vehicle.power_cycle()
    station.run(4.0)
    assert station.position[2] == pytest.approx(0.0, abs=0.1)
    heartbeat = station.last("HEARTBEAT")
    assert heartbeat.custom_mode == STABILIZE
    assert not heartbeat.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED
