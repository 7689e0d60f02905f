"""Keyboard input of the navigation client and the terminal it is typed on."""

from __future__ import annotations

import contextlib
import os
import re
import select
import termios
import tty
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import IO

HINT = "p pause  r resume  g new goal  c cancel  ? help"
HINT_SHORT = "keys: p r g c ?"
HELP = (
    "p: pause, the vehicle holds. r: resume. g: enter another goal, which replaces this one "
    "in flight. c: cancel and wait for the stop; so does Ctrl-C, and a second Ctrl-C stops waiting."
)

_ESCAPE = "\x1b"
# A key that sends more than one character, such as an arrow (ECMA-48, 5.4; SS3 of 8.3.142).
_SEQUENCE = re.compile(r"\x1b(\[[0-?]*[ -/]*[@-~]|O.)")
_ERASE = ("\x7f", "\b")
_ERASE_ALL = "\x15"  # Ctrl-U
_PROMPT_MAX = 60


class Key(Enum):
    """Actions of keys."""

    PAUSE = "p"
    RESUME = "r"
    GOAL = "g"
    CANCEL = "c"
    HELP = "?"


_KEYS = {key.value: key for key in Key} | {"q": Key.HELP, "h": Key.HELP}


@dataclass(frozen=True)
class Pressed:
    """A key action; GOAL carries the typed line."""

    key: Key
    line: str = ""


class Keys:
    """Converts characters to key actions; independent of the terminal.

    Attributes:
        typed: what stands in the prompt for another goal, or None while there is no prompt.
    """

    def __init__(self) -> None:
        """Start without a prompt."""
        self.typed: str | None = None

    def feed(self, characters: str) -> Iterator[Pressed]:
        """Process the characters of one read; yield their actions."""
        for character in _SEQUENCE.sub("", characters):
            if self.typed is not None:
                line = self._edit(character)
                if line is not None:
                    yield Pressed(Key.GOAL, line)
            elif character.lower() in _KEYS:
                key = _KEYS[character.lower()]
                if key is Key.GOAL:
                    self.typed = ""
                else:
                    yield Pressed(key)

    def _edit(self, character: str) -> str | None:
        """Change the prompt's text; return it when it is done."""
        assert self.typed is not None
        if character in "\r\n":
            line, self.typed = self.typed, None
            return line or None
        if character == _ESCAPE:
            self.typed = None
        elif character in _ERASE:
            self.typed = self.typed[:-1]
        elif character == _ERASE_ALL:
            self.typed = ""
        elif character.isprintable() and len(self.typed) < _PROMPT_MAX:
            self.typed += character
        return None


class Keyboard:
    """A terminal in raw mode without echo, until it is closed."""

    def __init__(self, stream: IO[str]) -> None:
        """Switch the terminal behind ``stream`` to raw mode, if there is one."""
        self._file: int | None = None
        self._saved: list[int | list[bytes | int]] = []
        with contextlib.suppress(OSError, ValueError, termios.error):
            file = stream.fileno()
            if os.isatty(file):
                self._saved = termios.tcgetattr(file)
                self._file = file
                self._enter()

    @contextlib.contextmanager
    def returned(self) -> Iterator[None]:
        """Restore the terminal temporarily."""
        self._restore()
        try:
            yield
        finally:
            self._enter()

    def _enter(self) -> None:
        # A process in the background must not touch it: the kernel would stop the process.
        if self._file is not None and self._in_foreground(self._file):
            # Ctrl-C still is a signal; what was typed before is not lost.
            tty.setcbreak(self._file, termios.TCSANOW)

    def read(self) -> str:
        """Return the characters typed since; never blocks."""
        file = self._file
        if file is None:
            return ""
        try:
            if not self._in_foreground(file) or not select.select([file], [], [], 0.0)[0]:
                return ""
            data = os.read(file, 1024)
        except OSError:
            data = b""
        if not data:  # the terminal was closed
            self._file = None
        return data.decode("utf-8", "ignore")

    def close(self) -> None:
        """Restore the terminal."""
        self._restore()
        self._file = None

    def _restore(self) -> None:
        if self._file is not None and self._in_foreground(self._file):
            with contextlib.suppress(termios.error):
                termios.tcsetattr(self._file, termios.TCSANOW, self._saved)

    @staticmethod
    def _in_foreground(file: int) -> bool:
        try:
            return os.tcgetpgrp(file) == os.getpgrp()
        except OSError:
            return False
