"""Clocks of vehicles that are wrong: times in messages are rewritten before they are heard."""

from __future__ import annotations

from collections.abc import Callable

from mavlink_vehicle.codec import Codec, Message
from tests.support.flights.simulated_flight import SimulatedFlight

Clock = Callable[[str, float, int], int]
"""Returns a time in microseconds for the type of a message, our time in s and the true time."""

_UINT32 = 1 << 32
_FIELDS = {"time_boot_ms": 1000, "time_usec": 1}


def with_clock(message: Message, clock: Clock, now_s: float) -> Message:
    """Return a message with another time since boot, in all its fields that have one."""
    kind = message.get_type()
    for name, unit_us in _FIELDS.items():
        true = getattr(message, name, None)
        if true is not None:
            time = clock(kind, now_s, true * unit_us) // unit_us
            setattr(message, name, time % _UINT32 if unit_us == 1000 else time)
    if kind == "TIMESYNC" and message.tc1:
        message.tc1 = 1000 * clock(kind, now_s, message.tc1 // 1000)
    return message


class OtherClock(Codec):
    """Reads the vehicle's messages with times of another clock."""

    def __init__(self, flight: SimulatedFlight, clock: Clock) -> None:
        """Read for a flight, by a clock."""
        super().__init__(1, 191)
        self._flight, self._clock = flight, clock

    def decode(self, data: bytes) -> list[Message]:
        """Return the messages in what was received."""
        messages = super().decode(data)
        return [with_clock(message, self._clock, self._flight.now) for message in messages]


def _apart(kind: str, _now_s: float, true_us: int) -> int:
    """Each kind of message counts from elsewhere, hours apart."""
    return true_us + 3_600_000_000 * (sum(map(ord, kind)) % 97)


def backward(_kind: str, _now_s: float, true_us: int) -> int:
    """Run backward, second by second."""
    return max(4_000_000_000_000 - true_us, 0)


def _set(_kind: str, now_s: float, true_us: int) -> int:
    """It is set forward and back by minutes, every 4 s; it never began lately."""
    return true_us + (7_200_000_000, 7_900_000_000, 7_260_000_000)[int(now_s / 4.0) % 3]


CLOCKS: dict[str, Clock] = {
    "of 0": lambda _kind, _now_s, _true_us: 0,
    "standing": lambda _kind, _now_s, _true_us: 5_000_000,
    "wrapping after 20 s": lambda _kind, _now_s, true_us: true_us + 1000 * (_UINT32 - 20_000),
    "wrapping as it is heard first": lambda _k, _n, true_us: true_us + 1000 * (_UINT32 - 3_000),
    "apart by kind": _apart,
    "set": _set,
    "from 1970": lambda _kind, _now_s, true_us: true_us + 1_790_000_000_000_000,
    "slow": lambda _kind, _now_s, true_us: true_us // 10,
    "quick": lambda _kind, _now_s, true_us: true_us * 20,
    "coarse": lambda _kind, _now_s, true_us: true_us // 1_000_000 * 1_000_000,
    "a second behind at times": lambda _k, now_s, true_us: true_us - 1_000_000 * (int(now_s) % 2),
}
"""Clocks that no goal may hang on."""
