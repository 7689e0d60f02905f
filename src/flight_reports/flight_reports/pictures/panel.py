"""Panel beside a flight video: distance, time, speed, battery, status."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from flight_reports.flight_recording import FlightRecording
from flight_reports.pictures import scene
from flight_reports.timeline import Timeline
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.progress import Status

_FRAME = (0.605, 0.115, 0.38, 0.52)
_WIDTH = 1.0
_BAR_HEIGHT = 0.03
_LOW_BATTERY_PERCENT = 25.0
# Time for which the status line shows a replan or a new goal (seconds of the film).
_NEWS_S = 1.2
_UNKNOWN = "–"


class Panel:
    """Draws the figures of a recording."""

    def __init__(self, figure: Figure, recording: FlightRecording, speedup: float) -> None:
        """Add the static part to ``figure``."""
        self._recording, self._speedup = recording, speedup
        self._replan_times_s = scene.replan_times_s(recording)
        figure.text(0.036, 0.955, recording.vehicle, fontsize=10, color=scene.INK, weight="bold")
        figure.text(0.566, 0.957, "from the recording", fontsize=7, color=scene.FAINT,
                    horizontalalignment="right")  # fmt: skip
        self._axes = axes = figure.add_axes(_FRAME)
        axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
        axes.axis("off")
        self._numbers: list[Text] = []
        rows = ("distance left", "time left", "speed", "altitude", "goal", "replans")
        for number, name in enumerate(rows):
            x, y = 0.35 * (number % 3), 0.83 - 0.24 * (number // 3)
            axes.text(x, y + 0.115, name, fontsize=7, color=scene.FAINT)
            self._numbers.append(self._text(x, y, "", 14, "bold"))
        self._progress = self._bar(0.43, "path", scene.TRACK)
        self._battery = self._bar(0.30, "battery", scene.GOOD)
        self._percent = self._text(_WIDTH, 0.35, "", 7, "normal")
        self._percent.set_horizontalalignment("right")
        self._legend()
        self._time = figure.text(0.985, 0.955, "", fontsize=10, color=scene.INK, weight="bold",
                                 ha="right", animated=True)  # fmt: skip
        self._line = figure.text(0.036, 0.03, "", fontsize=9, color=scene.INK, animated=True)

    def _text(self, x: float, y: float, text: str, size: float, weight: str) -> Text:
        return self._axes.text(
            x, y, text, fontsize=size, color=scene.INK, weight=weight, animated=True
        )

    def _bar(self, y: float, name: str, colour: str) -> Rectangle:
        self._axes.text(0.0, y + 0.05, name, fontsize=7, color=scene.FAINT)
        self._axes.add_patch(Rectangle((0.0, y), _WIDTH, _BAR_HEIGHT, color=scene.GONE))
        bar = Rectangle((0.0, y), 0.0, _BAR_HEIGHT, color=colour, animated=True)
        self._axes.add_patch(bar)
        return bar

    def _legend(self) -> None:
        rows = (
            (scene.TRACK, "flown"),
            (scene.PLAN, "planned path"),
            (scene.FAINT, "previous path"),
            (scene.NEW, "obstacle, newly sensed"),
            (scene.OBSTACLE, "obstacle, known"),
            (scene.GONE, "no longer there"),
        )
        for number, (colour, name) in enumerate(rows):
            x, y = 0.52 * (number // 3), 0.16 - 0.075 * (number % 3)
            self._axes.add_patch(Rectangle((x, y), 0.05, 0.028, color=colour))
            self._axes.text(x + 0.075, y - 0.004, name, fontsize=6.5, color=scene.FAINT)

    def show(self, time_s: float) -> list[Artist]:
        """Set the state of a time, and return the artists to draw."""
        recording = self._recording
        index = max(int(np.searchsorted(recording.times_s, time_s, "right")) - 1, 0)
        self._time.set_text(f"{time_s:5.1f} s   × {self._speedup:g}")
        replans = sum(at_s <= time_s for at_s in self._replan_times_s)
        goals = recording.goals.count(time_s)
        for text, value in zip(
            self._numbers,
            (
                _number(recording.distance_m, time_s, "m"),
                _number(recording.time_left_s, time_s, "s"),
                f"{recording.speeds_m_s[index]:.1f} m/s",
                f"{recording.positions_enu_m[index, 2]:.1f} m",
                f"{goals}" if goals else _UNKNOWN,
                f"{replans} ×",
            ),
            strict=True,
        ):
            text.set_text(value)
        self._progress.set_width(_WIDTH * self._share_done(time_s))
        percent = recording.battery_percent.at(time_s)
        self._battery.set_width(_WIDTH * (percent or 0.0) / 100.0)
        self._battery.set_color(
            scene.GOAL if (percent or 0.0) < _LOW_BATTERY_PERCENT else scene.GOOD
        )
        self._percent.set_text(_UNKNOWN if percent is None else f"{percent:.0f} %")
        self._show_status(time_s)
        return [self._time, *self._numbers, self._progress, self._battery, self._percent,
                self._line]  # fmt: skip

    def _share_done(self, time_s: float) -> float:
        recording = self._recording
        left_m = recording.distance_m.at(time_s)
        begun = recording.goals.count(time_s)
        if left_m is None or not begun:
            return 0.0
        since = recording.distance_m.count(recording.goals.times_s[begun - 1])
        until = recording.distance_m.count(time_s)
        longest_m = max(recording.distance_m.values[since:until], default=left_m)
        return 1.0 - left_m / longest_m if longest_m > 0.0 else 1.0

    def _show_status(self, time_s: float) -> None:
        status = self._recording.status.at(time_s) or ""
        words = [status]
        if self._is_news(self._replan_times_s, time_s):
            words.append("replanned")
        if self._is_news(self._recording.goals.times_s[1:], time_s):
            words.append("new goal")
        warnings = self._recording.warnings
        if self._is_news(warnings.times_s, time_s):
            words.append(f"“{warnings.at(time_s)}”")
        self._line.set_text("   ·   ".join(word for word in words if word))
        self._line.set_color(scene.GOAL if self._is_in_trouble(time_s) else scene.INK)

    def _is_in_trouble(self, time_s: float) -> bool:
        """Whether the goal at that time is blocked, or has ended without success."""
        goals = self._recording.all_goals
        goal = next((goal for goal in reversed(goals) if goal.accepted_s <= time_s), None)
        if goal is None:
            return False
        if goal.ended_s is not None and goal.ended_s <= time_s:
            return goal.code != OutcomeCode.SUCCESS.value
        statuses = (status for at_s, status, _ in reversed(goal.statuses) if at_s <= time_s)
        return next(statuses, "") == Status.BLOCKED.value

    def _is_news(self, times_s: Sequence[float], time_s: float) -> bool:
        news_s = _NEWS_S * self._speedup
        return any(0.0 <= time_s - at_s <= news_s for at_s in times_s)


def _number(line: Timeline[float], time_s: float, unit: str) -> str:
    value = line.at(time_s)
    return _UNKNOWN if value is None else f"{value:.1f} {unit}"
