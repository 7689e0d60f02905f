"""The aspects in which two conversations are compared, and how differences are found.

Acknowledgements, modes and landed states are sequences: they are aligned, so that one answer
too many is one difference and not a hundred. HEARTBEAT comes once a second, so an armed state
or a status that lasts less may be seen on one side only: that is no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import zip_longest

from comparison.motion import position_differences, target_differences
from comparison.recording import Timed
from comparison.replay import Conversation
from mavlink_sitl.mavlink.codec import Message, dialect

BETWEEN_BEATS_S = 1.2
"""A state that lasts less may fall between two heartbeats"""


@dataclass(frozen=True)
class Difference:
    """Something that one vehicle did and the other did not.

    Attributes:
        aspect: what it is about: a key of `ASPECTS`.
        what: the command, the list, or the target.
        recorded: what the real one did; None for nothing.
        simulated: what the simulated one did; None for nothing.
        time_s: when, since power-up.
    """

    aspect: str
    what: str
    recorded: str | None
    simulated: str | None
    time_s: float

    def __str__(self) -> str:
        """One line."""
        real, ours = self.recorded or "nothing", self.simulated or "nothing"
        return f"{self.time_s:8.2f} s  {self.what}: recorded {real}, simulated {ours}"


@dataclass(frozen=True)
class SequenceElement:
    """One element of a sequence: what has to be equal for an alignment, and its value."""

    time_s: float
    key: Hashable
    what: str
    value: str
    lasts_s: float = float("inf")


def acknowledgements(messages: Timed) -> list[SequenceElement]:
    """Each COMMAND_ACK."""
    return [
        SequenceElement(t, m.command, _name("MAV_CMD", m.command), _name("MAV_RESULT", m.result))
        for t, m in messages
        if m.get_type() == "COMMAND_ACK"
    ]


def mission_acknowledgements(messages: Timed) -> list[SequenceElement]:
    """Each MISSION_ACK."""
    return [
        SequenceElement(
            t,
            m.mission_type,
            _name("MAV_MISSION_TYPE", m.mission_type),
            _name("MAV_MISSION_RESULT", m.type),
        )
        for t, m in messages
        if m.get_type() == "MISSION_ACK"
    ]


def modes(messages: Timed) -> list[SequenceElement]:
    """Mode, base mode and system status that the HEARTBEAT went through."""

    def value(beat: Message) -> str:
        number = f"{beat.custom_mode}" if beat.custom_mode < 1000 else f"{beat.custom_mode:#010x}"
        return f"{number} base {beat.base_mode:#04x} status {beat.system_status}"

    return _states(messages, "HEARTBEAT", "mode", value)


def landed_states(messages: Timed) -> list[SequenceElement]:
    """The landed states in order."""
    return _states(
        messages,
        "EXTENDED_SYS_STATE",
        "landed state",
        lambda m: _name("MAV_LANDED_STATE", m.landed_state),
    )


def _states(
    messages: Timed, kind: str, what: str, value: Callable[[Message], str]
) -> list[SequenceElement]:
    found: list[tuple[float, str]] = []
    for time_s, message in messages:
        if message.get_type() == kind:
            now = value(message)
            if not found or found[-1][1] != now:
                found.append((time_s, now))
    ends = [*(t for t, _ in found[1:]), float("inf")]
    return [
        SequenceElement(t, v, what, v, end - t) for (t, v), end in zip(found, ends, strict=False)
    ]


def _name(enum: str, number: int) -> str:
    entry = dialect.enums[enum].get(number)
    prefixes = (f"{enum}_", f"{enum.removesuffix('_RESULT')}_")
    name = str(number if entry is None else entry.name)
    return name.removeprefix(prefixes[0]).removeprefix(prefixes[1])


def mode_differences(flight: Conversation) -> list[Difference]:
    """Of the modes that the HEARTBEAT went through."""
    every_change_is_told = flight.recording.autopilot == "ardupilot"

    def shown(states: Sequence[SequenceElement], place: int) -> bool:
        if states[place].lasts_s >= BETWEEN_BEATS_S:
            return True
        beside = [*states[max(place - 1, 0) : place], *states[place + 1 : place + 2]]
        number = states[place].value.split()[0]
        return every_change_is_told and number not in [s.value.split()[0] for s in beside]

    return _aligned("mode", modes(flight.real), modes(flight.ours), shown)


def _sequence(
    aspect: str, elements: Callable[[Timed], list[SequenceElement]]
) -> Callable[[Conversation], list[Difference]]:
    return lambda flight: _aligned(aspect, elements(flight.real), elements(flight.ours))


def text_differences(flight: Conversation) -> list[Difference]:
    """Of what was said; chunks apart, numbers that were measured left out."""
    real, ours = _texts(flight.real), _texts(flight.ours)
    only_real = [
        Difference("text", text, "said", None, t) for text, t in real.items() if text not in ours
    ]
    only_ours = [
        Difference("text", text, None, "said", t) for text, t in ours.items() if text not in real
    ]
    return only_real + only_ours


def _texts(messages: Timed) -> dict[str, float]:
    said = [(m.text, t) for t, m in reversed(messages) if m.get_type() == "STATUSTEXT"]
    return {text.split(" at ")[0].split(" used ")[0].rstrip(): t for text, t in said}


def _aligned(
    aspect: str,
    real: list[SequenceElement],
    ours: list[SequenceElement],
    shown: Callable[[Sequence[SequenceElement], int], bool] = lambda *_: True,
) -> list[Difference]:
    found: list[Difference] = []
    matcher = SequenceMatcher(None, [e.key for e in real], [e.key for e in ours], autojunk=False)
    for tag, a, b, c, d in matcher.get_opcodes():
        if tag == "equal":
            pairs = list(zip(real[a:b], ours[c:d], strict=True))
            found += [_difference(aspect, x, y) for x, y in pairs if x.value != y.value]
            continue
        left = [real[i] for i in range(a, b) if shown(real, i)]
        right = [ours[i] for i in range(c, d) if shown(ours, i)]
        found += [_difference(aspect, x, y) for x, y in zip_longest(left, right)]
    return found


def _difference(
    aspect: str, real: SequenceElement | None, ours: SequenceElement | None
) -> Difference:
    sides = [None if side is None else side.value for side in (real, ours)]
    here = next(side for side in (real, ours) if side is not None)
    return Difference(aspect, here.what, sides[0], sides[1], here.time_s)


ASPECTS: dict[str, tuple[str, Callable[[Conversation], list[Difference]]]] = {
    "command": ("result of each COMMAND_ACK", _sequence("command", acknowledgements)),
    "mission": ("type of each MISSION_ACK", _sequence("mission", mission_acknowledgements)),
    "mode": ("modes of the HEARTBEAT", mode_differences),
    "landed": ("order of landed states", _sequence("landed", landed_states)),
    "target": (
        "time to each target, within 10 %",
        lambda flight: [Difference("target", *d) for d in target_differences(flight)],
    ),
    "position": (
        "position in GUIDED and OFFBOARD, within 1.5 m",
        lambda flight: [Difference("position", *d) for d in position_differences(flight)],
    ),
    "text": ("texts (for information)", text_differences),
}
"""Title and search of each thing that is compared"""
