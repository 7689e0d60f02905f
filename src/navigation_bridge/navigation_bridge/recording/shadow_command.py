"""Entry point of ``navigation_server --shadow-goals``. No ROS."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from flight_logs.progress import bytes_bar
from mavlink_vehicle.io.links import LinkKind, parse_url
from mavlink_vehicle.io.tlog import TlogReader
from navigation_bridge.configuration.make_config import ConfigurationError, ServerConfig
from navigation_bridge.recording.replay import open_recording
from navigation_bridge.recording.shadow_file import read_shadow_goals
from navigation_bridge.recording.shadow_goals import ShadowResult, work_shadow_goals

_SUCCESS = "SUCCESS"


def run_shadow_goals(config: ServerConfig, path: Path, json_output: bool) -> int:
    """Run the goals of a file and print their results.

    Args:
        config: settings, with a recording as the link.
        path: YAML of the goals.
        json_output: print JSON, feedback included, instead of a table.

    Returns:
        0 when every goal ended with SUCCESS, else 1.

    Raises:
        ConfigurationError: the link is not a recording, or there are several vehicles.
        LinkError: the recording cannot be read.
        ShadowGoalsError: the goals cannot be read.
    """
    link = parse_url(config.link_url)
    if link.kind is not LinkKind.TLOG:
        raise ConfigurationError(
            f"Shadow goals run against a recording: give --link tlog:PATH, not {link}."
        )
    goals = read_shadow_goals(path)
    reader, _ = open_recording(link.path)
    with bytes_bar("playing") as report:
        results = work_shadow_goals(_watched(reader, report), config, goals)
    if json_output:
        print(json.dumps([as_dict(result) for result in results], indent=2))
    else:
        show(results, Console(file=sys.stdout))
    return 0 if all(result.end == _SUCCESS for result in results) else 1


def _watched(
    reader: TlogReader, report: Callable[[int, int], None]
) -> Iterator[tuple[float, bytes]]:
    for number, record in enumerate(reader):
        if number % 1000 == 0:
            report(reader.position, reader.size)
        yield record


def show(results: Sequence[ShadowResult], console: Console) -> None:
    """Print a table of the goals, each with its statuses and its end."""
    table = Table(box=None if not console.is_terminal else Table().box, show_lines=False)
    for title in ("at", "action", "feedback", "statuses", "end", "after", "why"):
        table.add_column(title, overflow="fold", ratio=3 if title == "why" else None)
    for result in results:
        ended_s = result.ended_s
        table.add_row(
            f"{result.goal.at_s:.1f} s",
            result.goal.action,
            str(len(result.feedback)),
            " ".join(dict.fromkeys(status for _, status, _ in result.statuses)),
            result.end,
            "" if ended_s is None else f"{ended_s - result.goal.at_s:.1f} s",
            result.message.removeprefix(f"{result.end}: "),
        )
    if not console.is_terminal:
        console.width = 160
    console.print(table, markup=False)


def as_dict(result: ShadowResult) -> dict[str, object]:
    """Return a result for JSON; unknown values are null."""
    return {
        "at_s": result.goal.at_s,
        "action": result.goal.action,
        "end": result.end,
        "message": result.message,
        "ended_s": result.ended_s,
        "final_error_m": result.final_error_m,
        "statuses": [
            {"time_s": time_s, "status": status, "message": message}
            for time_s, status, message in result.statuses
        ],
        "feedback": [
            {
                "time_s": time_s,
                "status": feedback.status.value,
                "position_enu_m": None if feedback.pose is None else feedback.pose.position_enu_m,
                "distance_remaining_m": feedback.distance_remaining_m,
                "time_remaining_s": feedback.time_remaining_s,
                "battery_remaining": feedback.battery_remaining,
                "height_m": feedback.height_m,
                "replans": feedback.replans,
            }
            for time_s, feedback in result.feedback
        ],
    }
