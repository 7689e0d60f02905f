"""Plays a recording through what flies: bridge and vehicle see it as they would have live.

Nothing in here waits, reads a clock or sends: time is what the recording says, and what the
bridge wants to send is dropped. So a recording gives the same again and again, as fast as the
machine goes. :func:`play` yields after each thing that happened, and the caller collects what
the bridge puts out.

The two directions of a recording are told apart by who speaks, as on a link: what the server
itself sent is no news to it, and its notes (:mod:`drone_navigation.notes`) come by themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from drone_navigation import notes
from drone_navigation.bridge import Bridge
from mavlink_vehicle.codec import Codec, Message

LONGEST_SILENCE_S = 120.0
"""More silence than this is not lived through: by then nothing changes any more."""

# Deadlines in one silence: a mistake in the bridge must not become an endless loop.
_TIMERS_MAX = 100_000


class ReplayError(RuntimeError):
    """The bridge asks to be called again and again at one time: a defect of ours."""


@dataclass
class RecordedTime:
    """Seconds since the recording began, which never go back.

    A recorder's clock may be set while it records. A step back counts as no time at all; a
    step forward can't be told from silence and counts as such, up to ``LONGEST_SILENCE_S``.

    Attributes:
        now: seconds since the first packet.
        stepped_back: how often the clock went back.
        shortened_s: what was left out of long silences, in total.
    """

    now: float = 0.0
    stepped_back: int = 0
    shortened_s: float = 0.0
    _unix_s: float | None = None

    def advance(self, unix_s: float) -> float:
        """Take the stamp (s since 1970) of the next packet; returns the new ``now``."""
        before, self._unix_s = self._unix_s, unix_s
        passed_s = 0.0 if before is None else unix_s - before
        if passed_s < 0.0:
            self.stepped_back += 1
        elif passed_s > LONGEST_SILENCE_S:
            self.shortened_s += passed_s - LONGEST_SILENCE_S
        self.now += min(max(passed_s, 0.0), LONGEST_SILENCE_S)
        return self.now


@dataclass(frozen=True)
class Played:
    """One thing that happened: a message came, or a timer was due.

    Attributes:
        now: seconds since the recording began.
        unix_s: the recorder's clock at that time.
        message: what came; None for a timer.
        is_note: the message is one of the recorder's own notes, which the bridge doesn't hear.
    """

    now: float
    unix_s: float
    message: Message | None
    is_note: bool = False


def play(
    records: Iterable[tuple[float, bytes]],
    bridge: Bridge,
    codec: Codec,
    time: RecordedTime | None = None,
) -> Iterator[Played]:
    """Play a recording to a bridge that was not started yet.

    Args:
        records: (unix time in seconds, packet), as ``TlogReader`` yields them.
        bridge: it is started; what it wants to send is dropped.
        codec: decodes the packets, and counts what could not be decoded.
        time: tells afterwards what the recorder's clock did; made here if not given.

    Yields:
        After each message and each timer, when outputs and state can be looked at.
    """
    time = RecordedTime() if time is None else time
    started = False
    for unix_s, packet in records:
        before = time.now
        now = time.advance(unix_s)
        if not started:
            started = True
            bridge.start(now)
        for timer_s in _run_timers(bridge, before, now):
            yield Played(timer_s, unix_s - (now - timer_s), None)
        for message in codec.decode(packet):
            note = message.get_srcComponent() == notes.COMPONENT_ID
            if not note:
                bridge.receive(message, now)
                bridge.messages_to_send()
            yield Played(now, unix_s, message, note)


def _run_timers(bridge: Bridge, start_s: float, end_s: float) -> Iterator[float]:
    """Let the bridge do what falls due up to a time, each thing at its own time."""
    now = start_s
    for _ in range(_TIMERS_MAX):
        deadline = bridge.next_deadline()
        if deadline is None or deadline > end_s:
            return
        now = max(now, deadline)
        bridge.handle_timer(now)
        bridge.messages_to_send()
        yield now
    raise ReplayError(f"The bridge's timers do not come to rest {now:.3f} s into the recording.")
