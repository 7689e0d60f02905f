"""The server as a program sees it: ROS in a thread of its own.

All of ROS is used by that one thread, which takes work by `post`. Answers go to callbacks, which
are called there and pass them on to the thread that waits for them.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import rclpy
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from rclpy.action import ActionClient
from rclpy.client import Client
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from sensor_msgs.msg import BatteryState, NavSatFix
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from custom_interfaces.msg import VehicleStatus
from drone_navigation.client.client_goal import ClientGoal
from drone_navigation.client.events import Ended, Telemetry
from drone_navigation.client.goals import GoalStage, SentGoal
from drone_navigation.client.process import SILENT_S, SPIN_S, ServerSigns
from drone_navigation.client.rejections import Rejections
from drone_navigation.client.servers import no_server
from drone_navigation.client.watch import ServerWatch
from drone_navigation.process_control.ros_start import starting_ros
from drone_navigation.programs.errors import NO_SERVER, NavigationError
from drone_navigation.programs.reported_state import ReportedState, reported_state
from drone_navigation.qos import LATCHED_QOS, REQUEST_QOS, STREAM_QOS
from navigation_bridge.names import SERVER_NODE_NAME

__all__ = ["LinkGuest", "ServerLink", "TrackedGoal"]

_FIND_S = 10.0
"""Of a service or an action that is not there yet"""
_ANSWER_S = 30.0
"""A service of the server gives up after 25 s by itself"""
_REASON_S = 5.0
"""The reason of a rejection comes on its own topic, usually before the rejection itself"""
_CLOSE_S = 5.0
_ENDED = NavigationError(NO_SERVER, "The vehicle's 'with' block has ended, and so its connection.")


class LinkGuest(Protocol):
    """Another user of the node, in the thread of ROS."""

    def tick(self, now: float) -> None:
        """Do what is due, at a time in s; called in each turn."""

    def close(self) -> None:
        """End."""


class GoalListener(Protocol):
    """Hears of a goal, in the thread of ROS."""

    def accept(self) -> None:
        """The server has accepted it."""

    def feed(self, telemetry: Telemetry) -> None:
        """A feedback."""

    def finish(self, end: Ended | NavigationError) -> None:
        """Its end; or nothing is known of it, or it was rejected."""


@dataclass
class TrackedGoal:
    """A goal on its way.

    Attributes:
        client_goal: what is sent.
        listener: hears of it.
        origin: the program's name for itself, reported with the first feedback; empty for none.
        find_until_s: when its action is given up, while it is not sent.
        sent: once it is sent.
        cancels: whether it is to be cancelled.
        watch: of the server, while it is flown.
    """

    client_goal: ClientGoal
    listener: GoalListener
    origin: str
    find_until_s: float
    sent: SentGoal | None = None
    cancels: bool = False
    watch: ServerWatch = field(default_factory=ServerWatch)


@dataclass
class _Call:
    """A request to a service, from before the service is found to its answer."""

    client: Client
    name: str
    request: object
    done: Callable[[Any], None]
    until_s: float
    answer: Future | None = None


class ServerLink:
    """Goals, requests and topics of one server.

    Attributes:
        knows_obstacles: whether the server publishes obstacles.
    """

    def __init__(self, vehicle: str) -> None:
        """Begin to listen, and start the thread.

        Args:
            vehicle: the namespace; empty without one.

        Raises:
            RosStartError: ROS cannot start.
        """
        self._context = rclpy.Context()
        with starting_ros():
            rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
            self._node = Node("navigation_program", namespace=vehicle, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._signs = ServerSigns(self._node)
        self._actions: dict[str, ActionClient] = {}
        self._services: dict[str, Client] = {}
        self._steers: Publisher | None = None
        self._goals: list[TrackedGoal] = []
        self._calls: list[_Call] = []
        self._rejections = Rejections(self._node)
        self._origins = self._node.create_publisher(
            String, f"{SERVER_NODE_NAME}/goal_origin", STREAM_QOS
        )
        self._guests: list[LinkGuest] = []
        self._numbers = 0
        self._seen: dict[str, Any] = {}
        self._heard_s = 0.0
        self.knows_obstacles = False
        for kind, topic, qos in (
            (VehicleStatus, "vehicle_status", LATCHED_QOS),
            (PoseStamped, "pose", STREAM_QOS),
            (BatteryState, "battery", STREAM_QOS),
            (NavSatFix, "fix", STREAM_QOS),
            (MarkerArray, "obstacles", LATCHED_QOS),
        ):
            self._node.create_subscription(
                kind,
                f"{SERVER_NODE_NAME}/{topic}",
                lambda message, topic=topic: self._hear(topic, message),
                qos,
            )
        self._posted: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._ends = False
        self._thread = threading.Thread(target=self._run, name="navigation program", daemon=True)
        self._thread.start()

    # --- any thread ----------------------------------------------------------------------

    def post(self, work: Callable[[], None]) -> None:
        """Have something done in the thread of ROS, within one turn of it.

        Raises:
            NavigationError: with NO_SERVER, once that thread has ended.
        """
        if not self._thread.is_alive():
            raise _ENDED
        self._posted.put(work)

    def attach(self, make: Callable[[Node, float], LinkGuest]) -> None:
        """Let another one use the node; ``make`` gets it, and the time in s, in ROS's thread."""
        self.post(lambda: self._guests.append(make(self._node, time.monotonic())))

    @property
    def state(self) -> ReportedState | None:
        """The newest state; None before the first, and while the server is silent."""
        seen = dict(self._seen)
        if "vehicle_status" not in seen or time.monotonic() - self._heard_s > SILENT_S:
            return None
        parts = (seen.get(name) for name in ("pose", "battery", "fix"))
        return reported_state(seen["vehicle_status"], *parts)

    def close(self) -> None:
        """End the thread, and ROS with it; waits for it for a limited time."""
        self._ends = True
        self._thread.join(_CLOSE_S)

    # --- the thread of ROS ---------------------------------------------------------------

    def _run(self) -> None:
        try:
            while not self._ends:
                self._executor.spin_once(timeout_sec=SPIN_S)
                while not self._posted.empty():
                    self._posted.get()()
                now_s = time.monotonic()
                for guest in self._guests:
                    guest.tick(now_s)
                self._goals = [goal for goal in self._goals if not self._follow(goal, now_s)]
                self._calls = [call for call in self._calls if not self._serve(call, now_s)]
        finally:
            self._finish()

    def _finish(self) -> None:
        """Let nobody wait any more, and end ROS."""
        for guest in self._guests:
            guest.close()
        for goal in self._goals:
            goal.listener.finish(_ENDED)
        for call in self._calls:
            call.done(_ENDED)
        for client in self._actions.values():
            client.destroy()
        self._executor.shutdown(timeout_sec=1.0)
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def _hear(self, topic: str, message: object) -> None:
        self._seen[topic] = message
        if isinstance(message, VehicleStatus):
            self._heard_s = time.monotonic()
        elif isinstance(message, MarkerArray):
            self.knows_obstacles = True

    def send(
        self, client_goal: ClientGoal, listener: GoalListener, origin: str = ""
    ) -> TrackedGoal:
        """Send a goal once its action is found, and follow it to its end.

        Args:
            client_goal: what is sent.
            listener: hears of it.
            origin: the program's name for itself; empty for none.
        """
        if client_goal.name not in self._actions:
            client = ActionClient(
                self._node,
                client_goal.action,
                client_goal.name,
                goal_service_qos_profile=REQUEST_QOS,
                result_service_qos_profile=REQUEST_QOS,
                cancel_service_qos_profile=REQUEST_QOS,
            )
            self._actions[client_goal.name] = client
        goal = TrackedGoal(client_goal, listener, origin, time.monotonic() + _FIND_S)
        self._goals.append(goal)
        return goal

    def _follow(self, goal: TrackedGoal, now_s: float) -> bool:
        """Look at a goal; return whether nothing more comes of it."""
        if goal.sent is None:
            return self._find(goal, now_s)
        sent = goal.sent
        if sent.look(now_s) and sent.stage is GoalStage.OPEN:
            goal.watch.hear(now_s)
            goal.listener.accept()
        if goal.cancels:
            sent.cancel(now_s)
        end = self._end_of(goal, now_s)
        if end is not None:
            goal.listener.finish(end)
        return end is not None

    def _find(self, goal: TrackedGoal, now_s: float) -> bool:
        """Send a goal whose action is there; return whether it is given up."""
        client = self._actions[goal.client_goal.name]
        if goal.cancels:
            goal.listener.finish(NavigationError("CANCELED", "The goal was not sent."))
        elif client.server_is_ready():
            self._numbers += 1

            def feed(sent: SentGoal, telemetry: Telemetry) -> None:
                goal.watch.hear(time.monotonic())
                if goal.origin:  # the goal is active now
                    self._origins.publish(String(data=f"{sent.id} {goal.origin}"))
                    goal.origin = ""
                goal.listener.feed(telemetry)

            goal.sent = SentGoal(self._numbers, goal.client_goal, client, feed, now_s)
            return False
        elif now_s > goal.find_until_s:
            text = no_server(self._node, goal.client_goal.name)
            goal.listener.finish(NavigationError(NO_SERVER, text))
        else:
            return False
        return True

    def _end_of(self, goal: TrackedGoal, now_s: float) -> Ended | NavigationError | None:
        """Return the end of a goal that was sent, or None."""
        sent = goal.sent
        assert sent is not None
        if sent.stage is GoalStage.ENDED:
            return sent.end(replaced=sent.number < self._numbers)
        if sent.stage is GoalStage.REFUSED:
            reason = self._rejections.of(sent.id)
            if reason is not None:
                return NavigationError(reason.code, reason.sentence)
            if now_s > sent.since_s + _REASON_S:
                return NavigationError("INTERNAL_ERROR", "Rejected; no reason was published.")
        elif sent.stage is GoalStage.UNANSWERED:
            return NavigationError(NO_SERVER, "The server did not answer the goal request.")
        elif sent.stage is GoalStage.FORGOTTEN:
            text = "The server was restarted, and does not know the goal."
            return NavigationError(NO_SERVER, text)
        elif sent.stage is GoalStage.OPEN:
            ready = self._actions[goal.client_goal.name].server_is_ready()
            goal.watch.look(now_s, ready=ready)
            if goal.watch.asks_again(now_s):
                sent.ask_again()
            if why := goal.watch.verdict(now_s):
                return NavigationError(NO_SERVER, why)
        return None

    def call(
        self, kind: type[Any], name: str, request: object, done: Callable[[Any], None]
    ) -> None:
        """Call a service below the server's name.

        Args:
            kind: its generated type.
            name: its name.
            request: what is sent.
            done: gets the response, or a NavigationError.
        """
        if name not in self._services:
            self._services[name] = self._node.create_client(kind, f"{SERVER_NODE_NAME}/{name}")
        until_s = time.monotonic() + _FIND_S
        self._calls.append(_Call(self._services[name], name, request, done, until_s))

    def _serve(self, call: _Call, now_s: float) -> bool:
        """Look at a call; return whether it is over."""
        if call.answer is None:
            if call.client.service_is_ready():
                self._signs.begin()
                call.answer, call.until_s = call.client.call_async(call.request), now_s + _ANSWER_S
            elif now_s > call.until_s:
                text = no_server(self._node, f"{SERVER_NODE_NAME}/{call.name}")
                call.done(NavigationError(NO_SERVER, text))
                return True
            return False
        if call.answer.done():
            call.done(call.answer.result())
            return True
        why = self._signs.why_gone(call.client.service_is_ready())
        if not why and now_s > call.until_s:
            why = f"The server did not answer {call.name}."
        if why:
            call.done(NavigationError(NO_SERVER, why))
        return bool(why)

    def steer(self, linear_m_s: tuple[float, float, float], turn_rad_s: float, frame: str) -> None:
        """Publish one velocity command, of the type that the server listens to.

        Args:
            linear_m_s: forward, left, up in `base_link`; east, north, up in `map`.
            turn_rad_s: counter-clockwise.
            frame: one of both.
        """
        topic = f"{SERVER_NODE_NAME}/cmd_vel"
        if self._steers is None:
            full = self._node.resolve_topic_name(topic)
            heard = self._node.get_subscriptions_info_by_topic(full)
            if not heard:
                return
            plain = all(each.topic_type == "geometry_msgs/msg/Twist" for each in heard)
            kind = Twist if plain else TwistStamped
            self._steers = self._node.create_publisher(kind, topic, STREAM_QOS)
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.linear.z = linear_m_s
        twist.angular.z = turn_rad_s
        message = twist
        if self._steers.msg_type is TwistStamped:
            # A stamp of zero has no age.
            message = TwistStamped(twist=twist)
            message.header.frame_id = frame
        self._steers.publish(message)
