"""What the navigation client shows: a live view on a terminal, plain lines elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

_PLAIN_PERIOD_S = 1.0
_BAR_WIDTH = 40


@dataclass(frozen=True)
class Telemetry:
    """One feedback, in numbers that people read.

    Attributes:
        position_enu_m: position in the map frame; NaN when unknown.
        distance_m: distance remaining.
        time_s: time remaining.
        battery_percent: 0 to 100; NaN when unknown.
        status: the server's ``current_status``.
    """

    position_enu_m: tuple[float, float, float]
    distance_m: float
    time_s: float
    battery_percent: float
    status: str


class View(Protocol):
    """Shows a goal's way."""

    def note(self, text: str, *, bad: bool = False) -> None:
        """Show one line that stays."""

    def show(self, telemetry: Telemetry, elapsed_s: float) -> None:
        """Show a feedback."""

    def close(self) -> None:
        """Leave the terminal as it was."""


class PlainView:
    """One line a second and one for each change of status; for pipes and log files."""

    def __init__(self, console: Console) -> None:
        """Write to ``console``."""
        self._console = console
        self._status = ""
        self._next_s = 0.0

    def note(self, text: str, *, bad: bool = False) -> None:
        """Print a line."""
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def show(self, telemetry: Telemetry, elapsed_s: float) -> None:
        """Print the feedback if it is time or if the status changed."""
        if telemetry.status == self._status and elapsed_s < self._next_s:
            return
        self._status = telemetry.status
        self._next_s = elapsed_s + _PLAIN_PERIOD_S
        self.note(f"{elapsed_s:6.1f} s  {_summary(telemetry)}")

    def close(self) -> None:
        """Nothing to restore."""


class LiveView:
    """A block at the bottom of the terminal that is redrawn in place."""

    def __init__(self, console: Console) -> None:
        """Start drawing on ``console``."""
        self._console = console
        self._start_distance_m = 0.0
        self._live = Live(console=console, refresh_per_second=10, transient=False)
        self._live.start()

    def note(self, text: str, *, bad: bool = False) -> None:
        """Print a line above the block."""
        self._live.console.print(Text(text, style="bold red" if bad else "bold"))

    def show(self, telemetry: Telemetry, elapsed_s: float) -> None:
        """Redraw the block."""
        if telemetry.distance_m > self._start_distance_m:
            self._start_distance_m = telemetry.distance_m
        self._live.update(self._block(telemetry, elapsed_s))

    def close(self) -> None:
        """Stop drawing."""
        self._live.stop()

    def _block(self, telemetry: Telemetry, elapsed_s: float) -> Group:
        whole_m = max(self._start_distance_m, 1e-6)
        done = min(max(1.0 - telemetry.distance_m / whole_m, 0.0), 1.0)
        table = Table.grid(padding=(0, 2))
        table.add_row("status", Text(telemetry.status, style=_status_style(telemetry.status)))
        table.add_row(
            "progress",
            ProgressBar(total=1.0, completed=done, width=_BAR_WIDTH),
            Text(f"{telemetry.distance_m:.1f} m left"),
        )
        table.add_row("position", Text(_position(telemetry)))
        table.add_row("time", Text(f"{elapsed_s:.0f} s, about {telemetry.time_s:.0f} s left"))
        if math.isfinite(telemetry.battery_percent):
            table.add_row(
                "battery",
                ProgressBar(
                    total=100.0,
                    completed=telemetry.battery_percent,
                    width=_BAR_WIDTH,
                    complete_style="green" if telemetry.battery_percent > 25.0 else "red",
                    finished_style="green",
                ),
                Text(f"{telemetry.battery_percent:.0f} %"),
            )
        else:
            table.add_row("battery", Text("unknown"))
        return Group(table)


def make_view(*, plain: bool) -> View:
    """Return the live view on a terminal and the plain one elsewhere."""
    console = Console(stderr=False)
    return PlainView(console) if plain or not console.is_terminal else LiveView(console)


def _status_style(status: str) -> str:
    if status in ("LINK_LOST", "HOLDING"):
        return "bold red"
    return "yellow" if status == "CANCELLING" else "bold green"


def _position(telemetry: Telemetry) -> str:
    x, y, z = telemetry.position_enu_m
    if not math.isfinite(x):
        return "unknown"
    return f"east {x:.2f}  north {y:.2f}  up {z:.2f} m"


def _summary(telemetry: Telemetry) -> str:
    battery = telemetry.battery_percent
    battery_text = f"{battery:.0f} %" if math.isfinite(battery) else "unknown"
    return (
        f"{telemetry.status:<10}  {_position(telemetry)}  {telemetry.distance_m:.2f} m left, "
        f"about {telemetry.time_s:.1f} s, battery {battery_text}"
    )
