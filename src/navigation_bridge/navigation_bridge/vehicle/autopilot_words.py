"""Selection of the autopilot's texts for the reason of a goal's end. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import OperationFinished, OperationKind, OperationResult
from mavlink_vehicle.state.status_text import StatusText
from navigation_core.outcomes import OutcomeCode

RECENT_S = 30.0
"""Maximum age of a text that explains an end, counted from the last HEARTBEAT.

Some ends come long after their cause: a goal without progress ends after 20 s (`settle_timeout_s`),
a blocked one after 30 s. Observed on ArduCopter 4.7 with a dead motor:
"Potential Thrust Loss (1)" 15.5 s before TIMEOUT.
"""
# Lower severities are remarks (https://mavlink.io/en/messages/common.html#MAV_SEVERITY), such as
# every answer to a request for messages: ArduPilot's "No ap_message for mavlink id" and "Requested
# rate ... too fast" have severity INFO (observed on ArduCopter and ArduRover 4.7).
_LEAST_SEVERE = mavlink.MAV_SEVERITY_WARNING
_AS_ASKED = frozenset({OutcomeCode.SUCCESS, OutcomeCode.CANCELED, OutcomeCode.PREEMPTED})
# During these the vehicle flies, so a text may concern the flight instead of the request.
_FLOWN = frozenset(
    {
        OperationKind.TAKE_OFF,
        OperationKind.LAND,
        OperationKind.RETURN_TO_LAUNCH,
        OperationKind.REPOSITION,
        OperationKind.START_MISSION,
    }
)


def worst_text(
    texts: Iterable[StatusText],
    code: OutcomeCode,
    since_s: float,
    heard_s: float,
    answers: Collection[StatusText] = (),
) -> str:
    """Return the text to quote for the end of a goal: the worst recent one (then the latest).

    Args:
        texts: texts of the autopilot, oldest first.
        code: code of the end. Nothing is quoted for a requested end.
        since_s: time of acceptance.
        heard_s: time of the last message; a silent vehicle gave its reason before the silence.
        answers: texts that only answered a request of this server.

    Returns:
        Empty if there is nothing to quote.
    """
    if code in _AS_ASKED:
        return ""
    begin_s = max(since_s, heard_s - RECENT_S)
    candidates = [
        text
        for text in texts
        if text.time_s >= begin_s and text.severity <= _LEAST_SEVERE and text not in answers
    ]
    worst = min(reversed(candidates), key=lambda text: text.severity, default=None)
    return "" if worst is None else worst.text.strip()


def answers_in(event: OperationFinished, texts: Iterable[StatusText]) -> frozenset[StatusText]:
    """Return the texts with which a vehicle rejected a request; the event's reason quotes them."""
    if event.result is not OperationResult.REFUSED or event.kind in _FLOWN:
        return frozenset()
    return frozenset(text for text in texts if f'"{text.text}"' in event.reason)
