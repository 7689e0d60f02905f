"""The live view of the navigation client: a block at the bottom of the terminal."""

from __future__ import annotations

import math
from dataclasses import replace

from rich.console import Console, Group
from rich.live import Live
from rich.style import Style
from rich.text import Text

from drone_navigation.client.events import Ended, Event, Sending, Telemetry
from drone_navigation.client.terminal.keys import HINT, HINT_SHORT
from navigation_core.safety.late_setpoints import LATE_S

_PERIOD_S = 0.1
# Below this width the lines have no labels.
_LABELS_WIDTH = 60
_LABEL_WIDTH = 10
_BAR_MIN, _BAR_MAX = 5, 40
# Characters beside a bar: " 100 %  12345.6 m left".
_BESIDE_BAR = 23
_BATTERY_LOW_PERCENT = 25.0
# A server sends several per second; a longer gap is shown.
_SILENCE_S = 3.0

_SUCCESS, _CANCELLING = "SUCCESS", "CANCELLING"
_FAILED = "bold white on red"
# All that is not named here is a step on the way to NAVIGATING.
_STATUS_STYLES = {
    "NAVIGATING": "bold black on green",
    "SETTLING": "bold black on green",
    _SUCCESS: "bold black on green",
    "PAUSED": "bold black on yellow",
    _CANCELLING: "bold black on yellow",
    "CANCELED": "bold black on yellow",
    "BLOCKED": "bold yellow on red",
    "HOLDING": _FAILED,
    "LINK_LOST": _FAILED,
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
        self._failed = False
        self._heard_s = 0.0
        self._drawn_s = -math.inf
        self.open()

    def tell(self, event: Event, t_s: float) -> None:
        """Print a line above the block."""
        if isinstance(event, Sending):
            self._goals[event.goal] = event.description
        if isinstance(event, Ended):
            self._show_end(event)
        if event.sentence:
            self._live.console.print(self.line(event))

    @staticmethod
    def line(event: Event) -> Text:
        """Return the permanent line of an event."""
        return Text(event.sentence, style="bold red" if event.bad else _style_of(event))

    def _show_end(self, ended: Ended) -> None:
        if self._telemetry is not None and self._telemetry.goal == ended.goal:
            left_m = ended.error_m
            # A route's end may be near while most of the route is left.
            if self._telemetry.waypoint is not None or not math.isfinite(left_m):
                left_m = self._telemetry.distance_left_m
            self._telemetry = replace(self._telemetry, status=ended.code, distance_left_m=left_m)
            self._failed = ended.bad
            self._heard_s = math.inf  # nothing more is to come

    def show(self, telemetry: Telemetry, t_s: float) -> None:
        """Redraw the block with a feedback."""
        before = self._telemetry
        if before is None or telemetry.goal != before.goal:
            self._whole_m = 0.0
        elif telemetry.status == _CANCELLING:  # its path ends where it stops, which is no progress
            telemetry = replace(telemetry, distance_left_m=before.distance_left_m)
        self._telemetry, self._failed = telemetry, False
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
        """Redraw periodically."""
        if t_s >= self._drawn_s + _PERIOD_S:
            self._draw(t_s)

    def close(self) -> None:
        """Stop drawing; the last numbers stay, the key hints do not."""
        keys, typed, self._keys, self._typed = self._keys, self._typed, False, None
        self._draw(self._drawn_s)
        self._live.stop()
        self._keys, self._typed = keys, typed

    def open(self) -> None:
        """Draw again."""
        self._live = Live(console=self._console, auto_refresh=False, transient=False)
        self._live.start()
        self._draw(self._drawn_s)

    def _draw(self, t_s: float) -> None:
        self._drawn_s = t_s
        self._live.update(self.block(t_s), refresh=True)

    def block(self, t_s: float) -> Group:
        """Return the block with the numbers of the last feedback."""
        lines = self._lines(t_s)
        for line in lines:
            line.no_wrap, line.overflow = True, "ellipsis"
        return Group(*lines)

    def _lines(self, t_s: float) -> list[Text]:
        telemetry = self._telemetry
        lines = [Text()] if telemetry is None else self._numbers(telemetry, t_s)
        if self._typed is not None:
            prompt = Text(self._label, style="bold cyan")
            prompt.append(f"{self._typed}▏", style="bold not dim")
            prompt.append("  Enter: send  Esc: dismiss", style="not bold dim")
            lines.append(prompt)
        elif self._keys:
            hint = HINT if len(HINT) <= self._console.width else HINT_SHORT
            lines.append(Text(hint, style="dim"))
        return lines

    def _numbers(self, telemetry: Telemetry, t_s: float) -> list[Text]:
        x, y, z = (round(part, 2) + 0.0 for part in telemetry.position_enu_m)  # + 0: no "-0.00"
        known = math.isfinite(x)
        battery = telemetry.battery_percent
        charge = battery / 100.0 if math.isfinite(battery) else 0.0
        left_m, done = telemetry.distance_left_m, self._done(telemetry)
        left = f"{left_m:.1f}" if math.isfinite(left_m) else "?"
        time = Text(f"{_clock(t_s)}, ETA in {_clock(telemetry.time_left_s)}")
        if telemetry.replans:
            time.append(f"  replans {telemetry.replans}", style="bold yellow")
        if telemetry.setpoint_delay_s >= LATE_S:
            late = f"  setpoints {telemetry.setpoint_delay_s:.1f} s late"
            time.append(late, style="bold red")
        if t_s - self._heard_s > _SILENCE_S:
            time.append(f"  no feedback for {t_s - self._heard_s:.0f} s", style="bold red")
        return [
            Text(),
            self._heading(telemetry),
            self._line(
                "position", f"east {x:.2f}  north {y:.2f}  up {z:.2f} m" if known else "unknown"
            ),
            self._line("path", self._bar(done, "cyan"), f"{_percent(done)}  {left} m left"),
            self._line(
                "battery",
                self._bar(charge, "green" if battery > _BATTERY_LOW_PERCENT else "red"),
                _percent(charge) if math.isfinite(battery) else " unknown",
            ),
            self._line("time", time),
        ]

    def _heading(self, telemetry: Telemetry) -> Text:
        style = _STATUS_STYLES.get(telemetry.status, "bold black on cyan")
        line = Text.assemble(
            (f" {telemetry.status} ", _FAILED if self._failed else style),
            f" {telemetry.goal}: {self._goals.get(telemetry.goal, '')}",
        )
        if telemetry.waypoint is not None:
            line.append(f", waypoint {telemetry.waypoint} of {telemetry.waypoints}")
            line.append(f", lap {telemetry.lap}" if telemetry.lap != 1 else "")
        if telemetry.follow_state is not None:
            line.append(f", {telemetry.follow_text}")
        if telemetry.laps_flown is not None:
            line.append(f", {telemetry.laps_flown:.1f} laps flown")
        return line

    def _done(self, telemetry: Telemetry) -> float:
        """Return the completed share of the path; it decreases if the path gets longer."""
        if telemetry.status == _SUCCESS:
            return 1.0
        done = 1.0 - telemetry.distance_left_m / max(self._whole_m, 1e-6)
        return min(max(done, 0.0), 1.0) if math.isfinite(done) else 0.0

    @property
    def _labels(self) -> bool:
        return self._console.width >= _LABELS_WIDTH

    def _line(self, label: str, *parts: str | Text) -> Text:
        if self._labels:
            return Text.assemble((f"{label:<{_LABEL_WIDTH}}", "dim"), *parts)
        return Text.assemble(*parts)

    def _bar(self, part: float, colour: str) -> Text:
        """Return a bar that is readable without colours."""
        beside = _BESIDE_BAR + (_LABEL_WIDTH if self._labels else 0)
        width = min(max(self._console.width - beside, _BAR_MIN), _BAR_MAX)
        full = math.floor(part * width)
        return Text.assemble(("━" * full, Style(color=colour)), ("╌" * (width - full), "dim"))


def _style_of(event: Event) -> str:
    if isinstance(event, Ended):
        return "bold green" if event.state == "SUCCEEDED" else "yellow"
    return "bold"


def _percent(part: float) -> str:
    return f" {100.0 * part:3.0f} %"


def _clock(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "?"
    minutes, rest = divmod(round(max(seconds, 0.0)), 60)
    return f"{minutes}:{rest:02d}"
