"""A mode that somebody else chooses while a request of the server for another one is on its way.

Each case is flown twice: once alone, to know when the request leaves, and once with the other
choice at a time before or after that. The simulator's truth counts: the last one to choose, if it
was seen to, has the vehicle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pytest

from mavlink_sitl import LinkFaults, VehicleConfig
from mavlink_vehicle.codec import Codec, make, mavlink
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.requests import (
    LandRequest,
    ReturnRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


ASKS = (mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_MISSION_START)
# The pilot's mode, and the one that the vehicle is in before.
CHOSEN = {"px4": "POSCTL", "ardupilot": "ALT_HOLD"}
BEFORE = {"px4": "AUTO.LOITER", "ardupilot": "BRAKE"}
RETURNS = {"px4": "AUTO.RTL", "ardupilot": "RTL"}
OURS_FOR_S = 8.0
PILOT = Codec(255, 190)


@dataclass
class Seen:
    """The modes of the vehicle in truth, and those that the server was shown."""

    truth: list[tuple[float, str]]
    shown: list[tuple[float, str]]


class CrossedFlight(SimulatedFlight):
    """A flight with a slow link, sticks that are held, and a record of the modes."""

    def __init__(self, autopilot: str, delay_s: float) -> None:
        self.autopilot = autopilot
        self.seen = Seen([], [])
        simulated = VehicleConfig(
            autopilot=autopilot,
            ready_after_s=1.0,
            faults=LinkFaults(delay_s=delay_s),
            # It returns when the setpoints end.
            parameters={"COM_OBL_RC_ACT": 3.0} if autopilot == "px4" else {},
        )
        super().__init__(simulated=simulated)

    @property
    def true_mode(self) -> str:
        """The vehicle's mode."""
        return str(self.simulation.vehicles[0].firmware.mode.spec.name)

    def tick(self) -> None:
        if self.autopilot == "px4":
            sticks = make("MANUAL_CONTROL", target=1, x=0, y=0, z=500, r=0, buttons=0)
            self.simulation.vehicles[0].link.write(PILOT.encode(sticks))
        elif self.autopilot == "ardupilot" and self.vehicle.state.armed:
            self.simulation.vehicles[0].pilot_throttle(1500)
        super().tick()
        for modes, name in (
            (self.seen.truth, self.true_mode),
            (self.seen.shown, self.vehicle.mode_name),
        ):
            if not modes or modes[-1][1] != name:
                modes.append((self.now, name))

    def requests(self, since_s: float) -> list[tuple[float, int]]:
        """Return when a mode was asked for since a time, and by which command.

        Repetitions, until the acknowledgement has come over a slow link, do not count.
        """
        commands = [(t, m) for t, m in self.sent if t > since_s and m.get_type() == "COMMAND_LONG"]
        return [(t, m.command) for t, m in commands if m.command in ASKS and m.confirmation == 0]


def in_the_air(flight: CrossedFlight) -> None:
    flight.fly_up()
    flight.set_mode_as_pilot(BEFORE[flight.autopilot])
    flight.run_for(2.5)


def navigate(flight: CrossedFlight) -> str:
    in_the_air(flight)
    return flight.send(60.0, 0.0, 3.0)


def land(flight: CrossedFlight) -> str:
    in_the_air(flight)
    return flight.start(LandRequest())


def return_home(flight: CrossedFlight) -> str:
    in_the_air(flight)
    return flight.start(ReturnRequest())


def take_off(flight: CrossedFlight) -> str:
    return flight.start(TakeoffRequest(5.0))


def fly_mission(flight: CrossedFlight) -> str:
    in_the_air(flight)
    places = [(40.0, 0.0, 4.0), (40.0, 40.0, 4.0)]
    waypoints = tuple(WaypointRequest(place, acceptance_radius_m=2.0) for place in places)
    return flight.start(WaypointsRequest(waypoints, by_mission=True))


def cancelled(flight: CrossedFlight) -> str:
    flight.fly_up()
    goal_id = flight.send(60.0, 0.0, 3.0)
    flight.run_for(6.0)
    flight.bridge.goals.cancel(goal_id, flight.now)
    return goal_id


def serve_mode(flight: CrossedFlight) -> str:
    in_the_air(flight)
    flight.bridge.services.serve(99, Service.SET_MODE, flight.now, RETURNS[flight.autopilot])
    return ""


Begin = Callable[[CrossedFlight], str]
OPERATIONS: dict[str, Begin] = {
    "navigate": navigate,
    "land": land,
    "return": return_home,
    "take-off": take_off,
    "mission": fly_mission,
    "cancel": cancelled,
    "service": serve_mode,
}


def request_s(autopilot: str, begin: Begin, delay_s: float) -> float:
    """Return when the last request for a mode leaves that is not a repetition."""
    flight = CrossedFlight(autopilot, delay_s)
    flight.ready()
    begin(flight)
    since_s = flight.now
    flight.run_until(lambda: bool(flight.requests(since_s - 0.001)), 60.0)
    return flight.requests(since_s - 0.001)[-1][0]


def cross(
    autopilot: str,
    begin: Begin,
    delay_s: float,
    chosen_s: float,
    choose: Callable[[CrossedFlight], None],
    later_s: float = OURS_FOR_S,
) -> tuple[CrossedFlight, str]:
    """Fly until some seconds after somebody chose a mode; the same until then."""
    flight = CrossedFlight(autopilot, delay_s)
    flight.ready()
    goal_id = begin(flight)
    flight.run_until(lambda: flight.now >= chosen_s - 0.001, 90.0)
    choose(flight)
    flight.run_for(later_s)
    return flight, goal_id


def as_pilot(flight: CrossedFlight) -> None:
    flight.set_mode_as_pilot(CHOSEN[flight.autopilot])


def as_station(flight: CrossedFlight) -> None:
    """Ask by SET_MODE on another link, which a PX4 hands on to ours."""
    number = flight.vehicle.profile.modes[CHOSEN[flight.autopilot]]  # type: ignore[union-attr]
    message = make("SET_MODE", target_system=1, base_mode=1, custom_mode=number)
    data = Codec(255, 190).encode(message)
    (overheard,) = flight.codec.decode(data)
    flight.simulation.link.set_faults(None)
    flight.simulation.link.write(data)
    flight.simulation.link.set_faults(flight.simulation.vehicles[0].config.faults)
    flight.bridge.overhear(overheard, flight.now)


def check(flight: CrossedFlight, goal_id: str, chosen_s: float, delay_s: float) -> None:
    chosen, seen = CHOSEN[flight.autopilot], flight.seen
    told = [time_s for time_s, name in seen.shown if time_s >= chosen_s and name == chosen]
    ends = flight.ends(goal_id)
    after = [(time_s, name) for time_s, name in seen.truth if time_s >= chosen_s]
    first_s = next((time_s for time_s, name in after if name == chosen), chosen_s)
    overtaken = [(time_s, name) for time_s, name in after if time_s > first_s and name != chosen]
    if not told:
        # The server cannot know: the vehicle is flown on, and the stream does not end.
        assert flight.true_mode != "OFFBOARD" or not ends, (seen, ends)
        return
    assert flight.true_mode == chosen, (seen, ends)
    assert "Failsafe" not in str([line.text for line in flight.log_lines()]), seen
    assert len(overtaken) <= 1, seen
    asked = flight.requests(told[0] + 0.001)
    assert len(asked) == len(overtaken), (asked, seen)
    if overtaken:
        # At once: as soon as it shows, and that is asked for.
        back_s = next(time_s for time_s, name in after if time_s > overtaken[0][0])
        assert back_s - overtaken[0][0] < 0.35 + 4.0 * delay_s, seen
    if ends and ends[0].code.value == "PILOT_OVERRIDE":
        restored = f"{chosen}, which was requested again and is active" in ends[0].message
        assert restored == bool(overtaken), (ends, seen)
    elif goal_id:
        assert [end.code.value for end in ends] in (["CANCELED"], ["SUCCESS"]), ends


# Against the time at which the request leaves; it arrives a delay later.
OFFSETS_S = (-0.2, -0.02, 0.03, 0.1, 0.25, 0.6)


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize("delay_s", [0.1, 0.0, 0.3])
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("operation", OPERATIONS)
def test_a_pilots_mode_that_our_request_overtakes_is_restored(
    operation: str, autopilot: str, delay_s: float
) -> None:
    if (operation, autopilot) == ("cancel", "ardupilot"):
        return  # it is stopped by a setpoint, and no mode is requested
    begin = OPERATIONS[operation]
    sent_s = request_s(autopilot, begin, delay_s)
    for offset_s in OFFSETS_S:
        if offset_s > delay_s + 0.35:
            continue
        flight, goal_id = cross(autopilot, begin, delay_s, sent_s + offset_s, as_pilot)
        check(flight, goal_id, sent_s + offset_s, delay_s)


@pytest.mark.night
@pytest.mark.wide
@pytest.mark.parametrize("delay_s", [0.1, 0.3])
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("operation", ["navigate", "service"])
def test_a_mode_of_a_ground_station_is_not_overtaken_for_good(
    operation: str, autopilot: str, delay_s: float
) -> None:
    """It is overheard, so that it is restored even if the vehicle never showed it."""
    begin = OPERATIONS[operation]
    sent_s = request_s(autopilot, begin, delay_s)
    for offset_s in OFFSETS_S[3:8]:
        flight, _ = cross(autopilot, begin, delay_s, sent_s + offset_s, as_station)
        assert flight.true_mode == CHOSEN[autopilot], (offset_s, flight.seen)


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_second_change_of_the_pilot_is_left_alone(autopilot: str) -> None:
    second = {"px4": "ALTCTL", "ardupilot": "STABILIZE"}[autopilot]
    delay_s = 0.1
    sent_s = request_s(autopilot, navigate, delay_s)
    for later_s in (0.22, 0.3, 0.45, 0.7):  # our request has arrived
        flight, goal_id = cross(autopilot, navigate, delay_s, sent_s - 0.1, as_pilot, later_s)
        flight.set_mode_as_pilot(second)
        changed_s = flight.now
        flight.run_for(OURS_FOR_S)
        # A request on its way when the pilot changed the mode again arrives; no more is sent.
        # A PX4 shows a mode within 0.2 s.
        asked = flight.requests(changed_s + delay_s + 0.25)
        assert not asked, (later_s, asked, flight.seen)
        (end,) = flight.ends(goal_id)
        assert end.code.value == "PILOT_OVERRIDE"
        assert flight.true_mode in (second, CHOSEN[autopilot]), flight.seen


@pytest.mark.night
def test_a_failsafe_after_the_crossing_is_not_overridden() -> None:
    """The link is down when the mode was overtaken; a PX4 then acts by itself."""
    delay_s = 0.1
    sent_s = request_s("px4", navigate, delay_s)
    flight = CrossedFlight("px4", delay_s)
    flight.ready()
    goal_id = navigate(flight)
    flight.run_until(lambda: flight.now >= sent_s - 0.101, 90.0)
    as_pilot(flight)
    flight.run_until(lambda: flight.true_mode == "OFFBOARD", 5.0)
    flight.link_up = False
    flight.run_until(lambda: flight.true_mode == "AUTO.RTL", 5.0)
    flight.run_for(0.3)
    flight.link_up = True
    since_s = flight.now
    flight.run_for(OURS_FOR_S)
    assert flight.true_mode == "AUTO.RTL", flight.seen
    assert not flight.requests(since_s)
    (end,) = flight.ends(goal_id)
    assert end.code.value != "SUCCESS"
