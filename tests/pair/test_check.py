"""`navigation_server --check` against the simulator, on simulated time."""

from __future__ import annotations

import itertools
import json
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml

from drone_navigation.check.examination import Checker
from drone_navigation.check.report import CheckVerdict, Report, make_report
from drone_navigation.check.report_output import as_json, plain_lines
from mavlink_sitl import LinkFaults, Simulation, VehicleConfig
from mavlink_vehicle.codec import Codec, Message, make, mavlink
from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.signing import Signing
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.configuration.parameter_table import ParameterValue
from tests.support.messages.autopilot_messages import AutopilotMessages

pytestmark = pytest.mark.wide_but_first


CONFIG = Path(__file__).resolve().parents[2] / "bridge_config"
_TICK_S = 0.01
ADVICE = "Check the cable."
# All that a check may say: questions. The mission's are about the uploaded fence, and the
# acknowledgement ends the reading of it.
HARMLESS = {
    "HEARTBEAT", "TIMESYNC", "PARAM_REQUEST_READ", "REQUEST_DATA_STREAM", "COMMAND_LONG",
    "MISSION_REQUEST_LIST", "MISSION_REQUEST_INT", "MISSION_ACK",
}  # fmt: skip
HARMLESS_COMMANDS = {
    mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
    mavlink.MAV_CMD_REQUEST_MESSAGE,
    mavlink.MAV_CMD_RUN_PREARM_CHECKS,
}


class Look:
    """A checker and a simulated vehicle on one clock; every byte that goes out is kept."""

    def __init__(self, simulated: VehicleConfig, values: dict[str, ParameterValue]) -> None:
        """Start both."""
        self.simulation = Simulation([simulated], seed=1)
        codec = Codec(1, 191)
        self.checker = Checker(make_config(values), lambda: LinkStatistics.of(codec.statistics))
        self.sent: list[bytes] = []
        self.set_up = ""
        self.now = 0.0
        self._codec = codec
        self.checker.start(self.now)

    def listen_with(self, codec: Codec) -> None:
        """Hear by another codec, which the checker counts by, from now on."""
        self._codec = codec
        self.checker.start(self.now)

    def run_for(self, seconds: float) -> Look:
        """Continue for a while."""
        end_s = self.now + seconds
        while self.now < end_s:
            self._tick()
        return self

    def run_to_end(self, limit_s: float = 15.0) -> Report:
        """Look as long as the command does, and report."""
        next_s, end_s = self.now, self.now + limit_s
        while self.now < end_s:
            self._tick()
            if self.now >= next_s:
                next_s += 0.2
                if self.checker.waiting_for(self.now) is None:
                    break
        return self.report()

    def report(self) -> Report:
        """Report now."""
        return make_report(self.checker, ADVICE, self.now, self.set_up)

    def messages(self) -> list[Message]:
        """Return what the bytes that were sent say."""
        return Codec(9, 9).decode(b"".join(self.sent))

    def _tick(self) -> None:
        self.now += _TICK_S
        self.simulation.run_for(_TICK_S)
        for data in self.simulation.link.read_datagrams():
            for message in self._codec.decode(data):
                self.checker.receive(message, self.now)
        deadline = self.checker.next_deadline()
        if deadline is not None and deadline <= self.now:
            self.checker.handle_timer(self.now)
        for message in self.checker.messages_to_send():
            self.sent.append(self._codec.encode(message))
            self.simulation.link.write(self.sent[-1])


def look(
    firmware: str = "ardupilot",
    kind: str = "copter",
    release: str = "",
    faults: LinkFaults | None = None,
    parameters: dict[str, float] | None = None,
    ready_after_s: float = 1.0,
    battery_remaining: float = 1.0,
    **values: ParameterValue,
) -> Look:
    """Look with the set-up of a simulated vehicle, some of its values changed."""
    path = CONFIG / "simulated" / f"{firmware}_{kind}.yaml"
    set_up = yaml.safe_load(path.read_text("utf-8"))["navigation_server"]["ros__parameters"]
    simulated = VehicleConfig(
        autopilot=firmware,
        vehicle=kind,
        firmware=release,
        faults=faults,
        parameters=parameters or {},
        ready_after_s=ready_after_s,
        battery_remaining=battery_remaining,
    )
    return Look(simulated, {**set_up, **values})


def value_of(report: Report, name: str) -> str:
    (value,) = [x.value for section in report.sections for x in section.lines if x.name == name]
    return value


def warning_of(report: Report, name: str) -> str | None:
    (warning,) = [x.warning for section in report.sections for x in section.lines if x.name == name]
    return warning


def assert_harmless(sent: list[Message]) -> None:
    assert {message.get_type() for message in sent} <= HARMLESS
    commands = {m.command for m in sent if m.get_type() == "COMMAND_LONG"}
    assert commands <= HARMLESS_COMMANDS


SETTINGS = {
    ("ardupilot", "copter"): ("FS_GCS_ENABLE", 5.0, "5 (land)"),
    ("ardupilot", "rover"): ("FS_ACTION", 1.0, "1 (RTL)"),
    ("ardupilot", "boat"): ("FS_ACTION", 0.0, "0 (nothing)"),
    ("ardupilot", "plane"): ("FS_LONG_ACTN", 2.0, "2 (glides)"),
    ("px4", "copter"): ("COM_LOW_BAT_ACT", 2.0, "2 (lands when critical)"),
    ("px4", "rover"): ("COM_OBL_RC_ACT", 5.0, "5 (hold)"),
    ("px4", "boat"): ("NAV_DLL_ACT", 0.0, "0 (nothing)"),
    ("px4", "plane"): ("GF_ACTION", 3.0, "3 (return)"),
}


@pytest.mark.parametrize(("firmware", "kind"), SETTINGS)
def test_a_vehicle_of_each_set_up_is_found_ready_and_left_alone(firmware: str, kind: str) -> None:
    name, value, words = SETTINGS[firmware, kind]
    flight = look(firmware, kind, parameters={name: value}).run_for(2.0)
    before = flight.checker.vehicle.state
    place = flight.simulation.truth.position_ned_m.copy()
    report = flight.run_to_end()
    assert (report.verdict, report.sentence) == (CheckVerdict.READY, "Ready for goals."), (
        report.missing
    )
    assert value_of(report, "kind") == kind
    expected = {"ardupilot": "Ardu", "px4": "PX4 "}[firmware]
    assert value_of(report, "firmware").startswith(expected)
    assert value_of(report, "round trip").endswith(" ms")
    assert value_of(report, "age of the data") == "0.00 s at most"
    assert value_of(report, "estimator") == "position good"
    assert value_of(report, name).endswith(words)
    assert (warning_of(report, name) is not None) == (value == 0.0)
    after = flight.checker.vehicle.state
    assert (after.armed, after.custom_mode) == (before.armed, before.custom_mode)
    assert not after.armed
    assert np.allclose(flight.simulation.truth.position_ned_m, place, atol=0.01)
    assert_harmless(flight.messages())


class Delaying(Codec):
    """Decodes what the vehicle sends, late, or without its answers to TIMESYNC."""

    def __init__(self, flight: Look, answers: bool = True) -> None:
        super().__init__(1, 191)
        self.late_s = 0.0
        self._flight = flight
        self._answers = answers
        self._waiting: deque[tuple[float, Message]] = deque()

    def decode(self, data: bytes) -> list[Message]:
        now, due = self._flight.now, []
        for message in super().decode(data):
            if self._answers or message.get_type() != "TIMESYNC":
                self._waiting.append((now, message))
        while self._waiting and self._waiting[0][0] <= now - self.late_s:
            due.append(self._waiting.popleft()[1])
        return due


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_data_that_is_old_when_it_is_read_is_reported(firmware: str) -> None:
    flight = look(firmware)
    codec = Delaying(flight)
    flight.listen_with(codec)
    flight.run_for(5.0)
    assert warning_of(flight.report(), "age of the data") is None
    codec.late_s = 2.0  # data from now on waits in a buffer
    flight.run_for(6.0)
    report = flight.report()
    age_s = float(value_of(report, "age of the data").removesuffix(" s at most"))
    assert age_s == pytest.approx(2.0, abs=0.2)
    assert "stops it from 1 s on" in str(warning_of(report, "age of the data"))


@pytest.mark.parametrize("firmware", ["ardupilot", "px4"])
def test_the_age_of_data_is_unknown_without_answers_to_timesync(firmware: str) -> None:
    flight = look(firmware)
    flight.listen_with(Delaying(flight, answers=False))
    report = flight.run_to_end()
    assert "does not answer TIMESYNC" in value_of(report, "age of the data")
    assert warning_of(report, "age of the data") is None
    assert report.verdict is CheckVerdict.READY


@pytest.mark.parametrize(("firmware", "kind"), [("ardupilot", "copter"), ("px4", "boat")])
def test_every_message_comes_as_often_as_it_was_asked_for(firmware: str, kind: str) -> None:
    flight = look(firmware, kind)
    flight.run_to_end()
    rates = flight.checker.rates(flight.now)
    assert {"GLOBAL_POSITION_INT", "SYS_STATUS"} <= {rate.name for rate in rates}
    for rate in rates:
        if rate.name == "TERRAIN_REPORT":
            continue  # not every vehicle has terrain data
        assert not rate.low, rate
        assert rate.refusal is None, rate
        expected_hz = min(rate.asked_hz, rate.own_hz or rate.asked_hz)
        assert rate.measured_hz == pytest.approx(expected_hz, rel=0.3, abs=0.5), rate


def rate_warnings(report: Report) -> dict[str, str]:
    (section,) = [s for s in report.sections if s.title.startswith("Message rates")]
    return {line.name: line.warning for line in section.lines if line.warning is not None}


@pytest.mark.parametrize(("firmware", "kind"), SETTINGS)
def test_a_healthy_vehicle_gives_no_reason_to_doubt_the_link(firmware: str, kind: str) -> None:
    """Neither when it is looked at nor at any moment before, its estimator ready or not."""
    flight = look(firmware, kind, ready_after_s=8.0)
    flight.run_for(6.0)
    while flight.now < 14.0:
        flight.run_for(0.25)
        assert not rate_warnings(flight.report()), flight.now
    assert flight.run_to_end().verdict is CheckVerdict.READY


def test_what_a_firmware_sends_at_its_own_rate_is_said_so() -> None:
    report = look("px4").run_to_end()
    for name, own_hz in (("CURRENT_MODE", 2), ("MISSION_CURRENT", 1)):
        assert value_of(report, name).endswith(f"the firmware sends it at {own_hz} Hz")


def test_a_slow_link_is_warned_of_and_what_limits_it_is_named() -> None:
    for firmware, advice in (("px4", "MAV_x_RATE"), ("ardupilot", "is the link too slow?")):
        flight = look(firmware)
        flight.run_for(4.0)
        receive, count = flight.checker.receive, itertools.count()

        def slow(
            message: Message,
            now: float,
            receive: Callable[[Message, float], None] = receive,
            count: Iterator[int] = count,
        ) -> None:
            often = message.get_type() in ("GLOBAL_POSITION_INT", "ATTITUDE")
            if not often or next(count) % 10 == 0:
                receive(message, now)

        flight.checker.receive = slow  # type: ignore[method-assign]
        flight.run_for(6.0)
        warnings = rate_warnings(flight.report())
        assert set(warnings) == {"GLOBAL_POSITION_INT", "ATTITUDE"}
        assert all(advice in warning for warning in warnings.values())


def test_a_flying_vehicle_flies_on_and_says_what_it_does() -> None:
    flight = look().run_for(4.0)
    station = Codec(255, 190)
    for command, *params in ((176, 1, 4), (400, 1), (22, 0, 0, 0, 0, 0, 0, 8)):
        names = {f"param{i}": float(value) for i, value in enumerate(params, 1)}
        order = make("COMMAND_LONG", target_system=1, target_component=1, command=command, **names)
        flight.simulation.link.write(station.encode(order))
    flight.run_for(15.0)
    before = flight.simulation.truth.position_ned_m[0].copy()
    report = flight.run_to_end()
    assert report.verdict is CheckVerdict.READY, report.missing
    assert (value_of(report, "armed"), value_of(report, "mode")) == ("yes", "GUIDED")
    assert before[2] < -7.0
    assert np.allclose(flight.simulation.truth.position_ned_m[0], before, atol=0.5)
    assert_harmless(flight.messages())


def test_a_real_vehicle_is_ready_and_its_arming_is_left_to_the_pilot() -> None:
    report = look(arming="never").run_to_end()
    assert report.verdict is CheckVerdict.READY
    assert "manually" in report.yours[0]
    assert "take off" in report.yours[0]
    assert "take off" not in look(kind="rover", arming="never").run_to_end().yours[0]


@pytest.mark.parametrize("kind", ["copter", "rover", "plane"])
def test_the_ground_stations_system_id_is_reported_by_the_name_that_the_firmware_has(
    kind: str,
) -> None:
    report = look(kind=kind).run_to_end()
    (section,) = (s for s in report.sections if s.title == "Vehicle failsafes")
    names = [line.name for line in section.lines]
    assert len({"MAV_GCS_SYSID", "SYSID_MYGCS"} & set(names)) == 1
    assert "SYSID" not in "".join(
        line.value for line in section.lines if line.name == "not reported"
    )


@pytest.mark.parametrize(
    ("release", "own", "others"),
    [
        ("px4-1.18", {"MAN_OVERRIDE_SPD", "COM_GNSSLOSS_ACT", "FD_ALT_LOSS"}, {"COM_RC_OVERRIDE"}),
        ("px4-1.17", {"COM_RC_OVERRIDE"}, {"MAN_OVERRIDE_SPD", "COM_GNSSLOSS_ACT", "FD_ALT_LOSS"}),
    ],
)
def test_the_parameters_of_the_release_are_reported_and_no_others_missed(
    release: str, own: set[str], others: set[str]
) -> None:
    report = look("px4", release=release).run_to_end()
    (section,) = (s for s in report.sections if s.title == "Vehicle failsafes")
    names = {line.name for line in section.lines}
    assert own <= names
    assert not others & names
    assert "not reported" not in names


def test_a_pilot_who_cannot_take_over_by_a_stick_is_warned_of() -> None:
    parameters = {"MAN_OVERRIDE_SPD": -1.0}
    report = look("px4", release="px4-1.18", parameters=parameters).run_to_end()
    assert "none takes over" in value_of(report, "MAN_OVERRIDE_SPD")
    assert warning_of(report, "MAN_OVERRIDE_SPD") == "Off: the vehicle does not react."


def test_who_else_speaks_is_reported() -> None:
    flight = look()
    kinds = [(255, 1, mavlink.MAV_TYPE_GCS, 0), (1, 154, mavlink.MAV_TYPE_GIMBAL, 8)]
    for system, component, kind, autopilot in kinds:
        beat = AutopilotMessages(system, component).heartbeat(
            autopilot=autopilot, vehicle_type=kind
        )
        flight.checker.receive(beat, flight.now)
    assert "255/1 (GCS, autopilot GENERIC)" in flight.report().sentence + str(flight.report())
    report = flight.run_to_end()
    assert report.verdict is CheckVerdict.READY
    assert value_of(report, "also heard") == "1/154 (GIMBAL), 255/1 (GCS, autopilot GENERIC)"


def test_without_a_position_it_is_not_ready_and_says_what_to_do() -> None:
    report = look(ready_after_s=60.0).run_to_end()
    assert report.verdict is CheckVerdict.NOT_READY
    assert report.missing[0].what.startswith("NO_POSITION: ")
    assert report.missing[0].advice


def test_a_position_that_comes_while_it_looks_is_waited_for() -> None:
    flight = look(ready_after_s=9.0)
    assert flight.run_for(7.0).report().verdict is CheckVerdict.NOT_READY
    assert flight.run_to_end().verdict is CheckVerdict.READY


def test_a_vehicle_that_would_not_arm_is_asked_for_its_reasons() -> None:
    flight = look(parameters={"BATT_LOW_VOLT": 20.0, "BATT_LOW_TIMER": 1.0})
    report = flight.run_to_end()
    assert report.verdict is CheckVerdict.NOT_READY
    (missing,) = report.missing
    assert "Battery 1 low voltage failsafe" in missing.what
    assert_harmless(flight.messages())


def test_a_px4_that_reports_no_reasons_is_a_case_for_a_ground_station() -> None:
    report = look("px4", ready_after_s=60.0).run_to_end()
    assert "heartbeat_type" in report.missing[-1].advice


def test_what_the_server_would_reject_is_reported_in_its_words() -> None:
    report = look(volume_altitude_min_m=20.0, volume_altitude_max_m=50.0).run_to_end()
    assert report.verdict is CheckVerdict.NOT_READY
    assert report.missing[0].what.startswith("OUTSIDE_VOLUME: ")


def test_silence_is_no_vehicle_and_the_link_is_what_to_look_at() -> None:
    flight = look()
    flight.simulation.link.silent = True
    report = flight.run_to_end(3.0)
    assert report.verdict is CheckVerdict.NO_VEHICLE
    assert report.missing[0].advice == ADVICE
    assert_harmless(flight.messages())


def test_the_wrong_system_id_names_those_that_are_heard() -> None:
    report = look(target_system=7).run_to_end(3.0)
    assert report.verdict is CheckVerdict.NO_VEHICLE
    assert "1/1" in report.missing[0].what
    assert "target_system" in report.missing[0].advice


def test_a_vehicle_without_our_key_points_to_the_signing() -> None:
    flight = look()
    signed = Codec(1, 191, Signing(bytes(range(32)), lambda: 1.8e9))
    flight.checker = Checker(make_config({}), lambda: LinkStatistics.of(signed.statistics))
    flight.listen_with(signed)
    report = flight.run_to_end(3.0)
    assert report.verdict is CheckVerdict.NO_VEHICLE
    assert "none with our key" in report.missing[0].what
    assert "signing_key_file" in report.missing[0].advice


def test_bytes_that_are_no_mavlink_point_to_the_baud_rate() -> None:
    codec = Codec(1, 191)
    checker = Checker(make_config({}), lambda: LinkStatistics.of(codec.statistics))
    checker.start(0.0)
    assert codec.decode(bytes(range(200))) == []
    report = make_report(checker, ADVICE, 1.0)
    assert report.verdict is CheckVerdict.NO_VEHICLE
    assert "baud rate" in report.missing[0].advice


def test_a_bad_link_is_looked_at_anyway_and_warned_of() -> None:
    flight = look(faults=LinkFaults(loss=0.3))
    report = flight.run_to_end()
    assert report.verdict is CheckVerdict.READY, report.missing
    assert warning_of(report, "lost") is not None


def test_a_low_battery_is_warned_of() -> None:
    report = look(battery_remaining=0.25).run_to_end()
    assert (report.verdict, warning_of(report, "remaining")) == (
        CheckVerdict.READY,
        "Charge the battery.",
    )
    empty = look(battery_remaining=0.15).run_to_end()
    assert empty.missing[0].what.startswith("LOW_BATTERY: ")
    assert "Charge the battery" in empty.missing[0].advice


@pytest.mark.parametrize(("word", "number"), [("auto", 18), ("onboard", 18), ("gcs", 6)])
def test_by_default_it_is_no_ground_station_whose_end_would_be_a_loss(
    word: str, number: int
) -> None:
    flight = look("px4", heartbeat_type=word).run_for(3.0)
    types = {m.type for m in flight.messages() if m.get_type() == "HEARTBEAT"}
    assert types == {number}


def test_the_report_is_the_same_in_lines_and_in_json() -> None:
    report = look(arming="never").run_to_end()
    lines = plain_lines(report)
    document = json.loads(as_json({"": report}))
    assert document["verdict"] == 0
    assert lines[-1] == document["sentence"] == report.sentence
    for section in document["sections"]:
        assert f"{section['title']}:" in lines
        for line in section["lines"]:
            assert f"  {line['name']}: {line['value']}" in lines


@pytest.mark.parametrize(
    ("firmware", "parameters", "separation", "words"),
    [
        ("ardupilot", {}, "enabled", "ADSB_TYPE is 0"),
        ("ardupilot", {"ADSB_TYPE": 1.0}, "enabled", "none has been received"),
        ("px4", {}, "enabled", "none has been received"),
        ("ardupilot", {}, "disabled", "not asked for"),
    ],
)
def test_what_a_vehicle_lacks_to_know_of_other_aircraft_is_reported(
    firmware: str, parameters: dict[str, float], separation: str, words: str
) -> None:
    report = look(firmware, parameters=parameters, separation=separation).run_to_end()
    assert words in value_of(report, "other aircraft")


@pytest.mark.parametrize(
    ("firmware", "parameters", "words"),
    [
        ("ardupilot", {}, "not yet: set PLND_ENABLED to 1 and PLND_TYPE to 1, and restart it"),
        ("ardupilot", {"PLND_ENABLED": 1.0, "PLND_TYPE": 3.0}, "not yet: set PLND_TYPE to 1, and"),
        ("ardupilot", {"PLND_ENABLED": 1.0, "PLND_TYPE": 1.0}, "possible, in LAND"),
        ("px4", {}, "possible, in AUTO.PRECLAND"),
    ],
)
def test_what_a_vehicle_lacks_to_land_on_a_target_is_reported(
    firmware: str, parameters: dict[str, float], words: str
) -> None:
    report = look(firmware, parameters=parameters).run_to_end()
    assert value_of(report, "land on a target").startswith(words)


def test_no_landing_on_a_target_is_reported_for_a_plane() -> None:
    report = look(kind="plane").run_to_end()
    assert "land on a target" not in {line.name for part in report.sections for line in part.lines}


@pytest.mark.parametrize(
    ("set_up", "right"),
    [
        ("px4_copter", "ardupilot_copter.yaml"),
        ("ardupilot_rover", "ardupilot_copter.yaml"),
        ("ardupilot_copter", None),
        ("my_vehicle", None),
    ],
)
def test_a_set_up_for_another_vehicle_is_warned_of(set_up: str, right: str | None) -> None:
    seen = look()
    seen.set_up = set_up
    text = "\n".join(plain_lines(seen.run_to_end()))
    assert ("It is for another vehicle" in text) == (right is not None)
    assert right is None or f"take {right}" in text
