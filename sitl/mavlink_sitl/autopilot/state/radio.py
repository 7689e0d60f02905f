"""The pilot's sticks as the firmware takes them: RCMAP_*, and the calibration in RCn_*."""

from __future__ import annotations

from typing import NamedTuple

from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.state.pilot import CHANNELS, Pilot

AXES = {
    "Roll": "RCMAP_ROLL",
    "Pitch": "RCMAP_PITCH",
    "Throttle": "RCMAP_THROTTLE",
    "Yaw": "RCMAP_YAW",
}
"""The firmware's names of the sticks, and which channel each is"""
LEAST_US, MOST_US = 800, 2200
"""A pulse that is not between them is none"""
FULL_STICK = 4000 / 4500
"""Further out a stick counts as held to the side"""


class Calibration(NamedTuple):
    """RCn_MIN, _MAX, _TRIM, _DZ and _REVERSED of a channel, microseconds."""

    channel: int
    least: float
    most: float
    trim: float
    dead_zone: float
    reversed: bool

    def limited(self, raw_us: float) -> float:
        """A pulse within RCn_MIN and RCn_MAX."""
        return min(max(raw_us, self.least), self.most)

    def angle(self, raw_us: float) -> float:
        """Of a stick that rests in the middle: -1..1, with a dead zone around RCn_TRIM."""
        raw_us = self.limited(raw_us)
        high, low = self.trim + self.dead_zone, self.trim - self.dead_zone
        share = 0.0
        if raw_us > high and self.most > high:
            share = (raw_us - high) / (self.most - high)
        elif raw_us < low and low > self.least:
            share = (raw_us - low) / (low - self.least)
        return -share if self.reversed else share

    def range(self, raw_us: float) -> float:
        """Of a stick that stays where it is put: 0..1, with a dead zone above RCn_MIN."""
        raw_us = self.limited(raw_us)
        if self.reversed:
            raw_us = self.most - (raw_us - self.least)
        low = self.least + self.dead_zone
        return (raw_us - low) / (self.most - low) if raw_us > low and self.most > low else 0.0

    def middle(self) -> float:
        """Where the middle of such a stick is in its `range`."""
        return self.range((self.least + self.most) / 2.0)


class Radio:
    """The sticks of one vehicle.

    Args:
        pilot: the raw channels.
        parameters: the vehicle's.

    Attributes:
        failed: the failsafe has found it silent for too long.
    """

    def __init__(self, pilot: Pilot, parameters: Parameters) -> None:
        self._pilot = pilot
        self._parameters = parameters
        self.failed = False
        self._revision = -1
        self._axes: dict[str, Calibration] = {}

    def stamp(self, now_s: float) -> tuple[int, int, bool]:
        """Equal as long as no stick or switch moves, and none means something else."""
        pilot, parameters = self._pilot, self._parameters
        if pilot.overridden:
            pilot.forget(now_s, parameters["RC_OVERRIDE_TIME"])
        return pilot.revision, parameters.revision, self.failed

    def calibration(self, axis: str) -> Calibration:
        """The channel of a stick, by its name in `AXES`."""
        if self._revision != self._parameters.revision:
            self._revision = self._parameters.revision
            self._axes = {name: self._calibration(mapped) for name, mapped in AXES.items()}
        return self._axes[axis]

    def _calibration(self, mapped: str) -> Calibration:
        p = self._parameters
        n = min(max(int(p[mapped]), 1), CHANNELS)
        return Calibration(
            n,
            p[f"RC{n}_MIN"],
            p[f"RC{n}_MAX"],
            p[f"RC{n}_TRIM"],
            p[f"RC{n}_DZ"],
            p[f"RC{n}_REVERSED"] != 0.0,
        )

    def channels(self, now_s: float) -> list[int]:
        """All channels, microseconds."""
        return self._pilot.channels(now_s, self._parameters["RC_OVERRIDE_TIME"])

    def pulse_us(self, channel: int, now_s: float) -> int | None:
        """The pulse of a channel, 1..16; None where there is no such channel or no pulse."""
        if not 1 <= channel <= CHANNELS:
            return None
        raw_us = self.channels(now_s)[channel - 1]
        return raw_us if LEAST_US < raw_us < MOST_US else None

    def raw_us(self, axis: str, now_s: float) -> int:
        """The pulse of a stick."""
        return self.channels(now_s)[self.calibration(axis).channel - 1]

    def heard(self, now_s: float) -> bool:
        """Whether pulses or overrides come, with a throttle that is not below its failsafe's."""
        p = self._parameters
        if not self._pilot.heard(now_s, p["RC_OVERRIDE_TIME"]):
            return False
        raw_us = self.raw_us("Throttle", now_s)
        if "THR_FS_VALUE" in p:  # a plane, which counts the value itself as lost, too
            return not p["THR_FAILSAFE"] or raw_us > p["THR_FS_VALUE"]
        return not p["FS_THR_ENABLE"] or raw_us >= p["FS_THR_VALUE"]

    def obeyed(self, now_s: float) -> bool:
        """Whether the sticks and switches count."""
        return not self.failed and self.heard(now_s)

    def angle(self, axis: str, now_s: float) -> float:
        """A stick that rests in the middle, -1..1; the middle while nothing is heard."""
        if self._pilot.lost and not self.heard(now_s):
            return 0.0
        return self.calibration(axis).angle(self.raw_us(axis, now_s))

    def stick(self, axis: str, now_s: float) -> float:
        """The same; the middle while the sticks do not count, too."""
        return self.angle(axis, now_s) if self.obeyed(now_s) else 0.0

    def range(self, axis: str, now_s: float) -> float:
        """A stick that stays where it is put, 0..1."""
        return self.calibration(axis).range(self.raw_us(axis, now_s))

    def throttle(self, now_s: float) -> float:
        """The throttle of vehicles that only go forward or up, 0..1."""
        return self.range("Throttle", now_s)
