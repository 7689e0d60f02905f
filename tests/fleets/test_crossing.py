"""Fleets cross in the simulator: by ground truth nobody gets too near, and nobody is stuck."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Codec, make
from navigation_bridge.goals.requests import (
    LandRequest,
    NavigateRequest,
    OrbitRequest,
    ReturnRequest,
    TrajectoryRequest,
)
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.traffic.volumes import Separation
from navigation_core.trajectories.timed_point import TimedPoint
from tests.fleets.flown import FlownFleet, homes
from tests.fleets.points import arrived, fly_crossing, starts_and_targets

pytestmark = pytest.mark.timeout(900)
_QUICK = {"GUID_TIMEOUT": 1.0}


def on_a_circle(count: int, radius_m: float = 20.0) -> list[tuple[float, float]]:
    """Return places on a circle."""
    turns = [math.tau * index / count for index in range(count)]
    return [(radius_m * math.cos(turn), radius_m * math.sin(turn)) for turn in turns]


def copters(places: Sequence[tuple[float, float]]) -> list[VehicleConfig]:
    """Return copters that start there."""
    return [
        VehicleConfig(home=home, ready_after_s=1.0, parameters=_QUICK) for home in homes(places)
    ]


def cross(fleet: FlownFleet, places: Sequence[tuple[float, float]], height_m: float = 5.0) -> None:
    """Send all to the opposite side of the circle."""
    for craft, (east, north) in zip(fleet.crafts, places, strict=True):
        fleet.go(craft, -east - places[0][0], -north - places[0][1], height_m)


def codes(fleet: FlownFleet) -> list[str]:
    """Return how all goals have ended."""
    return [end.code.value for craft in fleet.crafts for _, end in craft.ends()]


@pytest.mark.wide
def test_four_copters_cross_through_one_point() -> None:
    places = on_a_circle(4)
    fleet = FlownFleet(copters(places)).ready()
    with fleet.holding():
        cross(fleet, places)
        fleet.run_to_end()
    assert codes(fleet) == ["SUCCESS"] * 4


@pytest.mark.wide
def test_without_separation_they_collide() -> None:
    # That the simulator would show it, and that the parameter switches it off.
    places = on_a_circle(2)
    fleet = FlownFleet(copters(places), separation="disabled").ready()
    cross(fleet, places)
    fleet.run_for(40.0)
    assert fleet.simulation.truth.collided.any()


@pytest.mark.parametrize("seed", [3, 4])
def test_crossings_of_the_core_keep_apart_and_arrive(seed: int) -> None:
    pairs = starts_and_targets(seed, 8, 60.0, 9.0)
    crossing = fly_crossing(pairs, Separation())
    assert crossing.least_share >= 1.0, crossing.worst
    assert arrived(crossing)


@pytest.mark.wide
def test_trajectories_towards_each_other_end_with_traffic_before_they_meet() -> None:
    fleet = FlownFleet(copters([(0.0, 0.0), (40.0, 0.0)]), traffic_timeout_s=10.0).ready()
    for craft, east in zip(fleet.crafts, (0.0, 40.0), strict=True):
        fleet.go(craft, east, 0.0, 5.0)
    fleet.run_to_end()
    with fleet.holding():
        for craft, way in zip(fleet.crafts, (1.0, -1.0), strict=True):
            pose = craft.bridge.pose
            assert pose is not None
            x, y, z = pose.position_enu_m
            points = tuple(
                TimedPoint(t, (x + way * 2.0 * t, y, z), (way * 2.0, 0.0, 0.0))
                for t in (0.0, 10.0, 20.0)
            )
            assert isinstance(fleet.send(craft, TrajectoryRequest("map", points)), str)
        fleet.run_to_end()
    assert "TRAFFIC" in codes(fleet), codes(fleet)
    assert "WAITING_FOR_TRAFFIC" in {s for craft in fleet.crafts for s in craft.statuses()}


def two_with_near_targets(conflict: str) -> tuple[FlownFleet, str | Rejection]:
    """Return two copters, the second of which was asked to go where the first goes."""
    fleet = FlownFleet(copters([(0.0, 0.0), (15.0, 0.0)]), traffic_conflict=conflict).ready()
    first, second = fleet.crafts
    fleet.go(first, 0.0, 15.0, 5.0)
    fleet.run_for(1.0)
    place = fleet.place(second, 1.0, 15.0, 5.0)
    return fleet, fleet.send(second, NavigateRequest("map", place, (0.0,) * 4, False, 0.0))


def test_a_target_of_another_is_rejected_with_its_name() -> None:
    _, sent = two_with_near_targets("reject")
    assert isinstance(sent, Rejection)
    assert sent.code.value == "TRAFFIC"
    assert "v00" in sent.message


@pytest.mark.wide
def test_a_target_of_another_is_moved_to_the_nearest_free_position() -> None:
    fleet, _ = two_with_near_targets("reroute")
    with fleet.holding():
        fleet.run_to_end()
    assert codes(fleet) == ["SUCCESS"] * 2
    assert "moved" in fleet.crafts[1].ends()[0][1].message


@pytest.mark.night
@pytest.mark.wide
def test_a_target_of_another_is_waited_for() -> None:
    fleet, _ = two_with_near_targets("wait")
    first, second = fleet.crafts
    with fleet.holding():
        fleet.run_until(lambda: bool(first.ends()), 60.0)
        fleet.run_until(lambda: "WAITING_FOR_TRAFFIC" in second.statuses(), 60.0)
        fleet.run_for(3.0)
        assert not second.ends()
        fleet.go(first, 0.0, -10.0, 5.0)
        fleet.run_to_end()
    assert codes(fleet) == ["SUCCESS"] * 3


@pytest.mark.night
@pytest.mark.wide
def test_a_circle_is_crossed_by_another_and_waits_for_who_stays_on_it() -> None:
    fleet = FlownFleet(copters([(0.0, -20.0), (30.0, 0.0)]), traffic_timeout_s=15.0).ready()
    first, second = fleet.crafts
    with fleet.holding():
        centre = fleet.place(first, 0.0, 0.0, 5.0)
        sent = fleet.send(first, OrbitRequest("map", centre, 12.0, 5.0, 2.0, 3.0))
        assert isinstance(sent, str)
        fleet.run_for(12.0)
        fleet.go(second, -30.0, 0.0, 5.0)
        fleet.run_to_end()
        assert codes(fleet) == ["SUCCESS"] * 2
        # The first stands where its circle ended, and the second comes the other way round.
        centre = fleet.place(second, 0.0, 0.0, 5.0)
        sent = fleet.send(second, OrbitRequest("map", centre, -12.0, 5.0, 1.0, 3.0))
        assert isinstance(sent, str)
        fleet.run_to_end()
    assert second.ends()[-1][1].code.value == "TRAFFIC"


@pytest.mark.night
@pytest.mark.wide
def test_a_lost_link_closes_the_volume_and_the_others_go_round() -> None:
    places = on_a_circle(4)
    fleet = FlownFleet(copters(places)).ready()
    with fleet.holding():
        cross(fleet, places)
        fleet.run_until(lambda: fleet.now > 18.0, 60.0)
        fleet.crafts[0].linked = False
        fleet.run_to_end(240.0)
    # The target of the third is where the first may land: it waits before it, and says so.
    assert codes(fleet) == ["LINK_LOST", "SUCCESS", "TRAFFIC", "SUCCESS"]
    assert "v00" in fleet.crafts[2].ends()[0][1].message


@pytest.mark.wide
def test_motors_that_fail_in_the_middle_hit_nobody() -> None:
    places = on_a_circle(4)
    fleet = FlownFleet(copters(places)).ready()
    with fleet.holding():
        cross(fleet, places)
        fleet.run_until(lambda: fleet.now > 18.0, 60.0)
        fleet.simulation.vehicles[1].weaken_motors(0.0)
        fleet.run_to_end(240.0)
    assert codes(fleet).count("SUCCESS") == 3


@pytest.mark.night
@pytest.mark.wide
def test_a_landing_waits_for_who_is_below_and_a_return_for_who_is_at_home() -> None:
    fleet = FlownFleet(copters([(0.0, 0.0), (20.0, 0.0)])).ready()
    above, below = fleet.crafts
    with fleet.holding():
        fleet.go(above, 0.0, 0.0, 12.0)
        fleet.run_to_end()
        fleet.go(below, 0.0, 0.0, 5.0)
        fleet.run_to_end()
        assert isinstance(fleet.send(above, LandRequest()), str)
        fleet.run_until(lambda: "WAITING_FOR_TRAFFIC" in above.statuses(), 20.0)
        assert above.bridge.vehicle.mode_name == "GUIDED"
        fleet.go(below, 20.0, 0.0, 5.0)
        fleet.run_to_end(200.0)
        assert isinstance(fleet.send(below, ReturnRequest()), str)
        fleet.run_to_end(200.0)
    assert codes(fleet) == ["SUCCESS"] * 5


@pytest.mark.night
@pytest.mark.wide
def test_a_return_waits_for_longer_than_the_longest_wait_of_other_goals() -> None:
    """It may be for an empty battery: no wait ends it."""
    places = [(0.0, 0.0), (12.0, 0.0)]
    fleet = FlownFleet(copters(places), traffic_timeout_s=5.0).ready()
    returns, hovers = fleet.crafts
    with fleet.holding():
        fleet.go(returns, 0.0, 12.0, 5.0)
        fleet.go(hovers, 0.0, 0.0, 5.0)
        fleet.run_to_end(60.0)
        assert isinstance(fleet.send(returns, ReturnRequest()), str)
        fleet.run_for(12.0)
        assert returns.statuses()[-1] == "WAITING_FOR_TRAFFIC", fleet.report()
        fleet.go(hovers, 12.0, 0.0, 5.0)
        fleet.run_until(lambda: returns.bridge.vehicle.mode_name == "RTL", 30.0)
    assert len(returns.ends()) == 1, fleet.report()


def test_others_seen_by_adsb_are_kept_clear_of() -> None:
    fleet = FlownFleet(copters([(0.0, 0.0)])).ready()
    (craft,) = fleet.crafts
    fleet.go(craft, 0.0, 0.0, 5.0)
    fleet.run_to_end()
    home = fleet.simulation.vehicles[0].frame.to_geodetic(0.0, 60.0, -5.0)
    hovers = make(
        "ADSB_VEHICLE", ICAO_address=0xABCDEF, lat=round(home.latitude_deg * 1e7),
        lon=round(home.longitude_deg * 1e7), altitude_type=1,
        altitude=round(home.altitude_amsl_m * 1e3), heading=0, hor_velocity=0, ver_velocity=0,
        callsign=b"HELI", emitter_type=7, tslc=0, flags=3, squawk=0,
    )  # fmt: skip
    sender = Codec(1, 156)

    def report(now: float) -> None:
        for message in Codec(1, 1).decode(sender.encode(hovers)):
            craft.bridge.receive(message, now)

    fleet.on_tick = report
    fleet.run_for(1.0)
    fleet.go(craft, 50.0, 0.0, 5.0)
    fleet.run_until(lambda: "WAITING_FOR_TRAFFIC" in craft.statuses(), 60.0)
    fleet.run_for(5.0)
    east_m = fleet.simulation.positions_ned_m[0][1]
    # Its position is taken to be wrong by up to 30 m.
    assert 15.0 < east_m < 60.0 - 30.0 - 5.0
