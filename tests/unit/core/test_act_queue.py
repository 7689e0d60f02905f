"""Acts at the waypoints of a route: when, in which order, and what their failure means."""

from __future__ import annotations

from collections.abc import Sequence

from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.flying.flight import SetpointFlight
from navigation_core.tasks.flying.route import fly_route
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.inputs.waypoint_acts import (
    ActReport,
    SetServo,
    TakePhoto,
    TriggerDistance,
    UseGripper,
    VehicleAct,
    WaitHere,
    WaypointAct,
)
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.waypoint import Route, RouteWaypoint
from tests.support.models.point_mass import PointMass, fly

PLACES = ((8.0, 0.0, 3.0), (16.0, 0.0, 3.0), (24.0, 0.0, 3.0))
ANSWER_S = 0.4


class Equipment:
    """Answers the acts of a task after a while, as a bridge would, and keeps where they came."""

    def __init__(self, task: SetpointFlight, vehicle: PointMass, bad: Sequence[str] = ()) -> None:
        self._task, self._vehicle, self._bad = task, vehicle, bad
        self.done: list[tuple[VehicleAct, float]] = []
        self._since_s = 0.0

    def __call__(self, now: float) -> None:
        order, report = self._task.act, self._vehicle.act
        if order is None or (report is not None and report.number == order.number):
            return
        if len(self.done) < order.number:
            self.done.append((order.act, self._vehicle.position[0]))
            self._since_s = now
        elif now - self._since_s >= ANSWER_S and "SILENT" not in self._bad:
            failure = "it was DENIED" if order.act.name in self._bad else ""
            self._vehicle.act = ActReport(order.number, failure)


def route(*acts: Sequence[WaypointAct], hold_time_s: float = 0.0) -> SetpointFlight:
    waypoints = tuple(
        RouteWaypoint(place, 0.5, hold_time_s, max_speed_m_s=2.0, acts=tuple(some))
        for place, some in zip(PLACES, acts, strict=True)
    )
    return fly_route(Route(waypoints), FlightTerms(GotoConfig()))


def hovering() -> PointMass:
    return PointMass(position=(0.0, 0.0, 3.0), armed=True, in_control=True, airborne=True)


PHOTO, SERVO = WaypointAct(TakePhoto()), WaypointAct(SetServo(9, 1500))


def test_acts_are_done_in_their_order_where_they_belong() -> None:
    vehicle = hovering()
    task = route([SERVO, PHOTO], [WaypointAct(TriggerDistance(2.0))], [PHOTO])
    equipment = Equipment(task, vehicle)
    outcome = fly(task, vehicle, equipment).outcome
    assert outcome.code is OutcomeCode.SUCCESS
    assert outcome.message == "Flew 3 of 3 waypoints."
    acts, places = zip(*equipment.done, strict=True)
    assert acts == (SetServo(9, 1500), TakePhoto(), TriggerDistance(2.0), TakePhoto())
    assert abs(places[0] - 8.0) < 1.0
    assert places[1] > places[0], "it does not stop for them"
    assert abs(places[2] - 16.0) < 1.0
    assert abs(places[3] - 24.0) < 0.5


def test_a_wait_between_acts_is_a_stop() -> None:
    vehicle = hovering()
    task = route([PHOTO, WaypointAct(WaitHere(5.0)), PHOTO], [], [])
    equipment = Equipment(task, vehicle)
    assert fly(task, vehicle, equipment).outcome.code is OutcomeCode.SUCCESS
    (_, first), (_, second) = equipment.done
    assert abs(first - 8.0) < 0.5
    assert abs(second - 8.0) < 0.5


def test_an_act_that_is_not_done_is_named_at_the_end() -> None:
    vehicle = hovering()
    task = route([PHOTO, SERVO], [], [PHOTO])
    outcome = fly(task, vehicle, Equipment(task, vehicle, ["PHOTO"])).outcome
    assert outcome.code is OutcomeCode.SUCCESS
    assert outcome.message == (
        "Flew 3 of 3 waypoints. Not done: PHOTO at waypoint 1, PHOTO at waypoint 3."
    )


def test_a_required_act_that_is_not_done_stops_the_vehicle_and_ends_the_goal() -> None:
    vehicle = hovering()
    task = route([PHOTO], [WaypointAct(TakePhoto(), required=True), SERVO], [PHOTO])
    equipment = Equipment(task, vehicle, ["PHOTO"])
    outcome = fly(task, vehicle, equipment).outcome
    assert outcome.code is OutcomeCode.ACT_FAILED
    assert "did not do PHOTO at waypoint 2, which is required: it was DENIED." in outcome.message
    assert vehicle.position[0] < 22.0
    assert len(equipment.done) == 2, "nothing more is done"


def test_a_vehicle_that_never_answers_does_not_keep_the_flight_waiting() -> None:
    vehicle = hovering()
    task = route([], [], [PHOTO, PHOTO])
    outcome = fly(task, vehicle, Equipment(task, vehicle, ["SILENT"])).outcome
    assert outcome.code is OutcomeCode.SUCCESS
    assert "Not done: PHOTO at waypoint 3, PHOTO at waypoint 3." in outcome.message


def test_a_pause_at_a_stop_does_no_act_twice() -> None:
    vehicle = hovering()
    task = route([PHOTO, WaypointAct(WaitHere(4.0)), SERVO], [], [])
    equipment = Equipment(task, vehicle)
    paused_s: list[float] = []

    def each_step(now: float) -> None:
        equipment(now)
        if len(equipment.done) == 1 and not paused_s:
            paused_s.append(now)
            task.pause(now)
        elif paused_s and now >= paused_s[0] + 8.0:
            task.unpause(now)

    assert fly(task, vehicle, each_step).outcome.code is OutcomeCode.SUCCESS
    assert [act for act, _ in equipment.done] == [TakePhoto(), SetServo(9, 1500)]


def test_a_cancel_does_nothing_more() -> None:
    vehicle = hovering()
    task = route([PHOTO, SERVO, SERVO], [PHOTO], [PHOTO])
    equipment = Equipment(task, vehicle)

    def each_step(now: float) -> None:
        equipment(now)
        if len(equipment.done) == 2:
            task.cancel(now)

    assert fly(task, vehicle, each_step).outcome.code is OutcomeCode.CANCELED
    assert len(equipment.done) == 2
    assert task.act is None


def test_at_a_missed_waypoint_photos_are_taken_but_nothing_is_dropped() -> None:
    vehicle = hovering()
    task = route([], [WaypointAct(UseGripper(grabs=False)), PHOTO], [])
    equipment = Equipment(task, vehicle)

    def each_step(now: float) -> None:
        equipment(now)
        within = 12.0 < vehicle.position[0] < 18.0
        vehicle.wind = (0.0, 1.8 if within else 0.0, 0.0)

    outcome = fly(task, vehicle, each_step).outcome
    assert outcome.code is OutcomeCode.WAYPOINT_MISSED
    assert [act for act, _ in equipment.done] == [TakePhoto()]
    assert "Not done: GRIPPER at waypoint 2." in outcome.message


def test_a_required_act_that_needs_its_waypoint_ends_the_goal_without_it() -> None:
    vehicle = hovering()
    task = route([], [WaypointAct(UseGripper(grabs=False), required=True)], [PHOTO])
    equipment = Equipment(task, vehicle)

    def each_step(now: float) -> None:
        equipment(now)
        within = 12.0 < vehicle.position[0] < 18.0
        vehicle.wind = (0.0, 1.8 if within else 0.0, 0.0)

    outcome = fly(task, vehicle, each_step).outcome
    assert outcome.code is OutcomeCode.ACT_FAILED
    assert "its waypoint was passed outside its radius" in outcome.message
    assert equipment.done == []
