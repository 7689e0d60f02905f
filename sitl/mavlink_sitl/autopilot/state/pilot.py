"""The sticks. Without a receiver the firmware's simulator has the throttle at its lowest."""

from __future__ import annotations

CENTRE_US = 1500
THROTTLE_LOW_US = 1000
DEADZONE_US = 100
"""THR_DZ: around the centre of the throttle, where height is held"""


class Pilot:
    """Raw channels 1..8, and overrides that run out.

    Attributes:
        throttle_us: where the throttle stick stands when nothing overrides it.
        lost: nothing comes from the radio; overrides stand in for it.
    """

    def __init__(self) -> None:
        """Sticks centred, throttle low."""
        self.throttle_us = THROTTLE_LOW_US
        self.lost = False
        self._overrides: dict[int, tuple[int, float]] = {}

    def override(self, channels: list[int], now_s: float) -> None:
        """RC_CHANNELS_OVERRIDE: 0 gives a channel back, 65535 leaves it as it is."""
        for index, value in enumerate(channels):
            if value == 0:
                self._overrides.pop(index, None)
            elif value != 65535:
                self._overrides[index] = (value, now_s)

    def channels(self, now_s: float, timeout_s: float) -> list[int]:
        """The eight channels as the firmware sees them, microseconds."""
        base = [CENTRE_US, CENTRE_US, self.throttle_us, CENTRE_US, 1800, 1000, 1000, 1800]
        for index, (value, since_s) in list(self._overrides.items()):
            if now_s - since_s > timeout_s:
                del self._overrides[index]
            elif index < len(base):
                base[index] = value
        return base

    def heard(self, now_s: float, timeout_s: float) -> bool:
        """Whether the sticks or overrides reach the vehicle."""
        if not self.lost:
            return True
        self.channels(now_s, timeout_s)  # drops the overrides that have run out
        return bool(self._overrides)

    def throttle(self, now_s: float, timeout_s: float) -> float:
        """The throttle stick, 0..1."""
        raw = self.channels(now_s, timeout_s)[2]
        return min(max((raw - 1000) / 1000.0, 0.0), 1.0)

    def climb_rate_m_s(
        self, now_s: float, timeout_s: float, up_m_s: float, down_m_s: float
    ) -> float:
        """The climb rate of the throttle in altitude-hold modes; positive is up."""
        offset = self.channels(now_s, timeout_s)[2] - CENTRE_US
        if abs(offset) <= DEADZONE_US:
            return 0.0
        span = 500 - DEADZONE_US
        if offset > 0:
            return up_m_s * min((offset - DEADZONE_US) / span, 1.0)
        return down_m_s * max((offset + DEADZONE_US) / span, -1.0)
