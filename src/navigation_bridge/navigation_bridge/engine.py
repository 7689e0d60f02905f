"""One turn of a goal: snapshot, rules, task, effects, outputs. No ROS.

A turn makes a :class:`Snapshot`, asks the rules (:mod:`navigation_bridge.rules.goal_rules`) in
their order, then the task, and carries out the answer (:mod:`navigation_bridge.effects`). A goal
begins in `Engine.begin` and ends in `Engine.end`, or in `Engine.abandon` if control is lost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from mavlink_vehicle.state.position_trust import PositionTrust
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.effects import Effects
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.goals.succession import successor
from navigation_bridge.obstacles.standing_obstacles import StandingObstacles
from navigation_bridge.reporting import Reporter
from navigation_bridge.requests.feature import Features
from navigation_bridge.rules import goal_rules as rules
from navigation_bridge.snapshot import Snapshot
from navigation_bridge.supervision.observer import (
    LatenessWatch,
    Observer,
    judged,
    position_fault,
)
from navigation_bridge.supervision.overtaken_mode import OvertakenMode
from navigation_bridge.supervision.parking import Parking
from navigation_bridge.supervision.stations import Stations
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.intents import Fly, Outcome, Perform
from navigation_core.tasks.progress import Progress, Status
from navigation_core.tasks.standstill import Standstill


@dataclass(frozen=True)
class Parts:
    """Everything that a goal is flown with."""

    vehicle: Vehicle
    observer: Observer
    standing: StandingObstacles
    report: Reporter
    effects: Effects
    lateness: LatenessWatch
    positions: PositionTrust
    features: Features
    parking: Parking
    overtaken: OvertakenMode
    stations: Stations


class Engine:
    """Flies one goal at a time.

    Attributes:
        goal: the active goal, or None.
        config: settings for goals.
    """

    def __init__(self, parts: Parts, config: BridgeConfig) -> None:
        """Begin without a goal."""
        self._parts = parts
        self._report, self._effects = parts.report, parts.effects
        self._features = parts.features
        self.config = config
        self.goal: ActiveGoal | None = None

    def configure(self, config: BridgeConfig) -> None:
        """Apply other settings."""
        self.config = config
        self._parts.observer.configure(config)

    # --- a turn --------------------------------------------------------------------------

    def look(self, now: float, goal: ActiveGoal | None = None) -> Snapshot:
        """Return all that is known now, for a goal or for admission."""
        parts, vehicle = self._parts, self._parts.vehicle
        traffic = self._features.traffic if self._features.in_turns else None
        if goal is None:
            return parts.observer.look(now, traffic=traffic)
        overtaken, taken, mission = parts.overtaken, goal.takeover is not None, None
        if goal.mission is not None:
            mission = goal.mission.report(vehicle.state, vehicle.stations.mission_change)
        requested = parts.parking.operation_id is not None or overtaken.operation_id is not None
        return parts.observer.look(
            now,
            operation=goal.operation.report,
            act=goal.act.report,
            mission=mission,
            fault=position_fault(parts.positions, goal.doubt.jumps_ned_m),
            late_s=parts.lateness.recent_s(now),
            taken=taken,
            mode_requested=requested,
            mode_unclear=taken and overtaken.is_open,
            command=self._features.command if goal.follows_commands else None,
            followed=None if goal.followed is None else self._features.followed,
            trajectory=self._features.trajectory,
            traffic=traffic,
        )

    def turn(self, now: float) -> None:
        """Do what is due: the task's replanning, its step, the features, feedback."""
        goal, snapshot = self.goal, None
        if goal is not None and now >= goal.times.replan_s:
            self._replan(goal, now)
        if goal is not None and now >= goal.times.next_step_s:
            self._parts.lateness.note_step(now - goal.times.next_step_s, now)
            goal.times.step_begins(self.config.setpoint_period_s, now)
            snapshot = self.look(now, goal)
            self._step(goal, snapshot)
        # Positions trigger feedback; without one for half a period, a timer does.
        self._update(snapshot, 0.5, now)

    def _replan(self, goal: ActiveGoal, now: float) -> None:
        goal.times.replan_begins()
        goal.task.replan(self.look(now, goal), now)

    def next_deadline(self) -> float | None:
        """Return the time of the next turn."""
        if (goal := self.goal) is None:
            return None
        feedback_s = goal.times.feedback_due_s + 0.5 * self.config.feedback_period_s
        # A task replans once its setpoint has been sent, and finishes before the next.
        return min(goal.times.next_step_s, goal.times.replan_s, feedback_s)

    def position_came(self, now: float) -> None:
        """Give feedback of a new position, if it is due."""
        # A position that arrives slightly early still counts; otherwise positions at 20 Hz would
        # give feedback at 6.7 Hz instead of 10.
        self._update(None, -0.25, now)

    def _update(self, snapshot: Snapshot | None, wait_periods: float, now: float) -> None:
        """Let the features do what is due, and give feedback some periods after it is due."""
        goal = self.goal
        if self._features.in_turns and self._features.is_due(now):
            snapshot = snapshot or self.look(now, goal)
            self._features.update(goal, snapshot)
        wait_s = wait_periods * self.config.feedback_period_s
        if goal is not None and now >= goal.times.feedback_due_s + wait_s:
            self._give_feedback(goal, snapshot or self.look(now, goal))

    def _step(self, goal: ActiveGoal, snapshot: Snapshot) -> None:
        goal.see_failsafe(snapshot.state)
        due = guarded = goal.is_guarded(snapshot.time_s)
        for rule in rules.RULES:
            if rule.guards and not guarded:
                continue
            if (verdict := rule.judge(snapshot, goal)) is None:
                continue
            if isinstance(verdict, rules.Abandon):
                self.abandon(verdict.code, verdict.text, snapshot.time_s)
                return
            if isinstance(verdict, rules.SendNothing):
                if verdict.shown:
                    self._show_status(goal, snapshot)
                return
            self._apply(verdict, goal, snapshot)
            guarded = guarded and not goal.ending
        if due:
            goal.times.guard_begins(snapshot.time_s)
            snapshot = self.bound(snapshot)
        if goal.yielded is None:
            self._step_task(goal, snapshot)
        elif (outcome := rules.judge_yielded(snapshot, goal, goal.yielded)) is not None:
            self.end(goal, outcome, snapshot.time_s)
        else:
            self._show_status(goal, snapshot)

    def bound(self, snapshot: Snapshot) -> Snapshot:
        """Have paths planned inside the fence as known now, and inside the volume."""
        config, pose = snapshot.config, snapshot.pose
        place = None if pose is None else pose.position_enu_m[:2]
        margin_m = config.safety.fence_margin_m
        self._parts.standing.bound(snapshot.own_fence, margin_m, config.volume, place)
        return self._parts.observer.bounded(snapshot)

    def _apply(self, verdict: rules.Verdict, goal: ActiveGoal, snapshot: Snapshot) -> None:
        """Carry out a verdict that does not end the turn."""
        now = snapshot.time_s
        if isinstance(verdict, rules.Yield):
            goal.yield_vehicle(Standstill.of_stop(snapshot.config.goto, snapshot.traits), now)
            self._parts.stations.let_go(goal, now)
        elif isinstance(verdict, rules.Warn):
            goal.remember(verdict.rule, verdict.fact, verdict.text)
            if verdict.text:
                self._report.log(LogLevel.WARN, f"Goal {goal.short_id}: {verdict.text}")
        elif isinstance(verdict, rules.Stop):
            self.stop(goal, verdict.outcome, now)
        elif isinstance(verdict, rules.Doubt):
            goal.doubted(verdict.doubt, now)
            if verdict.text:
                self._report.log(LogLevel.WARN, f"Goal {goal.short_id}: {verdict.text}")
                self._report.remark(goal, verdict.text)
            if verdict.outcome is not None:
                self.stop(goal, verdict.outcome, now)

    def _step_task(self, goal: ActiveGoal, snapshot: Snapshot) -> None:
        now = snapshot.time_s
        intent = goal.task.step(snapshot, now)
        goal.operation.known()
        ended: Outcome | None = None
        if isinstance(intent, Outcome):
            ended = judged(intent, snapshot)
        elif isinstance(intent, Perform):
            new = goal.operation.is_new(intent)
            delay = self._features.delay(goal, intent, snapshot) if new else None
            if delay is not None:
                self._effects.wait(now)
                if delay.outcome is None:
                    goal.task.postpone(now)
                    self._show_status(goal, snapshot)
                    return
                ended = delay.outcome
            else:
                self._effects.perform(goal, intent, new, now)
        elif isinstance(intent, Fly):
            if self._features.in_turns:
                intent = self._features.limited(goal, intent, snapshot)
            ended = self._effects.fly(goal, intent, now)
        if ended is not None:
            self.end(goal, ended, now)
            return
        self._effects.act(goal, goal.task.act, now)
        self._show_status(goal, snapshot)
        if (path_enu_m := goal.task.path_enu_m) is not goal.path_enu_m:
            self._report.plan(goal, path_enu_m)

    # --- its beginning and its end ----------------------------------------------------------

    def begin(
        self, goal_id: str, admitted: Admitted, now: float
    ) -> tuple[ActiveGoal | None, ActiveGoal]:
        """Make an admitted goal the active one; return the one that it replaces, and itself."""
        previous = continued = self.goal
        ignored = self._parts.stations.ignores_setpoints
        if previous is not None and (previous.takeover or previous.yielded or ignored):
            continued = None  # its last setpoint is obsolete
        mode, jumps_ned_m = self._parts.observer.mode, self._parts.positions.jump_ned_m
        goal = self.goal = successor(goal_id, admitted, continued, mode, jumps_ned_m, now)
        return previous, goal

    def start_task(self, goal: ActiveGoal, now: float) -> None:
        """Start the task of a goal that has begun."""
        self._features.goal_began()
        self._report.accepted(goal)
        if goal.plan is not None:
            self._parts.stations.free(now)
        goal.task.start(self.look(now, goal), now)

    def stop(self, goal: ActiveGoal, outcome: Outcome, now: float) -> None:
        """Have the task stop the vehicle for a reason; the goal then ends with this outcome."""
        self._report.log(LogLevel.WARN, f"Goal {goal.short_id}: {outcome.message}")
        goal.stop(outcome, now)

    def end(self, goal: ActiveGoal, outcome: Outcome, now: float) -> None:
        """End the active goal and stop a vehicle that is still under our control."""
        self.goal = None
        outcome = self._parts.stations.name(outcome, now)
        self._effects.rest(goal, now)
        self._conclude(goal, outcome, now)

    def abandon(self, code: OutcomeCode, text: str, now: float) -> None:
        """End the active goal because control was lost; send nothing."""
        if (goal := self.goal) is not None:
            self.goal = None
            self._effects.leave(goal, now)
            self._conclude(goal, Outcome(code, text, None), now)

    def _conclude(self, goal: ActiveGoal, outcome: Outcome, now: float) -> None:
        goal.progressed(goal.task.progress(self.look(now, goal), now))
        goal.doubted(None, now)
        self._features.goal_ended(goal, goal.end_of(outcome).code)
        self._report.ended(goal, outcome, now)

    def _progress(self, goal: ActiveGoal, snapshot: Snapshot) -> Progress:
        progress = goal.task.progress(snapshot, snapshot.time_s)
        if self._features.in_turns:
            progress = self._features.progress(progress)
        goal.progressed(progress)
        if not snapshot.connected:
            return replace(progress, status=Status.LINK_LOST)
        if goal.yielded is None:
            return progress
        return replace(progress, status=Status.CANCELLING if goal.ending else Status.PAUSED)

    def _show_status(self, goal: ActiveGoal, snapshot: Snapshot) -> None:
        """Report a status that is new, with feedback: a short one would pass between two."""
        progress = self._progress(goal, snapshot)
        if progress.status is not goal.status:
            self._report.status(goal, progress)
            self._give_feedback(goal, snapshot)

    def _give_feedback(self, goal: ActiveGoal, snapshot: Snapshot) -> None:
        goal.times.feedback_given(self.config.feedback_period_s, snapshot.time_s)
        self._report.feedback(goal, self._progress(goal, snapshot), snapshot)
