"""Player that feeds a recording to bridge and vehicle as if it were live.

Nothing here waits, reads a clock or sends: the time is that of the recording, and the bridge's
messages are dropped. So a recording always gives the same result, as fast as the machine allows. A
:class:`Player` processes one event at a time; :func:`play` yields after each, and the caller
collects the bridge's outputs.

The sender distinguishes the two directions of a recording, as on a link: the server's own messages
are not played, and its notes (:mod:`navigation_bridge.notes`) are passed on separately.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.driver import Application
from mavlink_vehicle.io.tlog import TlogReader
from navigation_bridge import notes

OWN_COMPONENT = 191
"""Default component id of a server."""

LONGEST_SILENCE_S = 120.0
"""Longer silences are shortened to this; by then nothing changes any more."""

USUAL_GAP_S = 5.0
"""Packets come more often than this; a longer step forward may be a clock change."""

_SETTLED_S = 10.0
_MAGIC_2 = 0xFD
# Maximum number of deadlines in one silence, so that a defect of the bridge cannot loop forever.
_TIMERS_MAX = 100_000


class ReplayError(RuntimeError):
    """The bridge repeats the same deadline endlessly: an internal error."""


@dataclass
class RecordedTime:
    """Seconds since the recording began, which never go back.

    A recorder's clock may be set while it records. A step back counts as no time. A step forward
    cannot be distinguished from silence and counts as such, up to ``LONGEST_SILENCE_S``; soon after
    a step back, as in records out of order, it first makes up for that. So the elapsed time is
    bounded by the number of packets.

    Attributes:
        now: seconds since the first packet.
        stepped_back: number of backward steps of the clock.
        shortened_s: total time cut from long silences.
    """

    now: float = 0.0
    stepped_back: int = 0
    shortened_s: float = 0.0
    _unix_s: float | None = None
    _owed_s: float = 0.0
    _steady_s: float = 0.0

    def advance(self, unix_s: float) -> float:
        """Process the stamp (s since 1970) of the next packet; returns the new ``now``."""
        before, self._unix_s = self._unix_s, unix_s
        passed_s = 0.0 if before is None else unix_s - before
        if passed_s < 0.0:
            self.stepped_back += 1
            self._owed_s, self._steady_s = self._owed_s - passed_s, 0.0
            return self.now
        if passed_s > USUAL_GAP_S:
            repaid_s = min(self._owed_s, passed_s)
            self._owed_s -= repaid_s
            passed_s -= repaid_s
        else:
            self._steady_s += passed_s
            if self._steady_s > _SETTLED_S:
                self._owed_s = 0.0
        if passed_s > LONGEST_SILENCE_S:
            self.shortened_s += passed_s - LONGEST_SILENCE_S
        self.now += min(passed_s, LONGEST_SILENCE_S)
        return self.now


@dataclass(frozen=True)
class Played:
    """One event: a message or a timer.

    Attributes:
        now: seconds since the recording began.
        unix_s: the recorder's clock at that time.
        message: the message; None for a timer.
        is_note: whether the message is one of the recorder's notes. The bridge receives neither
            these nor the server's own messages.
    """

    now: float
    unix_s: float
    message: Message | None
    is_note: bool = False


def open_recording(path: str) -> tuple[TlogReader, float]:
    """Return a recording and its start time (s since 1970).

    Raises:
        LinkError: it can't be read, or holds nothing.
    """
    reader = TlogReader(path)
    first = next(iter(reader), None)
    if first is None:
        raise LinkError(f"{path} contains no MAVLink packets; nothing to replay.")
    return reader, first[0]


class Player:
    """Plays a recording to an application that is not started yet, one event at a time.

    Attributes:
        now: time of the last event, in seconds since the recording began.
        time: the recorder's clock.
        codec: decodes messages of others than the server, and counts errors.
    """

    def __init__(
        self,
        records: Iterable[tuple[float, bytes]],
        application: Application,
        codec: Codec,
        time: RecordedTime | None = None,
        own_component: int = OWN_COMPONENT,
    ) -> None:
        """Read the first record; the first :meth:`step` starts the application.

        Args:
            records: (unix time in seconds, packet), as ``TlogReader`` yields them.
            application: a bridge, or a fleet of them.
            codec: codec for messages of others.
            time: start time, if not zero.
            own_component: component id of the recorded server, whose messages are not played.
        """
        self.time = RecordedTime() if time is None else time
        self.now = self.time.now
        self.codec = codec
        self._own_codec = Codec(255, 190)
        self._own_component = own_component
        self._records = iter(records)
        self._application = application
        self._started = False
        self._timers = 0
        self._next: tuple[float, bytes] | None = None
        self._next_s = self.now
        self._load()

    @property
    def ended(self) -> bool:
        """True at the end of the recording; later timers are ignored."""
        return self._next is None

    def due_s(self) -> float | None:
        """Return the time (s) of the next event; None at the end of the recording."""
        if self._next is None:
            return None
        deadline = self._application.next_deadline() if self._started else None
        if deadline is None or deadline > self._next_s:
            return self._next_s
        return max(self.now, deadline)

    def step(self) -> list[Played]:
        """Process the next event: a timer, or the messages of a packet.

        Raises:
            ReplayError: the application's timers repeat endlessly.
        """
        if self._next is None:
            return []
        unix_s, packet = self._next
        if not self._started:
            self._started = True
            self._application.start(self.now)
        deadline = self._application.next_deadline()
        if deadline is not None and deadline <= self._next_s:
            return [self._run_timer(deadline, unix_s)]
        self.now, self._timers = self._next_s, 0
        self._load()
        return self._take(packet, unix_s)

    def _load(self) -> None:
        self._next = next(self._records, None)
        if self._next is not None:
            self._next_s = self.time.advance(self._next[0])

    def _run_timer(self, deadline: float, unix_s: float) -> Played:
        self._timers += 1
        if self._timers > _TIMERS_MAX:
            raise ReplayError(f"The timers did not settle {self.now:.3f} s into the recording.")
        self.now = max(self.now, deadline)
        self._application.handle_timer(self.now)
        self._application.messages_to_send()
        return Played(self.now, unix_s - (self._next_s - self.now), None)

    def _take(self, packet: bytes, unix_s: float) -> list[Played]:
        component = packet[6] if packet[0] == _MAGIC_2 else packet[4]
        is_note = component == notes.COMPONENT_ID
        is_own = is_note or component == self._own_component
        played = []
        for message in (self._own_codec if is_own else self.codec).decode(packet):
            if not is_own:
                self._application.receive(message, self.now)
                self._application.messages_to_send()
            played.append(Played(self.now, unix_s, message, is_note))
        return played


def play(
    records: Iterable[tuple[float, bytes]],
    application: Application,
    codec: Codec,
    time: RecordedTime | None = None,
    own_component: int = OWN_COMPONENT,
) -> Iterator[Played]:
    """Play a whole recording; see :class:`Player` for the arguments.

    Yields:
        After each message and timer, when outputs and state can be inspected.
    """
    player = Player(records, application, codec, time, own_component)
    while not player.ended:
        yield from player.step()
