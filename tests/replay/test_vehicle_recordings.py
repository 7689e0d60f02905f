"""Recordings of real autopilots: understood without an exception and without a wrong state.

They lie packed in `tests/data/recordings`.
"""

from __future__ import annotations

import functools
from typing import Any

import pytest

from mavlink_vehicle.codec import Codec, mavlink
from mavlink_vehicle.events import (
    ArmedChanged,
    FailsafeBegan,
    FailsafeEnded,
    HeartbeatLost,
    HeartbeatRegained,
    LandedChanged,
    ModeChanged,
    VehicleEvent,
    VehicleRebooted,
)
from mavlink_vehicle.io.tlog import TlogReader
from mavlink_vehicle.state.health import estimator_faults
from mavlink_vehicle.state.reducer import VehicleState, reduce
from mavlink_vehicle.vehicle import Vehicle, VehicleConfig
from tests.support.logs.recordings import NAMES, recording

pytestmark = pytest.mark.wide


def oracle(frames: list[bytes]) -> list[Any]:
    """The same frames as pymavlink's own parser decodes them; None for what it can't."""
    parser = mavlink.MAVLink(None)
    messages = []
    for frame in frames:
        try:
            message = parser.decode(bytearray(frame))
        except mavlink.MAVError:
            message = None
        messages.append(None if isinstance(message, mavlink.MAVLink_unknown) else message)
    return messages


@pytest.mark.parametrize("name", NAMES)
def test_every_message_is_understood_as_pymavlink_does_and_the_state_says_the_same(
    name: str,
) -> None:
    """The decoded message, and an independent reading of it against the state."""
    records = list(TlogReader(recording(name)))
    state, codec, kinds = VehicleState(), Codec(255, 190), set[str]()
    for (time_s, frame), expected in zip(records, oracle([f for _, f in records]), strict=True):
        decoded = codec.decode(frame)
        if expected is None:
            assert not decoded
            continue
        (message,) = decoded
        assert type(message) is type(expected)
        assert repr(message.to_dict()) == repr(expected.to_dict())
        assert message.get_header()._asdict() == vars(expected.get_header())
        state = reduce(state, message, time_s)
        if (expected.get_srcSystem(), expected.get_srcComponent()) == (state.system_id, 1):
            kinds.add(expected.get_type())
            check_state(state, expected)
    assert "HEARTBEAT" in kinds


def check_state(state: VehicleState, raw: Any) -> None:
    """Hold the state against the message just taken in."""
    kind = raw.get_type()
    if kind == "HEARTBEAT":
        assert state.armed == bool(raw.base_mode & 128)
        assert state.custom_mode == raw.custom_mode
        assert state.system_status == raw.system_status
    elif kind == "GLOBAL_POSITION_INT":
        there = not raw.lat == raw.lon == 0
        assert (state.global_position is not None) == there
        assert there or not state.position_valid
    elif kind == "EXTENDED_SYS_STATE":
        assert state.landed_state == raw.landed_state
    elif kind == "BATTERY_STATUS" and raw.id == 0:
        battery = state.battery
        assert battery is not None
        known = raw.battery_remaining >= 0
        assert battery.remaining == (raw.battery_remaining / 100 if known else None)
        volts = [cell for cell in raw.voltages if cell != 65535]
        assert (battery.voltage_v is None) == (not volts)
        assert battery.voltage_v is None or 9.0 < battery.voltage_v < 18.0
    elif kind == "EKF_STATUS_REPORT" and not raw.flags & 0x10:
        assert not state.position_valid


class Replay:
    """A whole `Vehicle` that listens to a recording."""

    def __init__(self, name: str) -> None:
        self.vehicle = Vehicle(VehicleConfig(message_rates_hz={}))
        self.events: list[tuple[float, VehicleEvent]] = []
        self.faults: set[str] = set()
        codec = Codec(1, 191)
        start_s: float | None = None
        for time_s, frame in TlogReader(recording(name)):
            if start_s is None:
                start_s = time_s
                self.vehicle.start(time_s)
            for message in codec.decode(frame):
                self.vehicle.receive(message, time_s)
            if self.vehicle.state.armed:
                self.faults.update(estimator_faults(self.vehicle.state))
            self.vehicle.handle_timer(time_s)
            self.vehicle.messages_to_send()
            while (event := self.vehicle.next_event()) is not None:
                self.events.append((time_s - start_s, event))

    def modes(self) -> list[str]:
        return [event.name for _, event in self.events if isinstance(event, ModeChanged)]

    def armed(self) -> list[bool]:
        return [event.armed for _, event in self.events if isinstance(event, ArmedChanged)]

    def landed(self) -> list[str]:
        return [e.current.name for _, e in self.events if isinstance(e, LandedChanged)]

    def kinds(self, *kinds: type) -> list[str]:
        return [type(event).__name__ for _, event in self.events if isinstance(event, kinds)]

    def texts(self) -> str:
        return "\n".join(text.text for text in self.vehicle.state.status_texts)


@functools.cache
def replayed(name: str) -> Replay:
    return Replay(name)


@pytest.mark.parametrize("name", [name for name in NAMES if not name.startswith("real/")])
def test_no_recorded_flight_of_a_healthy_vehicle_is_called_unhealthy(name: str) -> None:
    assert replayed(name).faults == set()


FLIGHT = ["ON_GROUND", "TAKEOFF", "IN_AIR", "LANDING", "ON_GROUND"]
UP_ONLY = ["ON_GROUND", "TAKEOFF", "IN_AIR"]


@pytest.mark.parametrize(
    ("name", "modes", "armed", "landed"),
    # As the notes taken beside each flight tell it.
    [
        ("ardupilot/copter_guided", ["GUIDED", "LAND"], [True, False], FLIGHT),
        ("ardupilot/copter_auto_cleared", ["AUTO", "RTL"], [True, False], FLIGHT),
        ("ardupilot/copter_gcsloss", ["GUIDED", "RTL", "GUIDED", "LAND"], [True, False], FLIGHT),
        (
            "ardupilot/copter_lowbatt",
            ["GUIDED", "RTL", "GUIDED", "LAND", "GUIDED"],
            [True, False],
            FLIGHT,
        ),
        ("ardupilot/copter_fence", ["GUIDED"], [True], UP_ONLY),
        ("ardupilot/copter_setpoints", ["GUIDED"], [True], UP_ONLY),
        (
            "ardupilot/copter_takeoff_mix",
            ["GUIDED", "LAND", "GUIDED", "LOITER", "GUIDED", "LOITER", "GUIDED", "LAND"],
            [True, False, True, False],
            FLIGHT,
        ),
        ("ardupilot/rover_auto", ["MANUAL", "AUTO", "HOLD", "AUTO", "HOLD"], [True, False], []),
        (
            "ardupilot/rover_guided",
            ["MANUAL", "GUIDED", "HOLD", "CIRCLE", "RTL", "HOLD"],
            [True, False],
            [],
        ),
        ("ardupilot/plane_guided", ["MANUAL", "TAKEOFF", "GUIDED", "RTL"], [True], UP_ONLY),
        (
            "px4/offboard_10m_20n_gt_api",
            ["OFFBOARD", "AUTO.LAND", "OFFBOARD"],
            [True, False],
            ["ON_GROUND", "IN_AIR", "LANDING", "ON_GROUND"],
        ),
        (
            "px4/offboard_loss_stop_api",
            ["OFFBOARD", "AUTO.RTL", "OFFBOARD"],
            [True, False],
            # It flapped on touch-down.
            ["ON_GROUND", "IN_AIR", "LANDING", "ON_GROUND", "LANDING", "ON_GROUND"],
        ),
        (
            "px4/mission_clear_api",
            ["AUTO.MISSION", "AUTO.LOITER", "AUTO.RTL", "AUTO.LOITER"],
            [True, False],
            FLIGHT,
        ),
        (
            "px4/mavsdk_offboard_goto_api",
            ["OFFBOARD", "AUTO.LOITER", "AUTO.LAND", "AUTO.LOITER"],
            [True, False],
            ["ON_GROUND", "IN_AIR", "LANDING", "ON_GROUND"],
        ),
    ],
)
def test_flights_are_reported_as_they_were(
    name: str, modes: list[str], armed: list[bool], landed: list[str]
) -> None:
    replay = replayed(name)
    assert replay.modes() == modes
    assert replay.armed() == armed
    assert replay.landed() == landed
    assert not replay.kinds(VehicleRebooted)
    asked = [e.name for _, e in replay.events if isinstance(e, ModeChanged) and e.requested]
    # Nobody here asked; only that a PX4 goes back to an earlier mode when it has landed is its
    # own doing.
    assert asked == (modes[-1:] if name.startswith("px4") and not armed[-1] else [])


@pytest.mark.parametrize(
    ("name", "profile", "mode", "landed", "position", "battery_v"),
    # How each recording ends, as its notes tell; the real ones by their last messages.
    [
        ("ardupilot/copter_acks", "ArduCopter", "GUIDED", "ON_GROUND", True, 12.6),
        ("ardupilot/copter_auto_cleared", "ArduCopter", "RTL", "ON_GROUND", True, 12.6),
        ("ardupilot/copter_fence", "ArduCopter", "GUIDED", "IN_AIR", True, 12.6),
        ("ardupilot/copter_gcsloss", "ArduCopter", "LAND", "ON_GROUND", True, 12.6),
        ("ardupilot/copter_guided", "ArduCopter", "LAND", "ON_GROUND", True, 12.6),
        ("ardupilot/copter_lowbatt", "ArduCopter", "GUIDED", "ON_GROUND", True, 10.0),
        ("ardupilot/copter_reboot", "ArduCopter", "STABILIZE", "ON_GROUND", False, 12.6),
        ("ardupilot/copter_setpoints", "ArduCopter", "GUIDED", "IN_AIR", True, 12.6),
        ("ardupilot/copter_takeoff_mix", "ArduCopter", "LAND", "ON_GROUND", True, 12.6),
        ("ardupilot/multi_udp", "ArduRover", "HOLD", "UNDEFINED", True, 12.6),
        ("ardupilot/plane_guided", "ArduPlane", "RTL", "IN_AIR", True, 12.2),
        ("ardupilot/rover_auto", "ArduRover", "HOLD", "UNDEFINED", True, 12.6),
        ("ardupilot/rover_guided", "ArduRover", "HOLD", "UNDEFINED", True, 12.6),
        ("px4/mavsdk_offboard_goto_api", "PX4 multicopter", "AUTO.LOITER", "ON_GROUND", True, 16.2),
        ("px4/mission_clear_api", "PX4 multicopter", "AUTO.LOITER", "ON_GROUND", True, 16.2),
        ("px4/offboard_10m_20n_gt_api", "PX4 multicopter", "OFFBOARD", "ON_GROUND", True, 16.2),
        ("px4/offboard_loss_stop_api", "PX4 multicopter", "OFFBOARD", "ON_GROUND", True, 16.2),
        ("px4/probe_ground_api", "PX4 multicopter", "AUTO.LOITER", "ON_GROUND", True, 16.2),
        ("real/copter_2018-09-17", "ArduCopter", "STABILIZE", "UNDEFINED", True, None),
        ("real/sub_small", "ArduSub", "MANUAL", "UNDEFINED", True, 16.2),
    ],
)
def test_each_recording_ends_as_it_did(
    name: str, profile: str, mode: str, landed: str, position: bool, battery_v: float | None
) -> None:
    vehicle = replayed(name).vehicle
    state = vehicle.state
    assert vehicle.profile is not None
    assert vehicle.profile.name == profile
    assert vehicle.mode_name == mode
    assert state.landed_state.name == landed
    assert state.position_valid == position
    assert state.armed == (landed == "IN_AIR" or name == "ardupilot/multi_udp")
    assert state.battery is not None
    if battery_v is None:
        assert state.battery.voltage_v is None
    else:
        assert state.battery.voltage_v == pytest.approx(battery_v, abs=0.05)


def test_a_reboot_and_a_kill_are_both_seen_once() -> None:
    replay = replayed("ardupilot/copter_reboot")
    assert replay.kinds(VehicleRebooted, HeartbeatLost, HeartbeatRegained) == [
        "VehicleRebooted",
        "HeartbeatLost",
        "HeartbeatRegained",
        "VehicleRebooted",
    ]
    assert replay.vehicle.state.boot_count == 2
    assert replay.armed() == [True, False, True, False]
    assert not replay.vehicle.state.position_valid


def test_px4s_pack_voltage_and_unknown_current_are_read_as_such() -> None:
    battery = replayed("px4/offboard_10m_20n_gt_api").vehicle.state.battery
    assert battery is not None
    assert battery.voltage_v == pytest.approx(16.2, abs=0.1)
    assert battery.current_a is None
    assert battery.consumed_ah is None
    assert battery.remaining == 0.97


@pytest.mark.parametrize(
    ("name", "began", "ended"),
    [
        ("ardupilot/copter_lowbatt", [("battery", "Battery Failsafe")], True),
        ("ardupilot/copter_gcsloss", [("gcs", "GCS Failsafe")], True),
        (
            "px4/offboard_loss_stop_api",
            [("offboard", "the stream of setpoints had a gap")],
            True,
        ),
        # Flights without one, with everything that could be mistaken for one: refused setpoints,
        # a defeated take-off, an enabled fence, failed arming checks, a reboot.
        *((f"ardupilot/{name}", [], False) for name in (
            "copter_acks", "copter_auto_cleared", "copter_fence", "copter_guided",
            "copter_reboot", "copter_setpoints", "copter_takeoff_mix", "multi_udp",
            "plane_guided", "rover_auto", "rover_guided",
        )),
        *((f"px4/{name}", [], False) for name in (
            "mavsdk_offboard_goto_api", "mission_clear_api", "offboard_10m_20n_gt_api",
            "probe_ground_api",
        )),
        ("real/copter_2018-09-17", [], False),
        ("real/sub_small", [], False),
    ],
)  # fmt: skip
def test_failsafes_are_reported_with_their_kind_and_no_others(
    name: str, began: list[tuple[str, str]], ended: bool
) -> None:
    replay = replayed(name)
    told = [(e.kind.value, e.text) for _, e in replay.events if isinstance(e, FailsafeBegan)]
    assert told == began
    assert bool(replay.kinds(FailsafeEnded)) == ended
    assert replay.vehicle.state.failsafe is None


def test_a_take_off_defeated_by_setpoints_ends_disarmed() -> None:
    """The recording behind the rule that no setpoints are sent during a take-off."""
    replay = replayed("ardupilot/copter_takeoff_mix")
    times = [at for at, event in replay.events if isinstance(event, ArmedChanged)]
    first = [e for at, e in replay.events if isinstance(e, LandedChanged) and at < times[1]]
    assert times[1] - times[0] == pytest.approx(10.0, abs=0.5)
    assert [event.current.name for event in first] == ["ON_GROUND"]


def test_a_low_battery_shows_in_state_and_texts() -> None:
    replay = replayed("ardupilot/copter_lowbatt")
    state = replay.vehicle.state
    assert state.prearm_ok is False
    assert state.battery is not None
    assert state.battery.charge_state == mavlink.MAV_BATTERY_CHARGE_STATE_CRITICAL
    assert state.battery.voltage_v == pytest.approx(10.0)
    assert "Battery failsafe" in replay.texts()


def test_on_a_port_with_three_vehicles_the_first_or_the_wanted_one_is_followed() -> None:
    name = "ardupilot/multi_udp"
    assert replayed(name).vehicle.state.system_id == 3
    codec, vehicle = Codec(1, 191), Vehicle(VehicleConfig(target_system=2, message_rates_hz={}))
    vehicle.start(0.0)
    for time_s, frame in TlogReader(recording(name)):
        for message in codec.decode(frame):
            vehicle.receive(message, time_s)
    assert vehicle.state.system_id == 2
    assert vehicle.profile is not None
    assert vehicle.profile.name == "ArduCopter"
