"""The speeds of a pilot's sticks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class SpeedRule:
    """The way in which a release measures them.

    Attributes:
        smoothing_s: time constant.
        steady_samples: how many in a row must move a stick to the same side: noise does not.
    """

    smoothing_s: float
    steady_samples: int = 0


@dataclass
class _Stick:
    """The speed of one stick.

    Attributes:
        place: where it was last, -1..1.
        speed_1_s: smoothed.
        way: the sign of its last movement.
        samples: how many samples in a row moved that way.
    """

    place: float
    speed_1_s: float = 0.0
    way: float = 0.0
    samples: int = 0

    def move(self, place: float, passed_s: float, smoothing_s: float) -> None:
        step = place - self.place
        share = passed_s / (smoothing_s + passed_s)
        self.speed_1_s += share * (step / passed_s - self.speed_1_s)
        self.place = place
        if step != 0.0:
            way = 1.0 if step > 0.0 else -1.0
            self.samples = self.samples + 1 if way == self.way else 1
            self.way = way


class StickSpeeds:
    """The speeds of all sticks, from the first sample of an unbroken stream on."""

    def __init__(self, rule: SpeedRule) -> None:
        self._rule = rule
        self._sticks: list[_Stick] = []

    def take(self, places: Sequence[float], passed_s: float) -> None:
        """Take a sample.

        Args:
            places: of the sticks, -1..1.
            passed_s: since the sample before.
        """
        if not self._sticks:
            self._sticks = [_Stick(place) for place in places]
        elif passed_s > 0.0:
            for stick, place in zip(self._sticks, places, strict=True):
                stick.move(place, passed_s, self._rule.smoothing_s)

    def exceed(self, threshold_1_s: float) -> bool:
        """Whether a stick moves faster, and steadily: its travel in a second, of -1..1."""
        return any(
            abs(stick.speed_1_s) > threshold_1_s and stick.samples >= self._rule.steady_samples
            for stick in self._sticks
        )
