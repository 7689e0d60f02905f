"""Lists the autopilot's own logs by MAVFTP: the folders where the firmwares keep them.

ArduPilot: `/APM/LOGS`, on its simulator `/logs`, with files such as `00000007.BIN`. PX4:
`/fs/microsd/log`, on its simulator `/log`, with a folder for each day (`2026-11-23/10_06_00.ulg`)
or, without a time, `sess007/log100.ulg`. Files of other names are left out.
"""

from __future__ import annotations

import calendar
import re
from collections import deque

from mavlink_vehicle.codec import Message
from mavlink_vehicle.events import StoredLog
from mavlink_vehicle.protocols.logs.ftp import (
    FtpAnswer,
    FtpError,
    FtpLine,
    FtpOp,
    FtpQuestion,
)
from mavlink_vehicle.protocols.logs.log_parts import LogLister

FOLDERS = ("/APM/LOGS", "/logs", "/fs/microsd/log", "/log")
_ENTRIES_MAX = 5000
_FOLDERS_MAX = 200
_ARDUPILOT = re.compile(r"(\d{1,8})\.BIN", re.IGNORECASE)
_PX4 = re.compile(r".+\.ulg")
_DAY = re.compile(r"(?P<y>\d{4})-(?P<m>\d{2})-(?P<d>\d{2})|sess\d+")
_TIME = re.compile(r"(\d{2})_(\d{2})_(\d{2})")


class FtpLogList(LogLister):
    """Lists until it is complete."""

    def __init__(self, line: FtpLine) -> None:
        """Prepare; `start` asks."""
        super().__init__()
        self._line = line
        self._open = deque(FOLDERS)
        self._has_root = False
        self._visited = 0
        self._files: list[tuple[str, int]] = []
        self._entries = 0
        self._folder = ""
        self._question: FtpQuestion | None = None

    def start(self, now: float) -> None:
        """Ask for the first folder."""
        self._next_folder(now)

    def receive(self, message: Message, now: float) -> None:
        """Take an answer."""
        question = self._question
        answer = FtpAnswer.of(message, self._line.address)
        if question is None or answer is None:
            return
        question.receive(answer)
        if question.answer is not None:
            self._take(question.answer, now)

    @property
    def deadline_s(self) -> float | None:
        """When to ask again."""
        return None if self._question is None else self._question.deadline_s

    def handle_timer(self, now: float) -> None:
        """Ask again, or give up."""
        question = self._question
        if question is None:
            return
        message = question.handle_timer(now)
        if message is not None:
            self.outbox.append(message)
        if question.gave_up:
            self._question = None
            self.problem = f"The autopilot did not list {self._folder} over MAVFTP."

    def _next_folder(self, now: float) -> None:
        if not self._open or self._visited >= _FOLDERS_MAX:
            self._finish()
            return
        self._visited += 1
        self._folder = self._open.popleft()
        self._entries = 0
        self._ask(now)

    def _ask(self, now: float) -> None:
        self._question = FtpQuestion(self._line, FtpOp.LIST, self._entries, self._folder)
        self.handle_timer(now)

    def _take(self, answer: FtpAnswer, now: float) -> None:
        if answer.error is None:
            # An ArduPilot ends each with two zeros, a PX4 with one.
            entries = [entry for entry in answer.data.split(b"\0") if entry]
            self._entries += len(entries)
            for entry in entries:
                self._take_entry(entry.decode("ascii", "replace"))
            if entries and self._entries < _ENTRIES_MAX:
                self._ask(now)
                return
        if self._folder in FOLDERS and (answer.error in (None, FtpError.END_OF_FILE)):
            # It exists: the other firmware's folders need not be looked for.
            self._open = deque(folder for folder in self._open if folder not in FOLDERS)
            self._has_root = True
        elif answer.error is FtpError.UNKNOWN_COMMAND:
            self._open.clear()
        self._next_folder(now)

    def _take_entry(self, entry: str) -> None:
        """Take "F", name, tab and size, or "D" and name; anything else is to be skipped."""
        kind, name = entry[:1], entry[1:]
        if kind == "D" and self._folder in FOLDERS and _DAY.fullmatch(name):
            self._open.append(f"{self._folder}/{name}")
        elif kind == "F" and name.count("\t") == 1:
            name, size = name.split("\t")
            if size.isdecimal() and (_ARDUPILOT.fullmatch(name) or _PX4.fullmatch(name)):
                self._files.append((f"{self._folder}/{name}", int(size)))

    def _finish(self) -> None:
        self._question = None
        if not self._has_root:
            self.problem = "The autopilot has no folder of logs that MAVFTP lists."
            return
        self.logs = {}
        for number, (path, size) in enumerate(sorted(set(self._files))):
            name = _ARDUPILOT.fullmatch(path.rsplit("/", 1)[1])
            log_id = int(name[1]) if name else number
            self.logs[log_id] = StoredLog(log_id, size, _begun_s(path), path)


def _begun_s(path: str) -> int:
    """Return the time in a path of a PX4 with a clock, in seconds since 1970; 0: none."""
    *_, folder, name = path.split("/")
    day, time = _DAY.fullmatch(folder), _TIME.match(name)
    if day is None or day["y"] is None or time is None:
        return 0
    date = (int(day["y"]), int(day["m"]), int(day["d"]))
    return max(calendar.timegm((*date, *(int(part) for part in time.groups()), 0, 0, 0)), 0)
