"""The flight of one plan: what is known, surveys, the rehearsal, the steps, and what follows."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import Point
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from rclpy.node import Node
from rclpy.task import Future

from custom_interfaces.action import ExecutePlan
from custom_interfaces.msg import Waypoint
from custom_interfaces.srv import ComputeSurvey
from drone_navigation.console.shown_values import ShownValues
from drone_navigation.console.vehicle import VehicleClient
from flight_rehearsal.flight_parameters import SERVER_PARAMETERS, VEHICLE_PARAMETERS
from mavbridge_trees.leaves import GoalLeaf, LandHere, Return, TakeOff
from mavbridge_trees.plan import Plan
from mavbridge_trees.plan_leaves import leaf_of, rehearsed
from mavbridge_trees.plan_rehearsal import PlanRehearsal
from mavbridge_trees.progress import StoredProgress
from navigation_bridge.names import SERVER_NODE_NAME

__all__ = ["PlanEnd", "PlanFlight"]

# A server and its vehicle answer within a second or two, or not at all.
_KNOWN_S, _SURVEY_S, _REHEARSAL_S = 10.0, 20.0, 65.0
_CANCEL_S = 20.0
_HANDS_OFF = (
    *("PILOT_OVERRIDE", "CANCELED", "PREEMPTED", "SHUTTING_DOWN", "INACTIVE", "DISARMED", "LANDED"),
    *("LINK_LOST", "VEHICLE_REBOOTED", "DUPLICATE_SERVER", "DUPLICATE_VEHICLE", "NO_SERVER"),
)
"""Ends after which the vehicle is somebody else's, or cannot be reached: nothing more is sent"""


@dataclass(frozen=True)
class PlanEnd:
    """How it ended.

    Attributes:
        code: one of GoalCode.msg, or NO_SERVER.
        message: a sentence.
        steps_done: how many steps are done.
        failed_step: the one that was rejected or failed, from 1; 0: none.
    """

    code: str
    message: str
    steps_done: int
    failed_step: int = 0


class _ParameterNames:
    """The parameters that decide a flight, as the console's rehearsals name them."""

    server_names = tuple(SERVER_PARAMETERS)

    def vehicle_names(self, autopilot: str) -> tuple[str, ...]:
        return tuple(VEHICLE_PARAMETERS.get(autopilot, ()))


class PlanFlight:
    """One plan. `turn` is called ten times a second, with a steady time in s.

    Attributes:
        end: how it ended; None before.
    """

    def __init__(
        self,
        node: Node,
        vehicle: VehicleClient,
        board: ShownValues,
        plan: Plan,
        first: int,
        progress: StoredProgress,
        publish: Callable[[ExecutePlan.Feedback], None],
        now: float,
    ) -> None:
        """Begin.

        Args:
            node: that it speaks through; one thread only.
            vehicle: what is known of the vehicle.
            board: where that is put.
            plan: what is flown.
            first: the step to begin with, from 0.
            progress: where it is written down.
            publish: gets the feedback.
            now: time.
        """
        self._node, self._plan, self._progress, self._publish = node, plan, progress, publish
        self._at = first
        self._board, self._vehicle = board, vehicle
        vehicle.watch(True)
        self._survey_service = node.create_client(
            ComputeSurvey, f"{SERVER_NODE_NAME}/compute_survey"
        )
        self._routes: dict[int, Sequence[Waypoint]] = {}
        self._asked: Future | None = None
        self._rehearsal: PlanRehearsal | None = None
        self._leaf: Behaviour | None = None
        self._takes_off_first = False
        self._after: PlanEnd | None = None
        self._since_s = now
        self._phase: Callable[[float], None] = self._learn
        self.end: PlanEnd | None = None

    # --- from outside -------------------------------------------------------------------------

    def turn(self, now: float) -> None:
        """Do what is due."""
        self._vehicle.tick(now)
        if self.end is None:
            self._phase(now)
        if self.end is None:
            self._publish(self._feedback())

    def interrupt(self, code: str, message: str, now: float) -> None:
        """Cancel what is flown; it ends once that has stopped."""
        if self._after is None:
            self._store(self._at + (self._plan.on_resume == "next" and self._leaf is not None))
        self._after = PlanEnd(code, message, self._at)
        if self._leaf is not None:
            self._leaf.stop(Status.INVALID)
            self._leaf = None
        self._enter(self._stop, now)

    def close(self) -> None:
        """Stop listening."""
        if self._rehearsal is not None:
            self._rehearsal.close()
        self._vehicle.watch(False)
        self._node.destroy_client(self._survey_service)

    # --- before the first step ----------------------------------------------------------------

    def _enter(self, phase: Callable[[float], None], now: float) -> None:
        self._phase, self._since_s = phase, now

    def _learn(self, now: float) -> None:
        """Wait until it is known what decides the flight."""
        known = self._vehicle.known_for(_ParameterNames())
        status = self._board.get(self._node.get_namespace(), "status")
        if known.server and known.vehicle and status and status["position_valid"]:
            stands = not status["armed"] and status["landed"] != "in the air"
            begins = self._plan.steps[self._at].kind
            self._takes_off_first = self._at > 0 and stands and begins != "takeoff"
            self._enter(self._compute_surveys, now)
        elif now - self._since_s > _KNOWN_S:
            code = "NO_POSITION" if known.server else "NO_SERVER"
            lacks = "position" if known.server else "answer of navigation_server"
            self._finish(PlanEnd(code, f"There is no {lacks}. Nothing was flown.", self._at))

    def _compute_surveys(self, now: float) -> None:
        """Ask for the waypoints of each survey."""
        steps = self._plan.steps
        missing = [
            k for k in range(self._at, len(steps))
            if steps[k].kind == "survey" and k not in self._routes
        ]  # fmt: skip
        if not missing:
            self._rehearse(now)
        elif self._asked is None and self._survey_service.service_is_ready():
            # A request to a server that is not discovered yet would be lost.
            self._asked = self._survey_service.call_async(_survey(steps[missing[0]].values))
            self._since_s = now
        elif self._asked is not None and self._asked.done():
            answer, self._asked = self._asked.result(), None
            if answer.success:
                self._routes[missing[0]] = answer.waypoints
            else:
                self._finish(self._rejected(missing[0], answer.message))
        elif now - self._since_s > _SURVEY_S:
            self._finish(self._rejected(missing[0], "TIMEOUT: No survey was computed."))

    def _rehearse(self, now: float) -> None:
        known = self._vehicle.known_for(_ParameterNames()).values
        steps = [
            rehearsed(step, self._routes.get(k, ()))
            for k, step in enumerate(self._plan.steps)
            if k >= self._at
        ]
        if self._takes_off_first:
            steps.insert(0, {"kind": "takeoff", "height": self._takeoff_height_m})
        try:
            order = {**known, "steps": steps, "waypoints": [], "lose_link": False}
            self._rehearsal = PlanRehearsal(order, now + _REHEARSAL_S)
        except OSError as error:
            self._finish(PlanEnd("INTERNAL_ERROR", f"No rehearsal: {error.strerror}.", self._at))
            return
        self._enter(self._await_rehearsal, now)

    def _await_rehearsal(self, now: float) -> None:
        flown = self._rehearsal.result(now) if self._rehearsal is not None else None
        if flown is None:
            return
        self._rehearsal = None
        if "error" in flown:
            text = f"The plan was not rehearsed, and is not flown: {flown['error']}"
            self._finish(PlanEnd("TIMEOUT", text, self._at))
        elif flown["code"] != "SUCCESS":
            step = max(flown["step"] - 1 - self._takes_off_first, 0) + self._at
            self._finish(self._rejected(step, f"{flown['code']}: {flown['text']}"))
        elif (text := self._lacks_energy(flown)) != "":
            self._finish(PlanEnd("LOW_BATTERY", text, self._at))
        else:
            self._begin_step(now)

    def _lacks_energy(self, flown: dict[str, Any]) -> str:
        """Return a sentence if the battery does not last; empty if it does, or that is unknown."""
        status = self._board.get(self._node.get_namespace(), "status") or {}
        reserve, left = status.get("reserve") or 0.0, flown["battery"]
        if left is None or left >= reserve or self._plan.return_below:
            return ""
        return (
            f"The whole plan takes {flown['duration_s']:.0f} s and would leave {left:.0%} of the "
            f"battery; {reserve:.0%} should remain. Nothing was flown. A plan with return_below "
            "is flown in parts."
        )

    def _rejected(self, step: int, text: str) -> PlanEnd:
        code, _, sentence = text.partition(": ")
        kind = self._plan.steps[step].kind
        words = f"Step {step + 1} ({kind}) would not succeed: {sentence} Nothing was flown."
        return PlanEnd(code, words, self._at, step + 1)

    # --- the steps ----------------------------------------------------------------------------

    @property
    def _takeoff_height_m(self) -> float:
        heights = [s.values["height"] for s in self._plan.steps if s.kind == "takeoff"]
        return float(heights[0]) if heights else 0.0

    def _begin_step(self, now: float) -> None:
        if self._takes_off_first:
            self._leaf = TakeOff(self._takeoff_height_m)
        else:
            self._leaf = leaf_of(self._plan.steps[self._at], self._routes.get(self._at, ()))
        self._leaf.setup(node=self._node)
        self._enter(self._fly, now)

    def _fly(self, now: float) -> None:
        leaf = self._leaf
        if leaf is None:
            return
        leaf.tick_once()
        goes_down = self._plan.steps[self._at].kind in ("return", "land")
        if leaf.status is Status.RUNNING and self._is_low() and not goes_down:
            text = f"Below {self._plan.return_below:.0%} of the battery, the vehicle returns."
            self._store(self._at + (self._plan.on_resume == "next"))
            leaf.stop(Status.INVALID)
            self._follow(PlanEnd("LOW_BATTERY", text, self._at), Return(), now)
        elif leaf.status is Status.SUCCESS:
            self._done(now)
        elif leaf.status is Status.FAILURE:
            self._failed(leaf, now)

    def _is_low(self) -> bool:
        battery = self._board.get(self._node.get_namespace(), "battery") or {}
        percent = battery.get("percent")
        return percent is not None and 0.01 * percent < self._plan.return_below

    def _done(self, now: float) -> None:
        if self._takes_off_first:
            self._takes_off_first = False
            self._begin_step(now)
            return
        self._at += 1
        if self._at < len(self._plan.steps):
            self._store(self._at)
            self._begin_step(now)
        else:
            self._progress.forget()
            count = len(self._plan.steps)
            self._finish(PlanEnd("SUCCESS", f"All {count} steps are done.", count))

    def _failed(self, leaf: Behaviour, now: float) -> None:
        code = leaf.code if isinstance(leaf, GoalLeaf) else "ACT_FAILED"
        text = leaf.feedback_message.partition(": ")[2] or leaf.feedback_message
        kind = "takeoff" if self._takes_off_first else self._plan.steps[self._at].kind
        end = PlanEnd(code, f"Step {self._at + 1} ({kind}): {text}", self._at, self._at + 1)
        is_ours = code not in _HANDS_OFF and not code.startswith(("FAILSAFE", "VEHICLE_FAILSAFE"))
        self._store(self._at + (self._plan.on_resume == "next"))
        if is_ours and self._plan.on_failure == "continue":
            self._node.get_logger().warning(end.message)
            self._done(now)
        elif is_ours and self._plan.on_failure in ("return", "land"):
            after = Return() if self._plan.on_failure == "return" else LandHere()
            self._follow(end, after, now)
        else:
            self._finish(end)

    # --- what follows -------------------------------------------------------------------------

    def _follow(self, end: PlanEnd, leaf: Behaviour, now: float) -> None:
        """Fly something else before the end."""
        self._after, self._leaf = end, leaf
        leaf.setup(node=self._node)
        self._enter(self._follow_on, now)

    def _follow_on(self, now: float) -> None:
        leaf, end = self._leaf, self._after
        if leaf is None or end is None:
            return
        leaf.tick_once()
        if leaf.status is Status.FAILURE:
            text = f"{end.message} Then: {leaf.feedback_message}"
            self._finish(PlanEnd(end.code, text, end.steps_done, end.failed_step))
        elif leaf.status is Status.SUCCESS:
            self._finish(end)

    def _stop(self, now: float) -> None:
        """Wait until the server has no goal any more."""
        is_active = bool(self._board.get(self._node.get_namespace(), "goal"))
        waited_s = now - self._since_s
        if self._after is not None and ((waited_s > 0.5 and not is_active) or waited_s > _CANCEL_S):
            self._finish(self._after)

    def _store(self, steps_done: int) -> None:
        try:
            self._progress.store(self._plan, steps_done)
        except OSError as error:
            self._node.get_logger().error(f"The plan's progress is not stored: {error}")

    def _finish(self, end: PlanEnd) -> None:
        self._leaf, self.end = None, end

    def _feedback(self) -> ExecutePlan.Feedback:
        feedback = ExecutePlan.Feedback(steps=len(self._plan.steps))
        of_step = getattr(self._leaf, "feedback", None)
        feedback.distance_remaining = getattr(of_step, "distance_remaining", math.nan)
        feedback.estimated_time_remaining = getattr(of_step, "estimated_time_remaining", math.nan)
        battery = self._board.get(self._node.get_namespace(), "battery") or {}
        percent = battery.get("percent")
        feedback.battery_percentage = math.nan if percent is None else float(percent)
        if self._after is not None:
            feedback.current_status = ExecutePlan.Feedback.PHASE_ENDING
        elif self._leaf is None:
            feedback.current_status = ExecutePlan.Feedback.PHASE_REHEARSING
        else:
            feedback.current_status = getattr(of_step, "current_status", "")
            feedback.step, feedback.kind = self._at + 1, self._plan.steps[self._at].kind
        return feedback


def _survey(values: Any) -> ComputeSurvey.Request:
    request = ComputeSurvey.Request(
        frame=Waypoint.FRAME_MAP,
        height=float(values["height"]),
        spacing=float(values["spacing"]),
        max_speed=float(values.get("speed", 0.0)),
        angle=math.nan,
    )
    request.boundary = [Point(x=float(x), y=float(y)) for x, y in values["area"]]
    return request
