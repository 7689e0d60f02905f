"""The life cycle of a mission, in every phase and with every event."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from navigation_core.geometry import Vector3, distance
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Intent, Outcome, Perform
from navigation_core.tasks.observation import (
    MissionReport,
    Observation,
    OperationReport,
    OperationStatus,
    TaskOperation,
    VehicleMode,
)
from navigation_core.tasks.phases import MISSION, STOPPING, Phase
from navigation_core.tasks.progress import Status
from navigation_core.tasks.traits import COPTER, Traits
from navigation_core.tasks.watching.mission import FlyMission
from navigation_core.tasks.waypoint import MissionPlan, Route, RouteWaypoint

CONFIG = GotoConfig(may_arm=True)
STEP_S = 0.1
SPEED_M_S = 4.0
WAYPOINTS = tuple(
    RouteWaypoint(place, 1.0) for place in ((20.0, 0.0, 3.0), (20.0, 20.0, 3.0), (0.0, 20.0, 3.0))
)
Each = Callable[["Mission"], None]


@dataclass
class Mission:
    """A vehicle that stores and flies a mission, with a task that watches over it."""

    task: FlyMission
    armed: bool = False
    airborne: bool = False
    mode: VehicleMode = VehicleMode.HOLD
    position: Vector3 = (0.0, 0.0, 0.0)
    refuses: frozenset[TaskOperation] = frozenset()
    answers: bool = True
    told: frozenset[int] = frozenset(range(9))
    changed: str = ""
    now: float = 0.0
    current: int = 0
    plan: MissionPlan | None = None
    asked: list[TaskOperation] = field(default_factory=list)
    outcome: Outcome | None = None
    statuses: list[Status] = field(default_factory=list)
    _operation: OperationReport | None = None
    _done_s: float = math.inf
    _speed_m_s: float = 0.0

    def observation(self) -> Observation:
        complete = self.plan is not None and self.current >= len(self.plan.waypoints)
        report = MissionReport(
            self.now, self.current, self.told & set(range(self.current)), complete, self.changed
        )
        return Observation(
            self.now, self.position, (self._speed_m_s, 0.0, 0.0), 0.0, self.armed, False,
            self.airborne, 0.0, 0.0, True, self._operation, self.mode,
            mission=report if self.plan is not None else None,
        )  # fmt: skip

    def run(self, each: Each = lambda _: None, limit_s: float = 200.0) -> Outcome:
        self.task.start(self.observation(), self.now)
        while self.now < limit_s:
            self.now += STEP_S
            self._finish()
            self._move()
            each(self)
            answer = self.task.step(self.observation(), self.now)
            progress = self.task.progress(self.observation(), self.now)
            assert math.isfinite(progress.distance_remaining_m + progress.time_remaining_s)
            self.statuses.append(progress.status)
            if isinstance(answer, Outcome):
                self.outcome = answer
                assert self.task.step(self.observation(), self.now) == answer
                return answer
            self._obey(answer)
        raise AssertionError(f"no end in {limit_s} s, in {self.task.phase}")

    def _obey(self, intent: Intent) -> None:
        report = self._operation
        if report is not None and report.state is not OperationStatus.PENDING:
            self._operation = None
        if not isinstance(intent, Perform):
            return
        if self._operation is not None and self._operation.kind is intent.kind:
            return
        self.asked.append(intent.kind)
        self._operation = OperationReport(intent.kind, OperationStatus.PENDING, "")
        self._done_s = self.now + 0.5 if self.answers else math.inf
        if intent.mission is not None:
            self.plan = intent.mission

    def _finish(self) -> None:
        if self._operation is None or self.now < self._done_s:
            return
        kind, self._done_s = self._operation.kind, math.inf
        if kind in self.refuses:
            self._operation = OperationReport(kind, OperationStatus.REFUSED, "because")
            return
        self._operation = OperationReport(kind, OperationStatus.ACHIEVED, "")
        if kind is TaskOperation.ARM:
            self.armed = True
        elif kind is TaskOperation.DISARM:
            self.armed = False
        elif kind is TaskOperation.HOLD:
            self.mode = VehicleMode.HOLD
        elif kind is TaskOperation.TAKE_CONTROL:
            self.mode = VehicleMode.CONTROL
        elif kind is TaskOperation.START_MISSION:
            self.mode = VehicleMode.MISSION
        elif kind is TaskOperation.CLEAR_MISSION:
            self.plan = None

    def _move(self) -> None:
        self._speed_m_s = 0.0
        flies = self.mode is VehicleMode.MISSION and self.armed
        if self.plan is None or not flies or self.current >= len(self.plan.waypoints):
            return
        self.airborne = True
        target = self.plan.waypoints[self.current].position_enu_m
        left_m = distance(self.position, target)
        share = min(SPEED_M_S * STEP_S / left_m, 1.0) if left_m > 0.0 else 1.0
        x, y, z = (a + share * (b - a) for a, b in zip(self.position, target, strict=True))
        self.position, self._speed_m_s = (x, y, z), SPEED_M_S
        self.current += share == 1.0


def mission(
    laps: int = 1, config: GotoConfig = CONFIG, traits: Traits = COPTER, **vehicle: object
) -> Mission:
    return Mission(FlyMission(Route(WAYPOINTS, laps), config, traits, 4.0), **vehicle)  # type: ignore[arg-type]


def flying(**vehicle: object) -> Mission:
    return mission(armed=True, airborne=True, position=(0.0, 0.0, 3.0), **vehicle)  # type: ignore[arg-type]


def in_phase(phase: Phase, what: Callable[[Mission], None]) -> Each:
    """Return what does something at the first step in a phase, but not before it has begun."""
    done: list[bool] = []

    def each(mission: Mission) -> None:
        if mission.task.phase is phase and not done:
            done.append(True)
            what(mission)

    return each


def pause_it(mission: Mission) -> None:
    assert mission.task.pause(mission.now) is None


UPLOAD, CONTROL, ARM = TaskOperation.UPLOAD_MISSION, TaskOperation.TAKE_CONTROL, TaskOperation.ARM
START, HOLD, CLEAR = TaskOperation.START_MISSION, TaskOperation.HOLD, TaskOperation.CLEAR_MISSION


def test_from_the_ground_it_is_uploaded_before_anything_moves() -> None:
    vehicle = mission()
    assert vehicle.run().code is OutcomeCode.SUCCESS
    assert vehicle.asked == [UPLOAD, CONTROL, ARM, START]
    assert vehicle.plan is not None
    assert vehicle.plan.takeoff_from_enu_m == (0.0, 0.0, 0.0)
    assert vehicle.plan.takeoff_height_m == CONFIG.takeoff_height_m
    assert vehicle.outcome is not None
    assert vehicle.outcome.message == "Flew 3 of 3 waypoints."


def test_in_flight_the_vehicle_is_stopped_first_and_nothing_takes_off() -> None:
    vehicle = flying(mode=VehicleMode.CONTROL)
    assert vehicle.run().code is OutcomeCode.SUCCESS
    assert vehicle.asked == [HOLD, UPLOAD, START]
    assert vehicle.plan is not None
    assert vehicle.plan.takeoff_from_enu_m is None


def test_a_vehicle_that_takes_off_by_itself_is_armed_where_it_is() -> None:
    vehicle = mission(traits=Traits(control_before_takeoff=False))
    assert vehicle.run().code is OutcomeCode.SUCCESS
    assert vehicle.asked == [UPLOAD, ARM, START]


def test_laps_are_written_out_and_counted() -> None:
    vehicle = mission(laps=3)
    laps: list[int] = []

    def each(mission: Mission) -> None:
        route = mission.task.progress(mission.observation(), mission.now).route
        assert route is not None
        laps.append(route.lap)
        assert route.remaining + route.lap * 3 + route.current == 9

    assert vehicle.run(each).message == "Flew 9 of 9 waypoints."
    assert set(laps) == {0, 1, 2}


def test_distance_and_time_only_shrink_in_flight() -> None:
    vehicle = flying()
    left: list[float] = []

    def each(mission: Mission) -> None:
        if mission.task.phase is Phase.NAVIGATING:
            progress = mission.task.progress(mission.observation(), mission.now)
            left.append(progress.distance_remaining_m)

    vehicle.run(each)
    assert left[0] == pytest.approx(60.0, abs=2.0)
    assert all(b <= a + 1e-6 for a, b in itertools.pairwise(left))


@pytest.mark.parametrize("phase", [phase for phase in MISSION if phase not in STOPPING])
def test_a_cancel_in_any_phase_ends_canceled_stopped_and_without_the_mission(
    phase: Phase,
) -> None:
    vehicle = flying(mode=VehicleMode.CONTROL) if phase is Phase.HALTING else mission()
    cancel = in_phase(phase, lambda mission: mission.task.cancel(mission.now))
    pausing = phase in (Phase.PAUSING, Phase.PAUSED)
    pause = in_phase(Phase.NAVIGATING, pause_it)

    def each(mission: Mission) -> None:
        if pausing:
            pause(mission)
        cancel(mission)

    assert vehicle.run(each).code is OutcomeCode.CANCELED
    assert vehicle.mode is not VehicleMode.MISSION
    assert vehicle.armed == vehicle.airborne, "motors off on the ground"
    if phase not in (Phase.HALTING, Phase.UPLOADING):
        assert vehicle.asked[-1] is CLEAR


def test_a_cancel_before_the_upload_has_begun_clears_nothing() -> None:
    vehicle = mission()
    vehicle.task.cancel(0.0)
    assert vehicle.run().code is OutcomeCode.CANCELED
    assert vehicle.asked == []


def test_a_cut_off_upload_leaves_no_half_mission() -> None:
    vehicle = mission()

    def each(mission: Mission) -> None:
        if mission.asked == [UPLOAD]:
            mission.task.cancel(mission.now)

    assert vehicle.run(each).code is OutcomeCode.CANCELED
    assert vehicle.asked == [UPLOAD, CLEAR]


@pytest.mark.parametrize(
    ("kind", "code"),
    [
        (UPLOAD, OutcomeCode.MISSION_REFUSED),
        (CONTROL, OutcomeCode.MODE_REFUSED),
        (ARM, OutcomeCode.ARMING_REFUSED),
        (START, OutcomeCode.MISSION_REFUSED),
    ],
)
def test_a_rejection_ends_it_with_the_reason_and_the_motors_off(
    kind: TaskOperation, code: OutcomeCode
) -> None:
    vehicle = mission(refuses=frozenset({kind}))
    outcome = vehicle.run()
    assert outcome.code is code
    assert "because" in outcome.message
    assert not vehicle.armed
    assert (CLEAR in vehicle.asked) == (kind is not UPLOAD)


def test_a_rejected_hold_in_flight_ends_it_before_anything_is_uploaded() -> None:
    vehicle = flying(mode=VehicleMode.CONTROL, refuses=frozenset({HOLD}))
    assert vehicle.run().code is OutcomeCode.MODE_REFUSED
    assert UPLOAD not in vehicle.asked


def test_a_vehicle_that_never_answers_ends_it_in_bounded_time() -> None:
    assert mission(answers=False).run().code is OutcomeCode.MISSION_REFUSED


def test_a_clear_that_is_rejected_is_reported() -> None:
    vehicle = flying(refuses=frozenset({CLEAR}))
    cancel = in_phase(Phase.NAVIGATING, lambda mission: mission.task.cancel(mission.now))
    outcome = vehicle.run(cancel)
    assert outcome.code is OutcomeCode.CANCELED
    assert "clear the mission" in outcome.message


def test_it_may_not_arm_unless_allowed() -> None:
    vehicle = mission(config=GotoConfig(may_arm=False))
    assert vehicle.run().code is OutcomeCode.ARMING_NOT_ALLOWED
    assert vehicle.asked == []


def test_it_may_not_take_off_unless_allowed() -> None:
    vehicle = mission(config=GotoConfig(), armed=True)
    assert vehicle.run().code is OutcomeCode.TAKEOFF_NOT_ALLOWED
    assert vehicle.asked == []


def test_a_vehicle_that_was_landed_in_a_pause_does_not_take_off_for_its_mission() -> None:
    vehicle = flying(config=GotoConfig())
    pause = in_phase(Phase.NAVIGATING, pause_it)

    def each(mission: Mission) -> None:
        pause(mission)
        if mission.now > 14.0:
            mission.airborne = False
            mission.task.unpause(mission.now)

    assert vehicle.run(each).code is OutcomeCode.TAKEOFF_NOT_ALLOWED
    assert vehicle.asked.count(START) == 1
    assert vehicle.plan is None, "the mission is removed, so that nobody starts it later"


def test_a_pause_holds_and_continues_with_the_same_mission() -> None:
    vehicle = flying()

    pause = in_phase(Phase.NAVIGATING, pause_it)

    def each(mission: Mission) -> None:
        pause(mission)
        if mission.now > 14.0:
            mission.task.unpause(mission.now)

    assert vehicle.run(each).code is OutcomeCode.SUCCESS
    # An ArduCopter forgets its speed in a pause.
    assert vehicle.asked == [UPLOAD, START, HOLD, START, TaskOperation.CHANGE_SPEED]
    assert Status.PAUSED in vehicle.statuses


def test_disarming_ends_it_in_flight_and_while_paused() -> None:
    for paused in (False, True):
        vehicle = flying()

        def each(mission: Mission, paused: bool = paused) -> None:
            if paused and mission.task.phase is Phase.NAVIGATING:
                mission.task.pause(mission.now)
            if mission.now > 8.0:
                mission.armed = False

        assert vehicle.run(each).code is OutcomeCode.DISARMED


def test_a_mission_that_somebody_changed_is_left_to_them() -> None:
    vehicle = flying()

    def each(mission: Mission) -> None:
        mission.changed = "it was removed" if mission.now > 8.0 else ""

    outcome = vehicle.run(each)
    assert outcome.code is OutcomeCode.MISSION_CHANGED
    assert "it was removed" in outcome.message
    assert vehicle.asked == [UPLOAD, START]


def test_a_hold_that_nobody_here_asked_for_is_somebody_taking_over() -> None:
    vehicle = flying()

    def each(mission: Mission) -> None:
        if mission.now > 6.0:
            mission.mode = VehicleMode.HOLD

    assert vehicle.run(each).code is OutcomeCode.PILOT_OVERRIDE
    assert vehicle.asked == [UPLOAD, START]


def test_holding_at_the_end_is_the_vehicles_own_way_to_finish() -> None:
    """A PX4 goes to AUTO.LOITER at the end of a mission, before it says that it is complete."""
    vehicle = flying()

    def each(mission: Mission) -> None:
        if mission.current == len(WAYPOINTS):
            assert mission.task.accepts_mode(VehicleMode.HOLD)
            mission.mode = VehicleMode.HOLD

    assert vehicle.run(each).code is OutcomeCode.SUCCESS


def test_a_vehicle_that_does_not_move_is_stopped() -> None:
    vehicle = flying()

    def each(mission: Mission) -> None:
        if mission.task.phase is Phase.NAVIGATING:
            mission.position = (5.0, 0.0, 3.0)

    assert vehicle.run(each).code is OutcomeCode.TIMEOUT
    assert vehicle.asked[-2:] == [HOLD, CLEAR]


def test_waypoints_count_by_measurement_when_their_reports_are_lost() -> None:
    vehicle = flying(told=frozenset())
    assert vehicle.run().message == "Flew 3 of 3 waypoints."


def test_skipped_waypoints_are_named_and_no_success() -> None:
    vehicle = flying(told=frozenset({1, 2}))

    def each(mission: Mission) -> None:
        if mission.position[0] > 10.0:
            mission.current = max(mission.current, 1)

    outcome = vehicle.run(each)
    assert outcome.code is OutcomeCode.WAYPOINT_MISSED
    assert "Flew 2 of 3 waypoints. Skipped or passed outside their radius: 1 " in outcome.message
    route = vehicle.task.progress(vehicle.observation(), vehicle.now).route
    assert route is not None
    assert route.missed == (0,)


def test_one_that_cannot_hover_circles_the_last_waypoint() -> None:
    plane = Traits(name="plane", hovers=False, control_before_takeoff=False, circle_radius_m=10.0)
    vehicle = mission(traits=plane)
    outcome = vehicle.run()
    assert outcome.code is OutcomeCode.SUCCESS
    assert "circles" in outcome.message
    assert vehicle.plan is not None
    assert vehicle.plan.circle_at_end
