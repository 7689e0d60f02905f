"""A vehicle with PX4 as its modes, checks and failsafes see it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from mavlink_sitl.autopilot.plans.plans import PlanItem
from mavlink_sitl.autopilot.px4.battery import Px4Battery
from mavlink_sitl.autopilot.px4.navigation import Px4Navigator
from mavlink_sitl.autopilot.state.vehicle_view import ArmingView, ModeView, VehicleView
from mavlink_sitl.exchange import Result, Vector


@dataclass(frozen=True)
class ManualControl:
    """The sticks, -1..1; throttle 0..1.

    Attributes:
        pitch: forward.
        roll: right.
        yaw: clockwise.
        throttle: 0.5 holds height where height is held.
        at_s: when they were heard.
    """

    pitch: float
    roll: float
    yaw: float
    throttle: float
    at_s: float


class LiftingMode(ModeView, Protocol):
    """The mode under way."""

    def wants_to_lift(self) -> bool:
        """Whether it would leave the ground."""


class LiftingArming(ArmingView, Protocol):
    """Whether the motors are armed."""

    def may_lift(self) -> bool:
        """Whether the motors may give what lifts the vehicle."""


class AreaView(Protocol):
    """The geofence."""

    breached: int

    @property
    def enabled(self) -> bool:
        """Whether a breach has consequences."""

    def enable(self, on: bool) -> None:
        """Switch it on or off."""

    def reasons(self) -> list[str]:
        """Why it does not let the vehicle arm."""

    def update(self) -> None:
        """Look where the vehicle is."""

    def broken_at(self, position_ned_m: Vector) -> int:
        """What a place breaks."""


class FeasibilityView(Protocol):
    """The check of the mission."""

    def holds(self) -> bool:
        """Whether it can be flown."""

    def hear(self) -> None:
        """The commander looks at the result at once."""


class Px4View(VehicleView, Protocol):
    """The members are those of `vehicle.Px4Vehicle`."""

    intention: int
    in_flight: bool
    after_disarming: int
    setpoint_at_s: float
    battery: Px4Battery

    @property
    def navigator(self) -> Px4Navigator:
        """Origin, home and limits."""

    @property
    def fence(self) -> AreaView:
        """The geofence."""

    @property
    def mode(self) -> LiftingMode:
        """The flight mode."""

    @property
    def arming(self) -> LiftingArming:
        """Whether the motors are armed, and since when."""

    @property
    def feasibility(self) -> FeasibilityView:
        """The check of the mission."""

    @property
    def manual(self) -> ManualControl | None:
        """The sticks, or None before any were heard."""

    def stream_alive(self) -> bool:
        """Whether usable setpoints come often enough for OFFBOARD."""

    def manual_alive(self) -> bool:
        """Whether somebody holds the sticks."""

    def can_arm(self) -> bool:
        """Whether the health and arming checks pass in the chosen mode."""

    def can_run(self, number: int) -> bool:
        """Whether a mode has what it needs."""

    def terminate(self) -> Result:
        """DO_FLIGHTTERMINATION."""

    def may_disarm(self) -> bool:
        """Whether it may be disarmed without force."""

    def may_land_by(self, items: Sequence[PlanItem]) -> bool:
        """Whether this kind can land as a mission says."""

    def flight_ended(self) -> None:
        """Disarmed."""

    def intend(self, number: int) -> None:
        """Make a mode the intention."""

    def hold_at(self, place_ned_m: Vector) -> None:
        """AUTO.LOITER at a place."""

    def height_above_ground_m(self) -> float:
        """Height above where it stood when home was set."""
