"""The keys of navigation_client: what characters ask for, and what the terminal looks like."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
import termios
from collections.abc import Iterator

import pytest

from drone_navigation.client.terminal.keys import (
    HELP,
    HINT,
    HINT_SHORT,
    Key,
    Keyboard,
    Keys,
    Pressed,
)
from tests.support.processes import HANGS_AFTER_S


def fed(keys: Keys, *reads: str) -> list[Pressed]:
    return [pressed for read in reads for pressed in keys.feed(read)]


@pytest.mark.parametrize("typed", ["p", "r", "c", "?"])
def test_each_key_works_in_either_case(typed: str) -> None:
    assert fed(Keys(), typed, typed.upper()) == [Pressed(Key(typed))] * 2


def test_every_key_is_named_in_the_hint_and_explained_or_leads_to_the_explanation() -> None:
    for key in Key:
        assert f"{key.value} " in HINT
        assert f" {key.value}" in HINT_SHORT
        assert key is Key.HELP or f"{key.value}: " in HELP
    assert fed(Keys(), "q") == [Pressed(Key.HELP)]


def test_other_keys_and_arrows_do_nothing() -> None:
    assert fed(Keys(), "xyz \n\t1", "\x1b[A\x1bOP\x1b[1;5C\x1b[3~", "\x1b", "é") == []


def test_g_opens_a_prompt_whose_line_comes_with_enter() -> None:
    keys = Keys()
    assert fed(keys, "g", "5 5") == []
    assert keys.typed == "5 5"
    assert fed(keys, " 2\r", "p") == [Pressed(Key.GOAL, "5 5 2"), Pressed(Key.PAUSE)]
    assert keys.typed is None


def test_a_prompt_can_be_edited_and_left() -> None:
    keys = Keys()
    assert fed(keys, "g123", "\x7f\b", "\x1b[D", "\x15", "7 c p") == []
    assert keys.typed == "7 c p"
    assert fed(keys, "\x1b", "c") == [Pressed(Key.CANCEL)]
    assert fed(keys, "g\n") == []  # nothing typed is nothing asked for
    assert keys.typed is None


def test_a_prompt_takes_no_more_than_a_line() -> None:
    keys = Keys()
    fed(keys, "g", "1" * 1000)
    assert keys.typed is not None
    assert len(keys.typed) < 100


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    ends = pty.openpty()
    yield ends
    for end in ends:
        os.close(end)


IN_TERMINAL = """
import fcntl, sys, termios
from drone_navigation.client.terminal.keys import Keyboard
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
keyboard = Keyboard(sys.stdin)
modes = []
def note():
    modes.append(bool(termios.tcgetattr(0)[3] & termios.ICANON))
note()
with keyboard.returned():
    note()
note()
typed = ""
while not typed:
    typed = keyboard.read()
keyboard.close()
note()
print(modes, repr(typed), repr(keyboard.read()))
"""


def test_the_terminal_delivers_keys_until_it_is_restored(terminal: tuple[int, int]) -> None:
    ours, theirs = terminal
    before = termios.tcgetattr(theirs)
    child = subprocess.Popen(
        [sys.executable, "-c", IN_TERMINAL],
        stdin=theirs,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    os.write(ours, b"p")
    printed, _ = child.communicate(timeout=HANGS_AFTER_S)
    assert printed.strip() == "[False, True, False, True] 'p' ''"
    assert termios.tcgetattr(theirs) == before


def test_without_a_terminal_there_are_no_keys() -> None:
    with open(os.devnull, encoding="utf-8") as nothing:  # noqa: PTH123
        keyboard = Keyboard(nothing)
        assert keyboard.read() == ""
        keyboard.close()


def test_the_terminal_of_another_process_is_left_alone(terminal: tuple[int, int]) -> None:
    """As in the background of a shell, where touching it would stop the process."""
    ours, theirs = terminal
    before = termios.tcgetattr(theirs)
    with os.fdopen(os.dup(theirs), encoding="utf-8") as stream:
        keyboard = Keyboard(stream)
        os.write(ours, b"p\n")
        assert termios.tcgetattr(theirs) == before
        assert keyboard.read() == ""
        keyboard.close()
    assert termios.tcgetattr(theirs) == before
