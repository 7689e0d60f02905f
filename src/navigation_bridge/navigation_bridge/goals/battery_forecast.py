"""Battery check for a goal and the return. No ROS."""

from __future__ import annotations

import math

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.state.health import battery_is_low
from mavlink_vehicle.state.vehicle_state import VehicleState
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.goals.straight_legs import FlightPlan
from navigation_bridge.snapshot import LocatedSnapshot, Snapshot
from navigation_bridge.vehicle.traits import traits_of
from navigation_core.geometry import Vector3, horizontal_norm
from navigation_core.safety.energy import ConsumptionEstimator

_DRIVING_M_S = 0.3
# Time to take control, arm and take off, and to settle at the end.
_BEGIN_S, _SETTLE_S = 10.0, 3.0
# Time within which the vehicle's own failsafe acts first.
_FAILSAFE_ACTS_S = 2.0
_SAID_LOW = "The autopilot reports a low battery"
# A PX4 reports its battery every 2 s.
_SILENT_S = 10.0


class BatteryReckoning:
    """Measures the consumption and predicts the charge."""

    def __init__(self, config: BridgeConfig) -> None:
        """Begin with the configured endurance."""
        self._consumption = ConsumptionEstimator(config.safety.battery_endurance_s)
        self._low_since_s: float | None = None
        # When it last reported its remaining charge, and which.
        self._told: tuple[float, float] | None = None

    def unknown(self, snapshot: Snapshot) -> str | None:
        """Return in a sentence how the remaining charge is not known; None if it is."""
        battery, now = snapshot.state.battery, snapshot.time_s
        silent = battery is None or now - battery.time_s > _SILENT_S
        told = self._told
        if battery is not None and battery.remaining is not None:
            if not silent:
                return None
            told = (battery.time_s, battery.remaining)
        if told is None:
            return "The vehicle has never reported its remaining battery."
        told_s, remaining = told
        was = f"{now - told_s:.0f} s ago it reported {100.0 * remaining:.0f} %."
        if silent:
            return f"The vehicle does not report its battery any more; {was}"
        return f"The vehicle reports its remaining battery as unknown now; {was}"

    def configure(self, config: BridgeConfig) -> None:
        """Apply other settings."""
        self._consumption.endurance_s = config.safety.battery_endurance_s

    def observe(self, state: VehicleState, profile: Profile | None, now: float) -> None:
        """Process a new battery state."""
        under_way = state.armed and state.landed_state in (
            LandedState.TAKEOFF,
            LandedState.IN_AIR,
            LandedState.LANDING,
        )
        position = state.global_position
        if profile is not None and not traits_of(profile).flies and position is not None:
            under_way = state.armed and horizontal_norm(position.velocity_ned_m_s) > _DRIVING_M_S
        remaining = None if state.battery is None else state.battery.remaining
        self._consumption.observe(now, remaining, under_way)
        if state.battery is not None and remaining is not None:
            self._told = (state.battery.time_s, remaining)

    @staticmethod
    def _return_speed_m_s(snapshot: Snapshot, plan: FlightPlan | None) -> float:
        """Return the speed of the vehicle's own return; the goal's, or the default, if unknown."""
        parameters = snapshot.parameters
        for name, scale in snapshot.profile.return_speeds:
            if parameters.get(name, 0.0) > 0.0:
                return parameters[name] * scale
        limits = snapshot.config.goto.limits
        return limits.speed_horizontal_m_s if plan is None else plan.speeds_m_s[-1]

    def _back_s(self, snapshot: Snapshot, start_enu_m: Vector3, plan: FlightPlan | None) -> float:
        """Return the time from a position to the launch point, landing included."""
        home = snapshot.home_enu_m or (0.0, 0.0, 0.0)
        limits = snapshot.config.goto.limits
        return_m = math.dist(start_enu_m[:2], home[:2])
        height_m = max(start_enu_m[2] - home[2], 0.0)
        return return_m / self._return_speed_m_s(snapshot, plan) + height_m / limits.speed_down_m_s

    def share_back(self, snapshot: LocatedSnapshot) -> float:
        """Return the share of the battery for the return from here, NaN if unknown."""
        prediction = self._consumption.predict(
            0.0, self._back_s(snapshot, snapshot.pose.position_enu_m, None)
        )
        return math.nan if prediction is None else prediction.at_end - prediction.back

    def problem(self, plan: FlightPlan, snapshot: LocatedSnapshot) -> str | None:
        """Return why the battery is insufficient for a plan and the return, or None."""
        if battery_is_low(snapshot.state.battery):
            return self._said_low(snapshot.state)
        start_enu_m = snapshot.pose.position_enu_m
        goal_s = _BEGIN_S + plan.duration_s(start_enu_m) + _SETTLE_S
        end_enu_m = plan.targets_enu_m[-1] if plan.targets_enu_m else start_enu_m
        back_s = self._back_s(snapshot, end_enu_m, plan)
        prediction = self._consumption.predict(goal_s, back_s)
        reserve = snapshot.config.safety.battery_reserve
        if prediction is None or prediction.back >= reserve:
            return None
        words = prediction.describe()
        return f"Insufficient battery: {words}; battery_reserve is {100 * reserve:g} %."

    def says_low(self, snapshot: Snapshot) -> str | None:
        """Return the warning that the autopilot reports a low battery but does not act, or None."""
        now = snapshot.time_s
        if not battery_is_low(snapshot.state.battery):
            self._low_since_s = None
        elif self._low_since_s is None:
            self._low_since_s = now
        if self._low_since_s is not None and now - self._low_since_s > _FAILSAFE_ACTS_S:
            return self._said_low(snapshot.state)
        return None

    @staticmethod
    def _said_low(state: VehicleState) -> str:
        """Report which battery it is, where there are several."""
        battery, several = state.battery, len(state.batteries) > 1
        number = f" (number {battery.battery_id})" if several and battery is not None else ""
        return f"{_SAID_LOW}{number}."

    def runs_low(self, plan: FlightPlan, snapshot: LocatedSnapshot) -> str | None:
        """Return why the charge requires turning back from a position on the path, or None."""
        here_enu_m = snapshot.pose.position_enu_m
        prediction = self._consumption.predict(0.0, self._back_s(snapshot, here_enu_m, plan))
        reserve = snapshot.config.safety.battery_reserve
        if prediction is None or prediction.back >= reserve:
            return None
        return (
            f"The battery is at {100 * prediction.now:.0f} %; the return takes "
            f"{prediction.back_s:.0f} s and would leave {100 * max(prediction.back, 0.0):.0f} %, "
            f"below battery_reserve ({100 * reserve:g} %)."
        )
