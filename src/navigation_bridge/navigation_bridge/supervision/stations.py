"""Ground station actions on the vehicle and their effect on the goal. No ROS.

Cancelling a MAVLink mission cancels the goal: a ground station that removes or replaces the
mission, or stops the vehicle, ends the goal CANCELED. A pause may pause it instead
(:class:`~navigation_bridge.configuration.settings.StationPause`).

A command is seen before or after its mode change, up to a second apart; both orders have the same
effect. A vehicle that a ground station has put into its hold mode is left alone: nothing that moves
it is sent until the ground station resumes it or another goal comes.
"""

from __future__ import annotations

from dataclasses import replace

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import ModeChanged, StationAct, StationActed
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge import notes
from navigation_bridge.configuration.settings import StationPause
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.reporting import Reporter
from navigation_bridge.supervision.parking import Parking
from navigation_bridge.supervision.station_rules import (
    STOPS,
    Consequence,
    act_sentence,
    consequence,
    note_text,
    sends_elsewhere,
    stays_paused,
    working_mode,
)
from navigation_bridge.vehicle.takeover import Takeover
from navigation_bridge.vehicle.traits import vehicle_mode
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.intents import Outcome

# Maximum time between a command and the mode change that it causes: HEARTBEAT comes once a second,
# and links have delays.
_BRINGS_S = 2.0
_PAUSE_CONTINUE = mavlink.MAV_CMD_DO_PAUSE_CONTINUE


class Stations:
    """Monitors ground stations; ends, pauses or resumes the goal accordingly."""

    def __init__(self, vehicle: Vehicle, report: Reporter, parking: Parking) -> None:
        """Start without observations."""
        self._vehicle = vehicle
        self._report = report
        self._parking = parking
        self._last: tuple[StationActed, float] | None = None
        self._stands_in_mode = False

    @property
    def ignores_setpoints(self) -> bool:
        """Whether it was paused in the mode in which it would follow setpoints, and ignores them.

        An ArduCopter does so until it is resumed or has been in another mode (mode_guided.cpp).
        Selecting the same mode again has no effect.
        """
        return self._stands_in_mode and self._vehicle.in_control_mode

    # --- observed events ---------------------------------------------------------------

    def take(
        self, acted: StationActed, goal: ActiveGoal | None, on_pause: StationPause, now: float
    ) -> None:
        """Apply the effect of an act."""
        self._last = (acted, now)
        self._follow_pause(acted)
        sentence = act_sentence(acted)
        self._report.log(LogLevel.WARN if goal is not None else LogLevel.INFO, sentence)
        self._report.note(notes.text(note_text(acted)))
        if goal is None:
            return
        self._report.remark(goal, sentence)
        what = consequence(acted, goal, on_pause, self._vehicle)
        if goal.takeover is None and sends_elsewhere(acted, goal, self._vehicle):
            self._give_away(goal, sentence, now)
            return
        if goal.takeover is not None:
            if not self._brought(goal, acted, goal.takeover):
                goal.taken(replace(goal.takeover, by=sentence))
                return
            goal.taken(None)
            if goal.plan is None and not goal.ending:
                what = Consequence.CANCEL
        if acted.act is StationAct.REPLACED_MISSION and goal.mission is not None:
            goal.mission.disown()
        if what is Consequence.CANCEL:
            self._cancel(goal, acted, now)
        elif what is Consequence.PAUSE:
            goal.pause_by_station(sentence, now)
            self._report.log(LogLevel.WARN, f"Goal {goal.short_id}: paused by a ground station")
        elif what is Consequence.GO_ON:
            self._go_on(goal, now)
        goal.times.due(now)

    def change_mode(self, event: ModeChanged, goal: ActiveGoal | None, now: float) -> bool:
        """Handle a mode change not requested here; True if a ground station's act explains it."""
        if goal is None:
            return False
        acted = self._recent(now)
        if self._holds_in(event.name):
            if acted is None or acted.act not in STOPS:
                return bool(goal.cancelled_by)
            if goal.plan is None and not goal.ending:
                self._cancel(goal, acted, now)
            return bool(goal.cancelled_by or goal.paused_by)
        mode = vehicle_mode(self._vehicle.profile, event.name)
        if mode is not working_mode(goal) or goal.ending or stays_paused(goal):
            return False
        if goal.paused_by:
            self._go_on(goal, now)
            return True
        return acted is not None and acted.act is StationAct.CONTINUED

    def leave_mode(self) -> None:
        """Process a mode change: a pause in the old mode is over."""
        self._stands_in_mode = False

    def take_away(self, goal: ActiveGoal, mode_name: str, now: float, mode: int = 0) -> None:
        """Stop sending: the mode has changed, and the origin may show later.

        Args:
            goal: the active one.
            mode_name: of the mode.
            now: time in seconds.
            mode: HEARTBEAT.custom_mode of it, where it is the vehicle's.
        """
        acted = self._recent(now)
        by = "" if acted is None else act_sentence(acted)
        goal.taken(Takeover(mode_name, now, by, mode=mode).watched(self._vehicle.state))
        self.let_go(goal, now)

    def name(self, outcome: Outcome, now: float) -> Outcome:
        """Name in the outcome who took control: a failsafe, or a ground station."""
        if outcome.code is OutcomeCode.PILOT_OVERRIDE:
            # The task has waited for longer than a failsafe needs to show.
            state, seen_s = self._vehicle.state, now - _BRINGS_S
            seen = Takeover(self._vehicle.mode_name, seen_s, mode=state.custom_mode)
            judged = seen.watched(state).judge(state, now)
            if judged is not None and judged[0] is not OutcomeCode.PILOT_OVERRIDE:
                return replace(outcome, code=judged[0], message=judged[1])
        acted = self._recent(now)
        taken = outcome.code in (OutcomeCode.DISARMED, OutcomeCode.PILOT_OVERRIDE)
        if acted is None or not taken or acted.act is not StationAct.CHANGED_MODE:
            return outcome
        return replace(outcome, message=f"{outcome.message} {act_sentence(acted)}")

    # --- a vehicle that is left alone -----------------------------------------------------

    def let_go(self, goal: ActiveGoal, now: float) -> None:
        """Send nothing to the vehicle of a goal any more."""
        if goal.operation.report is not None:
            self._vehicle.operations.abandon(now)
            goal.operation.dropped()
        self._vehicle.setpoints.close()
        goal.times.due(now)

    def free(self, now: float) -> bool:
        """Make a vehicle that ignores setpoints follow them again: through its hold mode."""
        if not self.ignores_setpoints:
            return False
        self._parking.change_over(now)
        return True

    # --- inside ------------------------------------------------------------------------

    def _give_away(self, goal: ActiveGoal, sentence: str, now: float) -> None:
        """Handle a ground station taking control; its stop before was part of that."""
        goal.redirect(Takeover("", now, sentence))
        self.let_go(goal, now)

    def _cancel(self, goal: ActiveGoal, acted: StationActed, now: float) -> None:
        goal.cancel_by_station(act_sentence(acted), acted.act is StationAct.PAUSED, now)
        self._report.log(LogLevel.WARN, f"Goal {goal.short_id}: cancelled by a ground station")
        self._report.cancel_wanted(goal)

    def _go_on(self, goal: ActiveGoal, now: float) -> None:
        goal.resume_by_station(now)
        if self.free(now) or goal.yielded is not None:
            goal.take_back(now)
        goal.times.due(now)
        self._report.log(LogLevel.INFO, f"Goal {goal.short_id}: resumed by a ground station")

    def _follow_pause(self, acted: StationActed) -> None:
        profile = self._vehicle.profile
        if acted.act is StationAct.PAUSED:
            self._stands_in_mode = profile is not None and profile.pauses_in_mode
        elif acted.act is StationAct.CONTINUED and acted.command == _PAUSE_CONTINUE:
            self._stands_in_mode = False

    def _recent(self, now: float) -> StationActed | None:
        if self._last is None or now - self._last[1] > _BRINGS_S:
            return None
        return self._last[0]

    def _brought(self, goal: ActiveGoal, acted: StationActed, takeover: Takeover) -> bool:
        """Whether this act explains the mode change seen before it."""
        mode = vehicle_mode(self._vehicle.profile, takeover.mode_name)
        if acted.act is StationAct.CONTINUED:
            goes_on = goal.paused_by and not stays_paused(goal)
            return bool(goes_on) and mode is working_mode(goal)
        return acted.act in STOPS and self._holds_in(takeover.mode_name)

    def _holds_in(self, mode_name: str) -> bool:
        """Whether it holds in this mode; a PX4 plane also flies its goals in it."""
        profile = self._vehicle.profile
        return profile is not None and mode_name == profile.hold_mode
