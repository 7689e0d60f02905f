"""Whatever an ArduPilot accepts has its effect: one flight or drive for each command.

Every command in the tables of the code is in exactly one of the tables here: with what shows its
effect, as rejected, or with the reason for which nothing shows.
"""

from __future__ import annotations

import math
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mav

from sitl_support.ground_station import ACCEPTED, GUIDED, POSITION, GroundStation
from sitl_support.kinds import (
    PLANE_AUTO,
    ROVER_GUIDED,
    kind,
    mode_of,
    plane,
    rover,
)
from sitl_support.missions import HOME, METRE, home, item, upload, waypoint

pytestmark = pytest.mark.wide

ROOT = Path(__file__).resolve().parents[2]
SCRIPT: dict[str, Any] = runpy.run_path(str(ROOT / "scripts/list_simulated.py"))
KINDS = ("copter", "rover", "boat", "plane")
FORMS = ("long", "int")


class Ask:
    """A vehicle that is ready, and its command in one of two forms."""

    def __init__(self, vehicle: str, command: int, form: str) -> None:
        self.vehicle, self._command, self._form = vehicle, command, form
        self.station = kind(vehicle)

    def __call__(
        self, *params: float, at: tuple[int, int, float] = (0, 0, 0.0), frame: int = 3
    ) -> int:
        x, y, z = at
        if self._form == "int":
            five = int(params[4]) if len(params) > 4 else x
            return self.station.command_int(self._command, frame, *params[:4], x=five, y=y, z=z)
        values = [*params, *[0.0] * (4 - len(params))]
        if len(values) < 5:
            values += [x / 1e7, y / 1e7, z]
        return self.station.command(self._command, *values)

    def moving(self) -> GroundStation:
        """In GUIDED and under way: in the air, or on the way to a place."""
        if self.vehicle == "plane":
            self.station = plane()
        elif self.vehicle == "copter":
            self.station.take_off(8.0)
        else:
            self.station = rover(vehicle=self.vehicle)
        return self.station

    def mission(self) -> GroundStation:
        """With a mission, under way in GUIDED."""
        station = self.moving()
        places = [
            waypoint(30, 0, 60),
            item(600, params=(5.0,), anywhere=True),
            waypoint(60, 30, 60),
        ]
        assert upload(station, [home(), *places]) == 0
        return station

    @property
    def flies(self) -> bool:
        return self.vehicle in ("copter", "plane")


def mode_name(station: GroundStation) -> str:
    return station.vehicle.firmware.mode.spec.name


def came(station: GroundStation, message: str) -> bool:
    return bool(station.messages(message))


def into(name: str) -> Callable[[Ask], None]:
    """The mode changes."""

    def effect(ask: Ask) -> None:
        station = ask.moving()
        assert ask() == ACCEPTED
        assert mode_name(station) == name

    return effect


def asked_for(message: str, *params: float) -> Callable[[Ask], None]:
    """A message comes, once."""

    def effect(ask: Ask) -> None:
        ask.station.log.clear()
        assert ask(*params) == ACCEPTED
        assert len(ask.station.messages(message)) == 1

    return effect


def take_off_to_five(ask: Ask) -> None:
    station = ask.station
    assert station.mode(GUIDED) == station.arm() == ACCEPTED
    assert ask(at=(0, 0, 5.0)) == ACCEPTED
    station.run(12.0)
    assert station.position[2] == pytest.approx(-5.0, abs=0.5)


def turn_the_nose(ask: Ask) -> None:
    station = ask.moving()
    assert ask(90, 30, 1, 0) == ACCEPTED
    station.run(8.0)
    assert float(station.simulation.truth.yaw_rad[0]) == pytest.approx(math.pi / 2, abs=0.1)


def set_a_mode(ask: Ask) -> None:
    wanted = {"copter": 2, "plane": 5}.get(ask.vehicle, 1)
    assert ask(1, wanted) == ACCEPTED
    assert mode_of(ask.station) == wanted


def another_speed(ask: Ask) -> None:
    station = ask.moving()
    speed, type_ = (26.0, 0) if ask.vehicle == "plane" else (1.5, 1)
    if ask.vehicle != "plane":
        station.setpoint(POSITION, (200.0, 0.0, -8.0))
        station.run(5.0)
    assert ask(type_, speed, -1) == ACCEPTED
    station.run(12.0)
    if ask.vehicle == "plane":
        assert station.vehicle.snapshot().airspeed_m_s == pytest.approx(speed, abs=1.5)
    else:
        assert math.hypot(*station.velocity[:2]) == pytest.approx(speed, abs=0.3)


def home_is_there(ask: Ask) -> None:
    x = HOME[0] + round(50 * METRE)
    assert ask(0, at=(x, HOME[1], 600.0), frame=0) == ACCEPTED
    assert ask.station.last("HOME_POSITION").latitude == pytest.approx(x, abs=40)


def output(station: GroundStation, number: int) -> int:
    station.command(512, 36)
    return int(getattr(station.last("SERVO_OUTPUT_RAW"), f"servo{number}_raw"))


def a_servo_moves(ask: Ask) -> None:
    assert ask(9, 1700) == ACCEPTED
    assert output(ask.station, 9) == 1700


def the_motors_stop(ask: Ask) -> None:
    station = ask.moving()
    assert ask(1) == ACCEPTED
    assert not station.vehicle.firmware.armed


def the_landing_begins(ask: Ask) -> None:
    station = ask.moving()
    start = item(mav.MAV_CMD_DO_LAND_START, anywhere=True)
    land = item(mav.MAV_CMD_NAV_LAND, 20.0, 0.0)
    assert upload(station, [home(), waypoint(90, 0, 60), start, waypoint(60, 0, 40), land]) == 0
    assert ask() == ACCEPTED
    assert mode_name(station) == ("AUTO RTL" if ask.vehicle == "copter" else "AUTO")
    assert station.vehicle.plans.current >= 2


def go_around(ask: Ask) -> None:
    station = ask.moving()
    assert upload(station, [home(), item(mav.MAV_CMD_NAV_LAND, 0.0, 0.0)]) == 0
    station.mode(PLANE_AUTO)
    station.run(2.0)
    assert ask(45) == ACCEPTED
    station.run(12.0)
    assert -station.position[2] > 40.0


def go_there(ask: Ask) -> None:
    if ask._form == "long":
        pytest.skip("UNSUPPORTED as COMMAND_LONG, as the real one")
    station = ask.moving()
    x = HOME[0] + round(25 * METRE)
    assert ask(-1, 1, 0, 0, at=(x, HOME[1], 20.0), frame=6) == ACCEPTED
    station.run(25.0)
    near = 120.0 if ask.vehicle == "plane" else 3.0
    assert math.dist(station.position[:2], (25.0, 0.0)) < near


def hold_and_go_on(ask: Ask) -> None:
    station = ask.moving()
    station.setpoint(POSITION, (60.0, 0.0, -8.0))
    station.run(3.0)
    assert ask(0) == ACCEPTED
    station.run(8.0)
    assert math.hypot(*station.velocity) < 0.3
    assert ask(1) == ACCEPTED
    station.run(4.0)
    assert station.velocity[0] > 1.0


def backwards(ask: Ask) -> None:
    station = ask.moving()
    station.setpoint(POSITION, (-40.0, 0.0, 0.0))
    assert ask(1) == ACCEPTED
    station.run(6.0)
    assert station.velocity[0] < -0.8
    assert abs(float(station.simulation.truth.yaw_rad[0])) < 0.5, "tail first"


def look_there(ask: Ask) -> None:
    station = ask.moving()
    assert ask(at=(HOME[0], HOME[1] + round(50 * METRE), 0.0)) == ACCEPTED
    station.run(8.0)
    assert float(station.simulation.truth.yaw_rad[0]) == pytest.approx(math.pi / 2, abs=0.2)


def look_nowhere(ask: Ask) -> None:
    station = ask.moving()
    station.command(mav.MAV_CMD_DO_SET_ROI, 0, 0, 0, 0, HOME[0] / 1e7, HOME[1] / 1e7 + 0.001, 0)
    station.run(3.0)
    yaw_rad = float(station.simulation.truth.yaw_rad[0])
    assert yaw_rad > 0.3
    assert ask() == ACCEPTED
    station.setpoint(POSITION, (20.0, 0.0, -8.0))
    station.run(6.0)
    assert abs(float(station.simulation.truth.yaw_rad[0])) < 0.2, "ahead again"


def the_fence_is_on(ask: Ask) -> None:
    assert ask(1) == ACCEPTED
    ask.station.command(512, 162)
    assert came(ask.station, "FENCE_STATUS")
    assert ask(0) == ACCEPTED
    assert not ask.station.vehicle.firmware.fence.enabled


def a_motor_turns(ask: Ask) -> None:
    station = ask.station
    if ask.vehicle == "copter":
        assert ask(1, 1, 1300, 2.0) == ACCEPTED
        assert output(station, 1) == 1300
    else:
        assert ask(1, 0, 40, 2.0) == ACCEPTED
        station.run(1.5)
        assert math.hypot(*station.velocity) > 0.3
    station.run(3.0)
    assert not station.vehicle.firmware.soft_armed


def a_switch_is_set(ask: Ask) -> None:
    station = ask.moving()
    assert ask(4, 2) == ACCEPTED
    assert mode_name(station) == "RTL"
    assert ask(31, 2) == ACCEPTED
    assert station.vehicle.firmware.guidance.motors == 0, "emergency stop"
    assert ask(999, 2) == 4
    assert station.texts()[-1] == "Invalid channel option (999)"


def the_item_in_force_changes(ask: Ask) -> None:
    station = ask.mission()
    assert ask(3) == ACCEPTED
    assert station.last("MISSION_CURRENT").seq == 3


def it_jumps_to_a_tag(ask: Ask) -> None:
    station = ask.mission()
    assert station.mode({"copter": 3}.get(ask.vehicle, 10)) == ACCEPTED
    assert ask(5) == ACCEPTED
    assert station.last("MISSION_CURRENT").seq == 3


def the_mission_starts(ask: Ask) -> None:
    station = ask.mission()
    assert ask() == ACCEPTED
    assert mode_name(station) == "AUTO"
    station.run(3.0)
    assert "Mission: 1 WP" in station.texts()


def gyroscopes_are_calibrated(ask: Ask) -> None:
    ask.station.log.clear()
    assert ask(1) == ACCEPTED
    saved = {m.param_id for m in ask.station.messages("PARAM_VALUE")}
    assert {"INS_GYROFFS_X", "INS_GYR2OFFS_Z"} <= saved


def parameters_have_their_defaults(ask: Ask) -> None:
    station = ask.station
    station.send(mav.MAVLink_param_set_message(1, 1, b"RTL_LOIT_TIME", 777.0, 6))
    station.send(mav.MAVLink_param_set_message(1, 1, b"FENCE_RADIUS", 77.0, 9))
    assert ask(2) == ACCEPTED
    station.command(246, 1)
    station.run(4.0)
    assert station.vehicle.parameters["FENCE_RADIUS"] == 300.0


def it_starts_again(ask: Ask) -> None:
    boots = ask.station.vehicle.parameters["STAT_BOOTCNT"]
    assert ask(1) == ACCEPTED
    ask.station.run(4.0)
    assert ask.station.vehicle.parameters["STAT_BOOTCNT"] == boots + 1


def it_arms_and_disarms(ask: Ask) -> None:
    assert ask(1) == ACCEPTED
    assert ask.station.vehicle.firmware.armed
    assert ask(0) == ACCEPTED
    assert not ask.station.vehicle.firmware.armed


def checks_are_told(ask: Ask) -> None:
    ask.station.send(mav.MAVLink_param_set_message(1, 1, b"BATT_LOW_VOLT", 99.0, 9))
    ask.station.command(241, 0, 0, 0, 0, 0)
    ask.station.vehicle.lose_gps()
    ask.station.mode({"copter": GUIDED}.get(ask.vehicle, ROVER_GUIDED))
    ask.station.run(1.0)
    assert ask() == ACCEPTED
    assert any(text.startswith("PreArm: ") for text in ask.station.texts())


def the_gps_is_off(ask: Ask) -> None:
    assert ask(4, 1, 0) == ACCEPTED
    ask.station.run(1.0)
    ask.station.command(512, 24)
    assert ask.station.last("GPS_RAW_INT").fix_type < 3


def an_interval_is_told(ask: Ask) -> None:
    ask.station.interval(30, 4.0)
    assert ask(30) == ACCEPTED
    assert ask.station.last("MESSAGE_INTERVAL").interval_us == 250_000


def it_comes_at_the_interval(ask: Ask) -> None:
    station = ask.station
    assert ask(29, 100_000) == ACCEPTED
    station.log.clear()
    station.run(5.0)
    assert len(station.messages("SCALED_PRESSURE")) == pytest.approx(50, abs=1)


def the_battery_counts_from_there(ask: Ask) -> None:
    station = ask.station
    assert ask(1, 40) == ACCEPTED
    station.run(0.1)
    station.command(512, 147)
    assert station.last("BATTERY_STATUS").battery_remaining == 40


def the_banner_comes(ask: Ask) -> None:
    assert ask() == ACCEPTED
    name = {"copter": "ArduCopter", "plane": "ArduPlane"}.get(ask.vehicle, "ArduRover")
    assert f"{name} V4.7.0-dev (cef8bcef)" in ask.station.texts()


def another_airspeed(ask: Ask) -> None:
    station = ask.moving()
    assert ask(0, 26.0) == ACCEPTED
    station.run(10.0)
    assert station.vehicle.snapshot().airspeed_m_s == pytest.approx(26.0, abs=1.5)


Effect = Callable[[Ask], None]
EVERY_KIND: dict[str, Effect] = {
    "DO_SET_MODE": set_a_mode,
    "DO_CHANGE_SPEED": another_speed,
    "DO_SET_HOME": home_is_there,
    "DO_SET_SERVO": a_servo_moves,
    "DO_FLIGHTTERMINATION": the_motors_stop,
    "DO_REPOSITION": go_there,
    "DO_FENCE_ENABLE": the_fence_is_on,
    "DO_AUX_FUNCTION": a_switch_is_set,
    "DO_SET_MISSION_CURRENT": the_item_in_force_changes,
    "DO_JUMP_TAG": it_jumps_to_a_tag,
    "MISSION_START": the_mission_starts,
    "NAV_RETURN_TO_LAUNCH": into("RTL"),
    "PREFLIGHT_CALIBRATION": gyroscopes_are_calibrated,
    "PREFLIGHT_STORAGE": parameters_have_their_defaults,
    "PREFLIGHT_REBOOT_SHUTDOWN": it_starts_again,
    "COMPONENT_ARM_DISARM": it_arms_and_disarms,
    "RUN_PREARM_CHECKS": checks_are_told,
    "GET_HOME_POSITION": asked_for("HOME_POSITION"),
    "INJECT_FAILURE": the_gps_is_off,
    "GET_MESSAGE_INTERVAL": an_interval_is_told,
    "SET_MESSAGE_INTERVAL": it_comes_at_the_interval,
    "REQUEST_MESSAGE": asked_for("SYSTEM_TIME", 2),
    "REQUEST_AUTOPILOT_CAPABILITIES": asked_for("AUTOPILOT_VERSION", 1),
    "BATTERY_RESET": the_battery_counts_from_there,
    "DO_SEND_BANNER": the_banner_comes,
}
DRIVEN: dict[str, Effect] = {
    **EVERY_KIND,
    "DO_MOTOR_TEST": a_motor_turns,
    "DO_SET_REVERSE": backwards,
}
EFFECTS: dict[str, dict[str, Effect]] = {
    "copter": {
        **EVERY_KIND,
        "NAV_LOITER_UNLIM": into("LOITER"),
        "NAV_LAND": into("LAND"),
        "NAV_VTOL_LAND": into("LAND"),
        "NAV_TAKEOFF": take_off_to_five,
        "CONDITION_YAW": turn_the_nose,
        "DO_LAND_START": the_landing_begins,
        "DO_PAUSE_CONTINUE": hold_and_go_on,
        "DO_SET_ROI_LOCATION": look_there,
        "DO_SET_ROI": look_there,
        "DO_SET_ROI_NONE": look_nowhere,
        "DO_MOTOR_TEST": a_motor_turns,
    },
    "rover": DRIVEN,
    "boat": DRIVEN,
    "plane": {
        **EVERY_KIND,
        "NAV_LOITER_UNLIM": into("LOITER"),
        "DO_LAND_START": the_landing_begins,
        "DO_GO_AROUND": go_around,
        "GUIDED_CHANGE_SPEED": another_airspeed,
    },
}
REFUSED = {
    "DO_GIMBAL_MANAGER_CONFIGURE": "there is no gimbal",
    "DO_GIMBAL_MANAGER_PITCHYAW": "there is no gimbal",
    "DO_GRIPPER": "there is none",
    "DO_MOUNT_CONTROL": "there is none",
    "IMAGE_START_CAPTURE": "there is no camera",
    "VIDEO_START_CAPTURE": "there is no camera",
}
REFUSED_BY = {
    "copter": {},
    "rover": {},
    "boat": {},
    "plane": {"NAV_TAKEOFF": "of quadplanes; FAILED in the recording"},
}
WITHOUT_EFFECT = {
    **dict.fromkeys(("DO_SET_RELAY", "DO_REPEAT_RELAY", "DO_REPEAT_SERVO"), "nothing is connected"),
    "DO_DIGICAM_CONTROL": "the firmware accepts it without a camera, too",
    "IMAGE_STOP_CAPTURE": "no photos are being taken by time",
    "DO_SET_CAM_TRIGG_DIST": "the firmware accepts it without a camera, too",
    **dict.fromkeys(
        ("DO_START_MAG_CAL", "DO_ACCEPT_MAG_CAL", "DO_CANCEL_MAG_CAL"), "nobody turns the vehicle"
    ),
    "SET_EKF_SOURCE_SET": "there is one source of the position, and no message shows which",
}
LOOKING = dict.fromkeys(
    ("DO_SET_ROI", "DO_SET_ROI_LOCATION", "DO_SET_ROI_NONE"),
    "the real one points its camera mount, and only a copter its nose",
)


def known(vehicle: str) -> set[str]:
    """The names of the commands in the tables of the code."""
    personality = SCRIPT["PERSONALITIES"][vehicle, "ardupilot"]
    answers = SCRIPT["answers"]("ardupilot", personality)
    return {SCRIPT["name_of"]("MAV_CMD", n) for n, entry in answers.items() if entry is not None}


def nothing_shows(vehicle: str) -> dict[str, str]:
    return WITHOUT_EFFECT if vehicle == "copter" else {**WITHOUT_EFFECT, **LOOKING}


@pytest.mark.parametrize("vehicle", KINDS)
def test_every_command_is_in_one_of_the_tables(vehicle: str) -> None:
    shown = set(EFFECTS[vehicle])
    refused = {*REFUSED, *REFUSED_BY[vehicle]}
    silent = set(nothing_shows(vehicle))
    assert not shown & refused
    assert not shown & silent
    assert shown | refused | silent == known(vehicle)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("vehicle", "name"),
    [(vehicle, name) for vehicle in KINDS for name in sorted(EFFECTS[vehicle])],
)
def test_what_is_accepted_has_its_effect(vehicle: str, name: str, form: str) -> None:
    ask = Ask(vehicle, getattr(mav, f"MAV_CMD_{name}"), form)
    EFFECTS[vehicle][name](ask)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("vehicle", KINDS)
def test_what_there_is_none_of_is_rejected_or_accepted_as_by_the_real_one(
    vehicle: str, form: str
) -> None:
    for name in {**REFUSED, **REFUSED_BY[vehicle]}:
        assert Ask(vehicle, getattr(mav, f"MAV_CMD_{name}"), form)(1, 1) != ACCEPTED, name
    for name in nothing_shows(vehicle):
        ask = Ask(vehicle, getattr(mav, f"MAV_CMD_{name}"), form)
        assert ask(1, 0, 0, at=(HOME[0], HOME[1], 5.0)) == ACCEPTED, name
