"""Selection of the autopilot's texts for the reason of a goal's end. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import OperationFinished, OperationKind, OperationResult
from mavlink_vehicle.state.status_text import StatusText
from navigation_core.outcomes import OutcomeCode

RECENT_S = 30.0
"""A text that is older than this, counted from the last HEARTBEAT, explains no end.

Some ends come only so long after their cause: a goal without progress ends after 20 s
(`settle_timeout_s`), a blocked one after 30 s. Observed on ArduCopter 4.7 with a dead motor:
"Potential Thrust Loss (1)" 15.5 s before TIMEOUT.
"""
# Below it are remarks (https://mavlink.io/en/messages/common.html#MAV_SEVERITY), among them every
# answer to a request for messages: ArduPilot's "No ap_message for mavlink id" and "Requested rate
# ... too fast" have severity INFO (observed on ArduCopter and ArduRover 4.7).
_LEAST_SEVERE = mavlink.MAV_SEVERITY_WARNING
_AS_ASKED = frozenset({OutcomeCode.SUCCESS, OutcomeCode.CANCELED, OutcomeCode.PREEMPTED})
# During these the vehicle flies, so that a text may tell of the flight and not of the request.
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
    """Return the text to quote for the end of a goal: the worst recent one, of equals the latest.

    Args:
        texts: what the autopilot said, oldest first.
        code: how the goal ended. Nothing is quoted for an end that somebody asked for.
        since_s: when the goal was accepted.
        heard_s: when the vehicle was heard last; a silent one said its reason before the silence.
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
