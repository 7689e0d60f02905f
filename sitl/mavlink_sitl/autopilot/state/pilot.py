"""The channels of the pilot's receiver, and the overrides that a ground station puts over them.

Without a transmitter the firmware's simulator has the sticks centred and the throttle lowest.
"""

from __future__ import annotations

from collections.abc import Sequence

CENTRE_US = 1500
THROTTLE_LOW_US = 1000
CHANNELS = 16
RECEIVED_AT_FIRST = 8
"""Channels that a receiver has until somebody sends more of them"""
THROTTLE = 2
"""Where the simulator's receiver has the throttle, whatever RCMAP_THROTTLE says"""
FAILED_THROTTLE_US = 950
"""SIM_RC_FAIL 2: what a receiver gives that has lost its transmitter"""
KEEP, RELEASE = 65535, 65534
"""In RC_CHANNELS_OVERRIDE: the channel as it is; the receiver's, of channels 9 and up"""


def released(place: int) -> int:
    """The value in RC_CHANNELS_OVERRIDE that releases a channel, counted from 0."""
    return 0 if place < RECEIVED_AT_FIRST else RELEASE


class Pilot:
    """Raw channels 1..16, and overrides that run out.

    Attributes:
        revision: grows when a channel moves, or the radio is lost or comes back.
        lost: no pulses come from the receiver; overrides stand in for them.
        throttle_failed: it has lost its transmitter, and says so by a low throttle.
        obeys_overrides: else they are not taken.
    """

    def __init__(self) -> None:
        """Sticks centred, throttle low, and the switches as the firmware's simulator has them."""
        self.revision = 0
        self.obeys_overrides = True
        self.lost = self.throttle_failed = False
        self._received = [CENTRE_US, CENTRE_US, THROTTLE_LOW_US, CENTRE_US, 1800, 1000, 1000, 1800]
        self._received += [0] * (CHANNELS - RECEIVED_AT_FIRST)
        self._overrides: dict[int, tuple[int, float]] = {}
        self.count = RECEIVED_AT_FIRST
        """How many channels the receiver has, for RC_CHANNELS"""

    def fail(self, lost: bool, throttle_failed: bool = False) -> None:
        """The receiver falls silent, or only lowers the throttle, or is well again."""
        self.lost, self.throttle_failed = lost, throttle_failed
        self.revision += 1

    @property
    def overridden(self) -> bool:
        """Whether a ground station holds a channel."""
        return bool(self._overrides)

    def receive(self, channels: Sequence[int]) -> None:
        """Pulses of the receiver, microseconds, from channel 1 on; 0 leaves a channel as it was."""
        for place, raw_us in enumerate(channels[:CHANNELS]):
            if raw_us and raw_us != self._received[place]:
                self._received[place] = raw_us
                self.revision += 1
        self.count = max(self.count, min(len(channels), CHANNELS))

    def override(self, channels: Sequence[int], now_s: float) -> None:
        """RC_CHANNELS_OVERRIDE: which values give a channel back or leave it differs above 8."""
        if not self.obeys_overrides:
            return
        for place, raw_us in enumerate(channels[:CHANNELS]):
            was = self._overrides.get(place)
            if raw_us == released(place):
                self._overrides.pop(place, None)
                self.revision += was is not None
            elif raw_us not in (0, KEEP):
                self._overrides[place] = (raw_us, now_s)
                self.revision += was is None or was[0] != raw_us

    def channels(self, now_s: float, timeout_s: float) -> list[int]:
        """The channels as the firmware sees them, microseconds; 0 for one that is not there.

        Args:
            now_s: simulated time.
            timeout_s: RC_OVERRIDE_TIME: 0 for no overrides, negative for those without an end.
        """
        seen = list(self._received)
        if self.throttle_failed:
            seen[0], seen[THROTTLE] = CENTRE_US, FAILED_THROTTLE_US
        if self._overrides and timeout_s:
            self.forget(now_s, timeout_s)
            for place, (raw_us, _) in self._overrides.items():
                seen[place] = raw_us
        return seen

    def heard(self, now_s: float, timeout_s: float) -> bool:
        """Whether pulses or overrides reach the vehicle."""
        if not self.lost:
            return True
        self.forget(now_s, timeout_s)
        return bool(self._overrides and timeout_s)

    def forget(self, now_s: float, timeout_s: float) -> None:
        """Give back what was overridden too long ago; arguments as of `channels`."""
        if timeout_s <= 0.0:
            return
        for place, (_, since_s) in list(self._overrides.items()):
            if now_s - since_s > timeout_s:
                del self._overrides[place]
                self.revision += 1
