"""Consumption of a vehicle's battery, and its last report. No ROS."""

from __future__ import annotations

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.state.health import battery_is_low
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.vehicle.traits import drives
from navigation_core.geometry import horizontal_norm
from navigation_core.safety.energy import ConsumptionEstimator

__all__ = ["BatteryWatch"]

_DRIVING_M_S = 0.3


class BatteryWatch:
    """Follows the battery of one vehicle.

    Attributes:
        consumption: measured from the reports.
        low_since_s: time since which it reports a low battery; None while it does not.
        reported: time and charge, 0 to 1, of the last report of a charge; None before one.
    """

    def __init__(self, endurance_s: float) -> None:
        """Begin with the configured endurance."""
        self.consumption = ConsumptionEstimator(endurance_s)
        self.low_since_s: float | None = None
        self.reported: tuple[float, float] | None = None

    def configure(self, endurance_s: float) -> None:
        """Apply another endurance."""
        self.consumption.endurance_s = endurance_s

    def observe(self, state: VehicleState, profile: Profile | None, now: float) -> None:
        """Process a new battery state."""
        battery, position = state.battery, state.global_position
        under_way = state.armed and state.landed_state in (
            LandedState.TAKEOFF,
            LandedState.IN_AIR,
            LandedState.LANDING,
        )
        if drives(profile) and position is not None:
            under_way = state.armed and horizontal_norm(position.velocity_ned_m_s) > _DRIVING_M_S
        remaining = None if battery is None else battery.remaining
        self.consumption.observe(now, remaining, under_way)
        if battery is not None and remaining is not None:
            self.reported = (battery.time_s, remaining)
        if not battery_is_low(battery):
            self.low_since_s = None
        elif self.low_since_s is None:
            self.low_since_s = now
