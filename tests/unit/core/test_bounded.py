"""Every task ends, whatever the vehicle does: each requested operation and each wait.

A pause is the one exception: it lasts until whoever paused lets the goal continue.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from navigation_core.geometry import Vector3
from navigation_core.tasks.flying.goto import GotoConfig, GotoGoal, fly_to
from navigation_core.tasks.flying.route import fly_route
from navigation_core.tasks.flying.target_landing import TargetLanding, TargetLandingGoal
from navigation_core.tasks.inputs.tracked_target import TrackedTarget
from navigation_core.tasks.intents import Intent, Outcome, Perform
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.observation import (
    MissionReport,
    Observation,
    OperationReport,
    OperationStatus,
    TaskOperation,
    VehicleMode,
)
from navigation_core.tasks.task import Task
from navigation_core.tasks.traits import COPTER, Traits
from navigation_core.tasks.watching.mission import FlyMission
from navigation_core.tasks.watching.plane import FlyPlane
from navigation_core.tasks.watching.vehicle_led import LAND, RETURN_TO_LAUNCH, VehicleLed
from navigation_core.tasks.waypoint import Route, RouteWaypoint
from tests.support.models.vehicle_traits import PLANE

pytestmark = pytest.mark.wide_but_first


STEP_S = 0.25
LONGEST_S = 1800.0
CONFIG = GotoConfig(may_arm=True)
PX4_COPTER = Traits(control_before_takeoff=False)
ROVER = Traits(name="rover", flies=False, lands_itself=False, turning_radius_m=0.9)


def waypoints(height_m: float, speed_m_s: float | None = None) -> tuple[RouteWaypoint, ...]:
    places = ((-300.0, 0.0, height_m), (-300.0, 200.0, height_m))
    return tuple(RouteWaypoint(place, 2.0, 2.0, max_speed_m_s=speed_m_s) for place in places)


TASKS: dict[str, Callable[[], Task]] = {
    "goto": lambda: fly_to(GotoGoal((-300.0, 0.0, 10.0)), FlightTerms(CONFIG)),
    "goto of a PX4": lambda: fly_to(
        GotoGoal((-300.0, 0.0, 10.0)), FlightTerms(CONFIG, traits=PX4_COPTER)
    ),
    "goto of a rover": lambda: fly_to(
        GotoGoal((-300.0, 0.0, 0.0)), FlightTerms(CONFIG, traits=ROVER)
    ),
    "route": lambda: fly_route(Route(waypoints(10.0), 2), FlightTerms(CONFIG)),
    "route of a rover": lambda: fly_route(
        Route(waypoints(0.0), 2), FlightTerms(CONFIG, traits=ROVER)
    ),
    "mission": lambda: FlyMission(Route(waypoints(10.0), 1), CONFIG, COPTER),
    "mission of a rover": lambda: FlyMission(Route(waypoints(0.0), 1), CONFIG, ROVER),
    "mission of a plane": lambda: FlyMission(Route(waypoints(50.0), 1), CONFIG, PLANE),
    "plane": lambda: FlyPlane(Route(waypoints(50.0, 20.0), 2), CONFIG, PLANE, 40.0),
    "landing": lambda: VehicleLed(LAND, CONFIG, COPTER),
    "landing on a target": lambda: TargetLanding(TargetLandingGoal(False, 1), FlightTerms(CONFIG)),
    "landing without its target": lambda: TargetLanding(
        TargetLandingGoal(True, 1, 20.0), FlightTerms(CONFIG)
    ),
    "landing of a plane": lambda: VehicleLed(LAND, CONFIG, PLANE),
    "return": lambda: VehicleLed(RETURN_TO_LAUNCH, CONFIG, COPTER),
    "return of a rover": lambda: VehicleLed(RETURN_TO_LAUNCH, CONFIG, ROVER),
    "return of a plane": lambda: VehicleLed(RETURN_TO_LAUNCH, CONFIG, PLANE),
}
DRIVES = {name for name in TASKS if "rover" in name}
_MODES = {
    TaskOperation.TAKE_CONTROL: VehicleMode.CONTROL,
    TaskOperation.REPOSITION: VehicleMode.CONTROL,
    TaskOperation.HOLD: VehicleMode.HOLD,
    TaskOperation.LAND: VehicleMode.LAND,
    TaskOperation.LAND_ON_TARGET: VehicleMode.LAND,
    TaskOperation.RETURN: VehicleMode.RETURN,
    TaskOperation.START_MISSION: VehicleMode.MISSION,
}


@dataclass
class Hostile:
    """A vehicle that does what it is asked, but one operation, and moves as it likes."""

    motion: str
    withheld: TaskOperation | None = None
    flies: bool = True
    sees_target: bool = False
    armed: bool = False
    airborne: bool = False
    mode: VehicleMode = VehicleMode.OTHER
    now: float = 100.0
    position: Vector3 = (0.0, 0.0, 0.0)
    velocity: Vector3 = (0.0, 0.0, 0.0)
    asked: set[TaskOperation] = field(default_factory=set)
    report: OperationReport | None = None
    seen_s: float = 100.0
    rng: random.Random = field(default_factory=lambda: random.Random(1))

    def move(self) -> None:
        """Continue by one step: it never comes to where it is to go."""
        self.now += STEP_S
        if not (self.armed and (self.airborne or not self.flies)):
            self.velocity = (0.0, 0.0, 0.0)
        elif self.motion == "circles":
            turn = 0.05 * self.now
            self.velocity = (6.0 * math.cos(turn), 6.0 * math.sin(turn), 0.0)
        elif self.motion == "wanders":
            east, north = self.rng.uniform(-6.0, 6.0), self.rng.uniform(-6.0, 6.0)
            up = self.rng.uniform(-1.0, 1.0) if self.flies and self.position[2] < 60.0 else 0.0
            self.velocity = (east, north, max(up, -self.position[2]))
        elif self.motion == "climbs":
            self.velocity = (0.0, 0.0, 3.0 if self.flies else 0.0)
        else:
            self.velocity = (0.0, 0.0, 0.0)
        x, y, z = (p + STEP_S * v for p, v in zip(self.position, self.velocity, strict=True))
        self.position = (x, y, z)

    def observe(self) -> Observation:
        told = True
        if self.motion == "comes and goes":
            told = self.now % 3.0 < 0.8
        elif self.motion == "is lost":
            told = self.now < 110.0
        self.seen_s = self.now if told else self.seen_s
        airborne = self.airborne
        if self.motion == "bounces" and self.airborne:
            airborne = self.now % 4.0 < 2.5
        in_control = self.mode is VehicleMode.CONTROL
        return Observation(
            time_s=self.now,
            position_enu_m=self.position,
            velocity_enu_m_s=self.velocity,
            yaw_enu_rad=None if self.motion == "has no heading" else 0.0,
            armed=self.armed,
            in_control=in_control,
            airborne=airborne if self.flies else None,
            ground_enu_m=0.0,
            position_age_s=self.now - self.seen_s,
            connected=True,
            operation=self.report,
            mode=self.mode,
            home_enu_m=(-300.0, -300.0, 0.0),
            mission=MissionReport(self.now, 0, frozenset(), False),
            followed=TrackedTarget(self.now, (1.0, 1.0, 0.0)) if self.sees_target else None,
        )

    def obey(self, intent: Intent) -> None:
        """Take an intent as a bridge does; an operation is over at the next step."""
        if self.report is not None and self.report.state is not OperationStatus.PENDING:
            self.report = None
        if not isinstance(intent, Perform):
            return
        self.asked.add(intent.kind)
        if self.report is None or self.report.kind is not intent.kind:
            self.report = OperationReport(intent.kind, OperationStatus.PENDING, "")
        if intent.kind is self.withheld:
            return
        self.report = OperationReport(intent.kind, OperationStatus.ACHIEVED, "")
        self.mode = _MODES.get(intent.kind, self.mode)
        if intent.kind in (TaskOperation.ARM, TaskOperation.DISARM):
            self.armed = intent.kind is TaskOperation.ARM
        elif intent.kind in (TaskOperation.TAKE_OFF, TaskOperation.START_MISSION) and self.flies:
            self.airborne = True
            self.position = (*self.position[:2], max(self.position[2], 30.0))


MOTIONS = (
    "stands", "circles", "wanders", "climbs", "bounces", "comes and goes", "is lost",
    "has no heading",
)  # fmt: skip


def run(
    name: str,
    motion: str,
    withheld: TaskOperation | None = None,
    cancel_after_s: float = math.inf,
    begins_in_air: bool = True,
    each: Callable[[Task, float], None] = lambda _task, _seconds: None,
) -> tuple[Outcome, set[TaskOperation]]:
    """Run a task to its end, which must come."""
    task, flies = TASKS[name](), name not in DRIVES
    begins_in_air = begins_in_air and flies
    sees = name == "landing on a target"
    vehicle = Hostile(motion, withheld, flies, sees, armed=begins_in_air, airborne=begins_in_air)
    if begins_in_air:
        vehicle.position = (0.0, 0.0, 30.0)
    elif name.startswith("return"):
        vehicle.armed = True
    task.start(vehicle.observe(), vehicle.now)
    cancelled = False
    while vehicle.now < 100.0 + LONGEST_S:
        if vehicle.now - 100.0 >= cancel_after_s and not cancelled:
            task.cancel(vehicle.now)
            cancelled = True
        each(task, vehicle.now - 100.0)
        answer = task.step(vehicle.observe(), vehicle.now)
        if isinstance(answer, Outcome):
            return answer, vehicle.asked
        vehicle.obey(answer)
        vehicle.move()
    raise AssertionError(f"{name}: no end while the vehicle {motion}, without {withheld}")


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("name", TASKS)
def test_every_task_ends_whatever_the_vehicle_does(name: str, motion: str) -> None:
    for begins_in_air in (False, True):
        run(name, motion, begins_in_air=begins_in_air)
    for cancel_after_s in (0.0, 1.0, 20.0):
        run(name, motion, cancel_after_s=cancel_after_s)


CASES = [(motion, air, cancel) for motion in ("stands", "circles") for air in (False, True)
         for cancel in (math.inf, 0.25, 1.0, 5.0)]  # fmt: skip
KINDS: dict[str, set[TaskOperation]] = {}


def kinds_of(name: str) -> set[TaskOperation]:
    """The operations that a task asks for, over all cases."""
    if name not in KINDS:
        KINDS[name] = set().union(
            *(run(name, m, cancel_after_s=c, begins_in_air=a)[1] for m, a, c in CASES)
        )
    return KINDS[name]


def test_every_kind_of_operation_is_asked_for_by_some_task() -> None:
    assert set().union(*(kinds_of(name) for name in TASKS)) == set(TaskOperation)


@pytest.mark.parametrize("name", TASKS)
def test_every_task_ends_though_an_operation_never_does(name: str) -> None:
    for kind in kinds_of(name):
        for motion, air, cancel_after_s in CASES:
            run(name, motion, kind, cancel_after_s, air)


@pytest.mark.parametrize("name", TASKS)
def test_every_task_ends_when_it_is_cancelled_though_nothing_is_ever_done(name: str) -> None:
    for kind in kinds_of(name):
        for asked in TaskOperation:
            if asked is not kind:
                run(name, "wanders", asked, cancel_after_s=3.0)


@pytest.mark.parametrize("name", [name for name in TASKS if "landing" not in name])
def test_a_pause_that_is_lifted_does_not_take_the_bounds_away(name: str) -> None:
    def each(task: Task, seconds: float) -> None:
        if seconds == 10.0:
            task.pause(seconds)
        elif seconds == 40.0:
            task.unpause(seconds)

    for motion in MOTIONS:
        run(name, motion, each=each)
