"""PX4's battery simulator: discharges with time while armed, whatever the motors do."""

from __future__ import annotations

from mavlink_sitl.autopilot.parameters import Parameters

REFILL_1_S = 0.4
"""Full again within 2 to 3 s after disarming"""
CONSUMED_MAH_S = -0.3
"""current_consumed runs negative: a current of "unknown" (-1 A), integrated"""


class Px4Battery:
    """The pack of one vehicle.

    Args:
        parameters: SIM_BAT_DRAIN, SIM_BAT_MIN_PCT, BAT1_*.

    Attributes:
        remaining: charge, 0..1.
        consumed_mah: as BATTERY_STATUS has it.
        voltage_v: of the pack.
        forced_v: a voltage that somebody forces upon it; 0 for its own.
    """

    def __init__(self, parameters: Parameters) -> None:
        """Full."""
        self._parameters = parameters
        self._at_s: float | None = None
        self.remaining = 1.0
        self.consumed_mah = 0.0
        self.forced_v = 0.0
        self.voltage_v = self._voltage()

    def _voltage(self) -> float:
        p = self._parameters
        cell = p["BAT1_V_EMPTY"] + (p["BAT1_V_CHARGED"] - p["BAT1_V_EMPTY"]) * self.remaining
        return cell * max(p["BAT1_N_CELLS"], 1.0)

    def update(self, now_s: float, armed: bool) -> None:
        """Let time pass."""
        dt = 0.0 if self._at_s is None else now_s - self._at_s
        self._at_s = now_s
        p = self._parameters
        if armed:
            least = min(max(p["SIM_BAT_MIN_PCT"] / 100.0, 0.0), 1.0)
            drained = self.remaining - dt / max(p["SIM_BAT_DRAIN"], 1.0)
            self.remaining = max(drained, min(least, self.remaining))
        else:
            self.remaining = min(self.remaining + REFILL_1_S * dt, 1.0)
        self.consumed_mah += CONSUMED_MAH_S * dt
        self.voltage_v = self._voltage()
        if self.forced_v > 0.0:
            self.voltage_v = self.forced_v
            full, empty = p["BAT1_V_CHARGED"], p["BAT1_V_EMPTY"]
            cell = self.forced_v / max(p["BAT1_N_CELLS"], 1.0)
            self.remaining = min(max((cell - empty) / max(full - empty, 0.01), 0.0), 1.0)
