"""Somebody on the link of a vehicle who sends frames with its ids, beside the true ones."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass, field

from mavlink_vehicle.codec import Codec, Message, mavlink

__all__ = ["LIES", "Liar"]

_ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
_ON_GROUND, _IN_AIR = mavlink.MAV_LANDED_STATE_ON_GROUND, mavlink.MAV_LANDED_STATE_IN_AIR
_MOVED = 5000  # 1e-7 degrees, some 50 m


def _disarmed(message: Message) -> None:
    message.base_mode &= ~_ARMED


def _armed(message: Message) -> None:
    message.base_mode |= _ARMED


def _landed(message: Message) -> None:
    message.landed_state = _ON_GROUND


def _airborne(message: Message) -> None:
    message.landed_state = _IN_AIR


def _charged(percent: int) -> Callable[[Message], None]:
    def lie(message: Message) -> None:
        message.battery_remaining = percent

    return lie


def _without_fix(message: Message) -> None:
    message.fix_type = mavlink.GPS_FIX_TYPE_NO_FIX


def _moved_home(message: Message) -> None:
    message.latitude += _MOVED


def _elsewhere(message: Message) -> None:
    message.lat += _MOVED


LIES: dict[str, dict[str, Callable[[Message], None]]] = {
    "disarmed": {"HEARTBEAT": _disarmed},
    "armed": {"HEARTBEAT": _armed},
    "landed": {"EXTENDED_SYS_STATE": _landed},
    "down": {"EXTENDED_SYS_STATE": _landed, "HEARTBEAT": _disarmed},
    "airborne": {"EXTENDED_SYS_STATE": _airborne},
    "full": {"BATTERY_STATUS": _charged(100)},
    "empty": {"BATTERY_STATUS": _charged(3)},
    "no fix": {"GPS_RAW_INT": _without_fix},
    "home": {"HOME_POSITION": _moved_home},
    "elsewhere": {"GLOBAL_POSITION_INT": _elsewhere},
}
"""The changes to the vehicle's own messages, by lie"""


@dataclass
class Liar:
    """Sends the last true messages again, changed, once or as a stream.

    Attributes:
        system: the vehicle's id.
        lie: a key of `LIES`.
        period_s: of the stream; 0 for once.
    """

    system: int
    lie: str
    period_s: float
    _heard: dict[str, tuple[Message, float]] = field(default_factory=dict)
    _due_s: float = -math.inf

    def __post_init__(self) -> None:
        """Begin with sequence numbers of its own."""
        self._ears, self._mouth = Codec(255, 190), Codec(self.system, 1)

    def turn(self, arrived: list[bytes], now_s: float) -> list[bytes]:
        """Hear what the vehicle sends; return what is sent beside it.

        Args:
            arrived: datagrams of the vehicle.
            now_s: simulated time.
        """
        changes = LIES[self.lie]
        for data in arrived:
            for message in self._ears.decode(data):
                if message.get_type() in changes:
                    self._heard[message.get_type()] = message, now_s
        if now_s < self._due_s or len(self._heard) < len(changes):
            return []
        self._due_s = now_s + self.period_s if self.period_s else math.inf
        return [self._frame(*heard, now_s) for heard in self._heard.values()]

    def _frame(self, message: Message, heard_s: float, now_s: float) -> bytes:
        lie = copy.copy(message)
        LIES[self.lie][message.get_type()](lie)
        if hasattr(lie, "time_boot_ms"):
            lie.time_boot_ms += round(1000.0 * (now_s - heard_s))
        return self._mouth.encode(lie)
