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
from collections.abc import Sequence
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
    command_name,
    result_name,
)
from mavlink_vehicle.protocols.operations.operation_parts import (
    Gate,
    Goal,
    OperationInput,
    OperationState,
    OperationTiming,
)
from mavlink_vehicle.state.reducer import VehicleState

_NOTHING_SENT = (OperationState.IDLE, OperationState.PREPARING, OperationState.FINISHED)
_GATE_LOOK_S = 0.1
_REJECTED_AGAIN_S = 0.2
_EXCUSED_S = 60.0


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
        """Prepare; `start` looks at the state and sends.

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
        self._address = address
        self._timing = timing
        self._first_ack_counts = first_ack_counts
        self._gate = gate
        self._command_timing = command_timing
        self._command = CommandExchange(goal.request, address, command_timing)
        self._again_s: float | None = None
        self._vehicle = VehicleState()
        self._connected = True
        self._texts_before = 0
        self._limit_s = 0.0
        self._heartbeat_from_s = -math.inf
        self._silent_until_s = -math.inf
        self._excusable_s = _EXCUSED_S
        self._refused_until_s: float | None = None
        self._rejected_until_s: float | None = None
        self._answer: int | None = None
        self._result = OperationResult.CANCELLED
        self._reason = ""

    @property
    def finished(self) -> bool:
        """Whether it has ended."""
        return self.state is OperationState.FINISHED

    @property
    def attempts(self) -> int:
        """How often the command has been sent."""
        return self._command.attempts

    def next_modes(self) -> tuple[int, ...]:
        """Return the modes that the vehicle still goes to by itself after this."""
        return self.goal.next_modes(self._vehicle)

    def start(self, now: float) -> None:
        """Send the command; `begin` is the way in, as it brings the state along."""
        self._limit_s = now + self._timing.timeout_s
        waits = self._gate is not None or now < self._silent_until_s
        self._fire(OperationInput.PREPARE if waits else OperationInput.START, now)

    def keep_silent(self, until_s: float) -> None:
        """Send nothing before a time: somebody else has just asked for another mode."""
        self._silent_until_s = until_s

    def begin(
        self,
        state: VehicleState,
        connected: bool,
        now: float,
        settle_s: float = 0.0,
        silent_until_s: float = -math.inf,
    ) -> None:
        """Start, unless the vehicle is already as wanted and its word is fresh.

        Args:
            state: the vehicle's state.
            connected: whether its HEARTBEAT is fresh.
            now: time in seconds.
            settle_s: an earlier request for something else may take effect for this long; what
                a HEARTBEAT shows before that proves nothing, unless `settle` is called.
            silent_until_s: nothing is sent before, as by `keep_silent`.
        """
        self._silent_until_s = silent_until_s
        self._vehicle = state
        self._connected = connected
        self._texts_before = state.texts.count
        if settle_s > 0.0:
            self._heartbeat_from_s = now + settle_s
        if self._reached():
            self._reason = f"{self._title()}: nothing to do."
            self._fire(OperationInput.REACHED, now)
        else:
            self.start(now)

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
                self._fire(OperationInput.REACHED, now)
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
        self._vehicle = state
        self._connected = connected
        if self._reached():
            self._fire(OperationInput.REACHED, now)
            return
        failure = self.goal.failure(state)
        if failure is not None:
            self._result, self._reason = OperationResult.REFUSED, failure
            self._fire(OperationInput.FAILED, now)
        else:
            self._contradict(now)

    def _contradict(self, now: float) -> None:
        """Withdraw a rejection when the vehicle visibly carries it out."""
        if self.state is OperationState.REFUSING and self.goal.under_way(self._vehicle):
            self._fire(OperationInput.UNDER_WAY, now)

    def excuse(self, gap_s: float) -> None:
        """Do not count time in which the server did not run: it neither listened nor repeated.

        Of a server that stops repeatedly only a limited time is excused, so that there is an end.
        """
        gap_s = min(gap_s, self._excusable_s)
        self._excusable_s -= gap_s
        self._limit_s += gap_s
        self._command.excuse(gap_s)
        if self._deadline is not None:
            self._deadline += gap_s
        if self._refused_until_s is not None:
            self._refused_until_s += gap_s
        if self._rejected_until_s is not None:
            self._rejected_until_s += gap_s
        if self._again_s is not None:
            self._again_s += gap_s

    def settle(self) -> None:
        """The earlier request has taken effect; from here HEARTBEATs count."""
        self._heartbeat_from_s = -math.inf

    def _reached(self) -> bool:
        heard_s = self._vehicle.last_heartbeat_s
        return (
            self._connected
            and heard_s is not None
            and heard_s >= self._heartbeat_from_s
            and (self._answer == ACCEPTED or not self.goal.needs_ack)
            and self.goal.reached(self._vehicle)
        )

    def cancel(self, reason: str, now: float) -> None:
        """End it CANCELLED for this reason, if it hasn't ended."""
        if not self.finished:
            self._result = OperationResult.CANCELLED
            self._reason = reason
            self._fire(OperationInput.CANCEL, now)

    def lose(self, reason: str, now: float) -> None:
        """End it LINK_LOST for this reason, if it hasn't ended."""
        if not self.finished:
            self._result = OperationResult.LINK_LOST
            self._reason = reason
            self._fire(OperationInput.FAILED, now)

    def _on_deadline(self, now: float) -> None:
        """Repeat the command, or end."""
        if self.finished:
            return
        if self.state is OperationState.PREPARING:
            self._try_gate(now)
        elif self._refused_until_s is not None and now >= self._refused_until_s:
            self._fire(OperationInput.WAITED, now)
        elif now >= self._limit_s:
            self._fire(OperationInput.TIME_UP, now)
        elif now < self._silent_until_s:
            self._deadline = min(self._silent_until_s, self._refused_until_s or math.inf)
        elif self._again_s is not None and now >= self._again_s:
            self._again_s = None
            if self.goal.under_way(self._vehicle):
                self._set_deadline()
            else:
                self._fire(OperationInput.AGAIN, now)
        else:
            self._command.handle_timer(now)
            self._step_command(now)

    def _step_command(self, now: float) -> None:
        self._outbox += self._command.messages_to_send()
        end = self._command.next_event()
        if end is not None and end.result is None:
            self._fire(OperationInput.UNANSWERED, now)
        else:
            self._set_deadline()

    def _set_deadline(self) -> None:
        times = (
            self._limit_s,
            self._refused_until_s,
            self._again_s,
            self._command.next_deadline(),
        )
        self._deadline = min(time for time in times if time is not None)

    def _try_gate(self, now: float) -> None:
        open_s = max(now if self._gate is None else self._gate(now), self._silent_until_s)
        if open_s <= now:
            self._fire(OperationInput.READY, now)
        elif now >= self._limit_s:
            self._result = OperationResult.LATE
            self._reason = (
                f"setpoints were not streamed without a gap within {self._timing.timeout_s:.1f} s, "
                "so that the vehicle could not be asked"
            )
            self._fire(OperationInput.FAILED, now)
        else:
            self._deadline = min(open_s, now + _GATE_LOOK_S, self._limit_s)

    def _prepare_again(self, now: float) -> None:
        self._refused_until_s = self._again_s = self._answer = None
        self._command = CommandExchange(
            self.goal.request,
            self._address,
            self._command_timing,
            sent_before=self._command.attempts,
        )
        self._try_gate(now)

    def _send(self, now: float) -> None:
        self._command.start(now)
        self._step_command(now)

    def _pause(self, now: float) -> None:
        self._again_s = now + self._timing.pause_s
        self._set_deadline()

    def _send_again(self, now: float) -> None:
        sent = self._command.attempts
        self._refused_until_s = None
        self._command = CommandExchange(
            self.goal.request, self._address, self._command_timing, sent_before=sent
        )
        self._send(now)

    def _confirm(self, now: float) -> None:
        self._refused_until_s = None
        self._again_s = None
        self._set_deadline()

    def _refuse(self, now: float) -> None:
        self._again_s = None
        repeated = self._command.attempts > 1 and self._rejected_until_s is None
        wait_s = self._timing.doubt_s if repeated else self._timing.texts_s
        self._refused_until_s = now + wait_s
        if self._answer == mavlink.MAV_RESULT_TEMPORARILY_REJECTED:
            if self._rejected_until_s is None:
                self._rejected_until_s = now + self._timing.rejected_s
            if now < self._rejected_until_s:
                self._again_s = now + _REJECTED_AGAIN_S
        self._set_deadline()

    def _achieve(self, now: float) -> None:
        self._finish(OperationResult.ACHIEVED, self._reason or f"{self._title()}: confirmed", now)

    def _give_reasons(self, now: float) -> None:
        name = command_name(self._command.request.command)
        answer = result_name(self._answer) if self._answer is not None else "nothing"
        what = f"{self._title()} rejected: {name} was answered {answer}"
        hint = self.goal.hint(self._vehicle)
        self._finish(OperationResult.REFUSED, f"{what}; {hint}" if hint else what, now)

    def _time_out(self, now: float) -> None:
        name = command_name(self._command.request.command)
        if self._answer == ACCEPTED:
            hint = self.goal.hint(self._vehicle) or "the vehicle's state does not show it"
            what = f"{name} was ACCEPTED, but {hint}"
        else:
            what = f"{name} was sent {self._command.attempts} times and not answered"
        what = f"{self._title()} not confirmed within {self._timing.timeout_s:.1f} s: {what}"
        if self._connected:
            self._finish(OperationResult.TIMED_OUT, what, now)
        else:
            self._finish(OperationResult.LINK_LOST, f"{what}, and no HEARTBEAT is received", now)

    def _fail(self, now: float) -> None:
        self._finish(self._result, f"{self._title()} ended: {self._reason}", now)

    def _title(self) -> str:
        title = f"{self.goal.kind.value} {self.goal.wish}".strip()
        return title[0].upper() + title[1:]

    def _finish(self, result: OperationResult, reason: str, now: float) -> None:
        self._command.cancel(now)
        self._deadline = None
        self._outbox.clear()
        if result is not OperationResult.ACHIEVED:
            reason += quote_texts(self._vehicle, self._texts_before)
        if not reason.endswith((".", "!", "?")):
            reason += "."
        self._events.append(OperationFinished(self.operation_id, self.goal.kind, result, reason))

    _S = OperationState
    _I = OperationInput
    table: ClassVar[Table] = {
        (_S.IDLE, _I.START): (_S.COMMANDING, _send),
        (_S.IDLE, _I.PREPARE): (_S.PREPARING, _try_gate),
        (_S.IDLE, _I.REACHED): (_S.FINISHED, _achieve),
        (_S.IDLE, _I.CANCEL): (_S.FINISHED, _fail),
        (_S.IDLE, _I.FAILED): (_S.FINISHED, _fail),
        (_S.PREPARING, _I.READY): (_S.COMMANDING, _send),
        (_S.PREPARING, _I.REACHED): (_S.FINISHED, _achieve),
        (_S.PREPARING, _I.FAILED): (_S.FINISHED, _fail),
        (_S.PREPARING, _I.CANCEL): (_S.FINISHED, _fail),
        (_S.COMMANDING, _I.REACHED): (_S.FINISHED, _achieve),
        (_S.COMMANDING, _I.FAILED): (_S.FINISHED, _fail),
        (_S.COMMANDING, _I.ACCEPTED): (_S.CONFIRMING, _confirm),
        (_S.COMMANDING, _I.REFUSED): (_S.REFUSING, _refuse),
        (_S.COMMANDING, _I.CLOSED): (_S.PREPARING, _prepare_again),
        (_S.COMMANDING, _I.UNANSWERED): (_S.CONFIRMING, _pause),
        (_S.COMMANDING, _I.TIME_UP): (_S.FINISHED, _time_out),
        (_S.COMMANDING, _I.CANCEL): (_S.FINISHED, _fail),
        (_S.CONFIRMING, _I.REACHED): (_S.FINISHED, _achieve),
        (_S.CONFIRMING, _I.FAILED): (_S.FINISHED, _fail),
        (_S.CONFIRMING, _I.ACCEPTED): (_S.CONFIRMING, None),
        (_S.CONFIRMING, _I.REFUSED): (_S.REFUSING, _refuse),
        (_S.CONFIRMING, _I.CLOSED): (_S.PREPARING, _prepare_again),
        (_S.CONFIRMING, _I.AGAIN): (_S.COMMANDING, _send_again),
        (_S.CONFIRMING, _I.TIME_UP): (_S.FINISHED, _time_out),
        (_S.CONFIRMING, _I.CANCEL): (_S.FINISHED, _fail),
        (_S.REFUSING, _I.REACHED): (_S.FINISHED, _achieve),
        (_S.REFUSING, _I.UNDER_WAY): (_S.CONFIRMING, _confirm),
        (_S.REFUSING, _I.FAILED): (_S.FINISHED, _fail),
        (_S.REFUSING, _I.ACCEPTED): (_S.CONFIRMING, _confirm),
        (_S.REFUSING, _I.CLOSED): (_S.PREPARING, _prepare_again),
        (_S.REFUSING, _I.REFUSED): (_S.REFUSING, None),
        (_S.REFUSING, _I.AGAIN): (_S.COMMANDING, _send_again),
        (_S.REFUSING, _I.TIME_UP): (_S.FINISHED, _give_reasons),
        (_S.REFUSING, _I.WAITED): (_S.FINISHED, _give_reasons),
        (_S.REFUSING, _I.CANCEL): (_S.FINISHED, _fail),
    }
    del _S, _I


def quote_texts(state: VehicleState, count_before: int) -> str:
    """Return the STATUSTEXTs since then, each once, to be put behind a sentence."""
    fresh = min(state.texts.count - count_before, len(state.status_texts))
    texts: Sequence[str] = [text.text for text in state.status_texts[-fresh:]] if fresh else []
    unique = list(dict.fromkeys(texts))
    return "; autopilot: " + ", ".join(f'"{text}"' for text in unique) if unique else ""
