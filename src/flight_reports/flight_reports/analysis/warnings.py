"""Warnings about a recorded flight. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flight_reports.analysis.causes import causes, shortly_before
from flight_reports.analysis.commands import LATE_S, SentCommand
from flight_reports.analysis.flight import Flight, Speaker
from flight_reports.recorded_events import EventSeverity, Moment, named

# Losing this share of the packets is worth a look, and this is bad.
_LOSS, _LOSS_BAD = 0.01, 0.1
_WARNINGS_MAX = 200
# Codes of goals that ended as their client wanted: reached, replaced or cancelled.
_WANTED_CODES = frozenset({"", "SUCCESS", "PREEMPTED", "CANCELED"})
_ANSWERED_WELL = frozenset({"ACCEPTED", "IN_PROGRESS", ""})
# Autopilots reject these for the messages that they don't have, which harms nothing.
_ASKING = ("SET_MESSAGE_INTERVAL", "REQUEST_")


@dataclass(frozen=True)
class Warned:
    """A warning, once for all occurrences.

    Attributes:
        first: when it happened first, and what.
        times_s: of all times.
    """

    first: Moment
    times_s: tuple[float, ...]


def warnings(flight: Flight) -> list[Warned]:
    """Return the warnings by time; repeated ones appear once."""
    moments = [moment for moment in flight.retold.moments if _counts(moment, flight)]
    led = _leader(flight)
    moments += causes(flight, None if led is None else led.source)
    moments += _of_goals(flight, moments)
    moments += _of_link(flight) + _of_commands(flight) + _of_others(flight) + _of_recorder(flight)
    together: dict[tuple[str, str], list[Moment]] = {}
    for moment in sorted(moments, key=lambda moment: moment.time_s):
        together.setdefault((moment.kind, moment.text), []).append(moment)
    warned = [
        Warned(same[0], tuple(moment.time_s for moment in same)) for same in together.values()
    ]
    return warned[:_WARNINGS_MAX]


def _counts(moment: Moment, flight: Flight) -> bool:
    """Return whether an event is a warning; acts of the controlling station are not."""
    if moment.kind == "station" and not flight.retold.noted.goals:
        led = _leader(flight)
        return led is None or moment.by != led.source
    return moment.severity is not EventSeverity.INFO


def _leader(flight: Flight) -> Speaker | None:
    """Return the controlling sender: by setpoints, or else by most commands."""
    commanders = [speaker for speaker in flight.speakers if speaker.requests + speaker.setpoints]
    return max(commanders, key=lambda s: (s.setpoints, s.requests), default=None)


def _of_goals(flight: Flight, happened: list[Moment]) -> list[Moment]:
    noted = flight.retold.noted
    moments = []
    for goal in noted.goals:
        if goal.ended_s is not None and goal.code not in _WANTED_CODES:
            text = f"Goal {goal.short_id} ended {goal.code}"
            text = _with(text, reason(goal.message, goal.code))
            if before := shortly_before(goal.ended_s, happened):
                text += f" – {before}"
            moments.append(Moment(goal.ended_s, "goal", text, EventSeverity.BAD))
        elif goal.ended_s is None:
            end_s = flight.contents.duration_s
            text = f"The recording ends before goal {goal.short_id} ended"
            moments.append(Moment(end_s, "goal", text, EventSeverity.WARNING))
    for time_s, event in noted.events:
        if event.happened.event == "REJECTED":
            text = _with("A goal was rejected", event.happened.message)
            moments.append(Moment(time_s, "goal", text, EventSeverity.WARNING))
    return moments


def _of_link(flight: Flight) -> list[Moment]:
    link, is_autopilots = flight.link, flight.contents.is_autopilots
    silent = "The log has no records for" if is_autopilots else "The vehicle was silent for"
    moments = [
        Moment(begin_s, "silence", f"{silent} {end_s - begin_s:.1f} s", EventSeverity.BAD)
        for begin_s, end_s in link.gaps
        # Disarmed, an autopilot logs little or nothing.
        if not is_autopilots or _is_armed_at(flight, begin_s)
    ]
    if is_autopilots:
        return moments  # its packets were never on a link
    for speaker in flight.speakers:
        quality = speaker.link
        if speaker.is_recorder or not quality.lost:
            continue
        who = "the vehicle" if speaker.source == flight.source else named(speaker.source)
        if not quality.numbers_follow:
            text = (
                f"The sequence numbers of {who} are not consecutive: "
                "the log may combine several links or omit messages; its loss is unknown"
            )
            moments.append(Moment(0.0, "loss", text, EventSeverity.WARNING))
        elif quality.loss_share >= _LOSS:
            severity = (
                EventSeverity.BAD if quality.loss_share >= _LOSS_BAD else EventSeverity.WARNING
            )
            text = f"{quality.lost} packets of {who} were lost ({quality.loss_share:.1%})"
            worst = int(np.argmax(np.nan_to_num(quality.loss)))
            moments.append(Moment(float(quality.intervals_s[worst]), "loss", text, severity))
    return moments


def _is_armed_at(flight: Flight, time_s: float) -> bool:
    known = [armed for since_s, armed in flight.retold.armed if since_s <= time_s]
    return known[-1] if known else True


def _of_commands(flight: Flight) -> list[Moment]:
    answered = any(command.result for command in flight.commands)
    moments = []
    for command in flight.commands:
        text, severity = _about_command(command, answered)
        if text:
            text = f"{command.name} of {named(command.by)} {text}"
            moments.append(Moment(command.time_s, "command", text, severity))
    return moments


def _about_command(command: SentCommand, any_answered: bool) -> tuple[str, EventSeverity]:
    if command.answered_after_s is None:
        # A recording of one direction only has no answers at all.
        text = f"was never acknowledged (sent {command.sent} times)" if any_answered else ""
        return text.replace("(sent 1 times)", "(sent once)"), EventSeverity.WARNING
    if command.result not in _ANSWERED_WELL and not command.name.startswith(_ASKING):
        return f"was answered {command.result}", EventSeverity.WARNING
    if command.answered_after_s > LATE_S:
        return (
            f"was acknowledged only after {command.answered_after_s:.1f} s",
            EventSeverity.WARNING,
        )
    return "", EventSeverity.INFO


def _of_others(flight: Flight) -> list[Moment]:
    """Return warnings about other stations that sent commands."""
    led = _leader(flight)
    moments = []
    for speaker in flight.speakers:
        if speaker.requests + speaker.setpoints and speaker is not led:
            times_s = [c.time_s for c in flight.commands if c.by == speaker.source]
            text = f"Ground station {named(speaker.source)} ({speaker.what}) also sent commands"
            moments.append(
                Moment(min(times_s, default=0.0), "station", text, EventSeverity.WARNING)
            )
    return moments


def _of_recorder(flight: Flight) -> list[Moment]:
    contents, counts = flight.contents, flight.contents.counts
    moments = [("damage", phrase) for phrase in contents.damage]
    if counts.steps_back > 0:
        text = (
            f"The recorder's clock stepped back {counts.steps_back} times; what was recorded "
            "until it caught up is shown at one moment"
        )
        moments.append(("clock", text.replace("back 1 times", "back once")))
    for count, what in (
        (contents.times_mended, "packets have an implausible time"),
        (counts.bad_checksums, "packets have a wrong checksum and were skipped"),
        (counts.bytes_outside, "bytes of the file are outside packets"),
    ):
        if count:
            moments.append(("damage", f"{count} {what}"))
    return [Moment(0.0, kind, text, EventSeverity.WARNING) for kind, text in moments]


def lacking(flight: Flight) -> list[str]:
    """Return sentences about missing content of the log."""
    sentences = []
    noted, retold = flight.retold.noted, flight.retold
    if flight.contents.is_autopilots:
        sentences.append(
            "This is the autopilot's own log: it has no commands, setpoints or acknowledgements "
            "of a link, and message rates and packets are those of this report."
        )
    sentences += flight.contents.remarks
    if not len(flight.track.time_s):
        sentences.append("The log has no position of this vehicle; map and altitude are missing.")
    elif not flight.track.has_velocity:
        sentences.append("The log has no velocity of this vehicle; its speed is missing.")
    sentences += flight.track.remarks
    if not noted.goals:
        sentences.append(
            "The log has no goals, plans or replans: it was recorded by another program, or no "
            "goal was sent (navigation_server --tlog records them)."
        )
    if not retold.battery and not retold.voltage:
        sentences.append("The log has no battery level.")
    elif not retold.battery:
        sentences.append("The log has the battery voltage, but not the remaining charge.")
    if flight.position_tracking is None and flight.velocity_tracking is None:
        sentences.append("The log has too few setpoints to evaluate tracking.")
    if not retold.name:
        sentences.append("The log has no HEARTBEAT of this vehicle; its modes are unknown.")
    if retold.state.firmware_version is None:
        sentences.append("The log has no firmware version.")
    return sentences


def reason(message: str, code: str) -> str:
    """Return the server's message about an end, without the code."""
    return message.removeprefix(f"{code}: ")


def _with(text: str, message: str) -> str:
    return f"{text}: {message}" if message else text
