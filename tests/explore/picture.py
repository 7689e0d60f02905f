"""A picture of an exploration: the true paths from above, and what happened when."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.patches import Circle

from tests.explore.check import Violation
from tests.explore.log import Log
from tests.explore.scenario import Scenario

# More names of events than these cover each other.
_NAMED = 30
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")


def draw(scenario: Scenario, log: Log, violations: Sequence[Violation], path: Path) -> None:
    """Draw to a PNG file."""
    figure = Figure(figsize=(12.0, 7.0), layout="constrained")
    above, beside = figure.subplots(1, 2)
    for post in scenario.posts:
        above.add_patch(Circle(post.at_enu_m, post.radius_m, color="0.6"))
    for craft in range(len(scenario.crafts)):
        true = [
            (e.time_s, e.value.position_enu_m)
            for e in log.entries
            if e.kind == "truth" and e.craft == craft
        ]
        colour = _COLOURS[craft % len(_COLOURS)]
        above.plot([p[0] for _, p in true], [p[1] for _, p in true], color=colour, lw=1.0)
        beside.plot([t for t, _ in true], [p[2] for _, p in true], color=colour, lw=1.0)
        for violation in violations:
            if violation.craft == craft:
                at = min(true, key=lambda point: abs(point[0] - violation.time_s))[1]
                above.plot(at[0], at[1], "x", color="black", ms=12, mew=2)
                beside.plot(violation.time_s, at[2], "x", color="black", ms=12, mew=2)
                beside.annotate(violation.policy, (violation.time_s, at[2]), fontsize=7)
    heights = [e.value.position_enu_m[2] for e in log.entries if e.kind == "truth"]
    top = max(heights, default=1.0)
    for entry in log.entries:
        if entry.kind == "happening":
            beside.axvline(entry.time_s, color="0.9", zorder=0)
            if len(scenario.events) <= _NAMED:
                beside.text(entry.time_s, top, entry.value.what, rotation=90, fontsize=6, va="top")
    above.set(xlabel="east (m)", ylabel="north (m)", aspect="equal", title=f"seed {scenario.seed}")
    beside.set(xlabel="time (s)", ylabel="height (m)")
    if not math.isfinite(top):
        beside.set_ylim(-5.0, 100.0)
    figure.savefig(path, dpi=100)
