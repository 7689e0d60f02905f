"""Mode change, arming, take-off and so on: a command, confirmed by the vehicle's own state.

An acknowledgement alone is never success: ArduPilot accepts a take-off that then doesn't
happen, PX4 accepts mode changes that it rejects a moment later, and an acknowledgement can be
lost although the command was obeyed. So:

- ACHIEVED means that the vehicle's own messages show it, acknowledged or not.
- A rejection ends the operation, after a short wait for the STATUSTEXTs that explain it. When
  the command was repeated, the rejection may be the answer to a repetition of a command already
  obeyed ("already flying"); the state then has longer to show it.
- Everything else ends when it times out.
- Where nothing in the state can show it (a speed), or something else could have the same look
  (a place to go to), the acknowledgement must come, too.
- A command may have to wait for a gate: PX4 enters OFFBOARD only while setpoints come. While they
  do not come as they should, the command waits, and a rejection says nothing of the vehicle: that
  is our own lateness, and ends the operation LATE when it times out.
- A time in which we did not run is not held against the vehicle (`excuse`).
"""

from __future__ import annotations

import math
from typing import ClassVar

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import OperationFinished, OperationResult
from mavlink_vehicle.protocols.machine import Machine, Table
from mavlink_vehicle.protocols.operations.command import (
    ACCEPTED,
    IN_PROGRESS,
    Address,
    CommandExchange,
    CommandTiming,
    ack_result,
)
from mavlink_vehicle.protocols.operations.endings import Ending, rejected, timed_out, title
from mavlink_vehicle.protocols.operations.evidence import Evidence, full_stop
from mavlink_vehicle.protocols.operations.operation_parts import (
    Gate,
    Goal,
    OperationInput,
    OperationState,
    OperationTiming,
)
from mavlink_vehicle.protocols.operations.operation_times import OperationTimes
from mavlink_vehicle.state.reducer import VehicleState

_NOTHING_SENT = (OperationState.IDLE, OperationState.PREPARING, OperationState.FINISHED)
_GATE_LOOK_S = 0.1
_REJECTED_AGAIN_S = 0.2


class Operation(Machine[OperationFinished]):
    """One operation; ends in exactly one `OperationFinished`."""

    def __init__(
        self,
        operation_id: int,
        goal: Goal,
        address: Address,
        command_timing: CommandTiming,
        timing: OperationTiming,
        *,
        first_ack_counts: bool = True,
        gate: Gate | None = None,
    ) -> None:
        """Prepare; `begin` looks at the state and sends.

        Args:
            operation_id: goes into the event.
            goal: what is wanted.
            address: who talks to whom.
            command_timing: repetitions of the command.
            timing: patience of the whole.
            first_ack_counts: False where the autopilot acknowledges twice and only the second
                one is right.
            gate: what the command has to wait for.
        """
        super().__init__(OperationState.IDLE)
        self.operation_id = operation_id
        self.goal = goal
        self.evidence = Evidence()
        self._address = address
        self._timing = timing
        self._times = OperationTimes()
        self._first_ack_counts = first_ack_counts
        self._gate = gate
        self._command_timing = command_timing
        self._command = CommandExchange(goal.request, address, command_timing)
        self._answer: int | None = None
        self._ending = Ending(OperationResult.CANCELLED, "")

    @property
    def finished(self) -> bool:
        """Whether it has ended."""
        return self.state is OperationState.FINISHED

    @property
    def attempts(self) -> int:
        """How often the command has been sent."""
        return self._command.attempts

    def begin(
        self,
        state: VehicleState,
        connected: bool,
        now: float,
        settle_s: float = 0.0,
        silent_until_s: float = -math.inf,
    ) -> None:
        """Send the command, unless the vehicle is already as wanted and its word is fresh.

        Args:
            state: the vehicle's state.
            connected: whether its HEARTBEAT is fresh.
            now: time in seconds.
            settle_s: an earlier request for something else may take effect for this long; what
                a HEARTBEAT shows before that proves nothing, unless `evidence.settle` is called.
            silent_until_s: nothing is sent before, as by `keep_silent`.
        """
        self._times.silent_until_s = silent_until_s
        self.evidence.begin(state, connected, now + settle_s if settle_s > 0.0 else -math.inf)
        if self._reached():
            self._achieve("nothing to do.", now)
            return
        self._times.limit_s = now + self._timing.timeout_s
        waits = self._gate is not None or now < silent_until_s
        self._fire(OperationInput.PREPARE if waits else OperationInput.START, now)

    def keep_silent(self, until_s: float) -> None:
        """Send nothing before a time: somebody else has just asked for another mode."""
        self._times.silent_until_s = until_s

    def receive(self, message: Message, now: float) -> None:
        """Look for the command's acknowledgements."""
        if self.state in _NOTHING_SENT:
            return
        result = ack_result(message, self._command.request.command, self._address)
        if result is None:
            return
        self._command.receive(message, now)
        if result == IN_PROGRESS:
            self._step_command(now)
            return
        if result == ACCEPTED:
            self._answer = result
            self._fire(OperationInput.ACCEPTED, now)
            if self.goal.needs_ack and self._reached():
                self._achieve("confirmed", now)
        elif self._answer != ACCEPTED or not self._first_ack_counts:
            self._answer = result
            if self._gate is not None and self._gate(now) > now:
                self._fire(OperationInput.CLOSED, now)
            else:
                self._fire(OperationInput.REFUSED, now)
                self._contradict(now)
        while self._command.next_event() is not None:  # what it says has been dealt with
            pass

    def observe(self, state: VehicleState, connected: bool, now: float) -> None:
        """Process the vehicle's new state."""
        if self.finished or self.state is OperationState.IDLE:
            return
        self.evidence.observe(state, connected)
        if self._reached():
            self._achieve("confirmed", now)
            return
        failure = self.goal.failure(state)
        if failure is not None:
            self.stop(OperationResult.REFUSED, failure, now)
        else:
            self._contradict(now)

    def _contradict(self, now: float) -> None:
        """Withdraw a rejection when the vehicle visibly carries it out."""
        if self.state is OperationState.REFUSING and self.goal.under_way(self.evidence.state):
            self._fire(OperationInput.UNDER_WAY, now)

    def excuse(self, gap_s: float) -> None:
        """Do not count time in which the server did not run: it neither listened nor repeated."""
        gap_s = self._times.excuse(gap_s)
        self._command.excuse(gap_s)
        if self.deadline_s is not None:
            self.deadline_s += gap_s

    def stop(self, result: OperationResult, reason: str, now: float) -> None:
        """End it for this reason, if it has not ended."""
        if not self.finished:
            self._ending = Ending(result, f"{title(self.goal)} ended: {reason}")
            self._fire(OperationInput.STOP, now)

    def _reached(self) -> bool:
        answered = self._answer == ACCEPTED or not self.goal.needs_ack
        return answered and self.evidence.shows(self.goal)

    def _achieve(self, how: str, now: float) -> None:
        self._ending = Ending(OperationResult.ACHIEVED, f"{title(self.goal)}: {how}")
        self._fire(OperationInput.REACHED, now)

    def _on_deadline(self, now: float) -> None:
        """Repeat the command, or end."""
        times = self._times
        if self.finished:
            return
        if self.state is OperationState.PREPARING:
            self._try_gate(now)
        elif times.reasons_until_s is not None and now >= times.reasons_until_s:
            self._fire(OperationInput.WAITED, now)
        elif now >= times.limit_s:
            self._fire(OperationInput.TIME_UP, now)
        elif now < times.silent_until_s:
            self.deadline_s = min(times.silent_until_s, times.reasons_until_s or math.inf)
        elif times.again_s is not None and now >= times.again_s:
            times.again_s = None
            if self.goal.under_way(self.evidence.state):
                self._set_deadline()
            else:
                self._fire(OperationInput.AGAIN, now)
        else:
            self._command.handle_timer(now)
            self._step_command(now)

    def _step_command(self, now: float) -> None:
        self.outbox += self._command.messages_to_send()
        end = self._command.next_event()
        if end is not None and end.result is None:
            self._fire(OperationInput.UNANSWERED, now)
        else:
            self._set_deadline()

    def _set_deadline(self) -> None:
        self.deadline_s = self._times.next_s(self._command.deadline_s)

    # Actions

    def _try_gate(self, now: float) -> None:
        times = self._times
        times.attempt_begins()
        self._answer = None
        open_s = max(now if self._gate is None else self._gate(now), times.silent_until_s)
        if open_s <= now:
            self._fire(OperationInput.READY, now)
        elif now >= times.limit_s:
            reason = (
                f"setpoints were not streamed without a gap within {self._timing.timeout_s:.1f} s, "
                "so that the vehicle could not be asked"
            )
            self.stop(OperationResult.LATE, reason, now)
        else:
            self.deadline_s = min(open_s, now + _GATE_LOOK_S, times.limit_s)

    def _send(self, now: float) -> None:
        """Begin an attempt; the numbers of the repetitions continue."""
        self._times.attempt_begins()
        self._command = CommandExchange(
            self.goal.request, self._address, self._command_timing, sent_before=self.attempts
        )
        self._command.start(now)
        self._step_command(now)

    def _pause(self, now: float) -> None:
        self._times.again_s = now + self._timing.pause_s
        self._set_deadline()

    def _confirm(self, now: float) -> None:
        self._times.attempt_begins()
        self._set_deadline()

    def _refuse(self, now: float) -> None:
        times = self._times
        times.again_s = None
        repeated = self.attempts > 1 and times.rejected_until_s is None
        wait_s = self._timing.doubt_s if repeated else self._timing.texts_s
        times.reasons_until_s = now + wait_s
        if self._answer == mavlink.MAV_RESULT_TEMPORARILY_REJECTED:
            if times.rejected_until_s is None:
                times.rejected_until_s = now + self._timing.rejected_s
            if now < times.rejected_until_s:
                times.again_s = now + _REJECTED_AGAIN_S
        self._set_deadline()

    def _give_reasons(self, now: float) -> None:
        self._ending = rejected(self.goal, self._answer, self.evidence)
        self._finish(now)

    def _time_out(self, now: float) -> None:
        self._ending = timed_out(
            self.goal, self._answer, self.attempts, self._timing.timeout_s, self.evidence
        )
        self._finish(now)

    def _finish(self, now: float) -> None:
        self._command.cancel(now)
        self.deadline_s = None
        self.outbox.clear()
        result, reason = self._ending.result, self._ending.reason
        achieved = result is OperationResult.ACHIEVED
        reason = full_stop(reason) if achieved else self.evidence.quoted(reason)
        self.events.append(OperationFinished(self.operation_id, self.goal.kind, result, reason))

    _S = OperationState
    _I = OperationInput
    table: ClassVar[Table] = {
        (_S.IDLE, _I.START): (_S.COMMANDING, _send),
        (_S.IDLE, _I.PREPARE): (_S.PREPARING, _try_gate),
        (_S.IDLE, _I.REACHED): (_S.FINISHED, _finish),
        (_S.IDLE, _I.STOP): (_S.FINISHED, _finish),
        (_S.PREPARING, _I.READY): (_S.COMMANDING, _send),
        (_S.PREPARING, _I.REACHED): (_S.FINISHED, _finish),
        (_S.PREPARING, _I.STOP): (_S.FINISHED, _finish),
        (_S.COMMANDING, _I.REACHED): (_S.FINISHED, _finish),
        (_S.COMMANDING, _I.ACCEPTED): (_S.CONFIRMING, _confirm),
        (_S.COMMANDING, _I.REFUSED): (_S.REFUSING, _refuse),
        (_S.COMMANDING, _I.CLOSED): (_S.PREPARING, _try_gate),
        (_S.COMMANDING, _I.UNANSWERED): (_S.CONFIRMING, _pause),
        (_S.COMMANDING, _I.TIME_UP): (_S.FINISHED, _time_out),
        (_S.COMMANDING, _I.STOP): (_S.FINISHED, _finish),
        (_S.CONFIRMING, _I.REACHED): (_S.FINISHED, _finish),
        (_S.CONFIRMING, _I.ACCEPTED): (_S.CONFIRMING, None),
        (_S.CONFIRMING, _I.REFUSED): (_S.REFUSING, _refuse),
        (_S.CONFIRMING, _I.CLOSED): (_S.PREPARING, _try_gate),
        (_S.CONFIRMING, _I.AGAIN): (_S.COMMANDING, _send),
        (_S.CONFIRMING, _I.TIME_UP): (_S.FINISHED, _time_out),
        (_S.CONFIRMING, _I.STOP): (_S.FINISHED, _finish),
        (_S.REFUSING, _I.REACHED): (_S.FINISHED, _finish),
        (_S.REFUSING, _I.UNDER_WAY): (_S.CONFIRMING, _confirm),
        (_S.REFUSING, _I.ACCEPTED): (_S.CONFIRMING, _confirm),
        (_S.REFUSING, _I.CLOSED): (_S.PREPARING, _try_gate),
        (_S.REFUSING, _I.REFUSED): (_S.REFUSING, None),
        (_S.REFUSING, _I.AGAIN): (_S.COMMANDING, _send),
        (_S.REFUSING, _I.TIME_UP): (_S.FINISHED, _give_reasons),
        (_S.REFUSING, _I.WAITED): (_S.FINISHED, _give_reasons),
        (_S.REFUSING, _I.STOP): (_S.FINISHED, _finish),
    }
    del _S, _I
