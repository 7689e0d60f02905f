"""The ROS client of the console: finds vehicles, in a thread of its own."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from functools import partial

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.node import Node

from drone_navigation.console.messages import (
    PageCommand,
    PageFollow,
    PageGoal,
    PagePhoto,
    PagePoint,
    PlanSurvey,
    Rehearse,
    RehearseTogether,
    Replay,
)
from drone_navigation.console.page_types import Tell
from drone_navigation.console.payload.payload_requests import ask_payload
from drone_navigation.console.rehearsing.joint_rehearsal import JointRehearsal
from drone_navigation.console.rehearsing.rehearsals import Rehearsals
from drone_navigation.console.requests import Answer, VehicleRequests
from drone_navigation.console.shown_values import ShownValues
from drone_navigation.console.surveying.surveys import ask_for_survey
from drone_navigation.console.vehicle import VehicleClient
from drone_navigation.qos import STREAM_QOS
from navigation_bridge.names import SERVER_NODE_NAME
from navigation_core.tasks.traffic.volumes import Separation

__all__ = ["Fleet"]

_STATUS_TOPIC = f"/{SERVER_NODE_NAME}/vehicle_status"
_STATUS_TYPE = "custom_interfaces/msg/VehicleStatus"
# rclpy builds a wait set of all entities for each wait: with hundreds of them a wait per message
# would cost a core. Messages are collected instead, as often as pages are updated.
_PERIOD_S = 0.1
# Events and statuses come once in a while, and are kept until they are read.
_PERIOD_UNWATCHED_S = 0.5
_SEARCH_S = 1.0
# A rehearsal waits this many periods for its process and the parameters that decide the flight.
_TRIES = 150
_CALLBACKS_MAX = 2000
_UNKNOWN = "the server has not reported its parameters yet; they are asked for again."


class Fleet:
    """All vehicles of the ROS domain."""

    def __init__(self, node: Node, board: ShownValues) -> None:
        """Prepare; :meth:`start` begins.

        Args:
            node: the console's own.
            board: what the vehicles' values are put on.
        """
        self._node = node
        self._board = board
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)
        self._vehicles: dict[str, VehicleClient] = {}
        self._posted: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._wake = threading.Event()
        self._stopping = False
        self._watched = False
        self._diagnostics: object | None = None
        self._search_s = 0.0
        self._rehearsals = Rehearsals(self.post)
        self._unready: dict[str, Callable[[], None]] = {}
        self._thread = threading.Thread(target=self._run, name="ros", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._stopping = True
        self._wake.set()
        self._thread.join(5.0)
        self._rehearsals.close()
        self._executor.shutdown(timeout_sec=1.0)

    # --- from any thread ------------------------------------------------------------------

    def post(self, work: Callable[[], None]) -> None:
        """Have something done in the thread of ROS, at once."""
        self._posted.put(work)
        self._wake.set()

    def watch(self, watched: bool) -> None:
        """Set whether any page is open."""
        self.post(partial(self._watch, watched))

    def prepare(self, vehicle: str) -> None:
        """Find the services of a vehicle: a page has taken control."""
        self.post(lambda: self._with(vehicle, VehicleRequests.find_all, _no_answer))

    def hold(self, vehicle: str, answer: Answer) -> None:
        """End the goal of a vehicle and hold."""
        self.post(lambda: self._with(vehicle, lambda v: v.trigger("hold", answer), answer))

    def cancel(self, vehicle: str, answer: Answer) -> None:
        """Cancel all goals of a vehicle."""
        self.post(lambda: self._with(vehicle, lambda v: v.cancel(answer), answer))

    def command(self, command: PageCommand, by: str, answer: Answer) -> None:
        """Execute a command of a page; `by` names the page."""
        self.post(
            lambda: self._with(command.vehicle, lambda v: v.command(command, by, answer), answer)
        )

    def fly(self, order: PageGoal | PageFollow, by: str, answer: Answer) -> None:
        """Send a goal, a route, or a target to follow; `by` names the page."""
        self.post(lambda: self._with(order.vehicle, lambda v: v.fly(order, by, answer), answer))

    def payload(self, asked: PagePhoto | PagePoint, answer: Answer) -> None:
        """Take a photo, or point the gimbal."""
        act = partial(ask_payload, asked=asked, answer=answer)
        self.post(lambda: self._with(asked.vehicle, act, answer))

    def survey(self, asked: PlanSurvey, tell: Tell, answer: Answer) -> None:
        """Compute lines over an area, which moves nothing."""
        act = partial(ask_for_survey, asked=asked, tell=tell, answer=answer)
        self.post(lambda: self._with(asked.vehicle, act, answer))

    def rehearse(self, order: Rehearse, by: str, tell: Tell) -> None:
        """Simulate how a goal or a route would go; `by` names the page."""
        self.post(lambda: self._rehearse(order, by, tell))

    def rehearse_together(self, order: RehearseTogether, by: str, tell: Tell) -> None:
        """Simulate how goals and routes of several vehicles would go; `by` names the page."""
        self.post(lambda: self._rehearse_together(order, by, tell))

    def replay(self, replay: Replay, answer: Answer) -> None:
        """Play a recording."""
        self.post(lambda: self._with(replay.vehicle, lambda v: v.replay(replay, answer), answer))

    # --- the thread of ROS ----------------------------------------------------------------

    def _with(self, name: str, act: Callable[[VehicleRequests], None], answer: Answer) -> None:
        vehicle = self._vehicles.get(name)
        if vehicle is None:
            answer(False, "There is no such vehicle.")
        else:
            act(vehicle.requests)

    def _rehearse(
        self,
        order: Rehearse,
        by: str,
        tell: Tell,
        lose_link: bool = True,
        tries: int = _TRIES,
    ) -> None:
        """Rehearse once it is known what decides the flight, or cannot be waited for."""
        vehicle = self._vehicles.get(order.vehicle)
        if vehicle is None:
            return
        self._rehearsals.warm_up()
        known = vehicle.known_for(self._rehearsals)
        if tries and not (known.server and known.vehicle):
            again = partial(self._rehearse, order, by, tell, lose_link, tries - 1)
            self._unready[by] = again
            return
        self._unready.pop(by, None)
        if known.server:
            acts = ("the acts at waypoints",) if any(w.acts for w in order.waypoints) else ()
            self._rehearsals.begin(by, order, known.values, tell, known.lacks + acts, lose_link)
        else:
            # With the defaults it would claim rejections that the server does not make.
            about = {"vehicle": order.vehicle, "number": order.number}
            tell({"type": "rehearsal", **about, "error": _UNKNOWN})

    def _rehearse_together(self, order: RehearseTogether, by: str, tell: Tell) -> None:
        """Rehearse one after the other, then compare the flights."""
        ordered = {route.vehicle: route for route in order.routes}
        ready = [(name, v) for name, v in self._vehicles.items() if name in ordered]
        joint: JointRehearsal | None = None

        def take(name: str, message: dict[str, object]) -> None:
            nonlocal joint
            if joint is None:
                # The first answer comes after the servers' parameters have.
                joint = self._joint_rehearsal(tuple(name for name, _ in ready))
            if joint.take(name, message):
                # Beside the thread of ROS: nothing that stops a vehicle waits for it.
                threading.Thread(target=finish, args=(joint,), daemon=True).start()

        def finish(joint: JointRehearsal) -> None:
            tell({"type": "together", "number": order.number, **joint.result()})

        for name, _ in ready:
            route = ordered[name]
            single = Rehearse(
                name,
                route.waypoints,
                route.speed_m_s,
                route.laps,
                route.avoid_obstacles,
                route.radius_m,
                order.number,
            )
            self._rehearse(single, f"{by}: {name}", partial(take, name), lose_link=False)

    def _joint_rehearsal(self, ordered: tuple[str, ...]) -> JointRehearsal:
        separations = [
            v.parameters.separation
            for v in self._vehicles.values()
            if v.parameters.separation is not None
        ]
        # The greater one of two servers, each of which has its vehicles keep its own.
        separation = Separation(
            max((s.horizontal_m for s in separations), default=Separation.horizontal_m),
            max((s.vertical_m for s in separations), default=Separation.vertical_m),
        )
        switches = [self._vehicles[name].parameters.is_separated for name in ordered]
        is_separated = None if None in switches else all(switches)
        vehicles = {name: vehicle.for_others() for name, vehicle in self._vehicles.items()}
        return JointRehearsal(ordered, vehicles, separation, is_separated)

    def _run(self) -> None:
        while not self._stopping:
            begun_s = time.monotonic()
            self._wake.clear()
            try:
                self._turn(begun_s)
            except ShutdownException:
                return
            except Exception as error:
                # One message that is not as expected must not end the console.
                self._node.get_logger().error(f"A message was skipped: {error!r}")
            period_s = _PERIOD_S if self._watched else _PERIOD_UNWATCHED_S
            self._wake.wait(max(period_s - (time.monotonic() - begun_s), 0.01))

    def _turn(self, now_s: float) -> None:
        while not self._posted.empty():
            self._posted.get()()
        if now_s >= self._search_s:
            self._search_s = now_s + _SEARCH_S
            self._search(now_s)
        self._take_messages()
        for vehicle in self._vehicles.values():
            vehicle.tick(now_s)
        self._rehearsals.tick(now_s)
        for rehearse in list(self._unready.values()):
            rehearse()

    def _take_messages(self) -> None:
        try:
            for _ in range(_CALLBACKS_MAX):
                task, _entity, _node = self._executor.wait_for_ready_callbacks(timeout_sec=0)
                task()
                error = task.exception()
                if error is not None:
                    self._node.get_logger().error(f"A message was skipped: {error!r}")
        except TimeoutException:
            return

    def _search(self, now_s: float) -> None:
        """Meet vehicles that have appeared; one whose server is gone stays, as silent."""
        here = set()
        for topic, kinds in self._node.get_topic_names_and_types():
            if topic.endswith(_STATUS_TOPIC) and _STATUS_TYPE in kinds:
                here.add(topic.removesuffix(_STATUS_TOPIC) or "/")
        for name in sorted(here - self._vehicles.keys()):
            self._vehicles[name] = VehicleClient(self._node, name, self._board, now_s)
            self._board.put(name, "alive", False)
            self._vehicles[name].watch(self._watched)
        if self._watched:
            services = {name for name, _ in self._node.get_service_names_and_types()}
            for vehicle in self._vehicles.values():
                vehicle.look_for_replay(services)

    def _watch(self, watched: bool) -> None:
        if watched == self._watched:
            return
        self._watched = watched
        for vehicle in self._vehicles.values():
            vehicle.watch(watched)
        if watched:
            self._diagnostics = self._node.create_subscription(
                DiagnosticArray, "/diagnostics", self._take_diagnostics, STREAM_QOS
            )
        else:
            self._node.destroy_subscription(self._diagnostics)
            self._rehearsals.close()

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        for vehicle in self._vehicles.values():
            vehicle.diagnostics(message.status)


def _no_answer(_done: bool, _text: str) -> None:
    """Take an answer that nobody waits for."""
