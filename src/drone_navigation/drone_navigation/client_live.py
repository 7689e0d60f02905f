"""The live view of the navigation client: a block at the bottom of the terminal."""

from __future__ import annotations

import math
from dataclasses import replace

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from drone_navigation.client_events import Ended, Event, Sending, Telemetry
from drone_navigation.client_keys import HINT

_PERIOD_S = 0.1
_BAR_MAX = 40
# What a line needs beside its bar.
_BESIDE_BAR = 34
_BAR_MIN = 5
_BATTERY_LOW_PERCENT = 25.0
# A server sends several a second; this long without one is worth a word.
_SILENCE_S = 3.0

_STATUS_STYLES = {
    "NAVIGATING": "bold green",
    "SETTLING": "bold green",
    "SUCCESS": "bold white on green",
    "PAUSED": "bold yellow",
    "CANCELLING": "bold yellow",
    "BLOCKED": "bold black on yellow",
    "HOLDING": "bold red",
    "LINK_LOST": "bold white on red",
}


class LiveView:
    """A block at the bottom of the terminal that is redrawn in place."""

    def __init__(self, console: Console, *, keys: bool = False) -> None:
        """Start drawing on ``console``, with a line about the keys if there are any."""
        self._console = console
        self._keys = keys
        self._whole_m = 0.0
        self._goals: dict[int, str] = {}
        self._label = ""
        self._typed: str | None = None
        self._telemetry: Telemetry | None = None
        self._heard_s = 0.0
        self._drawn_s = -math.inf
        self._live = Live(console=console, auto_refresh=False, transient=False)
        self._live.start()

    def tell(self, event: Event, t_s: float) -> None:
        """Print a line above the block."""
        if isinstance(event, Sending):
            self._goals[event.goal] = event.description
        if isinstance(event, Ended):
            self._show_end(event)
        if event.sentence:
            style = "bold red" if event.bad else _style_of(event)
            self._live.console.print(Text(event.sentence, style=style))

    def _show_end(self, ended: Ended) -> None:
        if self._telemetry is not None and self._telemetry.goal == ended.goal:
            self._telemetry = replace(self._telemetry, status=ended.code)
            self._heard_s = math.inf  # nothing more is to come

    def show(self, telemetry: Telemetry, t_s: float) -> None:
        """Redraw the block with a feedback."""
        before, self._telemetry = self._telemetry, telemetry
        if before is None or telemetry.goal != before.goal:
            self._whole_m = 0.0
        self._whole_m = max(self._whole_m, telemetry.distance_left_m)
        self._heard_s = t_s
        if before is None or telemetry.status != before.status:
            self._draw(t_s)
        self.tick(t_s)

    def prompt(self, label: str, typed: str | None) -> None:
        """Show the prompt instead of the keys."""
        if typed != self._typed:
            self._label, self._typed = label, typed
            self._draw(self._drawn_s)

    def tick(self, t_s: float) -> None:
        """Redraw now and then."""
        if t_s >= self._drawn_s + _PERIOD_S:
            self._draw(t_s)

    def close(self) -> None:
        """Stop drawing; the last numbers stay, the keys don't."""
        self._keys, self._typed = False, None
        self._draw(self._drawn_s)
        self._live.stop()

    def _draw(self, t_s: float) -> None:
        self._drawn_s = t_s
        self._live.update(Group(*self._lines(t_s)), refresh=True)

    def _lines(self, t_s: float) -> list[RenderableType]:
        lines: list[RenderableType] = []
        if self._telemetry is not None:
            lines.append(_heading(self._telemetry, self._goals.get(self._telemetry.goal, "")))
            lines.append(self._table(self._telemetry, t_s))
        if self._typed is not None:
            prompt = Text(self._label, style="bold cyan")
            prompt.append(self._typed, style="bold")
            prompt.append("▏")
            prompt.append("  Enter: fly there  Esc: don't", style="dim")
            lines.append(_line(prompt))
        elif self._keys:
            lines.append(_line(Text(HINT, style="dim")))
        return lines

    def _table(self, telemetry: Telemetry, t_s: float) -> Table:
        table = Table.grid(padding=(0, 2))
        for _ in range(3):
            table.add_column(no_wrap=True, overflow="ellipsis")
        width = min(max(self._console.width - _BESIDE_BAR, _BAR_MIN), _BAR_MAX)
        left_m, whole_m = telemetry.distance_left_m, max(self._whole_m, 1e-6)
        done = min(max(1.0 - left_m / whole_m, 0.0), 1.0) if math.isfinite(left_m) else 0.0
        replans = Text(
            f"replans {telemetry.replans}", style="yellow" if telemetry.replans else "dim"
        )
        table.add_row(Text("position", style="dim"), _place(telemetry), replans)
        table.add_row(
            Text("way", style="dim"),
            ProgressBar(total=1.0, completed=done, width=width),
            f"{100.0 * done:3.0f} %  {left_m:.1f} m left",
        )
        battery = telemetry.battery_percent
        colour = "green" if battery > _BATTERY_LOW_PERCENT else "red"
        table.add_row(
            Text("battery", style="dim"),
            ProgressBar(
                total=100.0,
                completed=battery if math.isfinite(battery) else 0.0,
                width=width,
                complete_style=colour,
                finished_style=colour,
            ),
            f"{battery:3.0f} %" if math.isfinite(battery) else "unknown",
        )
        silent_s = t_s - self._heard_s
        table.add_row(
            Text("time", style="dim"),
            f"{_clock(t_s)}, ETA in {_clock(telemetry.time_left_s)}",
            Text(f"no feedback for {silent_s:.0f} s", style="bold red")
            if silent_s > _SILENCE_S
            else "",
        )
        return table


def _heading(telemetry: Telemetry, goal: str) -> Text:
    text = Text(f" {telemetry.status} ", style=_STATUS_STYLES.get(telemetry.status, "bold cyan"))
    line = Text.assemble(text, f" {telemetry.goal}: {goal}")
    if telemetry.waypoint is not None:
        line.append(f", waypoint {telemetry.waypoint} of {telemetry.waypoints}")
        line.append(f", lap {telemetry.lap}" if telemetry.lap != 1 else "")
    return _line(line)


def _place(telemetry: Telemetry) -> Text:
    x, y, z = telemetry.position_enu_m
    text = f"east {x:.2f}  north {y:.2f}  up {z:.2f} m" if math.isfinite(x) else "unknown"
    return Text(text)


def _line(text: Text) -> Text:
    text.no_wrap, text.overflow = True, "ellipsis"
    return text


def _style_of(event: Event) -> str:
    if isinstance(event, Ended):
        return "yellow" if event.replaced else "bold green"
    return "bold"


def _clock(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "?"
    minutes, rest = divmod(round(max(seconds, 0.0)), 60)
    return f"{minutes}:{rest:02d}"
