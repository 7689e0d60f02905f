"""Thread that replays a recording to a fleet in place of a driver. No ROS.

Events and their order are the same at any speed; only the waiting differs.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Protocol

from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.io.clock import ManualClock, MonotonicClock
from mavlink_vehicle.io.driver import Application
from mavlink_vehicle.io.mailbox import Mailbox
from navigation_bridge.recording.replay import (
    OWN_COMPONENT,
    Player,
    RecordedTime,
    open_recording,
)

_LONGEST_WAIT_S = 0.5
_LOOK_PACKETS = 10_000
# A year of replay before builtin_interfaces/Time overflows.
_LATEST_UNIX_S = 2.0**31 - 366 * 86_400


class ReplayedApplication(Application, Protocol):
    """Receiver of a replayed recording."""

    def take_note(self, message: Message, now: float) -> None:
        """Process a note of the recorder."""

    def begin_again(self) -> None:
        """Reset: the recording is played from its start."""

    def mute(self, muted: bool, now: float) -> None:
        """Publish nothing for a while; afterwards, everything as it then is."""


@dataclass(frozen=True)
class ReplayPosition:
    """Progress of a replay.

    Attributes:
        recording_s: seconds since its beginning.
        unix_s: the recorder's clock, which never goes back here.
        share: from 0 to 1.
        ended: whether nothing is left.
        playing: whether it is not paused.
        paused: whether it is paused, ended or not.
        seeking: whether the state at another position is being rebuilt.
        jumps: number of jumps to another position.
        speed: seconds of the recording in a second; 0 is as fast as possible.
        stepped_back: number of backward steps of the recorder's clock.
        shortened_s: time cut from long silences.
    """

    recording_s: float
    unix_s: float
    share: float
    ended: bool
    playing: bool
    paused: bool
    seeking: bool
    jumps: int
    speed: float
    stepped_back: int
    shortened_s: float


class ReplayDriver(Mailbox):
    """Plays a recording; accepts work from other threads like a driver.

    Attributes:
        clock: the application's time; it stands still between two packets.
        codec: its counts cover the recording.
        on_time: called on the thread with the recorder's clock (s since 1970) as it advances.
        on_end: called on the thread when nothing is left.
        on_look: called on the thread between events, and at least twice a second.
        changes: counts what was changed about the playing: speed, pause, jumps, the end.
        duration_s: length of the recording; 0 until all of it has been looked at.
        path: the recording.
        begin_unix_s: start of the recording.
    """

    def __init__(self, path: str, speed: float, own_component: int = OWN_COMPONENT) -> None:
        """Read the recording; :meth:`play_to` must follow before :meth:`start`.

        Args:
            path: the tlog.
            speed: seconds of the recording in a second; 0 is as fast as possible.
            own_component: component id of the recorded server.

        Raises:
            LinkError: it can't be read, or holds nothing.
        """
        super().__init__("replay")
        self.path = Path(path)
        self.clock = ManualClock()
        self.on_time: Callable[[float], None] = lambda _unix_s: None
        self.on_end: Callable[[], None] = lambda: None
        self.on_look: Callable[[], None] = lambda: None
        self.changes = 0
        self.duration_s = 0.0
        self._reader, begin_unix_s = open_recording(path)
        # Times that ROS cannot represent count as damage.
        self.begin_unix_s = begin_unix_s if begin_unix_s < _LATEST_UNIX_S else 0.0
        self._own_component = own_component
        self._speed = speed
        self._wall = MonotonicClock()
        self._thread = self.thread = threading.Thread(target=self._run, name="replay", daemon=True)
        self._woken = threading.Event()
        self._stopping = False
        self._paused = False
        self._seek_s: float | None = None
        self._jumps = 0
        self._application: ReplayedApplication  # by play_to, as the player is
        self._player: Player
        self.codec = Codec(1, own_component)
        self._begin_s = 0.0
        self._anchor = (0.0, 0.0)

    def play_to(self, application: ReplayedApplication) -> None:
        """Set the receiver of the recording, before :meth:`start`."""
        self._application = application
        self._make_player()

    def start(self) -> None:
        """Start to play."""
        self._set_anchor(self._player.now)
        self._thread.start()
        threading.Thread(target=self._measure, name="replay duration", daemon=True).start()

    def stop(self, timeout_s: float = 5.0) -> None:
        """End the thread; stopping twice is harmless."""
        self._stopping = True
        self.wake()
        if self._thread.is_alive():
            self._thread.join(timeout_s)

    # --- from any thread -----------------------------------------------------------------

    def wake(self) -> None:
        """Have the thread stop waiting."""
        self._woken.set()

    def set_speed(self, speed: float) -> None:
        """Play faster or slower from now on; 0 is as fast as possible."""
        self.post(lambda: self._change(speed, self._paused))

    def pause(self, paused: bool) -> None:
        """Pause or resume."""
        self.post(lambda: self._change(self._speed, paused))

    def rewind(self, play: bool) -> None:
        """Go back to the start, and play or stop there."""
        self.post(lambda: self._rewind(play))

    def seek(self, position_s: float) -> None:
        """Go to a position, in seconds from the start; one beyond the end is the end.

        Everything before it is played there, from the start if it lies back, as fast as possible
        and unpublished: a state depends on all that came before. Other work is done meanwhile.
        """
        self.post(lambda: self._seek(max(position_s, 0.0)))

    def position(self) -> ReplayPosition:
        """Return the progress; on the thread, or by :meth:`call`."""
        player = self._player
        time = player.time
        recording_s = player.now - self._begin_s
        return ReplayPosition(
            recording_s=recording_s,
            unix_s=self.begin_unix_s + recording_s,
            share=self._reader.position / self._reader.size,
            ended=player.ended,
            playing=not self._paused and not player.ended,
            paused=self._paused,
            seeking=self._seek_s is not None,
            jumps=self._jumps,
            speed=self._speed,
            stepped_back=time.stepped_back,
            shortened_s=time.shortened_s,
        )

    # --- on the thread -------------------------------------------------------------------

    def _run(self) -> None:
        while not self._stopping:
            try:
                self._turn()
            except Exception as error:
                logging.getLogger(__name__).error("The replay has failed.", exc_info=error)
                self._paused, self._seek_s = True, None
                self.changes += 1

    def _turn(self) -> None:
        application = self._application
        while self.works:
            self.do_next()
            application.messages_to_send()  # the request reports its own effect
        self.on_look()
        player = self._player
        if self._seek_s is not None:
            self._seek_on(application, player, self._seek_s)
            return
        wait_s = self._wait_s(player)
        if wait_s > 0.0:
            self._woken.wait(min(wait_s, _LONGEST_WAIT_S))
            self._woken.clear()
            return
        due_s = player.due_s()
        if due_s is not None:
            self.clock.advance_to(due_s)
        self._report_time()
        self._step(application, player)
        if player.ended:
            self._end()

    @staticmethod
    def _step(application: ReplayedApplication, player: Player) -> None:
        for played in player.step():
            if played.is_note and played.message is not None:
                application.take_note(played.message, played.now)
        application.messages_to_send()

    def _report_time(self) -> None:
        self.on_time(self.begin_unix_s + self.clock.now() - self._begin_s)

    def _end(self) -> None:
        self.changes += 1
        self.on_end()

    def _seek_on(self, application: ReplayedApplication, player: Player, seek_s: float) -> None:
        """Play the next event before the position, or end the seek."""
        due_s = player.due_s()
        target_s = self._begin_s + seek_s
        if due_s is not None and due_s <= target_s:
            self.clock.advance_to(due_s)
            self._step(application, player)
            return
        if due_s is not None:
            self.clock.advance_to(target_s)
        self._seek_s = None
        self.changes += 1
        self._report_time()
        self.on_look()
        application.mute(False, self.clock.now())
        self._set_anchor(self.clock.now())
        if due_s is None:
            self._end()

    def _wait_s(self, player: Player) -> float:
        due_s = player.due_s()
        if self._paused or due_s is None:
            return _LONGEST_WAIT_S
        if self._speed == 0.0:
            return 0.0
        began_s, played_s = self._anchor
        return began_s + (due_s - played_s) / self._speed - self._wall.now()

    def _change(self, speed: float, paused: bool) -> None:
        self._speed, self._paused = speed, paused
        self.changes += 1
        self._set_anchor(self._player.now)

    def _rewind(self, play: bool) -> None:
        self._begin_again(self._application)
        if self._seek_s is not None:
            self._seek_s = None
            self._application.mute(False, self.clock.now())
        self._jumps += 1
        self._change(self._speed, not play)

    def _begin_again(self, application: ReplayedApplication) -> None:
        application.begin_again()
        self._begin_s = self.clock.now()
        self._make_player()

    def _seek(self, position_s: float) -> None:
        if self._seek_s is None:
            self._application.mute(True, self.clock.now())
        if position_s < self.clock.now() - self._begin_s:
            self._begin_again(self._application)
        self._seek_s = position_s
        self._jumps += 1
        self.changes += 1

    def _make_player(self) -> None:
        self.codec = Codec(1, self._own_component)
        records: Iterable[tuple[float, bytes]] = self._reader
        time = RecordedTime(now=self._begin_s)
        self._player = Player(records, self._application, self.codec, time, self._own_component)

    def _set_anchor(self, played_s: float) -> None:
        self._anchor = (self._wall.now(), played_s)

    # --- a thread of its own -------------------------------------------------------------

    def _measure(self) -> None:
        time = RecordedTime()
        # A copy, since a reader's `position` follows its last iteration, which is the replay's.
        for number, (unix_s, _) in enumerate(copy(self._reader)):
            time.advance(unix_s)
            if number % _LOOK_PACKETS == 0 and self._stopping:
                return
        self.post(partial(self._set_duration, time.now))

    def _set_duration(self, duration_s: float) -> None:
        self.duration_s = duration_s
        self.changes += 1
