"""Circles by setpoints: entry, laps, interruptions, obstacles, and what each phase does."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import pytest

from navigation_core.geometry import Vector3
from navigation_core.mapping.obstacle_shapes import Box, Cylinder
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.orbit import Orbit, fly_orbit
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.leading.flight_terms import AvoidanceConfig, FlightTerms
from navigation_core.tasks.leading.ring_path import RingYaw
from navigation_core.tasks.phases import Phase
from navigation_core.tasks.progress import OrbitProgress
from navigation_core.trajectories.ring import Ring
from tests.support.models.point_mass import Flight, PointMass, fly

CENTRE: Vector3 = (20.0, 0.0, 5.0)
RADIUS_M = 8.0
AVOIDANCE = AvoidanceConfig(heights_m=(4.9, 5.1), blocked_timeout_s=10.0)
# East of the centre, on the circle, half a lap after its entry from the south-west.
POST = Obstacles.of((Cylinder("post", (28.0, 0.0), 0.5),))


def hovering() -> PointMass:
    return PointMass(position=(0.0, 0.0, 5.0), armed=True, in_control=True, airborne=True)


def orbit(
    laps: float = 1.0,
    yaw: RingYaw = RingYaw.CENTRE,
    anticlockwise: bool = True,
    avoidance: AvoidanceConfig | None = None,
    speed_m_s: float = 2.5,
) -> SetpointFlight:
    ring = Ring(CENTRE, RADIUS_M, anticlockwise)
    terms = FlightTerms(GotoConfig(may_arm=True), avoidance=avoidance)
    return fly_orbit(Orbit(ring, laps, yaw, 0.7, speed_m_s), terms, (0.0, 0.0, 5.0))


def told(task: SetpointFlight, vehicle: PointMass) -> OrbitProgress:
    progress = task.progress(vehicle.observe(), vehicle.now).orbit
    assert progress is not None
    return progress


def on_ring(task: SetpointFlight, vehicle: PointMass) -> bool:
    """Whether the vehicle goes round now, as the progress says."""
    return not math.isnan(told(task, vehicle).radius_error_m)


def after_s(
    task: SetpointFlight, vehicle: PointMass, laps: float, act: Callable[[], None]
) -> Callable[[float], None]:
    """Do something once when a number of laps is flown."""
    done = False

    def each_step(_: float) -> None:
        nonlocal done
        if not done and on_ring(task, vehicle) and told(task, vehicle).laps_flown >= laps:
            done = True
            act()

    return each_step


def radii_m(flight: Flight) -> list[float]:
    """The distances of the setpoints from the centre."""
    return [math.dist(each.setpoint.position_enu_m[:2], CENTRE[:2]) for _, each in flight.setpoints]


@pytest.mark.parametrize("anticlockwise", [True, False])
@pytest.mark.parametrize("laps", [0.25, 1.0, 4.5])
def test_it_goes_round_as_often_and_in_the_direction_that_was_asked_for(
    laps: float, anticlockwise: bool
) -> None:
    vehicle, task = hovering(), orbit(laps, anticlockwise=anticlockwise)
    angles: list[float] = []

    def watch(_: float) -> None:
        if on_ring(task, vehicle):
            x, y, _ = vehicle.position
            angles.append(math.atan2(y - CENTRE[1], x - CENTRE[0]))

    outcome = fly(task, vehicle, watch).outcome
    assert outcome.code is OutcomeCode.SUCCESS
    assert outcome.message.startswith(f"Went round {laps:g} times")
    turned = sum(math.remainder(b - a, math.tau) for a, b in itertools.pairwise(angles))
    sign = 1.0 if anticlockwise else -1.0
    assert turned == pytest.approx(sign * laps * math.tau, abs=0.3)
    assert told(task, vehicle).laps_flown == laps


def test_it_stays_on_the_circle_and_faces_the_centre() -> None:
    vehicle, task = hovering(), orbit(2.0)
    errors_m: list[float] = []
    facing_rad: list[float] = []

    def watch(_: float) -> None:
        if on_ring(task, vehicle):
            errors_m.append(abs(told(task, vehicle).radius_error_m))
            x, y, _ = vehicle.position
            inward = math.atan2(CENTRE[1] - y, CENTRE[0] - x)
            facing_rad.append(abs(math.remainder(vehicle.yaw - inward, math.tau)))

    fly(task, vehicle, watch)
    assert max(errors_m) < 0.03 * RADIUS_M
    assert max(facing_rad) < math.radians(15.0)


def test_a_yaw_in_the_direction_of_travel_and_one_that_is_kept() -> None:
    vehicle, task = hovering(), orbit(1.0, RingYaw.KEEP)
    yaws: set[float] = set()
    fly(task, vehicle, lambda _: yaws.add(vehicle.yaw) if on_ring(task, vehicle) else None)
    assert yaws == {0.7}

    ahead, along = hovering(), orbit(1.0, RingYaw.TANGENT)
    off_rad: list[float] = []

    def watch(_: float) -> None:
        if on_ring(along, ahead) and ahead.speed > 1.0:
            course = math.atan2(ahead.velocity[1], ahead.velocity[0])
            off_rad.append(abs(math.remainder(ahead.yaw - course, math.tau)))

    fly(along, ahead, watch)
    assert max(off_rad) < math.radians(15.0)


def test_without_a_number_of_laps_it_goes_round_until_it_is_cancelled() -> None:
    vehicle, task = hovering(), orbit(math.inf)
    left_m: list[float] = []

    def watch(_: float) -> None:
        left_m.append(task.progress(vehicle.observe(), vehicle.now).distance_remaining_m)
        if told(task, vehicle).laps_flown > 5.3:
            task.cancel(vehicle.now)

    outcome = fly(task, vehicle, watch).outcome
    assert outcome.code is OutcomeCode.CANCELED
    assert told(task, vehicle).laps_flown > 5.3
    assert vehicle.speed < 0.3
    lap_m = math.tau * RADIUS_M
    assert min(left_m) >= 0.0
    assert max(left_m[-400:]) <= lap_m + 1.0


def test_a_pause_stops_it_and_its_laps_are_counted_on() -> None:
    vehicle, task = hovering(), orbit(2.0)
    paused: list[float] = []

    def pause() -> None:
        paused.append(vehicle.now)
        assert task.pause(vehicle.now) is None

    stop = after_s(task, vehicle, 0.8, pause)
    speeds: list[float] = []

    def watch(elapsed_s: float) -> None:
        stop(elapsed_s)
        if paused and vehicle.now - paused[0] > 8.0 and not speeds:
            speeds.append(vehicle.speed)
            task.unpause(vehicle.now)

    outcome = fly(task, vehicle, watch).outcome
    assert outcome.code is OutcomeCode.SUCCESS
    assert speeds[0] < 0.1
    assert told(task, vehicle).laps_flown == 2.0
    # Two laps, and no third one for what was flown before the pause.
    assert vehicle.now - 100.0 < 90.0


def test_an_obstacle_on_the_circle_is_flown_around_and_the_circle_taken_up_behind_it() -> None:
    vehicle, task = hovering(), orbit(2.0, avoidance=AVOIDANCE)
    vehicle.obstacles = POST
    nearest_m = math.inf

    def watch(_: float) -> None:
        nonlocal nearest_m
        nearest_m = min(nearest_m, math.dist(vehicle.position[:2], (28.0, 0.0)) - 0.5)

    outcome = fly(task, vehicle, watch).outcome
    assert outcome.code is OutcomeCode.SUCCESS, outcome.message
    assert nearest_m > AVOIDANCE.brake_clearance_m
    assert told(task, vehicle).laps_flown == 2.0


def test_an_obstacle_that_comes_up_on_the_way_stops_it_before_it_goes_around() -> None:
    vehicle, task = hovering(), orbit(1.0, avoidance=AVOIDANCE)

    def appear() -> None:
        vehicle.obstacles = POST

    stop, phases, nearest_m = after_s(task, vehicle, 0.05, appear), set(), math.inf

    def watch(elapsed_s: float) -> None:
        nonlocal nearest_m
        stop(elapsed_s)
        phases.add(task.phase)
        nearest_m = min(nearest_m, math.dist(vehicle.position[:2], (28.0, 0.0)) - 0.5)

    outcome = fly(task, vehicle, watch).outcome
    assert outcome.code is OutcomeCode.SUCCESS, outcome.message
    assert Phase.BLOCKED in phases
    assert nearest_m > AVOIDANCE.brake_clearance_m
    assert told(task, vehicle).laps_flown == 1.0


def test_a_circle_that_is_blocked_all_round_ends_without_a_path() -> None:
    vehicle, task = hovering(), orbit(1.0, avoidance=AVOIDANCE)
    vehicle.obstacles = Obstacles.of((Box("hall", CENTRE[:2], (17.0, 17.0)),))
    outcome = fly(task, vehicle).outcome
    assert outcome.code is OutcomeCode.NO_PATH
    assert math.dist(vehicle.position[:2], CENTRE[:2]) > 9.0


def test_the_end_of_a_lap_that_was_not_flown_is_no_end() -> None:
    """It is stopped right behind the entry, which is where the last lap ends."""
    vehicle, task = hovering(), orbit(1.0, avoidance=AVOIDANCE)

    def appear() -> None:
        vehicle.obstacles = POST

    stop = after_s(task, vehicle, 0.0, appear)
    outcome = fly(task, vehicle, stop).outcome
    assert outcome.code is OutcomeCode.SUCCESS, outcome.message
    assert told(task, vehicle).laps_flown == 1.0


def test_gusts_that_let_nothing_stand_still_do_not_keep_it_from_the_circle() -> None:
    vehicle, task = hovering(), orbit(1.0)
    rounds = False

    def watch(elapsed_s: float) -> None:
        nonlocal rounds
        rounds = rounds or on_ring(task, vehicle)
        vehicle.wind = (0.0, 0.0, 0.0) if rounds else (0.8 * math.sin(2.0 * elapsed_s), 0.0, 0.0)

    outcome = fly(task, vehicle, watch, time_max_s=90.0).outcome
    assert outcome.code is OutcomeCode.SUCCESS, outcome.message


# --- phases and events -------------------------------------------------------------------


def cut(vehicle: PointMass) -> None:
    vehicle.position_known = False


def doubt(vehicle: PointMass) -> None:
    vehicle.position_doubt = "a doubt"


def disarm(vehicle: PointMass) -> None:
    vehicle.armed = False


def take_over(vehicle: PointMass) -> None:
    vehicle.in_control = False


def land(vehicle: PointMass) -> None:
    vehicle.airborne = False


EVENTS = {
    "position lost": (cut, OutcomeCode.NO_POSITION),
    "disarmed": (disarm, OutcomeCode.DISARMED),
    "taken over": (take_over, OutcomeCode.PILOT_OVERRIDE),
    "landed": (land, OutcomeCode.LANDED),
}


@pytest.mark.parametrize("event", EVENTS)
@pytest.mark.parametrize("phase", ["approach", "round", "paused"])
def test_what_ends_a_flight_ends_it_in_each_phase(phase: str, event: str) -> None:
    act, code = EVENTS[event]
    vehicle, task = hovering(), orbit(2.0)
    happened = False

    def watch(elapsed_s: float) -> None:
        nonlocal happened
        if phase == "paused" and on_ring(task, vehicle) and task.phase is Phase.NAVIGATING:
            task.pause(vehicle.now)
        there = {
            "approach": elapsed_s > 3.0,
            "round": on_ring(task, vehicle) and told(task, vehicle).laps_flown > 0.2,
            "paused": task.phase is Phase.PAUSED,
        }[phase]
        if there and not happened:
            happened = True
            act(vehicle)

    assert fly(task, vehicle, watch).outcome.code is code


@pytest.mark.parametrize("phase", ["approach", "round"])
def test_after_a_doubt_of_the_position_it_comes_back_to_the_circle(phase: str) -> None:
    vehicle, task = hovering(), orbit(1.0)
    doubted_s: list[float] = []

    def watch(elapsed_s: float) -> None:
        there = elapsed_s > 3.0 if phase == "approach" else told(task, vehicle).laps_flown > 0.3
        if there and not doubted_s:
            doubted_s.append(elapsed_s)
            doubt(vehicle)
        elif doubted_s and elapsed_s > doubted_s[0] + 3.0:
            vehicle.position_doubt = ""

    outcome = fly(task, vehicle, watch).outcome
    assert outcome.code is OutcomeCode.SUCCESS, outcome.message
    assert told(task, vehicle).laps_flown == 1.0


def test_taken_control_again_it_continues_with_its_laps() -> None:
    vehicle, task = hovering(), orbit(2.0)

    def again() -> None:
        task.resume_control(vehicle.now)

    outcome = fly(task, vehicle, after_s(task, vehicle, 0.9, again)).outcome
    assert outcome.code is OutcomeCode.SUCCESS, outcome.message
    assert told(task, vehicle).laps_flown == 2.0


def test_setpoints_keep_to_the_circle_once_it_is_entered() -> None:
    vehicle, task = hovering(), orbit(3.0)
    flight = fly(task, vehicle)
    inside = [radius for radius in radii_m(flight) if radius < RADIUS_M]
    assert min(inside, default=RADIUS_M) > RADIUS_M * 0.95
