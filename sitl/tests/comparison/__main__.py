"""`python -m comparison RECORDING`: replays a recorded conversation and compares.

The messages of the ground station in a tlog are written to a simulated vehicle at the recorded
times, and the answers of the two vehicles are compared: acknowledgements, modes, landed states,
the times to targets and the way there. Intended differences are listed in
`differences.yaml` and reported with their reason.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from comparison.compared_states import ASPECTS
from comparison.expected_differences import (
    FOR_INFORMATION,
    ComparisonVerdict,
    judge,
    plain_name,
    set_up,
    stale,
)
from comparison.motion import rms_distance_m, spans
from comparison.recording import Recording, RecordingError, read
from comparison.replay import Conversation, replay
from comparison.start import start_of

SAME, DIFFERENT, NOT_COMPARED = 0, 1, 2


def load(path: Path) -> list[Recording]:
    """The conversations in a recording that are to be compared.

    Raises:
        RecordingError: there is none, or the file of differences says why it is not compared.
        OSError: the file cannot be read.
    """
    known = set_up(plain_name(path.stem))
    if known is not None and known.excluded:
        raise RecordingError(f"{path} is not compared: {known.reason}")
    return read(path)


def play(recording: Recording, name: str, parameters: Mapping[str, float]) -> Conversation:
    """Play one of them to a simulated vehicle with the set-up that the file gives it.

    Raises:
        RecordingError: there is no such vehicle here.
    """
    known = set_up(name)
    listed = {} if known is None else known.parameters
    return replay(recording, start_of(recording, {**listed, **parameters}))


def report(flight: Conversation, verdict: ComparisonVerdict) -> list[str]:
    """Lines for people."""
    config = flight.start.config
    lines = [f"{config.vehicle} with {config.autopilot}, system {config.system_id}"]
    lines += [f"      {note}" for note in flight.start.notes]
    for aspect, (title, _) in ASPECTS.items():
        if aspect in verdict.not_compared:
            lines.append(f"not compared: {title}: {verdict.not_compared[aspect]}")
            continue
        unlisted, meant = verdict.unlisted[aspect], verdict.meant[aspect]
        word = "DIFFERENT" if unlisted else "meant" if meant else "same"
        if unlisted and aspect == FOR_INFORMATION:
            word = "other"
        lines.append(f"{word:<9} {title}")
        lines += [f"    {difference}" for difference in unlisted]
        lines += [f"    {difference} (expected: {line.reason})" for difference, line in meant]
    for from_s, to_s in spans(flight):
        distance_m = rms_distance_m(flight, from_s, to_s)
        if math.isfinite(distance_m):
            span = f"{from_s:.1f} to {to_s:.1f} s"
            lines.append(f"          {distance_m:.2f} m apart (root mean square), {span}")
    return lines


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns:
        0 when everything is the same or meant to differ, 1 when something else differs, 2 when
        it cannot be compared.
    """
    parser = argparse.ArgumentParser(
        prog="comparison",
        description="Replay a recorded ground station's messages to a simulated vehicle and "
        "compare the answers of the two vehicles.",
        epilog="Exit codes: 0 if there are no unexpected differences, 1 if there are, 2 if the "
        "recording cannot be replayed.",
    )
    parser.add_argument("recording", type=Path, help="a tlog with the messages of both directions")
    parser.add_argument(
        "--param",
        action="append",
        default=[],
        metavar="NAME=NUMBER",
        help="a parameter that was not at its default in the recorded vehicle",
    )
    options = parser.parse_args(arguments)
    try:
        return _compare(options.recording, dict(map(_parameter, options.param)))
    except (OSError, RecordingError) as error:
        print(f"comparison: {error}", file=sys.stderr)
        return NOT_COMPARED


def _parameter(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not name or not math.isfinite(number):
        raise RecordingError(f"--param {text}: write NAME=NUMBER")
    return name.upper(), number


def _compare(path: Path, parameters: Mapping[str, float]) -> int:
    name, verdicts = plain_name(path.stem), []
    for recording in load(path):
        flight = play(recording, name, parameters)
        verdicts.append(judge(flight, name))
        print("\n".join(report(flight, verdicts[-1])))
    for line in stale(name, verdicts):
        print(f"stale     no longer occurs; remove it from the file: {line}")
    return SAME if all(verdict.equal for verdict in verdicts) else DIFFERENT


if __name__ == "__main__":
    sys.exit(main())
