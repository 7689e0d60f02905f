"""Planes give way to intruders that would hit them, by ground truth, with both firmwares."""

from __future__ import annotations

import math

import pytest

from navigation_bridge.goals.requests import VelocityRequest
from navigation_bridge.tasks.velocity_commands import VelocityCommands
from navigation_core.tasks.inputs.velocity_command import VelocityCommand, VelocityFrame
from navigation_core.tasks.traffic.volumes import Separation
from tests.fleets.encounters import Intruder, adsb, apart, hear
from tests.fleets.plane_encounters import (
    GOAL_ENU_M,
    alone,
    fly,
    fly_up,
    meet_plane,
    random_plane_encounter,
    strays_m,
)

pytestmark = [pytest.mark.wide_but_first, pytest.mark.timeout(1200)]

ENCOUNTERS = {
    "head on": [Intruder(180.0, 20.0)],
    "head on, fast": [Intruder(180.0, 60.0)],
    "head on, near": [Intruder(180.0, 20.0, 6.0)],
    "head on, far": [Intruder(180.0, 30.0, 25.0)],
    "crossing from the left": [Intruder(270.0, 20.0)],
    "crossing from the right": [Intruder(90.0, 20.0)],
    "crossing slowly": [Intruder(270.0, 10.0)],
    "crossing fast": [Intruder(90.0, 60.0)],
    "crossing, near": [Intruder(90.0, 30.0, 6.0)],
    "crossing, far": [Intruder(270.0, 30.0, 25.0)],
    "overtaking": [Intruder(0.0, 40.0)],
    "overtaking fast": [Intruder(0.0, 60.0)],
    "overtaken": [Intruder(0.0, 10.0)],
    "climbing head on": [Intruder(180.0, 20.0, climb_m_s=3.0)],
    "descending across": [Intruder(90.0, 20.0, climb_m_s=-3.0)],
    "climbing below": [Intruder(0.0, 12.0, climb_m_s=2.0)],
    "turning": [Intruder(90.0, 20.0, turn_deg_s=5.0)],
    "from both sides": apart([Intruder(90.0, 20.0), Intruder(270.0, 20.0)]),
    "one after the other": apart([Intruder(180.0, 20.0, 10.0), Intruder(90.0, 40.0, 16.0)]),
    "standing": [Intruder(180.0, 0.0)],
}
"""Each would hit"""


@pytest.mark.night_but_first
@pytest.mark.parametrize("name", ENCOUNTERS)
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_plane_keeps_apart_from_intruders_and_arrives(autopilot: str, name: str) -> None:
    flown = meet_plane(autopilot, ENCOUNTERS[name])
    assert flown.share >= 1.0, flown.brief
    assert flown.code == "SUCCESS"
    assert "WAITING_FOR_TRAFFIC" in flown.statuses
    assert math.dist(flown.places[-1][:2], GOAL_ENU_M[:2]) < 160.0
    assert flown.lowest_m >= 19.0


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_plane_without_traffic_near_it_keeps_its_path(autopilot: str) -> None:
    fleet = fly_up(autopilot)
    far = Intruder(180.0, 20.0, passes_m=400.0)
    flown = fly(fleet, [(far, GOAL_ENU_M)])
    assert strays_m(flown, alone(autopilot)) < 0.5
    assert "WAITING_FOR_TRAFFIC" not in flown.statuses


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("course_deg", [90.0, 180.0])
def test_a_plane_that_circles_its_target_gives_way(autopilot: str, course_deg: float) -> None:
    flown = meet_plane(autopilot, [Intruder(course_deg, 25.0, 57.0)], arrival_dwell_s=40.0)
    assert flown.share >= 1.0, flown.brief
    assert flown.code == "SUCCESS"
    assert flown.statuses[-3:] == ("WAITING_FOR_TRAFFIC", "NAVIGATING", "SETTLING")


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_paused_plane_gives_way_and_returns(autopilot: str) -> None:
    fleet = fly_up(autopilot)
    (craft,) = fleet.crafts
    fleet.go(craft, *GOAL_ENU_M)
    fleet.run_for(6.0)
    assert craft.bridge.services.pause(fleet.now)[0]
    north, east, down = map(float, fleet.simulation.positions_ned_m[0])
    fleet.run_for(15.0)
    begun_s, least_m = fleet.now, math.inf

    def watch(now: float) -> None:
        # It follows the circle, and is where the plane would be after 14 s if it flew no circle.
        nonlocal least_m
        place = (east + 80.0, north + 25.0 * (now - begun_s - 14.0), -down)
        here = fleet.simulation.positions_ned_m[0]
        level_m = math.hypot(place[0] - here[1], place[1] - here[0])
        least_m = min(least_m, max(level_m, abs(place[2] + here[2])))
        if round((now - begun_s) / 0.02) % 50 == 0:
            hear(fleet, adsb(fleet, place, (0.0, 25.0, 0.0)))

    fleet.on_tick = watch
    fleet.run_for(30.0)
    fleet.on_tick = None
    fleet.run_for(40.0)
    assert least_m >= 20.0
    assert craft.statuses()[-1] == "PAUSED"
    here = fleet.simulation.positions_ned_m[0]
    assert math.hypot(here[0] - north, here[1] - east) < 160.0
    assert abs(float(here[2]) - down) < 8.0


@pytest.mark.night
@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_an_evasion_of_a_plane_stays_within_the_flight_volume(autopilot: str) -> None:
    flown = meet_plane(
        autopilot,
        [Intruder(180.0, 20.0)],
        volume_radius_m=800.0,
        volume_altitude_min_m=50.0,
        volume_altitude_max_m=80.0,
    )
    assert flown.share >= 1.0, flown.brief
    assert flown.code == "SUCCESS"
    assert max(place[2] for place in flown.places) <= 80.0
    assert max(math.hypot(place[0], place[1]) for place in flown.places) <= 800.0


@pytest.mark.night
@pytest.mark.wide
@pytest.mark.parametrize("seed", range(24))
def test_a_plane_keeps_apart_wherever_it_can(seed: int) -> None:
    autopilot = ("ardupilot", "px4")[seed % 2]
    flown = meet_plane(autopilot, random_plane_encounter(seed))
    assert flown.share >= 1.0, flown.brief
    assert flown.code in ("SUCCESS", "TRAFFIC")


@pytest.mark.night
@pytest.mark.wide
@pytest.mark.parametrize("course_deg", [180.0, 90.0, 0.0])
def test_a_plane_that_follows_a_course_gives_way_and_follows_it_again(course_deg: float) -> None:
    fleet = fly_up("ardupilot")
    (craft,) = fleet.crafts
    assert isinstance(fleet.send(craft, VelocityRequest(22.0)), str)
    begun_s, meets_s, least, kept = fleet.now, 30.0, math.inf, Separation()
    intruder = Intruder(90.0 + course_deg, 20.0, meets_s)
    meeting: list[tuple[float, float, float]] = []

    def watch(now: float) -> None:
        nonlocal least
        time_s = now - begun_s
        tick = round(time_s / 0.02)
        if tick % 5 == 0:
            command = VelocityCommand(now, VelocityFrame.MAP, (20.0, 0.0, 0.0))
            craft.bridge.feature(VelocityCommands).follow(command, "0" * 32, now)
        north, east, down = map(float, fleet.simulation.positions_ned_m[0])
        if time_s < 12.0:
            return
        if not meeting:
            # Where it would be on its course, by its speed.
            speed_m_s = float(fleet.simulation.truth.velocity_ned_m_s[0][1])
            meeting.append((east + speed_m_s * (meets_s - time_s), north, -down))
        place, velocity = intruder.at(meeting[0], time_s)
        level_m, upright_m = math.dist(place[:2], (east, north)), abs(place[2] + down)
        least = min(least, max(level_m / kept.horizontal_m, upright_m / kept.vertical_m))
        if tick % 50 == 0:
            hear(fleet, adsb(fleet, place, velocity))

    fleet.on_tick = watch
    fleet.run_for(60.0)
    fleet.on_tick = None
    assert least >= 1.0
    assert "WAITING_FOR_TRAFFIC" in craft.statuses()
    assert craft.statuses()[-1] == "NAVIGATING"
    north_m_s, east_m_s, _ = map(float, fleet.simulation.truth.velocity_ned_m_s[0])
    assert math.degrees(math.atan2(north_m_s, east_m_s)) == pytest.approx(0.0, abs=5.0)
