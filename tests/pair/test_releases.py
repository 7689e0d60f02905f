"""The bridge flies each release that the simulator has, and gives way to its pilot."""

from __future__ import annotations

import pytest

from flight_rehearsal.flight_parameters import VEHICLE_PARAMETERS
from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Codec, make, mavlink
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.goals.requests import (
    LandRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_bridge.vehicle.traits import traits_of
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.messages.autopilot_messages import AutopilotMessages

pytestmark = pytest.mark.wide_but_first

RELEASES = ("px4-1.18", "ardupilot-4.7", "ardupilot-4.6")


def flight_of(firmware: str, kind: str = "copter") -> SimulatedFlight:
    autopilot = firmware.partition("-")[0]
    return SimulatedFlight(
        simulated=VehicleConfig(kind, autopilot, firmware=firmware, ready_after_s=1.0)
    ).ready()


def succeed(flight: SimulatedFlight, goal: str) -> None:
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.SUCCESS, end.message


def taken_by_pilot(flight: SimulatedFlight, goal: str) -> None:
    """See a goal end by a mode that the pilot selects, and the vehicle left in it."""
    flight.run_for(3.0)
    px4 = flight.simulation.vehicles[0].config.autopilot == "px4"
    mode = "AUTO.RTL" if px4 else "RTL"
    flight.set_mode_as_pilot(mode)
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.PILOT_OVERRIDE, end.message
    assert flight.vehicle.mode_name == mode


@pytest.mark.parametrize("firmware", RELEASES)
def test_a_copter_takes_off_arrives_lands_and_gives_way_to_its_pilot(firmware: str) -> None:
    flight = flight_of(firmware)
    succeed(flight, flight.send(6.0, 4.0, 5.0))
    succeed(flight, flight.start(LandRequest()))
    taken_by_pilot(flight, flight.send(60.0, 0.0, 6.0))


@pytest.mark.parametrize("kind", ["rover", "boat"])
@pytest.mark.parametrize("firmware", RELEASES)
def test_what_drives_arrives_and_gives_way_to_its_pilot(firmware: str, kind: str) -> None:
    flight = flight_of(firmware, kind)
    succeed(flight, flight.send(15.0, 5.0, 0.0))
    taken_by_pilot(flight, flight.send(80.0, 0.0, 0.0))


@pytest.mark.parametrize("firmware", RELEASES)
def test_a_plane_takes_off_arrives_and_gives_way_to_its_pilot(firmware: str) -> None:
    flight = flight_of(firmware, "plane")
    succeed(flight, flight.start(TakeoffRequest(50.0)))
    succeed(flight, flight.send(200.0, 100.0, 60.0))
    taken_by_pilot(flight, flight.send(-200.0, -100.0, 60.0))


@pytest.mark.parametrize("firmware", RELEASES)
def test_a_mission_of_all_that_a_route_may_have_is_taken_and_flown(firmware: str) -> None:
    """PX4 1.18 rejects items with a number that it does not use."""
    flight = flight_of(firmware)
    waypoints = (
        WaypointRequest((10.0, 0.0, 4.0), None, 1.5, hold_time_s=1.0, yaw_enu_rad=0.0),
        WaypointRequest((0.0, 5.0, 4.0), None, 1.5, max_speed_m_s=2.0),
    )
    succeed(flight, flight.start(WaypointsRequest(waypoints, by_mission=True, laps=2)))


@pytest.mark.parametrize("firmware", ["ardupilot-4.7", "ardupilot-4.7-dev"])
def test_the_limits_of_a_copter_are_read_by_the_names_that_its_release_has(firmware: str) -> None:
    """Renamed and in other units since 4.7; without them its speeds and heights were unknown."""
    flight = flight_of(firmware)
    flight.run_for(2.0)
    parameters = flight.vehicle.parameters
    assert set(parameters.values) >= {"WPNAV_ACCEL", "WPNAV_ACCEL_Z", "PSC_JERK_XY", "PSC_JERK_Z"}
    assert parameters.values["WPNAV_SPEED"] == pytest.approx(1000.0)
    asked = VEHICLE_PARAMETERS["ArduCopter"]
    for _ in range(2):
        parameters.read(asked, flight.now)
        flight.run_for(1.1)
    known = dict(zip(asked, parameters.read(asked, flight.now), strict=True))
    assert None not in known.values(), "a rehearsal needs all of them"
    assert known["RTL_ALT"] == pytest.approx(1500.0)
    assert known["LAND_SPEED"] == pytest.approx(50.0)
    newer = firmware == "ardupilot-4.7"
    flight.simulation.vehicles[0].parameters.set(
        *(("WP_ACC", 1.0) if newer else ("WPNAV_ACCEL", 100.0))
    )
    parameters.refresh(flight.now)
    flight.run_for(0.5)
    profile = flight.vehicle.profile
    assert profile is not None
    assert traits_of(profile, parameters.values).acceleration_m_s2 < 1.0


@pytest.mark.parametrize(
    ("firmware", "said"),
    [
        ("px4-1.18", "PX4 1.18.0: goals have been flown with this release in the simulator only"),
        ("px4-1.17", "PX4 1.17.0: goals have been flown with this release"),
        ("ardupilot-4.6", "ArduPilot 4.6.2: goals have been flown with this release in the sim"),
        ("ardupilot-4.7-dev", "ArduPilot 4.7.0-dev: goals have been flown with this release"),
    ],
)
def test_the_release_is_reported_once_when_it_is_known(firmware: str, said: str) -> None:
    flight = flight_of(firmware)
    flight.run_for(3.0)
    lines = [line for line in flight.log_lines() if "goals have been flown" in line.text]
    assert [line.level for line in lines] == [LogLevel.INFO]
    assert lines[0].text.startswith(said)


def test_a_release_that_was_never_flown_is_warned_of_and_flies() -> None:
    flight = flight_of("px4-1.17")
    version = AutopilotMessages()("AUTOPILOT_VERSION", flight_sw_version=0x011000FF)
    flight.bridge.receive(version, flight.now)
    flight.run_for(0.1)
    (line,) = (line for line in flight.log_lines() if "no goals have been flown" in line.text)
    assert line.level is LogLevel.WARN
    assert "PX4 1.16.0" in line.text
    succeed(flight, flight.send(3.0, 2.0, 4.0))


def sticks(flight: SimulatedFlight, per_second: float, samples: int) -> None:
    """Move the pitch stick from its middle, and then hold it there; a sample every 0.04 s."""
    joystick = Codec(1, 255)
    for sample in range(samples):
        x = round(1000.0 * per_second * 0.04 * min(sample, 8))
        message = make("MANUAL_CONTROL", target=1, x=x, z=500)
        flight.simulation.link.write(joystick.encode(message))
        flight.run_for(0.04)


def test_a_nudge_of_a_stick_ends_a_goal_of_px4_1_18() -> None:
    """As a change of the mode by the pilot, though nobody touches the switch."""
    flight = flight_of("px4-1.18")
    goal = flight.send(60.0, 0.0, 6.0, speed=4.0)
    flight.run_to_status(goal, "NAVIGATING")
    sticks(flight, 0.5, 25)
    assert not flight.ends(goal), "a slow stick takes over nothing"
    sticks(flight, 2.0, 75)
    (end,) = flight.ends(goal)
    assert end.code is OutcomeCode.PILOT_OVERRIDE, end.message
    assert "POSCTL" in end.message
    assert flight.now - flight.setpoint_times(0.0)[-1] > 1.0, "nothing more moves the vehicle"


@pytest.mark.parametrize("samples", [9, 18])
def test_a_nudge_whose_stream_falls_silent_was_the_pilots(samples: int) -> None:
    """The vehicle then holds by its failsafe, as nobody flies it in POSCTL."""
    flight = flight_of("px4-1.18")
    goal = flight.send(60.0, 0.0, 6.0, speed=4.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(1.0)
    sticks(flight, 2.0, samples)
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.PILOT_OVERRIDE, end.message
    flight.run_for(2.0)
    assert flight.vehicle.mode_name == "AUTO.LOITER"


class EquippedFlight(SimulatedFlight):
    """A flight of a PX4 1.18 with a parachute and a Remote ID beside the autopilot.

    Attributes:
        beats: the MAV_TYPEs of those whose HEARTBEATs come.
    """

    def __init__(self, **parameters: float) -> None:
        self.beats = {mavlink.MAV_TYPE_PARACHUTE: 161, mavlink.MAV_TYPE_ODID: 236}
        self._beat_s = 0.0
        config = VehicleConfig(
            autopilot="px4", firmware="px4-1.18", ready_after_s=1.0, parameters=parameters
        )
        super().__init__(simulated=config)

    def tick(self) -> None:
        if self.now >= self._beat_s:
            self._beat_s = self.now + 1.0
            for kind, component in self.beats.items():
                beat = make("HEARTBEAT", type=kind, autopilot=8, system_status=4)
                self.simulation.link.write(Codec(1, component).encode(beat))
        super().tick()


@pytest.mark.parametrize(
    ("parameters", "lost", "code", "text"),
    [
        ({"COM_PARACHUTE": 2.0}, "parachute", "VEHICLE_FAILSAFE", "Parachute system lost"),
        ({"COM_PARACHUTE": 3.0}, "parachute", "VEHICLE_FAILSAFE", "Parachute system lost"),
        ({"COM_ARM_ODID": 3.0}, "Remote ID", "VEHICLE_FAILSAFE", "Remote ID system lost"),
        ({"SYS_HAS_NUM_GNSS": 1.0, "COM_GNSSLOSS_ACT": 2.0}, "GPS", "FAILSAFE_GPS", "fix"),
    ],
    ids=["parachute, return", "parachute, land", "Remote ID", "receivers"],
)
def test_what_px4_1_18_loses_in_flight_ends_the_goal(
    parameters: dict[str, float], lost: str, code: str, text: str
) -> None:
    """By its code, in the autopilot's words, and nothing more moves the vehicle."""
    flight = EquippedFlight(**parameters).ready()
    goal = flight.send(90.0, 0.0, 6.0, speed=3.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(2.0)
    assert not flight.ends(goal)
    if lost == "GPS":
        flight.simulation.vehicles[0].lose_gps()
    else:
        kinds = {"parachute": mavlink.MAV_TYPE_PARACHUTE, "Remote ID": mavlink.MAV_TYPE_ODID}
        del flight.beats[kinds[lost]]
    end = flight.run_to_end(goal)
    assert end.code.value == code, end.message
    assert text in end.message
    flight.run_for(8.0)
    assert flight.vehicle.mode_name != "OFFBOARD"
    assert flight.now - flight.setpoint_times(0.0)[-1] > 5.0


def test_a_px4_1_18_that_sinks_below_its_setpoint_is_terminated_and_the_goal_ends() -> None:
    parameters = {"FD_ALT_LOSS": 1.0, "FD_ALT_LOSS_T": 0.2, "CBRK_FLIGHTTERM": 0.0}
    flight = EquippedFlight(**parameters).ready()
    goal = flight.send(60.0, 0.0, 25.0, speed=2.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(2.0)
    flight.simulation.vehicles[0].blow((0.0, 0.0, 15.0))
    end = flight.run_to_end(goal)
    assert end.code is OutcomeCode.DISARMED, end.message


def test_what_px4_1_18_needs_to_arm_is_said_when_it_is_not_there() -> None:
    flight = EquippedFlight(COM_PARACHUTE=2.0)
    flight.beats.clear()
    end = flight.ready().run_to_end(flight.send(5.0, 0.0, 4.0))
    assert end.code is OutcomeCode.ARMING_REFUSED
    assert "Parachute system missing" in end.message
