"""Keeps one vehicle apart from the others: the volumes it holds, the operations that wait. No ROS.

The path of a flight by setpoints is reserved by its task. Everything else is reserved here: where
a vehicle stands, and what its autopilot flies by itself. An operation is requested from the
autopilot once its whole volume is free. An autopilot that acts unasked, or is not heard, is assumed
to continue, whatever others hold.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mavlink_vehicle.codec import Message
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.requests import Request
from navigation_bridge.names import RETURN_ACTION_NAME, TRAJECTORY_ACTION_NAME
from navigation_bridge.requests.feature import Delay, Feature, FeatureParts, Redirection
from navigation_bridge.snapshot import LocatedSnapshot, Snapshot
from navigation_bridge.traffic import own_volumes
from navigation_bridge.traffic.announcements import Announcements
from navigation_bridge.traffic.other_traffic import seen_by_adsb
from navigation_bridge.traffic.own_view import OwnView
from navigation_bridge.traffic.own_volumes import is_plane
from navigation_bridge.traffic.shared_traffic import SharedTraffic
from navigation_bridge.traffic.target_conflicts import considered
from navigation_bridge.vehicle.traits import limits_of
from navigation_core.geometry import Vector3, norm
from navigation_core.limits import stopping_distance_m
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.tasks.intents import Fly, Outcome, Perform
from navigation_core.tasks.observation import TaskOperation, VehicleMode
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.steering.commanded_speed import CommandedSpeed
from navigation_core.tasks.traffic.entries import Claimant, Rank, TrafficWait
from navigation_core.tasks.traffic.path_in_traffic import BRAKE_SHARE
from navigation_core.tasks.traffic.traffic_view import TrafficFrame, TrafficView
from navigation_core.tasks.traffic.volumes import NOWHERE, Volume, joined

__all__ = ["VehicleSeparation"]

# Age of a reservation by the task from which it does not count as led any more.
_LED_AGE_MAX_S = 0.35
# Age of a position from which what the vehicle held is not given back any more.
_POSITION_AGE_MAX_S = 0.5
# Height of a return above home while the vehicle's parameter for it is unknown.
_RETURN_HEIGHT_M = 60.0
# Operations whose volume is reserved before they are requested.
_GATED = frozenset(
    {
        TaskOperation.ARM,
        TaskOperation.TAKE_OFF,
        TaskOperation.RETURN,
        TaskOperation.LAND,
        TaskOperation.LAND_ON_TARGET,
        TaskOperation.REPOSITION,
        TaskOperation.START_MISSION,
    }
)
# A return goes before every other goal, as if it had been accepted this much earlier.
_RETURN_AHEAD_S = 1e9
_ANY_HEIGHT_M = 20e3
_BY_ITSELF = frozenset({VehicleMode.RETURN, VehicleMode.LAND, VehicleMode.MISSION})
# A plane that is sent to a target this near, over ground, circles where it is.
_AT_TARGET_WITHIN_M = 30.0


class VehicleSeparation(Feature):
    """The part of the traffic of one vehicle."""

    hears = frozenset({"ADSB_VEHICLE"})

    def __init__(self, parts: FeatureParts) -> None:
        """Begin without other vehicles."""
        super().__init__(parts)
        self.name = parts.name
        self._own_view = OwnView(parts)
        self._shared: SharedTraffic | None = None
        self._asked: Perform | None = None
        self._updated_s = -math.inf
        self._gate: TrafficWait | None = None
        self._return_m: float | None = None
        self._now = 0.0
        self._target: tuple[tuple[TrafficFrame, Vector3], Volume] | None = None
        self._announcements = Announcements()
        self._commanded_speed = CommandedSpeed()

    def share(self, shared: SharedTraffic) -> None:
        """Keep apart from the other vehicles of a traffic."""
        self._shared = shared
        if self not in self.parts.in_turns:
            self.parts.in_turns.append(self)
        config = self.parts.config()
        if config.traffic.on:
            shared.alone_of[self.name] = self._alone
            self.configure(config)

    def configure(self, config: BridgeConfig) -> None:
        """Apply other settings."""
        if self._shared is not None and config.traffic.adsb_address:
            self._shared.others.own_addresses.add(config.traffic.adsb_address)

    @property
    def _config(self) -> BridgeConfig:
        return self.parts.config()

    # --- for tasks ---------------------------------------------------------------------------

    @property
    def traffic(self) -> TrafficView | None:
        """The traffic; None where there is nobody else, or no position yet."""
        shared = self._shared
        if shared is None or shared.is_alone:
            return None
        return self._own_view.of(shared)

    def progress(self, progress: Progress) -> Progress:
        """Return a progress with what an operation waits for."""
        if self._gate is None:
            return progress
        return replace(progress, status=Status.WAITING_FOR_TRAFFIC, blocked=self._gate.text)

    def consider(
        self, admitted: Admitted, request: Request, snapshot: Snapshot
    ) -> Admitted | Redirection | Rejection:
        """Check a target against those of other vehicles; it may be moved."""
        return considered(admitted, request, snapshot)

    # --- others ------------------------------------------------------------------------------

    def messages_to_send(self) -> list[Message]:
        """Return and clear the announcements of the other vehicles."""
        return self._announcements.take()

    def hear(self, message: Message, now: float) -> None:
        """Take a message of the autopilot's about another aircraft."""
        if self._shared is None or not self._config.traffic.on:
            return
        seen = seen_by_adsb(message)
        if seen is not None:
            self._shared.see(seen, now, self.name)

    def _alone(self) -> tuple[Volume, Volume] | None:
        """Return what the vehicle may enter without this server, and where it can be sent."""
        at = self.parts.look(self._now)
        if self._shared is None or not isinstance(at, LocatedSnapshot):
            return None
        view = self._own_view.of(self._shared)
        if view is None:
            return None
        centre = view.traffic_frame.traffic(np.zeros((1, 3)))
        reach = Volume.along(centre, self._config.volume.radius_max_m, _ANY_HEIGHT_M)
        return self._silent(view, at), reach

    # --- what is asked of the autopilot ------------------------------------------------------

    def delay(self, goal: ActiveGoal, intent: Perform, snapshot: Snapshot) -> Delay | None:
        """Reserve what an operation needs; return why it has to wait, or None."""
        waiting = self._waiting(goal, intent, snapshot)
        if waiting is None:
            return None
        waited_s = snapshot.time_s - waiting.since_s
        # A return is never given up because it has waited too long.
        if goal.kind == RETURN_ACTION_NAME or waited_s <= self._config.traffic.timeout_s:
            return Delay()
        return Delay(Outcome(OutcomeCode.TRAFFIC, waiting.text, None))

    def _waiting(self, goal: ActiveGoal, intent: Perform, snapshot: Snapshot) -> TrafficWait | None:
        view = TrafficView.of(snapshot)
        if view is None or intent.kind not in _GATED or goal.ending:
            self._asked = intent if intent.kind in _GATED else self._asked
            self._gate = None
            return None
        at, now = snapshot, snapshot.time_s
        if not isinstance(at, LocatedSnapshot) or _stays(intent, at):
            self._asked, self._gate = intent, None
            return None
        volume = self._volume_of(intent, view, at, goal)
        self._rank(goal, snapshot)
        before = self._gate
        # Only planes are sent to places; their task compares that with the motion of intruders.
        waits_for_intruders = intent.kind is not TaskOperation.REPOSITION
        self._gate = view.reservations.claim(self.name, volume, now, waits_for_intruders)
        if self._gate is None:
            self._asked = intent
        elif before is not None:
            self._gate = replace(self._gate, since_s=before.since_s)
        return self._gate

    def _volume_of(
        self, intent: Perform, view: TrafficView, at: LocatedSnapshot, goal: ActiveGoal | None
    ) -> Volume:
        if intent.kind is TaskOperation.RETURN:
            return own_volumes.return_home(view, at, self._return_height_m)
        if intent.kind in (TaskOperation.LAND, TaskOperation.LAND_ON_TARGET):
            return own_volumes.landing(view, at)
        if intent.kind is TaskOperation.REPOSITION and intent.target_enu_m is not None:
            if is_plane(at):
                return own_volumes.to_circle(view, at, intent.target_enu_m, intent.circle_m)
            return own_volumes.route(view, at, (intent.target_enu_m,))
        if intent.kind is TaskOperation.START_MISSION:
            targets = () if goal is None or goal.plan is None else goal.plan.targets_enu_m
            return own_volumes.route(view, at, targets)
        if not at.traits.flies:
            return own_volumes.standing(view, at, 0.0, is_parked=False)
        height_m = intent.height_m
        if height_m is None:
            height_m = self._config.goto.takeoff_height_m
        return own_volumes.climb(view, at, height_m)

    def limited(self, goal: ActiveGoal, intent: Fly, snapshot: Snapshot) -> Fly:
        """Return a setpoint as fast as a run-out from it is free, for who follows commands."""
        view = TrafficView.of(snapshot)
        self._gate = None
        steered = goal.follows_commands or goal.followed or goal.kind == TRAJECTORY_ACTION_NAME
        if view is None or not steered:
            return intent
        self._rank(goal, snapshot)
        setpoint = self._commanded_speed.slowed(
            view,
            intent.setpoint,
            *_run_out(snapshot),
            self._config.goto.limits.acceleration_horizontal_m_s2,
            snapshot.time_s,
        )
        return replace(intent, setpoint=setpoint)

    # --- what it holds ------------------------------------------------------------------------

    def is_due(self, now: float) -> bool:
        """Whether `update` has something to do."""
        return self._shared is not None and now - self._updated_s >= self._shared.period_s

    def update(self, goal: ActiveGoal | None, snapshot: Snapshot) -> None:
        """Hold what the vehicle occupies now, unless its task has just reserved its path."""
        now = snapshot.time_s
        if self._shared is None:
            return
        view = self._own_view.renewed(self._shared)
        if view is None:
            if not self._config.traffic.on:
                self._shared.reservations.forget(self.name)
            return
        self._updated_s = self._now = now
        if goal is None or goal.ending:
            self._gate = None
        self._shared.look(now)
        if self._config.traffic.announces:
            self._announcements.announce(self._shared, self.name, now)
        self._rank(goal, snapshot)
        self._ask_return_height(snapshot)
        heard = snapshot.connected and snapshot.arrival_age_s <= _POSITION_AGE_MAX_S
        if not isinstance(snapshot, LocatedSnapshot) or not heard:
            self._lose(view, snapshot)
            return
        at = snapshot
        axes, velocity = view.traffic_frame.axes, np.array(at.velocity_enu_m_s)
        position = view.traffic_frame.traffic(np.array([at.position_enu_m]))[0]
        self._shared.note_own(self.name, position, axes @ velocity, now)
        entry = view.reservations.entry(self.name)
        entry.target = None
        if goal is not None and goal.target_enu_m is not None:
            entry.target = self._target_of(view, goal.target_enu_m)
        led = entry.intent is not None and now - entry.heard_s < _LED_AGE_MAX_S
        self._keep(view, at, goal, led)
        if not led:
            self._stand(view, at, goal)

    def _target_of(self, view: TrafficView, target_enu_m: Vector3) -> Volume:
        """Return the volume at a target, which is the same for as long as that."""
        made_of = view.traffic_frame, target_enu_m
        if self._target is None or self._target[0] != made_of:
            self._target = made_of, view.volume(np.array([target_enu_m]))
        return self._target[1]

    def _lose(self, view: TrafficView, snapshot: Snapshot) -> None:
        """Give nothing back: only what a vehicle says is known to be empty.

        Once its link counts as lost it may be anywhere in what it held, on its way home, or on the
        ground below.
        """
        entry = view.reservations.entry(self.name)
        entry.moves = False
        if snapshot.connected:
            return
        entry.intent = entry.waiting = None
        if isinstance(snapshot, LocatedSnapshot):
            view.reservations.keep(self.name, self._silent(view, snapshot))

    def _stand(self, view: TrafficView, at: LocatedSnapshot, goal: ActiveGoal | None) -> None:
        """Hold where the vehicle is and comes to rest."""
        entry = view.reservations.entry(self.name)
        timeout_s, braking_m_s2 = _run_out(at)
        speed, stop_m = norm(at.velocity_enu_m_s), 0.0
        if not (at.parked or is_plane(at)):
            stop_m = stopping_distance_m(speed, timeout_s, braking_m_s2)
        held = own_volumes.standing(view, at, stop_m, at.parked)
        if self._gate is not None:
            entry.held = entry.used = held
            entry.moves = True
            return
        entry.waiting = None
        moves = goal is not None and not self._is_held(goal)
        view.reservations.stand(self.name, held, at.time_s, moves or _flies_by_itself(at))

    def _keep(
        self, view: TrafficView, at: LocatedSnapshot, goal: ActiveGoal | None, led: bool
    ) -> None:
        """Hold what the autopilot flies by itself, which gets less as it gets on."""
        if self._gate is not None:
            return  # it has not begun, and may be wished for
        asked = self._asked
        if led or (goal is None and at.parked):
            self._asked = asked = None
        if not at.armed and at.airborne:
            kept = own_volumes.landing(view, at)  # it falls
        elif at.armed and at.mode is VehicleMode.RETURN:
            kept = own_volumes.return_home(view, at, self._return_height_m)
        elif at.armed and at.mode is VehicleMode.LAND:
            kept = own_volumes.landing(view, at)
        elif asked is not None and (goal is not None or is_plane(at)):
            kept = self._volume_of(asked, view, at, goal)
        elif at.airborne and is_plane(at):
            kept = own_volumes.to_circle(view, at, at.position_enu_m)
        else:
            kept, self._asked = NOWHERE, None
        view.reservations.keep(self.name, kept)

    def _silent(self, view: TrafficView, at: LocatedSnapshot) -> Volume:
        if at.parked:
            return NOWHERE
        volumes = [own_volumes.return_home(view, at, self._return_height_m)]
        if at.traits.flies and not is_plane(at):
            volumes.append(own_volumes.landing(view, at))
        return joined(*volumes)

    def _rank(self, goal: ActiveGoal | None, snapshot: Snapshot) -> None:
        assert self._shared is not None
        entry = self._shared.reservations.entry(self.name)
        claimant, since_s = Claimant.NOTHING, 0.0
        if goal is not None:
            claimant, since_s = Claimant.GOAL, goal.accepted_s + self._shared.epoch_s
            if goal.kind == RETURN_ACTION_NAME:
                since_s -= _RETURN_AHEAD_S
        if _flies_by_itself(snapshot) or not snapshot.connected:
            claimant = Claimant.FIRMWARE
        entry.rank = Rank(claimant, since_s, self.name)

    @staticmethod
    def _is_held(goal: ActiveGoal) -> bool:
        paused = goal.paused_by_client or goal.paused_by or goal.yielded is not None
        return bool(paused) or goal.ending or goal.status in (Status.HOLDING, Status.BLOCKED)

    def _ask_return_height(self, snapshot: Snapshot) -> None:
        """Ask for the height of the vehicle's own return, once."""
        height = snapshot.profile.return_height
        if height is None or self._return_m is not None or snapshot.pose is None:
            return
        if snapshot.connected:
            name, scale = height
            (value,) = self.parts.vehicle.parameters.read((name,), snapshot.time_s)
            self._return_m = None if value is None else value * scale

    @property
    def _return_height_m(self) -> float:
        return _RETURN_HEIGHT_M if self._return_m is None else self._return_m


def _flies_by_itself(snapshot: Snapshot) -> bool:
    return snapshot.armed and snapshot.mode in _BY_ITSELF


def _run_out(snapshot: Snapshot) -> tuple[float, float]:
    """Return for how long a vehicle follows its last setpoint, and how hard it brakes then."""
    traits = snapshot.traits
    limits = limits_of(traits, snapshot.config.goto.limits)
    braking = limits.acceleration_horizontal_m_s2
    if not traits.flies:
        braking = min(braking, traits.braking_m_s2)
    return traits.setpoint_timeout_s, BRAKE_SHARE * braking


def _stays(intent: Perform, at: LocatedSnapshot) -> bool:
    """Whether a plane is to circle where it is, to be paused: it cannot wait with that."""
    target = intent.target_enu_m
    if target is None or intent.circle_m is not None:
        return False
    return math.dist(target[:2], at.position_enu_m[:2]) < _AT_TARGET_WITHIN_M
