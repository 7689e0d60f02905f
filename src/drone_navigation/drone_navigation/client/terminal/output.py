"""Output of the navigation client: live view on a terminal, plain lines or JSON elsewhere."""

from __future__ import annotations

import io
import math
import os
import sys
from typing import Protocol

from rich.console import Console

from drone_navigation.client.events import Event, Telemetry, as_json
from drone_navigation.client.terminal.keys import HINT
from drone_navigation.client.terminal.live import LiveView
from navigation_core.geometry import Vector3
from navigation_core.safety.late_setpoints import LATE_S

_PLAIN_PERIOD_S = 1.0


class ClientView(Protocol):
    """Shows the progress of a goal. All times are in seconds since the first goal was accepted."""

    def tell(self, event: Event, t_s: float) -> None:
        """Show an event permanently."""

    def show(self, telemetry: Telemetry, t_s: float) -> None:
        """Show a feedback."""

    def prompt(self, label: str, typed: str | None) -> None:
        """Show the prompt for another goal with what was typed; None for no prompt."""

    def tick(self, t_s: float) -> None:
        """Show the elapsed time."""

    def close(self) -> None:
        """Leave the terminal as it was."""

    def open(self) -> None:
        """Reopen after a close."""


class _PrintingView:
    """A view that only prints, so it leaves the terminal as it is."""

    def prompt(self, label: str, typed: str | None) -> None:
        """Show nothing: there is no keyboard."""

    def tick(self, t_s: float) -> None:
        """Nothing to redraw."""

    def close(self) -> None:
        """Nothing to restore."""

    def open(self) -> None:
        """Nothing to prepare."""


class PlainView(_PrintingView):
    """One line per second and one for each change, for pipes and log files."""

    def __init__(self, console: Console, *, keys: bool = False) -> None:
        """Write to ``console``, and what the keys are if there are any."""
        self._console = console
        self._shown: tuple[object, ...] = ()
        self._next_s = 0.0
        self._prompt = ""
        if keys:
            self._print(f"Keys: {HINT}")

    def tell(self, event: Event, t_s: float) -> None:
        """Print a line."""
        if event.sentence:
            self._leave_prompt()
            self._print(event.sentence)

    def show(self, telemetry: Telemetry, t_s: float) -> None:
        """Print the feedback if it is time or if something changed."""
        shown = (telemetry.goal, telemetry.status, telemetry.replans, telemetry.waypoint)
        if self._prompt or (shown == self._shown and t_s < self._next_s):
            return
        self._shown = shown
        self._next_s = t_s + _PLAIN_PERIOD_S
        self._print(f"{t_s:6.1f} s  {_summary(telemetry)}")

    def prompt(self, label: str, typed: str | None) -> None:
        """Print what is typed; feedback waits until the prompt is gone."""
        if typed is not None:
            line = f"{label}{typed}"
            if line != self._prompt:
                blank = " " * len(self._prompt)
                self._console.out(f"\r{blank}\r{line}", end="", highlight=False)
                self._prompt = line
        else:
            self._leave_prompt()

    def _leave_prompt(self) -> None:
        if self._prompt:
            self._print("")
            self._prompt = ""

    def _print(self, text: str) -> None:
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)


class JsonView(_PrintingView):
    """One JSON object a line, for scripts; :func:`client_events.as_json` has its members."""

    def __init__(self, console: Console) -> None:
        """Write to ``console``."""
        self._console = console

    def tell(self, event: Event, t_s: float) -> None:
        """Print an event."""
        self._print(as_json(event, t_s))

    def show(self, telemetry: Telemetry, t_s: float) -> None:
        """Print a feedback: each one."""
        self._print(as_json(telemetry, t_s))

    def _print(self, text: str) -> None:
        self._console.out(text, highlight=False)


class _PatientConsole(Console):
    """Goes quiet when the reader is gone; the goal is still followed to its end."""

    def on_broken_pipe(self) -> None:
        """Send the rest nowhere, where Console would end the program."""
        self.quiet = True
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.file.fileno())
        os.close(nowhere)


def make_view(*, plain: bool, json: bool, keys: bool) -> ClientView:
    """Return JSON if asked for, else the live view on a terminal, and plain lines elsewhere.

    Args:
        plain: plain lines on a terminal, too.
        json: JSON wherever it goes.
        keys: whether somebody can press keys.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal that can't draw a bar is no reason
    console = _PatientConsole()
    if json:
        return JsonView(console)
    if plain or not console.is_terminal or console.is_dumb_terminal:
        return PlainView(console, keys=keys)
    return LiveView(console, keys=keys)


def _summary(telemetry: Telemetry) -> str:
    battery = telemetry.battery_percent
    place = _position(telemetry.position_enu_m)
    parts = [f"{telemetry.status:<10}  {place}"]
    if telemetry.follow_state is None:
        parts = [
            f"{parts[0]}  {telemetry.distance_left_m:.2f} m left",
            f"about {telemetry.time_left_s:.1f} s",
        ]
    else:
        parts.append(telemetry.follow_text)
    parts += [
        f"battery {battery:.0f} %" if math.isfinite(battery) else "battery unknown",
    ]
    if telemetry.waypoint is not None:
        parts.append(f"waypoint {telemetry.waypoint} of {telemetry.waypoints}")
    if telemetry.laps_flown is not None:
        parts.append(f"{telemetry.laps_flown:.1f} laps flown")
    if telemetry.replans:
        parts.append(f"replans {telemetry.replans}")
    if telemetry.setpoint_delay_s >= LATE_S:
        parts.append(f"setpoints {telemetry.setpoint_delay_s:.1f} s late")
    return ", ".join(parts)


def _position(position_enu_m: Vector3) -> str:
    x, y, z = position_enu_m
    return f"east {x:.2f}  north {y:.2f}  up {z:.2f} m" if math.isfinite(x) else "position unknown"
