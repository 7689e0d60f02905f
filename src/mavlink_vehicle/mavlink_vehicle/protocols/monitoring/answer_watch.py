"""Notices that nothing we send arrives, while the vehicle's telemetry does.

A radio or a port may pass one direction only. Then no HEARTBEAT is missing, and a vehicle that
flies by itself, or on towards its last setpoint, shows nothing. So while a goal is active the
autopilot is asked by TIMESYNC twice a second. Once that stays unanswered for longer than a round
trip, it is asked six times a second, and by MAV_CMD_REQUEST_MESSAGE of HEARTBEAT, too, which both
firmwares acknowledge within milliseconds (measured).

Only questions of a kind that this autopilot has answered count, and enough of them must be
unanswered that losses like those measured before do not explain it. The count begins again
after an answer, after a silence of the vehicle (a link that is down, or lags), and after we stood
still. A link that lags is given twice its slowest recent round trip, and twice its last silence.
Answers are lost as telemetry is: where the sequence numbers show that a smaller share of the
vehicle's packets arrives than before, because of a flood on the port or a machine that is too slow,
the expected share of answers falls with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.protocols.known_vehicle import SequenceOrder
from mavlink_vehicle.protocols.monitoring.timesync import Timesync
from mavlink_vehicle.protocols.operations.command import Address, CommandRequest
from mavlink_vehicle.protocols.service import VehicleService
from mavlink_vehicle.state.vehicle_state import VehicleState

_EVERY_S, _URGENT_EVERY_S = 0.5, 0.15
_URGENT_AFTER_S = 0.6
_UNANSWERED_S = 2.0
_SILENT_S, _SILENCE_KEPT_S = 0.7, 10.0
_STOOD_STILL_S = 1.0
# Number of answers of a kind after which further ones are expected.
_EXPECTED_FROM = 3
_CHANCE_MAX = 1e-5
_SHARE_MIN, _SHARE_MAX, _SHARE_GAIN = 0.5, 0.9, 0.1
_REQUEST_MESSAGE = mavlink.MAV_CMD_REQUEST_MESSAGE
_REQUEST = CommandRequest(_REQUEST_MESSAGE, (mavlink.MAVLINK_MSG_ID_HEARTBEAT,))
_COMMAND_ACK = mavlink.MAVLink_command_ack_message


class AnswerWatch(VehicleService):
    """Asks while answers matter, and knows for how long there have been none.

    Attributes:
        one_way: whether the vehicle is heard, but does not hear us.
        expected: whether answers are expected, and asked for.
    """

    handles = (_COMMAND_ACK, mavlink.MAVLink_timesync_message)

    def __init__(
        self,
        timesync: Timesync,
        address: Callable[[], Address],
        heard_s: Callable[[], float],
        order: SequenceOrder,
    ) -> None:
        """Prepare; nothing is asked before `expect`.

        Args:
            timesync: asks by TIMESYNC.
            address: returns whom to ask.
            heard_s: returns when the vehicle was heard last, in seconds.
            order: counts the vehicle's packets that arrive, and those that do not.
        """
        super().__init__()
        self._timesync = timesync
        self._address = address
        self._heard_s = heard_s
        self._order = order
        self.one_way = False
        self.expected = False
        self._acks = self._commands = 0
        self._share = _SHARE_MAX
        self._arrival_usual = 1.0
        self._ran_s = -math.inf
        self._silence: tuple[float, float] = (-math.inf, 0.0)
        self._begin(0.0)

    def expect(self, expected: bool, now: float) -> None:
        """Begin to ask, or stop: while there is a goal."""
        if expected == self.expected:
            return
        self.expected = expected
        self._begin(now)
        self._ran_s = now
        if expected and self.deadline_s is None:
            self.deadline_s = now

    def forget(self, now: float) -> None:
        """Begin to count again: another autopilot, a restart, or a lost link."""
        self._acks = self._commands = 0
        self._share = _SHARE_MAX
        self._arrival_usual = 1.0
        self.one_way = False
        self._begin(now)

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Begin to count again."""
        self.forget(now)

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Begin to count again."""
        self.forget(now)

    def excuse(self, now: float) -> None:
        """Do not count a time in which we did not run."""
        self._begin(now)

    def unanswered_s(self, now: float) -> float:
        """Return for how long nothing has been answered."""
        return now - self._since_s

    def receive(self, message: Message, now: float) -> None:
        """Process what may be an answer."""
        if isinstance(message, _COMMAND_ACK):
            if self._commands and message.command == _REQUEST_MESSAGE:
                self._acks += 1
                self._commands = 0
            self._answered(now)
        elif self._timesync.answers != self._answers:
            self._learn(True)
            self._answered(now)

    def _answered(self, now: float) -> None:
        self.one_way = False
        self._arrival_usual += _SHARE_GAIN * (self._arrival() - self._arrival_usual)
        self._begin(now)

    def _arrival(self) -> float:
        """Return the share of the vehicle's packets that arrived since the count began."""
        arrived = self._order.arrived - self._counted[0]
        sent = arrived + max(self._order.missing - self._counted[1], 0)
        return arrived / sent if sent else 1.0

    def _begin(self, now: float) -> None:
        self._since_s = now
        self._counted = (self._order.arrived, self._order.missing)
        self._questions = 0
        self._answers = self._timesync.answers

    def _learn(self, answered: bool) -> None:
        self._share += _SHARE_GAIN * (answered - self._share)

    def _on_deadline(self, now: float) -> None:
        """Ask, and judge."""
        if not (self.expected or self.one_way):
            self.deadline_s = None
            return
        late, self._ran_s = now - self._ran_s > _STOOD_STILL_S, now
        silent_s = now - self._heard_s()
        if silent_s > _SILENT_S:
            longest_s = max(silent_s, self._silence[1] if self._is_kept(now) else 0.0)
            self._silence = (now, longest_s)
        if late or silent_s > _SILENT_S:
            self._begin(now)
        round_trip_s = self._timesync.slowest_round_trip_s
        urgent = self.unanswered_s(now) > _URGENT_AFTER_S + 1.5 * round_trip_s
        by_timesync = self._timesync.answers >= _EXPECTED_FROM
        self._judge(round_trip_s, by_timesync, now)
        self.deadline_s = now + (_URGENT_EVERY_S if urgent else _EVERY_S)
        if self._timesync.is_used:
            if self._questions and not urgent:
                self._learn(False)
            self._timesync.ask(now)
            self._questions += by_timesync
        if urgent or not by_timesync:
            self.outbox.append(_REQUEST.message(self._address(), 0))
            self._commands += 1
            self._questions += self._acks >= _EXPECTED_FROM

    def _is_kept(self, now: float) -> bool:
        return now - self._silence[0] <= _SILENCE_KEPT_S

    def _judge(self, round_trip_s: float, by_timesync: bool, now: float) -> None:
        lag_s = self._silence[1] if self._is_kept(now) else 0.0
        allowed_s = max(_UNANSWERED_S, 1.0 + 2.0 * round_trip_s) + 2.0 * lag_s
        share = min(max(self._share, _SHARE_MIN), _SHARE_MAX) if by_timesync else _SHARE_MIN
        share *= min(self._arrival() / self._arrival_usual, 1.0)
        chance = (1.0 - share) ** self._questions
        if self.unanswered_s(now) >= allowed_s and chance <= _CHANCE_MAX:
            self.one_way = True
