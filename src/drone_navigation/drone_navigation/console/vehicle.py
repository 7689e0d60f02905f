"""One vehicle of the console: what its server says. One thread only."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from sensor_msgs.msg import BatteryState, NavSatFix
from visualization_msgs.msg import MarkerArray

from custom_interfaces.action import Navigate
from custom_interfaces.msg import (
    Fence,
    GoalEvent,
    HomePosition,
    ImageCaptured,
    ReplayStatus,
    StoredItems,
    VehicleStatus,
)
from drone_navigation.console import page_values, plans
from drone_navigation.console.flight_parameters import FlightParameters
from drone_navigation.console.payload.photos import Photos
from drone_navigation.console.rehearsing.joint_rehearsal import RehearsedVehicle
from drone_navigation.console.remarks import Remarks
from drone_navigation.console.requests import ACTIONS, VehicleRequests
from drone_navigation.console.shown_values import ShownValues
from drone_navigation.qos import LATCHED_QOS, STREAM_QOS
from navigation_bridge.names import SERVER_NODE_NAME
from navigation_core.safety.energy import ConsumptionEstimator

__all__ = ["ParameterNames", "VehicleClient"]

# Topics that are shown as they come: type, topic, function that makes the page's value of it.
_SHOWN: tuple[tuple[type[object], str, Callable[..., object], QoSProfile], ...] = (
    (BatteryState, "battery", page_values.battery, STREAM_QOS),
    (NavSatFix, "fix", page_values.fix, STREAM_QOS),
    (Fence, "fence", page_values.fence, LATCHED_QOS),
    (Fence, "flight_volume", page_values.fence, LATCHED_QOS),
    (StoredItems, "mission", page_values.stored_items, LATCHED_QOS),
    (StoredItems, "rally_points", page_values.stored_items, LATCHED_QOS),
)
# A status comes once a second.
_SILENT_S = 2.5
_STILL_M_S = 0.5
_EVENTS = 40
_PLANS = 5


class ParameterNames(Protocol):
    """The names of parameters that decide a flight.

    Attributes:
        server_names: those of the server.
    """

    server_names: tuple[str, ...]

    def vehicle_names(self, autopilot: str) -> tuple[str, ...]:
        """Return those of a vehicle, by the name of its firmware and kind."""


@dataclass(frozen=True)
class Knowledge:
    """Vehicle, obstacles and settings as known for a rehearsal.

    Attributes:
        values: members of its request.
        server: whether the server's parameters are among them.
        vehicle: whether any of the vehicle's are.
        lacks: what it does not consider, for people.
    """

    values: dict[str, object]
    server: bool
    vehicle: bool
    lacks: tuple[str, ...]


class VehicleClient:
    """Subscriptions and requests for one vehicle.

    Attributes:
        parameters: what its server and the vehicle have set that a rehearsal needs.
    """

    def __init__(self, node: Node, namespace: str, board: ShownValues, now: float) -> None:
        """Listen to its status.

        Args:
            node: the console's.
            namespace: the vehicle's, "/" without one.
            board: what its values are put on.
            now: time, s.
        """
        self._node = node
        self._name = namespace
        self._root = namespace.rstrip("/")
        self._board = board
        self._now = now
        self._heard_s = -math.inf
        self._server_id = ""
        self._subscriptions: list[Subscription] = []
        self._streams: list[Subscription] = []
        self._events: deque[dict[str, object]] = deque(maxlen=_EVENTS)
        self._event_count = 0
        self._plans: deque[list[list[float]]] = deque(maxlen=_PLANS)
        self._active = ""
        self._remarks = Remarks()
        self._photos = Photos(board, namespace)
        self._player = ""
        self._replay_listener: Subscription | None = None
        self._jumps = (0, False)
        self._jumped = False
        self._plan_is_old = False
        self._moves: Odometry | None = None
        # The prior counts for nothing here: only what is measured is used.
        self._consumption = ConsumptionEstimator(endurance_s=math.inf)
        self.requests = VehicleRequests(node, namespace, lambda: self.is_alive, now)
        self.parameters = FlightParameters(self.requests)
        self._listen(self._subscriptions, VehicleStatus, "vehicle_status", self._status)
        self._listen(self._subscriptions, GoalEvent, "goal_events", self._goal_event, STREAM_QOS)
        self._listen(self._subscriptions, Path, "plan", self._plan)
        self._listen(self._subscriptions, HomePosition, "home", self._home)
        self._listen(
            self._subscriptions, ImageCaptured, "image_captured", self._photos.hear, STREAM_QOS
        )

    def _listen(
        self,
        into: list[Subscription],
        kind: type[object],
        topic: str,
        callback: Callable[..., None],
        qos: QoSProfile = LATCHED_QOS,
    ) -> None:
        name = f"{self._root}/{SERVER_NODE_NAME}/{topic}"
        into.append(self._node.create_subscription(kind, name, callback, qos))

    # --- what the server says ----------------------------------------------------------

    def watch(self, watched: bool) -> None:
        """Begin or end to listen to what comes many times a second."""
        if watched == bool(self._streams):
            return
        if not watched:
            for subscription in self._streams:
                self._node.destroy_subscription(subscription)
            self._streams.clear()
            return
        self._listen(self._streams, Odometry, "odometry", self._odometry, STREAM_QOS)
        self._listen(self._streams, MarkerArray, "obstacles", self._obstacles)
        for kind, topic, fact, qos in _SHOWN:
            self._listen(self._streams, kind, topic, partial(self._show, topic, fact), qos)
        for action, kind in ACTIONS.items():
            self._streams.append(
                self._node.create_subscription(
                    kind.Impl.FeedbackMessage,
                    f"{self._root}/{action}/_action/feedback",
                    partial(self._feedback, action),
                    STREAM_QOS,
                )
            )
        self.requests.find_open()

    def tick(self, now: float) -> None:
        """Take answers and note silence, at a time in s."""
        self._now = now
        self._board.put(self._name, "alive", now - self._heard_s <= _SILENT_S)
        if self._jumped:
            self._forget()
        self.requests.tick(now)
        self._board.put(self._name, "interrupted", self.requests.interrupted.value())

    @property
    def is_alive(self) -> bool:
        """Whether its server has spoken lately."""
        return self._now - self._heard_s <= _SILENT_S

    def _status(self, message: VehicleStatus) -> None:
        before = self._board.get(self._name, "text")
        if self._server_id and message.server_id != self._server_id:
            self._tell(message.header.stamp, "server", "The server was restarted.")
            self._end_goal()
            self.parameters.forget()
        self._server_id = message.server_id
        self._heard_s = self._now
        self._board.put(self._name, "status", page_values.status(message))
        if self._board.get(self._name, "earth") is None:
            self._find_earth()
        if message.last_status_text != (before or ""):
            self._board.put(self._name, "text", message.last_status_text)
            if message.last_status_text:
                self._tell(message.header.stamp, "vehicle", message.last_status_text)
        self._set_active(message.active_goal)
        self._remarks.notes = tuple(message.goal_notes)
        self._show_remarks()

    def _set_active(self, goal_id: str) -> None:
        if goal_id == self._active:
            return
        self._active = goal_id
        self._remarks = Remarks()
        self._board.put(self._name, "goal", goal_id)
        self._board.put(self._name, "route", self.requests.routes.get(goal_id))
        if not goal_id:
            self._board.put(self._name, "feedback", None)

    def _end_goal(self) -> None:
        self._set_active("")
        self._plans.clear()
        self._board.put(self._name, "earlier", [])

    def _goal_event(self, message: GoalEvent) -> None:
        route = self.requests.routes.get(message.goal_id)
        # The code stands in a member of its own.
        text = message.message.removeprefix(f"{message.what}: ")
        if message.event == GoalEvent.ACCEPTED:
            self._plans.clear()
            self._board.put(self._name, "earlier", [])
            self._set_active(message.goal_id)
        elif message.event == GoalEvent.ENDED and message.goal_id == self._active:
            self._end_goal()
        if message.event == GoalEvent.REJECTED:
            self.requests.hear_rejection(message.goal_id, text)
        if message.event in (GoalEvent.REJECTED, GoalEvent.ENDED):
            end = {"event": message.event, "code": message.what, "text": text}
            self._board.put(self._name, "end", {**end, "number": self._event_count + 1})
        elif message.event == GoalEvent.STATUS and message.goal_id == self._active:
            self._remarks.hear(message.what, message.message)
        self._show_remarks()
        by = route["by"] if route else ""
        self._tell(message.header.stamp, message.event.lower(), text, message.what, by)

    def _show_remarks(self) -> None:
        self._board.put(self._name, "remarks", self._remarks.sentences())

    def _tell(self, stamp: Time, kind: str, text: str, code: str = "", by: str = "") -> None:
        self._event_count += 1
        event = {"number": self._event_count, "time": stamp.sec, "kind": kind, "text": text}
        event |= {"code": code, "by": by}
        self._events.append(event)
        self._board.put(self._name, "events", list(self._events))

    def _plan(self, message: Path) -> None:
        path = page_values.path(message)
        before = None if self._plan_is_old else self._board.get(self._name, "plan")
        self._plan_is_old = False
        if before and path:
            self._plans.append(before)
            self._board.put(self._name, "earlier", list(self._plans))
        self._board.put(self._name, "plan", path)

    def _home(self, message: HomePosition) -> None:
        self._board.put(self._name, "home", page_values.home(message))
        self._find_earth()

    def _find_earth(self) -> None:
        status = self._board.get(self._name, "status") or {}
        home = self._board.get(self._name, "home")
        self._board.put(self._name, "earth", plans.earth(status.get("autopilot", ""), home))

    def _odometry(self, message: Odometry) -> None:
        self._moves = message
        motion = page_values.motion(message)
        self._board.put(self._name, "motion", motion)
        if motion is not None:
            self._board.pass_through(self._name, motion["at"])

    def known_for(self, names: ParameterNames) -> Knowledge:
        """Return what decides how a goal goes, as far as it is known; asks for the rest."""
        known = {
            name: self._board.get(self._name, name)
            for name in ("status", "motion", "home", "obstacles")
        }
        battery = self._board.get(self._name, "battery") or {}
        if known["motion"] and self._moves is not None:
            known["motion"] = {**known["motion"], "velocity": page_values.velocity(self._moves)}
        autopilot = (known["status"] or {}).get("autopilot", "")
        own = names.vehicle_names(autopilot)
        self.parameters.look(names.server_names, own, self._now)
        known["battery"] = battery.get("percent")
        known["consumption"] = self._consumption.measured_rate_per_s
        parameters = self.parameters
        values = {**known, **parameters.values()}
        lacks = [] if parameters.vehicle_is_known else ["the vehicle's parameters"]
        if values["wind"] is None:
            lacks.append("the wind")
        fence = self._board.get(self._name, "fence") or {}
        if any(area["in_force"] and area["stored"] for area in fence.get("areas", ())):
            lacks.append("the areas of the vehicle's fence")
        return Knowledge(
            values, parameters.server_is_known, parameters.vehicle_is_known, tuple(lacks)
        )

    def for_others(self) -> RehearsedVehicle:
        """Return what decides where it is for others that are rehearsed."""
        status, motion, home = (
            self._board.get(self._name, name) for name in ("status", "motion", "home")
        )
        parked = bool(status) and not status["armed"] and status["landed"] == "on the ground"
        autopilot = status["autopilot"] if status else ""
        position = motion["at"] if motion and self.is_alive else None
        return RehearsedVehicle(autopilot, home, position, parked, bool(self._active))

    def _obstacles(self, message: MarkerArray) -> None:
        self._board.put(self._name, "obstacles", page_values.obstacles(message))

    def _show(self, name: str, fact: Callable[..., object], message: object) -> None:
        if isinstance(message, BatteryState):
            self._consumption.observe(self._now, message.percentage, self._is_under_way)
        self._board.put(self._name, name, fact(message))

    @property
    def _is_under_way(self) -> bool:
        """Whether the vehicle flies or drives."""
        status = self._board.get(self._name, "status") or {}
        moves = (
            self._moves is not None and math.hypot(*page_values.velocity(self._moves)) > _STILL_M_S
        )
        return bool(status.get("armed")) and (status.get("landed") == "in the air" or moves)

    def _feedback(self, action: str, message: Navigate.Impl.FeedbackMessage) -> None:
        if bytes(message.goal_id.uuid).hex() == self._active:
            self._board.put(self._name, "feedback", page_values.feedback(action, message.feedback))

    def diagnostics(self, parts: Sequence[DiagnosticStatus]) -> None:
        """Take this vehicle's parts of /diagnostics."""
        own = f"{self._root}/{SERVER_NODE_NAME}: ".lstrip("/")
        for part in parts:
            if part.name.startswith(own):
                name = part.name.removeprefix(own)
                if name in ("vehicle link", "GPS", "obstacle sensors", "control loop"):
                    self._board.put(self._name, name, page_values.diagnostic(part))

    def look_for_replay(self, services: AbstractSet[str]) -> None:
        """Find the services of a recording that is played in the vehicle's place.

        Args:
            services: names of all services.
        """
        player = self.requests.find_replay(services)
        if player == self._player:
            return
        if self._player:
            self._node.destroy_subscription(self._replay_listener)
        self._player = player
        self._board.put(self._name, "replay", {} if player else None)
        if player:
            self._replay_listener = self._node.create_subscription(
                ReplayStatus, f"{player}/replay/status", self._replay, LATCHED_QOS
            )

    def _replay(self, message: ReplayStatus) -> None:
        jumps = (message.jumps, message.seeking)
        # After the messages that came with it, in whatever order.
        self._jumped = self._jumped or jumps != self._jumps
        self._jumps = jumps
        self._board.put(self._name, "replay", page_values.replay(message))

    def _forget(self) -> None:
        """Forget what was before or after another position of a recording."""
        self._jumped, self._plan_is_old = False, True
        self._board.restart_trail(self._name)
        self._plans.clear()
        self._events.clear()
        for name, nothing in (("earlier", []), ("events", []), ("end", None), ("feedback", None)):
            self._board.put(self._name, name, nothing)
