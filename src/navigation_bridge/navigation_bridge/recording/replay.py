"""Player that feeds a recording to bridge and vehicle as if it were live.

Nothing in here waits, reads a clock or sends: time is what the recording says, and what the
bridge wants to send is dropped. So a recording gives the same again and again, as fast as the
machine goes. A :class:`Player` does one thing at a time; :func:`play` yields after each, and the
caller collects what the bridge puts out.

The two directions of a recording are told apart by who speaks, as on a link: what the server
itself sent is no news to it and isn't played, and its notes (:mod:`navigation_bridge.notes`) come
by themselves.
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
"""The component that a server speaks as, unless it is told otherwise."""

LONGEST_SILENCE_S = 120.0
"""More silence than this is not lived through: by then nothing changes any more."""

USUAL_GAP_S = 5.0
"""Packets come more often than this; a longer step forward may be the clock's own."""

_SETTLED_S = 10.0
_MAGIC_2 = 0xFD
# Deadlines in one silence: a mistake in the bridge must not become an endless loop.
_TIMERS_MAX = 100_000


class ReplayError(RuntimeError):
    """The bridge sets its deadline to the same time endlessly: an internal error."""


@dataclass
class RecordedTime:
    """Seconds since the recording began, which never go back.

    A recorder's clock may be set while it records. A step back counts as no time at all. A
    step forward can't be told from silence and counts as such, up to ``LONGEST_SILENCE_S``; but
    soon after a step back, as in records out of order, it first makes that good. So the time
    that passes is bounded by the number of packets.

    Attributes:
        now: seconds since the first packet.
        stepped_back: how often the clock went back.
        shortened_s: what was left out of long silences, in total.
    """

    now: float = 0.0
    stepped_back: int = 0
    shortened_s: float = 0.0
    _unix_s: float | None = None
    _owed_s: float = 0.0
    _steady_s: float = 0.0

    def advance(self, unix_s: float) -> float:
        """Take the stamp (s since 1970) of the next packet; returns the new ``now``."""
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
        message: what came; None for a timer.
        is_note: the message is one of the recorder's own notes. These, and what the server itself
            sent, the bridge doesn't hear.
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
    """Plays a recording to an application that was not started yet, one thing at a time.

    Attributes:
        now: seconds since the recording began, of the last thing that happened.
        time: what the recorder's clock did.
        codec: decodes what others than the server said, and counts what could not be decoded.
    """

    def __init__(
        self,
        records: Iterable[tuple[float, bytes]],
        application: Application,
        codec: Codec,
        time: RecordedTime | None = None,
        own_component: int = OWN_COMPONENT,
    ) -> None:
        """Look at the first record; the application is started by the first :meth:`step`.

        Args:
            records: (unix time in seconds, packet), as ``TlogReader`` yields them.
            application: a bridge, or a fleet of them.
            codec: for what others said.
            time: a time to begin at, if not zero.
            own_component: the component that the server spoke as; what it said isn't played.
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
        """Return when the next thing happens (s); None at the recording's end."""
        if self._next is None:
            return None
        deadline = self._application.next_deadline() if self._started else None
        if deadline is None or deadline > self._next_s:
            return self._next_s
        return max(self.now, deadline)

    def step(self) -> list[Played]:
        """Process the next event: a timer, or the messages of a packet.

        Raises:
            ReplayError: timers of the application do not come to rest.
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
        After each message and each timer, when outputs and state can be looked at.
    """
    player = Player(records, application, codec, time, own_component)
    while not player.ended:
        yield from player.step()
