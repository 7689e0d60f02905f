"""TIMESYNC: measures the round trip to the autopilot. Sans I/O.

We ask with our own time in ``ts1``; the autopilot answers with its time in ``tc1`` and our
``ts1`` as it came (https://mavlink.io/en/services/timesync.html). An answer is ours when it
carries a ``ts1`` that we sent: PX4 leaves its target fields uninitialised, and autopilots
answer other systems, too. Our ids stand in its last digits, so that nobody else on this machine
sends the same. The smallest of the last round trips is the best measure, because
everything that disturbs one makes it longer.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.service import Conversation, VehicleService
from mavlink_vehicle.state.measurements import Values
from mavlink_vehicle.state.vehicle_state import Changes, VehicleState

_TIMESYNC = mavlink.MAVLink_timesync_message
Answered = Callable[[float, int, float], None]
_NANOSECONDS = 1_000_000_000
_IDENTITY_BITS = 0xFFFF  # 66 us: the time that is measured is kept apart from what is sent
_KEPT = 10
# An answer that takes longer than this is no answer.
_FORGOTTEN_S = 5.0


class Timesync(VehicleService):
    """Asks at an interval, and keeps the last round trips.

    Attributes:
        answers: how many questions were answered since `resume`.
    """

    handles = (_TIMESYNC,)

    def __init__(self, interval_s: float, answered: Answered = lambda *_: None) -> None:
        """Prepare; 0 never asks.

        Args:
            interval_s: of the questions.
            answered: called with an answer's round trip in s, the vehicle's time in it in ns, and
                the time in s.
        """
        super().__init__()
        self._interval_s = interval_s
        self._on_answer = answered
        self.answers = 0
        self._identity = 0
        self._asked: dict[int, float] = {}
        self._round_trips_s: deque[float] = deque(maxlen=_KEPT)

    @property
    def round_trip_s(self) -> float | None:
        """Smallest of the last round trips; None before the first answer."""
        return min(self._round_trips_s, default=None)

    @property
    def slowest_round_trip_s(self) -> float:
        """Greatest of the last round trips; 0 before the first answer."""
        return max(self._round_trips_s, default=0.0)

    @property
    def is_used(self) -> bool:
        """Whether it asks at all."""
        return self.deadline_s is not None

    def resume(self, address: Address, now: float) -> None:
        """Begin to ask; times of an earlier link count no more."""
        self._identity = address.source_system << 8 | address.source_component
        self._round_trips_s.clear()
        self.answers = 0
        self.deadline_s = now if self._interval_s > 0.0 else None

    def vehicle_came(self, conversation: Conversation, now: float) -> None:
        """Begin to ask."""
        self.resume(conversation.address, now)

    def link_lost(self, state: VehicleState, now: float) -> None:
        """Stop asking."""
        self.pause()

    def pause(self) -> None:
        """Stop asking."""
        self.deadline_s = None
        self._asked.clear()

    def receive(self, message: Message, now: float) -> None:
        """Take an answer to one of our questions; others belong to other programs."""
        if not isinstance(message, _TIMESYNC) or message.tc1 == 0:
            return
        asked_s = self._asked.pop(message.ts1, None)
        if asked_s is None:
            return
        self._round_trips_s.append(now - asked_s)
        self.answers += 1
        self._on_answer(now - asked_s, message.tc1, now)

    def changes(self, _state: VehicleState, _now: float, values: Values) -> Changes | None:
        """Return no changes by a TIMESYNC that is not for us; None for an answer of ours.

        It has no target. So of several vehicles on one link each answers the questions to all, and
        most that comes is for another.
        """
        vehicle_ns, asked_ns = values
        return None if vehicle_ns and asked_ns in self._asked else {}

    def _on_deadline(self, now: float) -> None:
        self.ask(now)

    def ask(self, now: float) -> None:
        """Ask now, and then at the interval again."""
        self.deadline_s = now + self._interval_s
        for ts1, asked_s in list(self._asked.items()):
            if now - asked_s > _FORGOTTEN_S:
                del self._asked[ts1]
        ts1 = int(now * _NANOSECONDS) & ~_IDENTITY_BITS | self._identity
        self._asked[ts1] = now
        self.outbox.append(make("TIMESYNC", tc1=0, ts1=ts1))
