"""A pilot who takes over by moving a stick fast, as PX4 1.18 has it (read in the firmware).

How fast counts, not how far: a stick that is held aside, or was never trimmed, takes over nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

SMOOTHING_S = 0.05
STEADY_SAMPLES = 3
"""In a row, each further to the same side: noise is not"""


@dataclass
class _Stick:
    """The speed of one stick.

    Attributes:
        value: where it was last, -1..1.
        speed_per_s: smoothed.
        way: the sign of its last movement.
        samples: how many samples in a row moved that way.
    """

    value: float
    speed_per_s: float = 0.0
    way: float = 0.0
    samples: int = 0

    def move(self, value: float, passed_s: float) -> None:
        step = value - self.value
        share = passed_s / (SMOOTHING_S + passed_s)
        self.speed_per_s += share * (step / passed_s - self.speed_per_s)
        self.value = value
        if step != 0.0:
            way = 1.0 if step > 0.0 else -1.0
            self.samples = self.samples + 1 if way == self.way else 1
            self.way = way


class StickOverride:
    """Watches the sticks of one vehicle."""

    def __init__(self) -> None:
        self._at_s = 0.0
        self._sticks: list[_Stick] = []

    def moved(
        self, places: Iterable[float], at_s: float, threshold_per_s: float, lost_after_s: float
    ) -> bool:
        """Take a sample; whether a stick moves faster than a threshold.

        Args:
            places: of the sticks, -1..1.
            at_s: when.
            threshold_per_s: MAN_OVERRIDE_SPD: travel in a second; negative for none.
            lost_after_s: after this time without a sample it begins again.
        """
        passed_s, self._at_s = at_s - self._at_s, at_s
        if not self._sticks or passed_s >= lost_after_s:
            self._sticks = [_Stick(place) for place in places]
            return False
        if passed_s <= 0.0:
            return False
        for stick, place in zip(self._sticks, places, strict=True):
            stick.move(place, passed_s)
        return threshold_per_s >= 0.0 and any(
            abs(stick.speed_per_s) > threshold_per_s and stick.samples >= STEADY_SAMPLES
            for stick in self._sticks
        )
