"""More situations, with seeds of their own: commands, other aircraft, sent fences, sensors of ROS.

They are arranged as those of `situations`; somebody steers copters, rovers, boats and planes.
"""

from __future__ import annotations

import math
from dataclasses import replace

from tests.explore.aimed_situations import AIMED
from tests.explore.scenario import Post, Scenario
from tests.explore.situations import Situation, Stage, staged

MORE_SITUATIONS_FROM = 2**42
"""Seeds from here on are situations of this module"""

_BAD_NUMBERS = (math.nan, math.inf, -math.inf, 1e9, -1e9, 1e-300)
# Beyond the limits of all vehicles, too.
_SPEEDS_M_S = (0.5, 1.5, 3.0, 8.0, 40.0)


def _become(stage: Stage, *kinds: str) -> str:
    """Let the vehicle be of one of some kinds; return which."""
    kind = stage.rng.choice(kinds)
    # A PX4 plane takes no commands.
    autopilot = "ardupilot" if kind in ("boat", "plane") else stage.craft.autopilot
    firmware = stage.craft.firmware if kind == "copter" else ""
    stage.craft = replace(stage.craft, kind=kind, autopilot=autopilot, firmware=firmware)
    return kind


def _under_way(stage: Stage) -> float:
    """Let the vehicle be in the air, or armed on the ground; return a time at which it is."""
    if stage.craft.kind == "copter":
        stage.add(0.0, "takeoff", height=5.0)
        return stage.rng.uniform(14.0, 18.0)
    if stage.craft.kind == "plane":
        stage.add(0.0, "navigate", place=[250.0, 0.0, 60.0])
        return stage.rng.uniform(60.0, 70.0)
    stage.add(0.0, "navigate", place=stage.away(6.0))
    return stage.rng.uniform(20.0, 25.0)


def _speed_m_s(stage: Stage) -> float:
    if stage.craft.kind == "plane":
        return stage.rng.choice((15.0, 20.0, 25.0, 90.0))
    return stage.rng.choice(_SPEEDS_M_S)


def _linear(stage: Stage, course_rad: float, up_m_s: float = 0.0) -> list[float]:
    speed_m_s = _speed_m_s(stage)
    east, north = speed_m_s * math.cos(course_rad), speed_m_s * math.sin(course_rad)
    return [round(east, 2), round(north, 2), up_m_s]


def _course_rad(stage: Stage) -> float:
    return stage.rng.uniform(-math.pi, math.pi)


def _steer(stage: Stage, time_s: float, linear: list[float], seconds: float) -> None:
    """Begin to steer along axes of the map; the goal is asked for."""
    stage.add(time_s, "steer", linear=linear, rate=0.0, seconds=seconds)


def _commands_that_cease(stage: Stage) -> None:
    _become(stage, "copter", "copter", "rover", "boat", "plane")
    begun_s = _under_way(stage)
    frame = stage.rng.choice(("map", "base_link"))
    up_m_s = stage.rng.choice((0.0, 0.0, 1.0, -0.5))
    forward = stage.rng.choice((1.0, 1.0, -1.0)) * _speed_m_s(stage)
    linear = [forward, 0.0, up_m_s]
    if frame == "map":
        linear = _linear(stage, _course_rad(stage), up_m_s)
    rate = stage.rng.choice((0.0, 0.3, -1.0, 6.0))
    seconds = stage.rng.choice((0.3, 3.0, 8.0))
    stage.add(begun_s, "steer", linear=linear, rate=rate, seconds=seconds, frame=frame)
    stage.end(begun_s + seconds + 25.0)


def _commands_towards_posts(stage: Stage) -> None:
    _become(stage, "copter", "copter", "rover")
    course = _course_rad(stage)
    along = (math.cos(course), math.sin(course))
    stage.wall(along, stage.rng.choice((12.0, 20.0, 35.0)), 4, radius_m=1.0)
    begun_s = 16.0
    if stage.craft.kind == "copter":
        stage.add(0.0, "takeoff", height=4.0)
    else:
        stage.add(0.0, "navigate", place=[round(2.0 * along[0], 1), round(2.0 * along[1], 1), 0.0])
    _steer(stage, begun_s, _linear(stage, course), 25.0)
    stage.end(begun_s + 35.0)


def _commands_out_of_the_volume(stage: Stage) -> None:
    is_plane = _become(stage, "copter", "copter", "rover", "boat", "plane") == "plane"
    radius_m = 700.0 if is_plane else 30.0
    stage.serve(volume_radius_m=radius_m, battery_policy="ignore")
    begun_s = _under_way(stage)
    course = 0.3 * _course_rad(stage) if is_plane else _course_rad(stage)
    _steer(stage, begun_s, _linear(stage, course), 40.0)
    # Back again, and on.
    _steer(stage, begun_s + 45.0, _linear(stage, course + math.pi), 10.0)
    stage.end(begun_s + 75.0)


def _commands_up_and_down(stage: Stage) -> None:
    is_plane = _become(stage, "copter", "copter", "plane") == "plane"
    ceiling_m = 100.0 if is_plane else 12.0
    stage.serve(volume_altitude_max_m=ceiling_m)
    begun_s = _under_way(stage)
    level = _linear(stage, _course_rad(stage))[:2] if is_plane else [0.0, 0.0]
    first = stage.rng.choice((1.0, -1.0))
    _steer(stage, begun_s, [*level, 5.0 * first], 20.0)
    _steer(stage, begun_s + 22.0, [*level, -5.0 * first], 40.0)
    stage.end(begun_s + 75.0)


def _commands_towards_the_fence(stage: Stage) -> None:
    _become(stage, "copter")
    if stage.craft.autopilot == "px4":
        stage.fit(GF_ACTION=stage.rng.choice((1.0, 2.0)), GF_MAX_HOR_DIST=30.0)
    else:
        stage.fit(FENCE_ENABLE=1.0, FENCE_RADIUS=30.0)
    begun_s = _under_way(stage)
    _steer(stage, begun_s, _linear(stage, _course_rad(stage)), 45.0)
    stage.end(begun_s + 60.0)


def _commands_that_are_wrong(stage: Stage) -> None:
    _become(stage, "copter", "copter", "rover", "plane")
    begun_s = _under_way(stage)
    course, asks = _course_rad(stage), True
    for number in range(5):
        linear = _linear(stage, course)
        if number % 2:
            linear[stage.rng.randrange(3)] = stage.rng.choice(_BAD_NUMBERS)
        rate = stage.rng.choice((0.0, 0.0, *_BAD_NUMBERS)) if number % 2 else 0.0
        at_s = begun_s + 2.0 * number
        stage.add(at_s, "steer", linear=linear, rate=rate, seconds=2.0, asks=asks)
        asks = False
    stage.end(begun_s + 35.0)


def _commands_that_start_a_goal(stage: Stage) -> None:
    _become(stage, "copter", "copter", "rover", "plane")
    stage.serve(cmd_vel_start="command")
    begun_s = _under_way(stage)
    linear = _linear(stage, _course_rad(stage))
    if stage.rng.random() < 0.5:
        stage.add(begun_s - 1.0, "steer", linear=[0.0] * 3, rate=0.0, seconds=0.9, asks=False)
    stage.add(begun_s, "steer", linear=linear, rate=0.0, seconds=6.0, asks=False)
    if stage.rng.random() < 0.5:
        stage.add(begun_s + 3.0, stage.rng.choice(("cancel", "land", "go_home", "pause")))
    stage.end(begun_s + 40.0)


def _commands_that_goals_take_over(stage: Stage) -> None:
    kind = _become(stage, "copter", "copter", "rover", "plane")
    begun_s = _under_way(stage)
    _steer(stage, begun_s, _linear(stage, _course_rad(stage)), 30.0)
    what = stage.rng.choice(("navigate", "go_home", "hold", "cancel", "pause"))
    at_s = begun_s + stage.rng.uniform(1.0, 8.0)
    if what == "navigate":
        place = [-200.0, 100.0, 60.0] if kind == "plane" else stage.away(12.0)
        stage.add(at_s, what, place=place)
    elif what == "hold":
        stage.add(at_s, "serve", service="hold", mode="")
    elif what == "pause":
        stage.add(at_s, what)
        stage.add(at_s + 5.0, "resume")
    else:
        stage.add(at_s, what)
    stage.end(begun_s + 60.0)


def _intruders(stage: Stage, time_s: float, count: int = 1) -> float:
    """Let other aircraft meet the vehicle; return when they have passed."""
    is_plane, rng = stage.craft.kind == "plane", stage.rng
    stage.craft = replace(stage.craft, sees_traffic=True)
    speeds_m_s = (10.0, 20.0, 40.0) if is_plane else (1.0, 3.0, 8.0, 20.0, 60.0)
    last_s = 0.0
    for number in range(count):
        meets_s = rng.uniform(12.0, 20.0)
        last_s = max(last_s, meets_s)
        stage.add(
            time_s, "intruder", course_deg=rng.choice((0.0, 90.0, 180.0, rng.uniform(0.0, 360.0))),
            speed=rng.choice(speeds_m_s), meets_s=meets_s, climb=rng.choice((0.0, 0.0, 1.0, -1.0)),
            turn_deg_s=rng.choice((0.0, 0.0, 3.0, -3.0)), passes=rng.choice((0.0, 0.0, 3.0)),
            number=number,
        )  # fmt: skip
    return time_s + last_s


def _an_intruder_on_the_path(stage: Stage) -> None:
    stage.add(0.0, "navigate", place=stage.away(90.0, 12.0), speed=stage.rng.choice((2.0, 4.0)))
    stage.end(_intruders(stage, stage.rng.uniform(14.0, 18.0)) + 10.0)


def _intruders_of_a_plane(stage: Stage) -> None:
    _become(stage, "plane")
    stage.serve(volume_radius_m=3000.0)
    stage.add(0.0, "navigate", place=[250.0, 0.0, 80.0])
    if stage.rng.random() < 0.5:
        stage.add(55.0, "orbit", centre=[300.0, 0.0], radius=80.0, laps=4.0, height=80.0)
    else:
        stage.add(55.0, "navigate", place=[-700.0, 400.0, 80.0])
    passed_s = _intruders(stage, stage.rng.uniform(68.0, 75.0), stage.rng.choice((1, 1, 2)))
    stage.end(passed_s + 20.0)


def _several_intruders(stage: Stage) -> None:
    places = [stage.away(60.0, 15.0) for _ in range(3)]
    stage.add(0.0, "route", places=places, speed=3.0)
    stage.end(_intruders(stage, stage.rng.uniform(20.0, 30.0), stage.rng.choice((2, 3))) + 10.0)


def _an_intruder_of_a_circle(stage: Stage) -> None:
    stage.add(0.0, "orbit", centre=[10.0, 0.0], radius=10.0, laps=5.0, height=12.0, speed=3.0)
    begun_s = stage.rng.uniform(22.0, 28.0)
    passed_s = _intruders(stage, begun_s)
    if stage.rng.random() < 0.4:
        stage.add(begun_s + 1.0, "pause")
        stage.add(passed_s + 5.0, "resume")
    stage.end(passed_s + 10.0)


def _an_intruder_of_who_steers(stage: Stage) -> None:
    _become(stage, "copter", "copter", "plane")
    begun_s = _under_way(stage)
    _steer(stage, begun_s, _linear(stage, _course_rad(stage)), 30.0)
    stage.end(_intruders(stage, begun_s + 5.0) + 10.0)


def _an_echo(stage: Stage) -> None:
    stage.craft = replace(stage.craft, sees_traffic=True)
    stage.add(0.0, "navigate", place=stage.away(60.0, 10.0), speed=2.0)
    stage.add(2.0, "aircraft", claim="echo", seed=stage.rng.randrange(1000))
    stage.end(50.0)


def _square(centre: list[float], half_m: float, turned_rad: float) -> list[list[float]]:
    """Return the corners of a square, east and north of home."""
    angles = [turned_rad + 0.25 * math.tau * (i + 0.5) for i in range(4)]
    reach_m = math.sqrt(2.0) * half_m
    return [
        [
            round(centre[0] + reach_m * math.cos(angle), 1),
            round(centre[1] + reach_m * math.sin(angle), 1),
        ]
        for angle in angles
    ]


def _send_fence(stage: Stage, course_rad: float) -> None:
    """Send a fence around home, and one around what is before the vehicle on a course."""
    rng = stage.rng
    if stage.craft.autopilot == "px4":
        stage.fit(GF_ACTION=rng.choice((1.0, 2.0)))
    else:
        stage.fit(FENCE_ENABLE=1.0, FENCE_TYPE=rng.choice((4.0, 7.0)))
    there = [22.0 * math.cos(course_rad), 22.0 * math.sin(course_rad)]
    around = {"corners": _square([0.0, 0.0], 40.0, rng.uniform(0.0, 1.5)), "inside": True}
    barred: dict[str, object] = {"corners": _square(there, 5.0, course_rad), "inside": False}
    if rng.random() < 0.3:
        barred = {"centre": [round(x, 1) for x in there], "radius": 6.0, "inside": False}
    areas = rng.choice(([around], [around, barred], [around, barred], [barred]))
    stage.add(1.0, "station_fence", areas=areas, seen=rng.random() < 0.7)


def _goals_within_a_sent_fence(stage: Stage) -> None:
    course = _course_rad(stage)
    _send_fence(stage, course)
    stage.add(3.0, "takeoff", height=5.0)
    for number, away_m in enumerate((34.0, 22.0, 60.0, 15.0)):
        angle = course + stage.rng.choice((0.0, 0.0, 0.3, math.pi))
        place = [round(away_m * math.cos(angle), 1), round(away_m * math.sin(angle), 1), 5.0]
        avoid = stage.rng.random() < 0.6
        stage.add(30.0 + 25.0 * number, "navigate", place=place, avoid=avoid)
    stage.end(135.0)


def _commands_within_a_sent_fence(stage: Stage) -> None:
    course = _course_rad(stage)
    _send_fence(stage, course)
    stage.add(3.0, "takeoff", height=5.0)
    _steer(stage, 30.0, _linear(stage, course), 30.0)
    _steer(stage, 65.0, _linear(stage, course + stage.rng.uniform(1.0, 5.0)), 30.0)
    stage.end(105.0)


def _a_wood_seen_by_a_sensor_of_ros(stage: Stage) -> None:
    kind = stage.rng.choice(("cloud", "cloud", "scan"))
    stage.serve(**{"points_topic" if kind == "cloud" else "scan_topic": "/sensor"})
    stage.craft = replace(stage.craft, sensor=kind)
    place = stage.away(50.0, 6.0)
    for _ in range(20):
        at = (round(stage.rng.uniform(-45.0, 45.0), 1), round(stage.rng.uniform(-45.0, 45.0), 1))
        if math.hypot(*at) > 6.0 and math.dist(at, place[:2]) > 6.0:
            stage.posts.append(Post(at, round(stage.rng.uniform(0.4, 2.0), 1), 20.0))
    stage.add(0.0, "navigate", place=place, avoid=True, speed=stage.rng.choice((0.0, 3.0, 6.0)))
    if stage.rng.random() < 0.4:
        begun_s = stage.soon()
        stage.add(begun_s, "blind", on=True)
        stage.end(begun_s + 15.0)


_SITUATIONS: tuple[Situation, ...] = (
    *(_commands_that_cease, _commands_towards_posts, _commands_out_of_the_volume),
    *(_commands_up_and_down, _commands_towards_the_fence, _commands_that_are_wrong),
    *(_commands_that_start_a_goal, _commands_that_goals_take_over),
    *(_an_intruder_on_the_path, _intruders_of_a_plane, _several_intruders),
    *(_an_intruder_of_a_circle, _an_intruder_of_who_steers, _an_echo),
    *(_goals_within_a_sent_fence, _commands_within_a_sent_fence),
    _a_wood_seen_by_a_sensor_of_ros,
    *AIMED,
)


def more_situation_of(seed: int) -> Situation:
    """Return the situation of a seed: they take turns."""
    return _SITUATIONS[(seed - MORE_SITUATIONS_FROM) % len(_SITUATIONS)]


def write_more(seed: int) -> Scenario:
    """Make the scenario of a seed from MORE_SITUATIONS_FROM on."""
    return staged(seed, more_situation_of(seed))
