"""Situations: short scenarios in which one thing happens to one vehicle, and nothing else.

A drawn scenario seldom has these coincide, so they are arranged here, with details from the seed:
a link that never returns, a path that stays blocked, a position that has jumped for good.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from tests.explore.releases import RELEASES
from tests.explore.scenario import Craft, Event, Post, Scenario

SITUATIONS_FROM = 2**41
"""Seeds from here on are situations."""

TRAJECTORIES_FROM = SITUATIONS_FROM + 2**30
"""Seeds from here on are situations in which trajectories of another program are flown."""

_HOMES = (
    (-35.363261, 149.165230, 584.0),
    (47.397742, 8.545594, 488.0),
    (69.65, 18.95, 3.0),
    (21.3, 179.9995, 5.0),
)


class Stage:
    """The scenario of a situation, as it is arranged.

    Attributes:
        rng: draws the details.
        craft: the vehicle.
        events: all that happens.
        posts: all that stands around.
    """

    def __init__(self, seed: int) -> None:
        """Begin with a copter that nothing happens to."""
        self.rng = random.Random(seed)
        autopilot = self.rng.choice(("ardupilot", "px4"))
        firmware = self.rng.choice(("", *RELEASES[autopilot]))
        home = self.rng.choice(_HOMES)
        self.craft = Craft("copter", autopilot, home, firmware=firmware)
        self.events: list[Event] = []
        self.posts: list[Post] = []

    def add(self, time_s: float, what: str, **how: Any) -> None:
        """Let something happen."""
        self.events.append(Event(round(time_s, 2), 0, what, how))

    def end(self, time_s: float) -> None:
        """Let all that is wrong last until then: a client resumes what nobody paused."""
        self.add(time_s, "resume")

    def serve(self, **server: Any) -> None:
        """Give the server parameters."""
        self.craft = replace(self.craft, server=server)

    def fit(self, **onboard: float) -> None:
        """Give the autopilot parameters."""
        self.craft = replace(self.craft, onboard=onboard)

    def drive(self) -> None:
        """Let it be a rover."""
        self.craft = replace(self.craft, kind="rover")

    def away(self, distance_m: float, height_m: float = 5.0) -> list[float]:
        """Return a place at a distance from home, anywhere around it."""
        angle = self.rng.uniform(-math.pi, math.pi)
        height_m = 0.0 if self.craft.kind in ("rover", "boat") else height_m
        east_m, north_m = distance_m * math.cos(angle), distance_m * math.sin(angle)
        return [round(east_m, 1), round(north_m, 1), height_m]

    def wall(
        self, along: tuple[float, float], away_m: float, half: int, radius_m: float = 1.2
    ) -> None:
        """Let posts stand across a direction from home, that many on both sides of a middle one."""
        for i in range(-half, half + 1):
            at = [
                away_m * a + 2.2 * i * b for a, b in zip(along, (-along[1], along[0]), strict=True)
            ]
            self.posts.append(Post((round(at[0], 1), round(at[1], 1)), radius_m, 20.0))

    def soon(self) -> float:
        """A time at which a copter is on its way to what is far."""
        return self.rng.uniform(11.0, 17.0)


Situation = Callable[[Stage], None]
"""Arranges what happens on a stage"""


def _a_link_that_stays_silent(stage: Stage) -> None:
    stage.serve(link_lost_abort_s=4.0)
    stage.add(0.0, "navigate", place=stage.away(90.0))
    begun_s = stage.soon()
    stage.add(begun_s, "silence", on=True, mute=stage.rng.random() < 0.3)
    stage.end(begun_s + 25.0)


def _a_target_beyond_the_fence(stage: Stage) -> None:
    if stage.craft.autopilot == "px4":
        stage.fit(GF_ACTION=stage.rng.choice((1.0, 2.0)), GF_MAX_HOR_DIST=30.0)
    else:
        stage.fit(FENCE_ENABLE=1.0, FENCE_RADIUS=30.0)
    stage.add(0.0, "navigate", place=stage.away(8.0))
    stage.add(30.0, "navigate", place=stage.away(stage.rng.uniform(34.0, 50.0)))
    stage.add(45.0, "go_home")


def _a_position_that_jumps_for_good(stage: Stage) -> None:
    stage.add(0.0, "navigate", place=stage.away(8.0))
    north, east, _ = stage.away(stage.rng.choice((8.0, 20.0, 40.0)))
    stage.add(20.0, "glitch", offset=[north, east, 0.0])
    stage.add(100.0, "navigate", place=stage.away(15.0))
    stage.end(150.0)


def _a_wind_that_carries_away(stage: Stage) -> None:
    stage.serve(volume_radius_m=60.0)
    stage.add(0.0, "navigate", place=[0.0, 50.0, 5.0])
    stage.add(20.0, "wind", velocity=[stage.rng.uniform(14.0, 18.0), 0.0, 0.0])
    stage.end(70.0)


def _a_target_beyond_the_volume(stage: Stage) -> None:
    stage.serve(volume_radius_m=60.0, battery_policy="ignore")
    stage.add(0.0, "navigate", place=stage.away(stage.rng.uniform(62.0, 100.0)))


def _arming_that_is_never_allowed(stage: Stage) -> None:
    stage.serve(arming="never")
    stage.add(1.0, "serve", service="arm", mode="")
    stage.add(8.0, stage.rng.choice(("takeoff", "land")))


def _a_pause_of_a_ground_station(stage: Stage) -> None:
    stage.serve(on_station_pause="pause")
    stage.add(0.0, "navigate", place=stage.away(90.0))
    begun_s = stage.soon()
    stage.add(begun_s, "station_pause", go_on=False, seen=True)
    stage.add(begun_s + 8.0, "station_pause", go_on=True, seen=True)
    stage.end(begun_s + 30.0)


def _a_target_that_is_walled_in(stage: Stage) -> None:
    stage.serve(blocked_timeout_s=5.0)
    east, north, up = stage.away(25.0)
    stage.posts = [
        Post((round(east + 8.0 * math.cos(a), 1), round(north + 8.0 * math.sin(a), 1)), 1.2, 20.0)
        for a in (math.tau * i / 26 for i in range(26))
    ]
    stage.add(0.0, "navigate", place=[east, north, up], avoid=True)
    stage.end(90.0)


def _a_sensor_that_falls_silent(stage: Stage) -> None:
    stage.posts = [Post((stage.rng.uniform(-40.0, 40.0), stage.rng.uniform(15.0, 40.0)), 1.0, 20.0)]
    place = stage.away(80.0)
    stage.add(0.0, "navigate", place=place, avoid=True, speed=stage.rng.choice((2.0, 4.0)))
    begun_s = stage.soon()
    stage.add(begun_s, "blind", on=True)
    stage.end(begun_s + 15.0)


def _a_wood(stage: Stage) -> None:
    place = stage.away(60.0)
    for _ in range(25):
        at = (round(stage.rng.uniform(-50.0, 50.0), 1), round(stage.rng.uniform(-50.0, 50.0), 1))
        if math.hypot(*at) > 6.0 and math.dist(at, place[:2]) > 6.0:
            stage.posts.append(Post(at, round(stage.rng.uniform(0.4, 2.0), 1), 20.0))
    stage.add(0.0, "navigate", place=place, avoid=True, speed=stage.rng.choice((0.0, 3.0, 6.0)))


def _a_wall_across_the_line(stage: Stage) -> None:
    east, north, up = stage.away(50.0)  # so low, a scanner that is tilted sees the ground
    stage.wall((east / 50.0, north / 50.0), 25.0, 6)
    stage.add(0.0, "navigate", place=[east, north, up], avoid=True, speed=6.0)


def _a_long_mission(stage: Stage) -> None:
    places = [stage.away(70.0), stage.away(70.0)]
    stage.add(0.0, "route", places=places, speed=2.0, mission=True, hold_s=2.0)


def _a_mission_of_short_legs(stage: Stage) -> None:
    if stage.rng.random() < 0.3:
        stage.drive()
    places = [stage.away(stage.rng.uniform(12.0, 18.0)) for _ in range(4)]
    stage.add(0.0, "route", places=places, mission=True, laps=stage.rng.choice((0, 0, 2)))


def _a_mission_that_is_paused(stage: Stage) -> None:
    places = [stage.away(40.0) for _ in range(3)]
    stage.add(0.0, "route", places=places, mission=True)
    begun_s = stage.soon()
    stage.add(begun_s, "pause")
    stage.add(begun_s + 12.0, "resume")
    stage.end(begun_s + 60.0)


def _a_mission_that_is_disarmed(stage: Stage) -> None:
    stage.craft = replace(stage.craft, autopilot="ardupilot", firmware="")
    stage.drive()
    stage.add(0.0, "route", places=[stage.away(40.0) for _ in range(3)], mission=True)
    begun_s = stage.soon()
    stage.add(begun_s, "station_arm", arm=False, seen=stage.rng.random() < 0.5)
    stage.end(begun_s + 15.0)


def _a_drive_home(stage: Stage) -> None:
    stage.drive()
    stage.add(0.0, "navigate", place=stage.away(25.0))
    stage.add(40.0, "go_home")


def _a_target_beside_the_vehicle(stage: Stage) -> None:
    stage.add(0.0, "navigate", place=stage.away(25.0))
    ahead = [stage.rng.uniform(6.0, 12.0), stage.rng.choice((-1.0, 1.0)) * 6.0, 3.0]
    stage.add(40.0, "navigate", place=ahead, frame="base_link")


def _a_service_that_is_not_heard(stage: Stage) -> None:
    stage.add(1.5, "full", on=True)
    stage.add(2.0, "serve", service="arm", mode="")
    over_s = stage.rng.choice((0.8, 1.2, 60.0))
    stage.add(2.0 + over_s, "full", on=False)


def _a_stranger_on_the_link(stage: Stage) -> None:
    stage.add(0.0, "navigate", place=stage.away(60.0))
    stage.add(6.0, "stranger", seed=stage.rng.randrange(1000), seconds=25.0)


def _positions_that_cease(stage: Stage) -> None:
    stage.add(0.0, "navigate", place=stage.away(90.0), speed=stage.rng.choice((3.0, 6.0)))
    begun_s = stage.soon()
    stage.add(begun_s, "unlocated", on=True)
    stage.end(begun_s + 15.0)


def _a_course_out_of_the_volume(stage: Stage) -> None:
    stage.craft = replace(stage.craft, kind="plane", autopilot="ardupilot", firmware="")
    stage.serve(volume_radius_m=700.0)
    stage.add(0.0, "navigate", place=[250.0, 0.0, 60.0])
    angle = stage.rng.uniform(-1.0, 1.0)
    linear = [20.0 * math.cos(angle), 20.0 * math.sin(angle), 0.0]
    stage.add(60.0, "steer", linear=linear, rate=0.0, seconds=60.0)
    stage.end(125.0)


def _a_takeoff_alone(stage: Stage) -> None:
    stage.add(0.0, "takeoff", height=stage.rng.choice((2.0, 5.0, 10.0)))


def _a_goal_that_ends_under_way(stage: Stage) -> None:
    velocity = [stage.rng.choice((-2.0, 2.0)), 0.0, 0.0]
    stage.add(0.0, "takeoff", height=6.0)
    stage.add(
        15.0, "follow", start=stage.away(10.0), velocity=velocity, offset=[0.0, 6.0, 4.0],
        duration=20.0, stands_s=60.0, speed=5.0,
    )  # fmt: skip
    stage.end(75.0)


def _a_pilot_who_takes_over(stage: Stage) -> None:
    stage.add(0.0, "navigate", place=stage.away(90.0))
    begun_s = stage.soon()
    mode = "LOITER" if stage.craft.autopilot == "ardupilot" else "AUTO.LOITER"
    stage.add(begun_s, "pilot_mode", mode=mode)
    stage.end(begun_s + 20.0)


def _line(start: list[float], velocity: list[float], duration_s: float) -> list[list[float]]:
    """Return points of a steady motion, which ends in motion."""
    return [
        [t, *(round(a + t * b, 3) for a, b in zip(start, velocity, strict=True)), *velocity]
        for t in (0.0, round(0.5 * duration_s, 3), round(duration_s, 3))
    ]


def _a_trajectory_to_the_bound(stage: Stage) -> None:
    stage.serve(volume_radius_m=30.0)
    stage.add(0.0, "takeoff", height=6.0)
    x, y, _ = stage.away(3.0)
    ends_m = stage.rng.choice((20.0, 28.5, 29.5))
    stage.add(20.0, "trajectory", points=_line([0.0] * 3, [x, y, 0.0], ends_m / 3.0))
    stage.end(60.0)


def _a_trajectory_that_is_replaced(stage: Stage) -> None:
    stage.add(0.0, "takeoff", height=6.0)
    x, y, _ = stage.away(2.0)
    stage.add(20.0, "trajectory", points=_line([0.0] * 3, [x, y, 0.0], 20.0))
    for number in range(3):
        aside = [-0.4 * y, 0.4 * x, 0.0]
        points = _line(aside, [x, y, 0.0], 8.0)
        stage.add(25.0 + 3.0 * number + stage.rng.random(), "trajectory", points=points, topic=True)
    stage.end(70.0)


def _a_trajectory_that_climbs(stage: Stage) -> None:
    stage.add(0.0, "takeoff", height=6.0)
    climb_m_s = stage.rng.choice((0.8, 5.0, 7.0))
    stage.add(20.0, "trajectory", points=_line([0.0] * 3, [0.5, 0.0, climb_m_s], 8.0))
    stage.end(60.0)


def _a_trajectory_from_elsewhere(stage: Stage) -> None:
    stage.add(0.0, "takeoff", height=6.0)
    start = stage.away(stage.rng.choice((0.5, 3.0, 9.0)), 0.0)
    stage.add(20.0, "trajectory", points=_line(start, [1.0, 0.0, 0.0], 8.0))
    stage.end(60.0)


_OF_TRAJECTORIES: tuple[Situation, ...] = (
    *(_a_trajectory_to_the_bound, _a_trajectory_that_is_replaced, _a_trajectory_that_climbs),
    _a_trajectory_from_elsewhere,
)

_SITUATIONS: tuple[Situation, ...] = (
    *(_a_link_that_stays_silent, _a_target_beyond_the_fence, _a_position_that_jumps_for_good),
    *(_a_wind_that_carries_away, _a_target_beyond_the_volume, _arming_that_is_never_allowed),
    *(_a_pause_of_a_ground_station, _a_target_that_is_walled_in, _a_sensor_that_falls_silent),
    *(_a_wood, _a_wall_across_the_line, _a_long_mission, _a_mission_of_short_legs),
    *(_a_mission_that_is_paused, _a_mission_that_is_disarmed, _a_drive_home),
    *(_a_target_beside_the_vehicle, _a_service_that_is_not_heard, _a_stranger_on_the_link),
    *(_positions_that_cease, _a_course_out_of_the_volume, _a_takeoff_alone),
    *(_a_goal_that_ends_under_way, _a_pilot_who_takes_over),
)


def situation_of(seed: int) -> Situation:
    """Return the situation of a seed: they take turns."""
    situations = _SITUATIONS if seed < TRAJECTORIES_FROM else _OF_TRAJECTORIES
    return situations[seed % len(situations)]


def write_situation(seed: int) -> Scenario:
    """Make the scenario of a seed from SITUATIONS_FROM on."""
    return staged(seed, situation_of(seed))


def staged(seed: int, situation: Situation) -> Scenario:
    """Make the scenario of a seed in which a situation is arranged."""
    stage = Stage(seed)
    situation(stage)
    return Scenario(seed, (stage.craft,), tuple(stage.events), tuple(stage.posts))
