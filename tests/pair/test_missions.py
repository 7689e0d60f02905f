"""Routes as missions, stored in simulated vehicles and flown by them."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import LinkFaults, VehicleConfig
from mavlink_vehicle.codec import Codec, Message, make, mavlink, with_source
from navigation_bridge.goals.requests import AltitudeReference, WaypointRequest, WaypointsRequest
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.vehicle_pair import BAD_RADIO

pytestmark = pytest.mark.wide_but_first


Place = tuple[float, float, float]
SQUARE = [(12.0, 0.0, 3.0), (12.0, 12.0, 4.0), (0.0, 12.0, 3.0)]


def flight_of(autopilot: str, vehicle: str = "copter") -> SimulatedFlight:
    # A PX4 plane wants a landing in every mission, which a route does not have.
    own = {"MIS_TKO_LAND_REQ": 0.0} if (autopilot, vehicle) == ("px4", "plane") else {}
    simulated = VehicleConfig(
        autopilot=autopilot, vehicle=vehicle, ready_after_s=1.0, parameters=own
    )
    return SimulatedFlight(simulated=simulated, volume_radius_m=2000.0).ready()


def mission(*places: Place, radius_m: float = 2.0, **options: float) -> WaypointsRequest:
    waypoints = tuple(WaypointRequest(place, acceptance_radius_m=radius_m) for place in places)
    return WaypointsRequest(waypoints, by_mission=True, **options)  # type: ignore[arg-type]


def nearest(flight: SimulatedFlight, goal_id: str, places: list[Place]) -> list[float]:
    """Fly to the end; returns how near the truth came to each place, over the ground."""
    found = [math.inf] * len(places)
    for _ in range(12_000):
        if flight.ends(goal_id):
            return found
        flight.run_for(0.05)
        east, north, _ = flight.truth()[0]
        for index, place in enumerate(places):
            found[index] = min(found[index], math.hypot(east - place[0], north - place[1]))
    raise AssertionError(f"no end: {flight.outputs[-5:]}")


def said(flight: SimulatedFlight, goal_id: str) -> str:
    return flight.ends(goal_id)[0].message


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_copter_on_the_ground_takes_off_and_flies_its_mission_to_the_end(autopilot: str) -> None:
    flight = flight_of(autopilot)
    goal_id = flight.start(mission(*SQUARE))
    found = nearest(flight, goal_id, SQUARE)
    assert flight.ends(goal_id)[0].code.value == "SUCCESS", said(flight, goal_id)
    assert flight.ends(goal_id)[0].waypoints_reached == 3
    assert max(found) < 2.0
    statuses = list(dict.fromkeys(item.status.value for item in flight.feedback(goal_id)))
    assert statuses[0] in ("PREPARING", "UPLOADING")
    assert statuses[-1] == "NAVIGATING"
    assert {"UPLOADING", "ARMING", "TAKING_OFF"} <= set(statuses)
    counts = [item.route.current for item in flight.feedback(goal_id) if item.route is not None]
    assert counts == sorted(counts)
    flight.run_for(3.0)
    assert math.dist(flight.truth()[0], SQUARE[-1]) < 1.5
    assert flight.setpoint_times(0.0) == []


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_rover_drives_its_mission(autopilot: str) -> None:
    flight = flight_of(autopilot, "rover")
    places = [(15.0, 0.0, 0.0), (15.0, 15.0, 0.0)]
    goal_id = flight.start(mission(*places))
    found = nearest(flight, goal_id, places)
    assert flight.ends(goal_id)[0].code.value == "SUCCESS", said(flight, goal_id)
    assert max(found) < 3.0


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_plane_takes_off_flies_its_mission_and_circles_its_end(autopilot: str) -> None:
    flight = flight_of(autopilot, "plane")
    places = [(0.0, 400.0, 60.0), (300.0, 400.0, 60.0)]
    goal_id = flight.start(mission(*places, radius_m=60.0))
    found = nearest(flight, goal_id, places)
    assert flight.ends(goal_id)[0].code.value == "SUCCESS", said(flight, goal_id)
    assert "circles" in said(flight, goal_id)
    assert found[0] < 100.0
    flight.run_for(20.0)
    assert math.dist(flight.truth()[0][:2], places[-1][:2]) < 150.0


@pytest.mark.night
@pytest.mark.wide
def test_laps_stays_headings_and_speeds_are_items_of_the_mission() -> None:
    flight = flight_of("ardupilot")
    waypoints = (
        WaypointRequest((10.0, 0.0, 3.0), None, 1.5, hold_time_s=3.5, yaw_enu_rad=0.0),
        WaypointRequest((0.0, 0.0, 3.0), None, 1.5, max_speed_m_s=1.0),
    )
    goal_id = flight.start(WaypointsRequest(waypoints, True, laps=2))
    still_s, fastest_m_s = 0.0, 0.0
    while not flight.ends(goal_id):
        flight.run_for(0.05)
        (east, _, _), speed_m_s = flight.truth()
        still_s += 0.05 if speed_m_s < 0.2 and abs(east - 10.0) < 1.0 else 0.0
        route = flight.feedback(goal_id)[-1].route if flight.feedback(goal_id) else None
        if route is not None and route.current == 1 and 2.0 < east < 8.0:
            fastest_m_s = max(fastest_m_s, speed_m_s)
    assert flight.ends(goal_id)[0].code.value == "SUCCESS", said(flight, goal_id)
    assert flight.ends(goal_id)[0].waypoints_reached == 4
    assert still_s == pytest.approx(8.0, abs=3.0)
    assert 0.5 < fastest_m_s < 1.2
    commands = [m.command for _, m in flight.sent if m.get_type() == "MISSION_ITEM_INT"]
    assert mavlink.MAV_CMD_CONDITION_YAW in commands
    laps = {item.route.lap for item in flight.feedback(goal_id) if item.route is not None}
    assert laps == {0, 1}


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_pause_holds_and_continues_with_the_same_item(autopilot: str) -> None:
    flight = flight_of(autopilot)
    goal_id = flight.start(mission((30.0, 0.0, 3.0), (30.0, 10.0, 3.0)))
    flight.run_until(lambda: flight.truth()[0][0] > 8.0)
    flight.bridge.services.pause(flight.now)
    flight.run_for(6.0)
    assert flight.status(goal_id) == "PAUSED"
    assert flight.truth()[1] < 0.3
    assert flight.truth()[0][0] < 25.0
    flight.bridge.services.resume(flight.now)
    found = nearest(flight, goal_id, [(30.0, 0.0, 3.0)])
    assert flight.ends(goal_id)[0].code.value == "SUCCESS", said(flight, goal_id)
    assert found[0] < 2.0


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("status", ["UPLOADING", "ARMING", "TAKING_OFF"])
def test_a_pause_before_the_flight_begins_in_the_air(status: str, autopilot: str) -> None:
    """A vehicle that waits on the ground, armed, is disarmed by its autopilot."""
    flight = flight_of(autopilot)
    goal_id = flight.start(mission((30.0, 0.0, 3.0)))
    flight.run_to_status(goal_id, status)
    flight.bridge.services.pause(flight.now)
    flight.run_to_status(goal_id, "PAUSED")
    flight.run_for(15.0)
    east, _, up = flight.truth()[0]
    assert flight.status(goal_id) == "PAUSED"
    assert east < 3.0
    assert up > 1.5
    flight.bridge.services.resume(flight.now)
    assert flight.run_to_end(goal_id).code.value == "SUCCESS", said(flight, goal_id)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_cancel_holds_and_removes_the_mission(autopilot: str) -> None:
    flight = flight_of(autopilot)
    goal_id = flight.start(mission((30.0, 0.0, 3.0)))
    flight.run_until(lambda: flight.truth()[0][0] > 8.0)
    flight.bridge.goals.cancel(goal_id, flight.now)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "CANCELED", end.message
    assert flight.truth()[1] < 0.3
    state = flight.vehicle.state.mission
    assert state is not None
    assert state.total == 0


def test_a_cancel_before_the_flight_leaves_the_motors_off() -> None:
    flight = flight_of("ardupilot")
    goal_id = flight.start(mission(*SQUARE))
    flight.run_to_status(goal_id, "ARMING")
    flight.bridge.goals.cancel(goal_id, flight.now)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "CANCELED", end.message
    flight.run_for(3.0)
    assert not flight.vehicle.state.armed


@pytest.mark.parametrize(("autopilot", "mode"), [("ardupilot", "LOITER"), ("px4", "AUTO.LOITER")])
def test_a_pilots_mode_change_ends_the_goal(autopilot: str, mode: str) -> None:
    flight = flight_of(autopilot)
    goal_id = flight.start(mission((30.0, 0.0, 3.0)))
    flight.run_until(lambda: flight.truth()[0][0] > 8.0)
    flight.set_mode_as_pilot(mode)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "PILOT_OVERRIDE", end.message


def test_a_px4_that_will_not_fly_the_mission_says_why() -> None:
    flight = flight_of("px4")
    flight.simulation.vehicles[0].parameters.set("MIS_TKO_LAND_REQ", 2.0)
    end = flight.run_to_end(flight.start(mission(*SQUARE)))
    assert end.code.value == "MISSION_REFUSED", end.message
    assert "MIS_TKO_LAND_REQ" in end.message
    assert not flight.vehicle.state.armed


def tell_as_ground_station(flight: SimulatedFlight, *messages: Message) -> None:
    codec = Codec(255, 190)
    for message in messages:
        flight.simulation.link.write(codec.encode(message))


def test_a_mission_cleared_by_somebody_else_cancels_the_goal() -> None:
    flight = flight_of("px4")
    goal_id = flight.start(mission((30.0, 0.0, 3.0)))
    flight.run_until(lambda: flight.truth()[0][0] > 8.0)
    tell_as_ground_station(flight, make("MISSION_CLEAR_ALL", target_system=1, target_component=1))
    end = flight.run_to_end(goal_id)
    assert end.code.value == "CANCELED", end.message
    assert "removed" in end.message


def test_a_mission_cut_short_by_somebody_else_cancels_the_goal() -> None:
    """An ArduPilot cuts the stored mission at the length of an upload that has only begun."""
    flight = flight_of("ardupilot")
    goal_id = flight.start(mission((30.0, 0.0, 3.0), (30.0, 9.0, 3.0)))
    flight.run_until(lambda: flight.truth()[0][0] > 8.0)
    count = make("MISSION_COUNT", target_system=1, target_component=1, count=2)
    tell_as_ground_station(flight, count)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "CANCELED", end.message


def test_an_item_that_somebody_else_replaces_in_flight_cancels_the_goal() -> None:
    """The number of items stays the same; only a text of the ArduPilot reports it."""
    flight = flight_of("ardupilot")
    goal_id = flight.start(mission((30.0, 0.0, 3.0), (30.0, 9.0, 3.0)))
    flight.run_until(lambda: flight.truth()[0][0] > 8.0)
    items = [m for _, m in flight.sent if m.get_type() == "MISSION_ITEM_INT"]
    target = {"target_system": 1, "target_component": 1}
    tell_as_ground_station(flight, make("MISSION_COUNT", **target, count=len(items)))
    for item in items:
        flight.run_for(0.3)
        fields = {name: getattr(item, name) for name in item.get_fieldnames()}
        tell_as_ground_station(flight, make("MISSION_ITEM_INT", **fields))
    end = flight.run_to_end(goal_id)
    assert end.code.value == "CANCELED", end.message
    assert "Auto mission changed" in end.message


def test_a_skipped_waypoint_is_named_and_no_success() -> None:
    flight = flight_of("ardupilot")
    goal_id = flight.start(mission((20.0, 0.0, 3.0), (20.0, 20.0, 3.0), (0.0, 20.0, 3.0)))
    flight.run_until(lambda: flight.truth()[0][0] > 5.0)
    seq = len([m for _, m in flight.sent if m.get_type() == "MISSION_ITEM_INT"]) - 1
    skip = make("MISSION_SET_CURRENT", target_system=1, target_component=1, seq=seq)
    tell_as_ground_station(flight, skip)
    end = flight.run_to_end(goal_id)
    assert end.code.value == "WAYPOINT_MISSED", end.message
    assert end.waypoints_reached == 1
    assert end.waypoints_missed == (0, 1)
    assert "1, 2" in end.message


def test_a_flying_goal_is_replaced_by_a_mission_and_a_mission_by_another_goal() -> None:
    for autopilot in ("ardupilot", "px4"):
        flight = flight_of(autopilot)
        first = flight.send(30.0, 0.0, 3.0)
        flight.run_until(lambda flight=flight: flight.truth()[0][0] > 8.0)  # type: ignore[misc]
        second = flight.start(mission((10.0, 20.0, 3.0), (0.0, 20.0, 3.0)))
        flight.run_until(lambda flight=flight: flight.truth()[0][1] > 8.0)  # type: ignore[misc]
        third = flight.send(0.0, 0.0, 4.0)
        assert flight.run_to_end(third).code.value == "SUCCESS", said(flight, third)
        assert [flight.ends(goal)[0].code.value for goal in (first, second)] == ["PREEMPTED"] * 2


@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("faults", [BAD_RADIO, LinkFaults(loss=0.4)], ids=["bad", "loss"])
def test_a_mission_on_a_bad_link_is_flown_to_its_end(autopilot: str, faults: LinkFaults) -> None:
    simulated = VehicleConfig(autopilot=autopilot, ready_after_s=1.0, faults=faults)
    flight = SimulatedFlight(simulated=simulated).ready()
    goal_id = flight.start(mission(*SQUARE))
    end = flight.run_to_end(goal_id, 240.0)
    assert end.code.value == "SUCCESS", end.message
    assert end.waypoints_reached == 3


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("status", ["UPLOADING", "ARMING", "NAVIGATING"])
def test_a_silence_of_three_seconds_ends_no_mission(autopilot: str, status: str) -> None:
    flight = flight_of(autopilot)
    goal_id = flight.start(mission(*SQUARE))
    flight.run_to_status(goal_id, status)
    flight.link_up = False
    flight.run_for(3.0)
    flight.link_up = True
    end = flight.run_to_end(goal_id)
    assert end.code.value == "SUCCESS", end.message


def test_a_lost_link_ends_the_goal_and_the_vehicle_flies_on_by_itself() -> None:
    flight = flight_of("ardupilot")
    goal_id = flight.start(mission(*SQUARE))
    flight.run_to_status(goal_id, "NAVIGATING")
    flight.link_up = False
    end = flight.run_to_end(goal_id)
    assert end.code.value == "LINK_LOST", end.message
    flight.run_for(30.0)
    assert math.dist(flight.truth()[0], SQUARE[-1]) < 1.5


def test_heights_above_ground_need_a_vehicle_that_follows_terrain() -> None:
    place = WaypointRequest((-35.3632, 149.1653, 5.0), AltitudeReference.GROUND)
    # The simulated ArduPilot has no terrain data either, and says nothing of it.
    for autopilot, by_mission in (
        ("px4", True), ("px4", False), ("ardupilot", False), ("ardupilot", True),
    ):  # fmt: skip
        rejection = flight_of(autopilot).check(WaypointsRequest((place,), by_mission))
        assert rejection is not None
        assert rejection.code.value == "INVALID_WAYPOINTS"
        assert "Waypoint 1" in rejection.message


@pytest.mark.parametrize(
    ("loaded", "pending", "ready"), [(64, 0, True), (64, 8, False), (0, 0, False)]
)
def test_heights_above_ground_are_taken_once_the_terrain_is_there(
    loaded: int, pending: int, ready: bool
) -> None:
    flight = flight_of("ardupilot")
    report = make("TERRAIN_REPORT", spacing=100, loaded=loaded, pending=pending)
    flight.bridge.receive(with_source(report, 1, 1), flight.now)
    place = WaypointRequest((-35.3632, 149.1653, 5.0), AltitudeReference.GROUND)
    rejection = flight.check(WaypointsRequest((place,), by_mission=True))
    assert (rejection is None) == ready, rejection


def test_a_plane_circles_the_end_so_it_must_be_high_enough() -> None:
    rejection = flight_of("ardupilot", "plane").check(mission((0.0, 300.0, 60.0), (0.0, 0.0, 3.0)))
    assert rejection is not None
    assert rejection.code.value == "UNSUPPORTED_VEHICLE"
    assert "Waypoint 2 is 3.0 m above the ground" in rejection.message


def test_more_waypoints_than_a_vehicle_stores_are_rejected() -> None:
    rejection = flight_of("ardupilot").check(mission(*SQUARE, laps=400))
    assert rejection is not None
    assert "1200 waypoints" in rejection.message
