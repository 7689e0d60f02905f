"""Reservations of vehicles: what is held keeps apart, and somebody always continues."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from navigation_core.geometry import KinematicState, Vector3, add, norm, subtract
from navigation_core.limits import Limits
from navigation_core.tasks.flying.goto import GotoConfig, GotoGoal, fly_to
from navigation_core.tasks.intents import Outcome
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.progress import Status
from navigation_core.tasks.traffic.detours import DetourSearch
from navigation_core.tasks.traffic.entries import Ask, Claimant, Intent, Rank, TrafficWait
from navigation_core.tasks.traffic.intruders import Intruder
from navigation_core.tasks.traffic.negotiation import Negotiation
from navigation_core.tasks.traffic.reservations import TrafficReservations
from navigation_core.tasks.traffic.reserved_path import ReservedPath, RunOut
from navigation_core.tasks.traffic.traffic_view import TrafficFrame, TrafficView
from navigation_core.tasks.traffic.volumes import NOWHERE, Separation, Volume, densified
from navigation_core.tasks.traits import Traits
from navigation_core.trajectories.trajectory import plan_to
from tests.support.models.point_mass import PointMass

SEPARATION = Separation(5.0, 3.0, 2.0)


def line(*points: tuple[float, float, float]) -> Volume:
    """Return the volume of a line of points."""
    spread, _ = densified(np.array(points, dtype=np.float64), np.zeros(len(points)))
    return Volume.along(spread, 1.0, 0.5)


def reservations(*names: str) -> TrafficReservations:
    """Return reservations in which all fly goals; the first has the best rank."""
    made = TrafficReservations(SEPARATION)
    for number, name in enumerate(names):
        made.entry(name).rank = Rank(Claimant.GOAL, float(number), name)
    return made


def ask(path: Volume, wanted: int, granted: int = 0, speed_m_s: float = 1.0) -> Ask:
    """Return a wish for a path that is flown at a speed from its beginning on."""
    steps = np.linalg.norm(np.diff(path.points_m, axis=0), axis=1)
    after_s = np.concatenate([[0.0], np.cumsum(steps)]) / speed_m_s
    return Ask(path, after_s, granted, wanted, wanted)


def test_a_path_is_held_up_to_what_another_holds() -> None:
    made = reservations("a", "b")
    made.stand("a", line((20.0, 0.0, 5.0)), 0.0)
    path = line((0.0, 0.0, 5.0), (40.0, 0.0, 5.0))
    grant = made.extend("b", ask(path, 40), path.part(0, 1), 0.0)
    assert grant.waiting is not None
    assert grant.waiting.whom == "a"
    assert not made.entry("b").held.meets(made.entry("a").held, SEPARATION).any()
    # 5 m apart, with a metre of room about each.
    assert path.points_m[grant.granted - 1][0] == pytest.approx(13.0, abs=1.0)


def test_a_path_longer_than_what_is_looked_at_is_held_as_far_as_that() -> None:
    made = reservations("a", "b")
    path = line((0.0, 0.0, 5.0), (400.0, 0.0, 5.0))
    grant = made.extend("b", ask(path, 401), path.part(0, 1), 0.0)
    assert grant.waiting is None
    assert 100 < grant.granted < 401


def test_more_is_asked_for_less_often_while_nobody_is_near_the_path() -> None:
    made = reservations("a", "b")
    path, course = line((0.0, 0.0, 5.0), (40.0, 0.0, 5.0)), object()
    wish = replace(ask(path, 20), course=course)
    made.stand("a", line((20.0, 30.0, 5.0)), 0.0)
    made.extend("b", wish, path.part(0, 1), 0.0)
    assert made.is_settled("b", course, 0.5)
    assert not made.is_settled("b", object(), 0.5)
    made.stand("a", line((20.0, 6.5, 5.0)), 1.0)
    made.extend("b", wish, path.part(0, 1), 1.0)
    assert made.is_settled("b", course, 1.2)
    assert not made.is_settled("b", course, 1.3)


def test_what_is_left_of_a_path_has_its_corners() -> None:
    path = line((0.0, 0.0, 5.0), (10.0, -7.0, 2.0), (-4.0, 3.0, 9.0))
    for first in (0, 3, len(path) - 1, len(path)):
        assert np.array_equal(path.rest(first).corners, path.part(first).corners)


@pytest.mark.parametrize(
    ("ahead_m", "aside_m", "stays"),
    [
        (-0.6, (0.0, 0.0), True),
        (-0.6, (0.2, 0.1), True),
        (-0.6, (0.4, 0.0), False),
        # A vehicle that leads its setpoint, as the simulated ArduCopter does by 0.2 m.
        (1.5, (0.0, 0.0), True),
        (6.0, (0.0, 0.0), False),
    ],
)
def test_on_a_straight_path_nothing_more_is_held_for_a_vehicle_on_it(
    ahead_m: float, aside_m: tuple[float, float], stays: bool
) -> None:
    made = reservations("a")
    view = TrafficView(made, "a", TrafficFrame.level(), 1.0, 0.5)
    trajectory = plan_to(KinematicState((0.0, 0.0, 5.0)), (200.0, 0.0, 5.0), Limits())
    carrot = Carrot(trajectory, GotoConfig(), 0.0, 0.0, time_s=10.0)
    path, run_out = ReservedPath(trajectory, view), RunOut(1.0, 1.2)
    x, speed_m_s = carrot.state.position_enu_m[0], norm(carrot.state.velocity_enu_m_s)
    first = path.reserve(view, carrot, (x - 1.0, 0.0, 5.0), speed_m_s, run_out, 1.0)
    assert path.stay(view, carrot, (x - 1.0, 0.0, 5.0), 1.0) == first
    held = made.entry("a").held
    carrot.advance(0.2, None)
    here = (x + ahead_m, aside_m[0], 5.0 + aside_m[1])
    within = path.stay(view, carrot, here, 1.2)
    assert (within is not None) == stays
    assert made.entry("a").held is held
    if within is not None:
        again = path.reserve(view, carrot, here, speed_m_s, run_out, 1.2)
        assert within.room_m == pytest.approx(again.room_m)
        assert len(held.pairs(view.volume(np.array([here])), SEPARATION)[0])
    assert path.stay(view, carrot, here, 9.0) is None, "more must be asked for"


def test_a_path_above_another_is_free() -> None:
    made = reservations("a", "b")
    made.stand("a", line((20.0, 0.0, 5.0)), 0.0)
    path = line((0.0, 0.0, 9.1), (40.0, 0.0, 9.1))
    assert made.extend("b", ask(path, 40), path.part(0, 1), 0.0).waiting is None


def test_nobody_stops_on_the_path_of_a_better_rank() -> None:
    made = reservations("a", "b")
    first = line((-30.0, 0.0, 5.0), (30.0, 0.0, 5.0))
    made.extend("a", ask(first, 5, speed_m_s=3.0), first.part(0, 1), 0.0)
    second = line((0.0, -30.0, 5.0), (0.0, 0.0, 5.0))
    grant = made.extend("b", ask(second, 100), second.part(0, 1), 0.0)
    assert grant.waiting is not None
    assert grant.waiting.whom == "a"
    assert not second.part(0, grant.granted).meets(first, SEPARATION).any()


def test_who_is_through_in_time_passes_before_a_better_rank() -> None:
    made = reservations("a", "b")
    first = line((-60.0, 0.0, 5.0), (60.0, 0.0, 5.0))
    made.extend("a", ask(first, 5, speed_m_s=1.0), first.part(0, 1), 0.0)
    second = line((0.0, -12.0, 5.0), (0.0, 30.0, 5.0))
    grant = made.extend("b", ask(second, 10, speed_m_s=3.0), second.part(0, 1), 0.0)
    assert grant.waiting is None
    # All of the crossing, up to behind it.
    assert second.points_m[grant.granted - 1][1] >= 7.0


def test_a_whole_volume_is_held_or_announced() -> None:
    made = reservations("a", "b")
    made.stand("a", line((0.0, 0.0, 5.0)), 0.0)
    column = line((1.0, 0.0, 0.0), (1.0, 0.0, 10.0))
    waiting = made.claim("b", column, 1.0)
    assert waiting is not None
    assert waiting.whom == "a"
    assert not len(made.entry("b").kept)
    made.stand("a", line((30.0, 0.0, 5.0)), 2.0)
    assert made.claim("b", column, 2.0) is None
    assert made.entry("b").kept is column


def test_less_is_kept_from_who_is_parked() -> None:
    made = reservations("a", "b")
    made.stand("a", line((0.0, 0.0, 0.0)).parked(SEPARATION), 0.0)
    assert made.claim("b", line((4.5, 0.0, 0.0), (4.5, 0.0, 5.0)), 0.0) is None
    assert made.claim("b", line((3.5, 0.0, 0.0), (3.5, 0.0, 5.0)), 0.0) is not None


def test_the_worst_rank_of_a_circle_gives_way() -> None:
    made = reservations("a", "b", "c")
    for name, whom in (("a", "b"), ("b", "c"), ("c", "a")):
        made.entry(name).moves = True
        made.entry(name).waiting = TrafficWait(whom, "", 0.0)
    assert [name for name in "abc" if made.must_give_way(name, 0.0)] == ["c"]
    made.entry("c").stuck_until_s = 5.0
    # One that found no way does not count; who waits for it goes round, and so does the next.
    assert made.must_give_way("b", 1.0)


def test_who_waits_for_one_that_stands_goes_round() -> None:
    made = reservations("a", "b", "c")
    made.entry("b").moves = made.entry("c").moves = True
    made.entry("b").waiting = TrafficWait("a", "", 0.0)
    made.entry("c").waiting = TrafficWait("b", "", 0.0)
    assert made.must_give_way("b", 0.0)
    assert not made.must_give_way("c", 0.0)


def test_a_detour_leads_over_what_stands() -> None:
    made = reservations("a", "b")
    made.stand("a", line((20.0, 0.0, 5.0)), 0.0)
    view = TrafficView(made, "b", TrafficFrame.level(), 1.0, 0.5, (1.0, 30.0))
    search = DetourSearch(view, Limits(), lambda _: True, 0.0)
    found = search.find(np.array([0.0, 0.0, 5.0]), np.array([[40.0, 0.0, 5.0]]))
    assert found is not None
    assert found.points_enu_m
    way = line((0.0, 0.0, 5.0), *found.points_enu_m, (40.0, 0.0, 5.0))
    assert not way.meets(made.entry("a").held, SEPARATION).any()


def test_what_drives_goes_round_on_the_ground() -> None:
    made = reservations("a", "b")
    made.stand("a", line((20.0, 0.0, 0.0)), 0.0)
    view = TrafficView(made, "b", TrafficFrame.level(), 1.0, 0.5)
    search = DetourSearch(view, Limits(), lambda _: True, 0.0)
    found = search.find(np.array([0.0, 0.0, 0.0]), np.array([[40.0, 0.0, 0.0]]))
    assert found is not None
    assert {z for _, _, z in found.points_enu_m} == {0.0}


places = st.tuples(*[st.floats(-30.0, 30.0)] * 2, st.floats(0.0, 12.0))


@given(st.lists(st.tuples(places, places), min_size=1, max_size=6), places, places, places)
def test_what_delays_a_path_is_the_same_in_a_wider_region(
    ways: list[tuple[Vector3, Vector3]], start: Vector3, via: Vector3, end: Vector3
) -> None:
    made = reservations(*(f"v{number}" for number in range(len(ways))), "z")
    for number, way in enumerate(ways):
        entry = made.entry(f"v{number}")
        path = line(*way)
        made.stand(entry.name, path.part(0, 2), 0.0, moves=number % 2 == 0)
        if number % 2 == 0:
            entry.intent = Intent(path, np.linspace(0.0, 20.0, len(path)))
        elif number % 3 == 0:
            made.keep(entry.name, path)
    path = line(start, via, end)
    after_s = np.linspace(0.0, 15.0, len(path))
    region = Volume.along(line(start, end).points_m, 1.0 + math.dist(start, via), 20.0)
    delay_s = made.ahead("z", region, 3.0).delay_s(path, after_s)
    assert delay_s == made.delay_s("z", path, after_s, 3.0)
    stands = [made.entry(f"v{number}") for number in range(1, len(ways), 2)]
    begins = path.part(0, 1)
    if not any(begins.meets(one.whole, SEPARATION).any() for one in stands):
        blocked = any(path.meets(one.whole, SEPARATION).any() for one in stands)
        assert blocked == math.isinf(delay_s)


@given(st.lists(st.tuples(places, places), min_size=2, max_size=5), st.integers(0, 1000))
def test_what_is_held_keeps_apart_whoever_asks_in_whatever_order(
    ways: list[tuple[tuple[float, float, float], tuple[float, float, float]]], order: int
) -> None:
    names = [f"v{number}" for number in range(len(ways))]
    made = reservations(*names)
    paths = {name: line(*way) for name, way in zip(names, ways, strict=True)}
    for name in names:
        begin = paths[name].part(0, 1)
        if made.blocked_by(name, begin) is None:
            made.stand(name, begin, 0.0)
        else:
            del paths[name]
            made.forget(name)
    granted = dict.fromkeys(paths, 1)
    for turn in range(12):
        name = sorted(paths)[(order + turn * 7) % len(paths)]
        path = paths[name]
        grant = made.extend(name, ask(path, 20, granted[name]), NOWHERE, float(turn))
        granted[name] = grant.granted
        held = [made.entry(one).held for one in paths]
        for i, one in enumerate(held):
            for other in held[i + 1 :]:
                assert not one.meets(other, SEPARATION).any()


@given(st.lists(places, min_size=1, max_size=60), st.lists(places, min_size=1, max_size=60))
def test_pairs_are_those_of_the_definition(
    mine: list[tuple[float, float, float]], theirs: list[tuple[float, float, float]]
) -> None:
    a, b = Volume.along(np.array(mine), 1.0, 0.5), Volume.along(np.array(theirs), 0.5, 0.2)
    wanted = {
        (i, j)
        for i, p in enumerate(mine)
        for j, q in enumerate(theirs)
        if math.hypot(p[0] - q[0], p[1] - q[1]) < 6.5 - 1e-9 and abs(p[2] - q[2]) < 3.7 - 1e-9
    }
    rows, columns = a.pairs(b, SEPARATION)
    found = set(zip(rows.tolist(), columns.tolist(), strict=True))
    assert wanted <= found
    assert all(
        math.hypot(mine[i][0] - theirs[j][0], mine[i][1] - theirs[j][1]) < 6.5 + 1e-6
        for i, j in found
    )


def test_who_has_drifted_too_near_to_one_that_stands_may_leave_but_not_come_nearer() -> None:
    made = reservations("a", "b")
    made.stand("a", line((6.95, 0.0, 5.0)), 0.0)
    path = line((0.0, 0.0, 5.0), (-20.0, 0.0, 5.0))
    made.stand("b", path.part(0, 1), 0.0)
    assert path.part(0, 1).meets(made.entry("a").held, SEPARATION).all()
    assert made.extend("b", ask(path, 20), path.part(0, 1), 0.0).waiting is None
    back = line((0.0, 0.0, 5.0), (4.0, 0.0, 5.0))
    grant = made.extend("b", ask(back, 5), back.part(0, 1), 0.0)
    assert grant.waiting is not None
    assert grant.granted <= 1


def test_no_detour_aside_leads_below_the_lowest_height() -> None:
    made = reservations("a", "b")
    # All around at its height, so that only down would be near.
    for number in range(12):
        angle = 2.0 * np.pi * number / 12
        made.stand(f"c{number}", line((12.0 * np.cos(angle), 12.0 * np.sin(angle), 5.0)), 0.0)
    made.stand("above", line((0.0, 0.0, 9.5)), 0.0)
    view = TrafficView(made, "b", TrafficFrame.level(), 1.0, 0.5, (3.0, 40.0))
    found = DetourSearch(view, Limits(), lambda _: True, 0.0).aside(np.array([0.0, 0.0, 5.0]))
    assert found is None or found.points_enu_m[-1][2] >= 3.0


def test_who_holds_what_a_better_rank_waits_for_may_leave_through_its_announced_path() -> None:
    made = reservations("a", "b")
    held = line((20.0, 0.0, 5.0))
    made.stand("b", held, 0.0)
    wanted = line((0.0, 0.0, 5.0), (40.0, 0.0, 5.0))
    assert made.claim("a", wanted, 0.0) is not None, "b is there"
    assert made.claim("b", line((20.0, 0.0, 5.0), (30.0, 0.0, 5.0)), 0.0) is None


def test_who_is_within_what_another_keeps_by_force_may_leave_it() -> None:
    made = reservations("a", "b")
    path = line((0.0, 0.0, 5.0), (0.0, 20.0, 5.0))
    made.stand("b", path.part(0, 1), 0.0)
    made.stand("a", line((-30.0, 0.0, 5.0)), 0.0)
    made.keep("a", line((-30.0, 0.0, 5.0), (10.0, 0.0, 5.0)))
    assert made.extend("b", ask(path, 20), path.part(0, 1), 0.0).waiting is None
    # Not into it again, nor to where the other is.
    back = line((0.0, 0.0, 5.0), (0.0, 12.0, 5.0), (5.0, 12.0, 5.0), (5.0, 0.0, 5.0))
    grant = made.extend("b", ask(back, 28), back.part(0, 1), 0.0)
    assert grant.waiting is not None
    along = line((0.0, 0.0, 5.0), (-40.0, 0.0, 5.0))
    assert made.extend("b", ask(along, 40), along.part(0, 1), 0.0).waiting is not None


def test_the_path_after_a_stop_begins_at_the_setpoint_and_not_with_the_measured_velocity() -> None:
    made = reservations("a", "b")
    view = TrafficView(made, "a", TrafficFrame.level(), 1.0, 0.5)
    limits = Limits(speed_horizontal_m_s=4.0)
    config = GotoConfig(limits=limits, may_arm=True)
    start = (0.0, 0.0, 5.0)
    mass = PointMass(position=start, armed=True, in_control=True, airborne=True, now=0.0)
    task = fly_to(GotoGoal((60.0, 0.0, 5.0)), FlightTerms(config, traits=Traits()))
    task.start(mass.observe(), 0.0)
    speeds_m_s: list[float] = []
    for tick in range(120):
        if tick == 60:  # a server that has to agree, and is silent
            Negotiation(made, "/a", 1, ["/b"])
            made.renew("a")
        observation = mass.observe()
        if tick > 60:  # the wind pushes it
            object.__setattr__(observation, "velocity_enu_m_s", (0.0, 0.4, 0.0))
        object.__setattr__(observation, "traffic", view)
        answer = task.step(observation, 0.1 * tick)
        assert not isinstance(answer, Outcome)
        if task.commanded is not None:
            speeds_m_s.append(norm(task.commanded.velocity_enu_m_s))
        mass.obey(answer)
        mass.advance(0.1)
    assert speeds_m_s[-1] < 0.01, "it did not stop"
    stopped = next(n for n in range(60, 120) if speeds_m_s[n] < 0.01)
    assert max(speeds_m_s[stopped:]) < 0.1


def test_who_is_too_near_to_one_that_stays_at_its_target_climbs_away_from_it() -> None:
    """The beginning of such a path gets no farther away; only the whole of it leads out."""
    made = reservations("a", "b")
    made.stand("b", line((6.7, 0.0, 5.0)), 0.0)
    view = TrafficView(made, "a", TrafficFrame.level(), 1.0, 0.5, (3.0, 40.0))
    config = GotoConfig(limits=Limits(speed_horizontal_m_s=4.0), may_arm=True)
    mass = PointMass((0.0, 0.0, 5.0), armed=True, in_control=True, airborne=True, now=0.0)
    task = fly_to(GotoGoal((6.7, 0.0, 5.0)), FlightTerms(config, traits=Traits()))
    task.start(replace(mass.observe(), traffic=view), 0.0)
    highest_m = 0.0
    for tick in range(100):
        answer = task.step(replace(mass.observe(), traffic=view), 0.1 * tick)
        assert not isinstance(answer, Outcome)
        mass.obey(answer)
        mass.advance(0.1)
        highest_m = max(highest_m, mass.position[2])
    assert highest_m > 9.0, "it did not make room"


def test_the_path_back_after_an_evasion_begins_at_the_setpoint() -> None:
    """Setpoints flowed all the time: a measured velocity is off by the lag and the wind."""
    made = reservations("a")
    entry = made.entry("X")
    entry.moves = True
    view = TrafficView(made, "a", TrafficFrame.level(), 1.0, 0.5, (3.0, 40.0))
    limits = Limits(speed_horizontal_m_s=4.0)
    config = GotoConfig(limits=limits, may_arm=True)
    mass = PointMass((0.0, 0.0, 5.0), armed=True, in_control=True, airborne=True, now=0.0)
    task = fly_to(GotoGoal((60.0, 0.0, 5.0)), FlightTerms(config, traits=Traits()))
    task.start(mass.observe(), 0.0)
    paths: set[tuple[Vector3, ...]] = set()
    statuses: set[Status] = set()
    jumps_m_s: list[float] = []
    before: Vector3 | None = None
    for tick in range(300):
        now = 0.1 * tick
        place, velocity = np.array([90.0 - 8.0 * now, 0.0, 5.0]), np.array([-8.0, 0.0, 0.0])
        entry.intruder = Intruder(place, velocity, now, 0.0, 0.0)
        pushed = add(mass.velocity, (0.0, 1.0, 0.0))
        observation = replace(mass.observe(), velocity_enu_m_s=pushed, traffic=view)
        answer = task.step(observation, now)
        if isinstance(answer, Outcome):
            break
        statuses.add(task.progress(observation, now).status)
        paths.add(task.path_enu_m)
        if task.commanded is not None and before is not None:
            jumps_m_s.append(norm(subtract(task.commanded.velocity_enu_m_s, before)))
        before = None if task.commanded is None else task.commanded.velocity_enu_m_s
        mass.obey(answer)
        mass.advance(0.1)
    assert Status.WAITING_FOR_TRAFFIC in statuses
    assert len(paths) > 1, "it did not evade"
    assert max(jumps_m_s) < 0.15 * limits.acceleration_horizontal_m_s2
