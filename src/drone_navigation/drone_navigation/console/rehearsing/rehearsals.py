"""Goals rehearsed in a process of its own, which may fail: flying needs none of it.

The process is `flight_rehearsal`, which knows the simulator and no ROS. It is started with the
first rehearsal, stays for the next ones, and is started again after it has ended. One thread only,
but for the reading of its answers.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from drone_navigation.console.messages import Rehearse
from drone_navigation.console.page_types import JsonObject, Tell

__all__ = ["Rehearsals"]

# It gives up by itself after 10 s; longer than this it hangs.
_TIMEOUT_S = 20.0
_COMMAND = (sys.executable, "-m", "flight_rehearsal")
_ENDED = "The rehearsal has ended unexpectedly. Flying does not need it."


@dataclass
class _Order:
    """A goal to rehearse, and the page that gets the results."""

    by: str
    order: Rehearse
    document: dict[str, object]
    tell: Tell
    lacks: tuple[str, ...] = ()

    def answer(self, **result: object) -> None:
        if "rehearsal" in result:
            result["lacks"] = self.lacks
        about = {"vehicle": self.order.vehicle, "number": self.order.number}
        self.tell({"type": "rehearsal", **about, **result})


class _Program:
    """The process, read and written by threads: whatever it does, nobody waits for it."""

    def __init__(self, command: Sequence[str], take: Callable[[JsonObject | None], None]) -> None:
        """Start it.

        Args:
            command: what to run.
            take: called with each answer, and None at the end; from another thread.

        Raises:
            OSError: it cannot be started.
        """
        self._take = take
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
        for work in (self._read, self._write):
            threading.Thread(target=work, daemon=True).start()

    def send(self, document: dict[str, object]) -> None:
        """Send it an object."""
        self._lines.put(json.dumps(document))

    def kill(self) -> None:
        """End it."""
        self._process.kill()

    def _write(self) -> None:
        assert self._process.stdin is not None
        with contextlib.suppress(OSError), self._process.stdin as pipe:
            while (line := self._lines.get()) is not None:
                pipe.write(line + "\n")
                pipe.flush()

    def _read(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as pipe:
            for line in pipe:
                with contextlib.suppress(ValueError):
                    self._take(json.loads(line))
        self._process.wait()
        self._lines.put(None)
        self._take(None)


class Rehearsals:
    """Passes goals to the process, of each page the newest one.

    Attributes:
        server_names: the server's parameters that decide a flight; none before the process
            has sent them.
    """

    def __init__(
        self, post: Callable[[Callable[[], None]], None], command: Sequence[str] = _COMMAND
    ) -> None:
        """Prepare; nothing is started yet.

        Args:
            post: has something done in the thread that calls all methods.
            command: that of the process.
        """
        self._post = post
        self._command = command
        self._program: _Program | None = None
        self._waiting: dict[str, _Order] = {}
        self._current: _Order | None = None
        self._numbers = itertools.count(1)
        self._number = 0
        self._now = self._deadline_s = 0.0
        self.server_names: tuple[str, ...] = ()
        self._vehicle_names: dict[str, tuple[str, ...]] = {}

    def vehicle_names(self, autopilot: str) -> tuple[str, ...]:
        """Return the vehicle's parameters that decide a flight; none before the process is up."""
        return self._vehicle_names.get(autopilot, ())

    def warm_up(self) -> None:
        """Start the process, unless it runs."""
        if self._program is None:
            with contextlib.suppress(OSError):
                self._program = self._start()

    def begin(
        self,
        by: str,
        order: Rehearse,
        known: dict[str, object],
        tell: Tell,
        lacks: tuple[str, ...] = (),
        lose_link: bool = True,
        steps: Sequence[Mapping[str, object]] = (),
    ) -> None:
        """Rehearse a goal; an older one of the same page is given up.

        Args:
            by: name of the page.
            order: the goal.
            known: what is known of the vehicle, the server and the obstacles.
            tell: called with the results, one after the other.
            lacks: what it does not consider, for people.
            lose_link: whether a loss of the link is rehearsed, too.
            steps: of a plan, as `flight_rehearsal` takes them, instead of the goal's waypoints.
        """
        document = {
            **known,
            "waypoints": [[*w.position_enu_m, w.hold_time_s] for w in order.waypoints],
            "speed": order.speed_m_s,
            "laps": order.laps,
            "avoid": order.avoid_obstacles,
            "radius": order.radius_m,
            "lose_link": lose_link,
            "steps": list(steps),
        }
        self._waiting.pop(by, None)
        new = _Order(by, order, document, tell, lacks)
        if self._current is None or self._current.by == by:
            self._send(new)
        else:
            self._waiting[by] = new

    def tick(self, now: float) -> None:
        """End a process that hangs, at a time in s."""
        self._now = now
        if self._current is not None and now > self._deadline_s and self._program is not None:
            self._deadline_s = math.inf
            self._program.kill()

    def close(self) -> None:
        """End the process; the next goal starts another one."""
        program, self._program, self._current = self._program, None, None
        self._waiting.clear()
        if program is not None:
            program.kill()

    # --- the process ------------------------------------------------------------------------

    def _send(self, order: _Order) -> None:
        self.warm_up()
        if self._program is None:
            order.answer(error=_ENDED)
            return
        self._current, self._deadline_s = order, self._now + _TIMEOUT_S
        self._number = next(self._numbers)
        self._program.send({**order.document, "number": self._number})

    def _start(self) -> _Program:
        def take(message: JsonObject | None) -> None:
            self._post(lambda: self._take(program, message))

        program = _Program(self._command, take)
        return program

    def _take(self, program: _Program, message: JsonObject | None) -> None:
        if program is not self._program:
            return
        current = self._current
        if message is None:
            self._program = None
            if current is not None:
                current.answer(error=_ENDED)
            self._go_on()
        elif "server" in message:
            self.server_names = tuple(message["server"])
            self._vehicle_names = {k: tuple(v) for k, v in message["vehicle"].items()}
        elif current is not None and message.pop("number", None) == self._number:
            current.answer(**message)
            flown = message.get("rehearsal")
            if flown is None or not flown["accepted"] or not current.document["lose_link"]:
                self._go_on()

    def _go_on(self) -> None:
        self._current = None
        if self._waiting:
            self._send(self._waiting.pop(next(iter(self._waiting))))
