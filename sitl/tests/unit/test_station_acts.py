"""Effects of ground station actions in flight, as measured on both firmware simulators.

Each test names what was seen there, with a companion computer and a station on two links.
"""

from __future__ import annotations

import itertools
import math

import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl.autopilot.personality import px4
from sitl_support.ground_station import (
    ACCEPTED,
    AUTO,
    BRAKE,
    DENIED,
    GUIDED,
    POSITION,
    UNSUPPORTED,
    VELOCITY,
    GroundStation,
    Message,
    copter,
    flying,
)
from sitl_support.kinds import plane, rover
from sitl_support.missions import answer, home, upload, waypoint
from sitl_support.px4_station import NAN, Px4Station, flying_px4, plan_item

pytestmark = pytest.mark.wide

PAUSE, REPOSITION = mav.MAV_CMD_DO_PAUSE_CONTINUE, mav.MAV_CMD_DO_REPOSITION
LARGEST, NAN_AS_INTEGER = 2**31 - 1, 0x7FF80000


def paused_on_the_way(down_m: float = -8.0) -> GroundStation:
    """A copter in GUIDED that has got a target far North, and then a pause."""
    station = flying(-down_m)
    station.setpoint(POSITION, (200.0, 0.0, down_m))
    station.run(3.0)
    assert station.command(PAUSE, 0) == ACCEPTED
    station.run(8.0)
    assert math.hypot(*station.velocity) < 0.1
    return station


def moves(station: GroundStation, seconds: float = 3.0) -> float:
    """How far it gets, metres."""
    begin = station.position
    station.run(seconds)
    return math.dist(begin, station.position)


# ArduCopter, GUIDED.


def test_a_paused_arducopter_takes_setpoints_and_does_not_fly_them() -> None:
    station = paused_on_the_way()
    for _ in range(5):
        station.setpoint(POSITION, (-100.0, 0.0, -8.0))
        assert moves(station, 1.0) < 0.3
    assert station.last("POSITION_TARGET_LOCAL_NED").x == pytest.approx(-100.0)
    station.stream(3.0, 5.0, lambda: station.setpoint(VELOCITY, velocity=(3.0, 0.0, 0.0)))
    assert math.hypot(*station.velocity) < 0.2
    assert station.last("HEARTBEAT").custom_mode == GUIDED, "nothing else shows the pause"
    assert not station.texts(station.now_s - 10.0)


def test_continue_flies_to_the_latest_target_also_one_that_came_while_paused() -> None:
    station = paused_on_the_way()
    x, y = home().x, home().y
    assert station.command_int(REPOSITION, 6, -1, 1, 0, NAN, x=x, y=y, z=8.0) == ACCEPTED
    assert moves(station) < 0.3
    before = station.position[0]
    assert station.command(PAUSE, 1) == ACCEPTED
    station.run(3.0)
    assert station.position[0] < before - 1.0


def test_a_velocity_that_ran_out_while_paused_is_not_flown_afterwards() -> None:
    station = paused_on_the_way()
    station.setpoint(VELOCITY, velocity=(3.0, 0.0, 0.0))
    station.run(4.0)
    assert station.command(PAUSE, 1) == ACCEPTED
    assert moves(station) < 0.5


def test_the_pause_outlasts_guided_chosen_again_and_ends_with_another_mode() -> None:
    station = paused_on_the_way()
    assert station.mode(GUIDED) == ACCEPTED
    station.setpoint(POSITION, (200.0, 0.0, -8.0))
    assert moves(station) < 0.3
    assert station.mode(BRAKE) == ACCEPTED
    assert station.mode(GUIDED) == ACCEPTED
    station.setpoint(POSITION, (200.0, 0.0, -8.0))
    assert moves(station) > 3.0


def test_pause_and_continue_are_all_that_it_knows() -> None:
    station = flying(6.0)
    assert station.command(PAUSE, 2) == DENIED
    assert station.command(PAUSE, -1) == DENIED


@pytest.mark.parametrize(
    ("x", "y", "z"),
    [(LARGEST, LARGEST, NAN), (NAN_AS_INTEGER, NAN_AS_INTEGER, NAN), (0, 0, 8.0)],
)
def test_a_reposition_without_a_place_is_no_pause_with_ardupilot(x: int, y: int, z: float) -> None:
    station = flying(8.0)
    station.setpoint(POSITION, (200.0, 0.0, -8.0))
    station.run(3.0)
    assert station.command_int(REPOSITION, 0, -1, 1, 0, NAN, x=x, y=y, z=z) == DENIED
    assert station.command(REPOSITION, -1, 1, 0, NAN, NAN, NAN, NAN) == UNSUPPORTED
    assert moves(station) > 15.0


# ArduRover and ArduPlane.


@pytest.fixture(scope="module", params=["rover", "plane"])
def traveller(request: pytest.FixtureRequest) -> GroundStation:
    """One that is under way to a far place in GUIDED."""
    station = rover() if request.param == "rover" else plane()
    place = waypoint(2000, 0)
    at = {"x": place.x, "y": place.y}
    assert station.command_int(REPOSITION, 6, -1, 1, 0, 0, z=50.0, **at) == ACCEPTED
    station.run(3.0)
    return station


@pytest.mark.parametrize("go_on", [0.0, 1.0])
def test_travellers_do_not_know_pauses_and_continue(traveller: GroundStation, go_on: float) -> None:
    assert traveller.command(PAUSE, go_on) == UNSUPPORTED
    assert moves(traveller) > 10.0


@pytest.mark.parametrize(("x", "z"), [(LARGEST, NAN), (NAN_AS_INTEGER, NAN), (0, 50.0)])
def test_travellers_deny_a_reposition_without_a_place_and_continue(
    traveller: GroundStation, x: int, z: float
) -> None:
    assert traveller.command_int(REPOSITION, 6, -1, 1, 0, NAN, x=x, y=x, z=z) == DENIED
    assert traveller.command(REPOSITION, -1, 1, 0, NAN, NAN, NAN, NAN) == UNSUPPORTED
    assert moves(traveller) > 10.0


# ArduCopter, AUTO.


def in_auto(*places: Message) -> GroundStation:
    station = flying(10.0)
    assert upload(station, [home(), *places]) == 0
    assert station.mode(AUTO) == ACCEPTED
    station.interval(42, 4.0)
    station.run(2.0)
    return station


def test_a_pause_in_auto_shows_in_mission_current_and_another_item_ends_it() -> None:
    station = in_auto(waypoint(100, 0), waypoint(100, 50))
    assert station.command(PAUSE, 0) == ACCEPTED
    station.run(6.0)
    current = station.last("MISSION_CURRENT")
    assert (current.seq, current.mission_state, current.mission_mode) == (1, 4, 1)
    station.send(mav.MAVLink_mission_set_current_message(1, 1, 2))
    assert moves(station) > 2.0
    assert station.last("MISSION_CURRENT").mission_state == 3
    assert station.command(PAUSE, 0) == ACCEPTED
    station.mode(GUIDED)
    station.run(0.5)
    assert station.last("MISSION_CURRENT").mission_state == 2


def test_clearing_all_types_is_unknown_to_ardupilot_wherever_it_is() -> None:
    station = in_auto(waypoint(100, 0))
    got = answer(station, mav.MAVLink_mission_clear_all_message(1, 1, 255))
    assert (got.type, got.mission_type) == (3, 255)
    station.mode(GUIDED)
    assert answer(station, mav.MAVLink_mission_clear_all_message(1, 1, 255)).type == 3
    assert answer(station, mav.MAVLink_mission_clear_all_message(1, 1, 0)).type == 0


def test_a_mission_is_cleared_in_auto_while_disarmed() -> None:
    station = copter().ready()
    assert upload(station, [home(), waypoint(20, 0)]) == 0
    assert station.mode(AUTO) == ACCEPTED
    assert answer(station, mav.MAVLink_mission_clear_all_message(1, 1, 0)).type == 0


def test_a_count_of_zero_in_auto_is_taken_and_the_leg_flown_to_its_end() -> None:
    station = in_auto(waypoint(100, 0), waypoint(100, 50))
    assert answer(station, mav.MAVLink_mission_count_message(1, 1, 0, 0)).type == 0
    assert "Auto mission changed but failed to restart command" in station.texts()
    assert moves(station) > 10.0
    current = station.last("MISSION_CURRENT")
    assert (current.total, current.mission_state, current.mission_mode) == (0, 1, 1)
    assert station.last("HEARTBEAT").custom_mode == AUTO


def test_a_mission_over_the_one_flown_is_flown_at_once_under_the_old_number() -> None:
    station = in_auto(waypoint(100, 0), waypoint(100, 50))
    begin_s = station.now_s
    assert upload(station, [home(), waypoint(-100, 0), waypoint(-100, 50)]) == 0
    assert "Auto mission changed, restarted command" in station.texts(begin_s)
    assert {m.seq for m in station.messages("MISSION_CURRENT", begin_s)} <= {1}
    station.run(6.0)
    assert station.velocity[0] < -1.0


def test_auto_without_a_mission_is_rejected_in_flight() -> None:
    station = flying(8.0)
    assert station.mode(AUTO) == mav.MAV_RESULT_FAILED
    assert "Mode change to AUTO failed: init failed" in station.texts()


# Two links of an ArduPilot.


def two_links(
    parameters: dict[str, float] | None = None,
) -> tuple[GroundStation, GroundStation]:
    """A companion computer (1/191) and a station (255/190), each on a link of its own."""
    station = copter(links=("gcs", "gcs"), parameters=parameters)
    companion = GroundStation(station.simulation, system=1, component=191)
    other = GroundStation(station.simulation, link=1)
    for each in (companion, other):
        each.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    companion.ready().take_off(8.0)
    other.read()
    return companion, other


def test_what_a_station_is_answered_goes_to_its_link_only() -> None:
    companion, station = two_links()
    begin_s = companion.now_s
    companion.run(0.1)
    assert station.command(PAUSE, 0) == ACCEPTED
    assert upload(station, [home(), waypoint(20, 0)]) == 0
    companion.run(1.0)
    station.read()
    for kind in ("COMMAND_ACK", "MISSION_REQUEST", "MISSION_ACK", "COMMAND_LONG"):
        assert not companion.messages(kind, begin_s + 0.01), kind
    assert station.last("MISSION_ACK").target_system == 255
    for each in (companion, station):
        assert "Flight plan received" in each.texts()


def test_each_link_has_its_own_sequence_without_gaps() -> None:
    companion, station = two_links()
    assert station.command(PAUSE, 0) == ACCEPTED
    companion.run(2.0)
    station.read()
    for each in (companion, station):
        own = [m.get_seq() for _, m in each.log if m.get_srcComponent() == 1]
        assert len(own) > 50
        assert all((b - a) % 256 == 1 for a, b in itertools.pairwise(own))


def test_heartbeats_and_set_mode_are_handed_on_to_the_other_link() -> None:
    companion, station = two_links()
    companion.log.clear()
    station.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    station.send(mav.MAVLink_set_mode_message(1, 1, BRAKE))
    companion.run(0.1)
    others = [m.get_type() for _, m in companion.log if m.get_srcSystem() == 255]
    assert others == ["HEARTBEAT", "SET_MODE"], "it names no component, and 1/191 is of the system"
    assert companion.last("HEARTBEAT").custom_mode == BRAKE
    assert not companion.messages("COMMAND_ACK")


def test_what_is_for_another_goes_to_the_link_where_that_one_was_heard() -> None:
    companion, station = two_links()
    companion.log.clear()
    station.send(mav.MAVLink_param_request_list_message(1, 191))
    station.send(mav.MAVLink_param_request_list_message(7, 1))
    companion.run(0.1)
    asked = companion.messages("PARAM_REQUEST_LIST")
    assert [(m.target_system, m.target_component) for m in asked] == [(1, 191)]


def test_nothing_from_a_private_port_is_handed_on_and_to_it_only_what_names_its_component() -> None:
    companion, station = two_links({"SERIAL1_OPTIONS": 1024.0})
    companion.log.clear()
    station.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    station.send(mav.MAVLink_param_request_list_message(1, 191))
    companion.send(mav.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
    companion.send(mav.MAVLink_param_request_list_message(255, 0))
    companion.send(mav.MAVLink_param_request_list_message(255, 190))
    companion.run(0.1)
    assert not [m for _, m in companion.log if m.get_srcSystem() == 255]
    station.read()
    others = [
        (m.get_type(), m.target_component) for _, m in station.log if m.get_srcComponent() == 191
    ]
    assert others == [("PARAM_REQUEST_LIST", 190)]
    assert station.command(PAUSE, 0) == ACCEPTED


# PX4.


def px4_mission() -> Px4Station:
    air = flying_px4(10.0)
    items = [plan_item(16, north, east, 10.0) for north, east in ((100, 0), (100, 60))]
    assert upload(air, items) == 0
    air.run(0.3)
    assert air.mode(px4.MISSION) == 0
    air.run(6.0)
    assert air.velocity[0] > 2.0
    return air


def test_a_reposition_without_place_and_height_stops_a_px4_and_its_mission_resumes() -> None:
    """As QGroundControl pauses."""
    air = px4_mission()
    assert air.command_results(REPOSITION, -1, 1, 0, NAN, NAN, NAN, NAN) == [0]
    assert air.custom_mode == px4.LOITER
    air.run(8.0)
    assert air.position[0] < 60.0
    assert math.hypot(*air.velocity) < 0.3
    assert air.mode(px4.MISSION) == 0
    air.run(4.0)
    assert air.velocity[0] > 2.0


def test_a_mission_is_not_started_in_the_air_before_it_is_judged() -> None:
    air = flying_px4(10.0)
    assert upload(air, [plan_item(16, 100, 0, 10.0), plan_item(16, 100, 60, 10.0)]) == 0
    assert air.mode(px4.MISSION) == 1
    air.run(0.3)
    assert air.mode(px4.MISSION) == 0


def test_a_reposition_with_a_height_alone_continues_to_the_place_of_the_item() -> None:
    air = px4_mission()
    height = air.last("GLOBAL_POSITION_INT").alt / 1000.0
    assert air.command_results(REPOSITION, -1, 1, 0, NAN, NAN, NAN, height) == [0]
    assert air.custom_mode == px4.LOITER
    air.run(30.0)
    assert air.position[0] == pytest.approx(100.0, abs=2.0)
    assert math.hypot(*air.velocity) < 0.5


def test_the_largest_integers_are_no_place_and_nan_as_an_integer_is_denied() -> None:
    air = px4_mission()
    place = NAN_AS_INTEGER
    assert air.command_int(REPOSITION, 0, -1, 1, 0, NAN, x=place, y=place, z=NAN) == DENIED
    assert air.custom_mode == px4.MISSION
    place = LARGEST
    assert air.command_int(REPOSITION, 0, -1, 1, 0, NAN, x=place, y=place, z=NAN) == ACCEPTED
    assert air.custom_mode == px4.LOITER


def test_px4_stays_in_hold_while_the_setpoints_continue() -> None:
    air = flying_px4(10.0)
    air.stream_to(2.0, 100.0, 0.0, -10.0)
    assert air.custom_mode == px4.OFFBOARD
    assert air.command_results(REPOSITION, -1, 1, 0, NAN, NAN, NAN, NAN) == [0]
    air.stream_to(8.0, 100.0, 0.0, -10.0)
    assert air.custom_mode == px4.LOITER
    assert math.hypot(*air.velocity) < 0.5
    assert air.command_results(PAUSE, 0) == [UNSUPPORTED]


def test_set_mode_gets_one_acknowledgement_and_is_handed_on() -> None:
    air = flying_px4(10.0)
    answers = air.send(mav.MAVLink_set_mode_message(1, 1, px4.LOITER))
    acks = [m for m in answers if m.get_type() == "COMMAND_ACK"]
    assert [(m.command, m.result) for m in acks] == [(mav.MAV_CMD_DO_SET_MODE, 0)]
