"""The numeric half for multicopters with PX4: the same bodies, other gains.

Part of `simulation` (the same layer).
"""

from __future__ import annotations

from collections.abc import Sequence

from mavlink_sitl.autopilot.control_state import ControllerGains
from mavlink_sitl.dynamics.battery import BatteryModel
from mavlink_sitl.physics import Physics


class Px4Physics(Physics):
    """`Physics` with what tracks PX4's shaped motion; see `autopilot.px4.navigation`.

    Args:
        yaw_rad: see `Physics`.
        pack: see `Physics`; PX4 has its own idea of the battery.
        remaining: see `Physics`.
        seed: see `Physics`.
        wind_ned_m_s: see `Physics`.
    """

    def __init__(
        self,
        yaw_rad: Sequence[float],
        pack: BatteryModel,
        remaining: Sequence[float],
        seed: int,
        wind_ned_m_s: tuple[float, float, float],
    ) -> None:
        """See the class."""
        super().__init__(yaw_rad, pack, remaining, seed, wind_ned_m_s)
        # MPC_TILTMAX_AIR is 45 degrees.
        self.gains = ControllerGains(max_lean=1.0, most_faster_m_s=6.0)
