"""The state of a vehicle that is being listened to."""

from __future__ import annotations

from typing import Any

from mavlink_vehicle.state.restarts import evolve
from mavlink_vehicle.state.telemetry import GlobalPosition
from mavlink_vehicle.state.vehicle_state import VehicleState


class LiveState:
    """The latest state, made when it is asked for: measurements come more often than that.

    Attributes:
        known: the state without the measurements that came since it was asked for last.
        measured: these measurements, by attribute of the state.
        boot_time_ms: the newest time since boot.
    """

    __slots__ = ("boot_time_ms", "known", "measured")

    def __init__(self, state: VehicleState) -> None:
        """Begin with a state."""
        self.set(state)

    def set(self, state: VehicleState) -> None:
        """Replace the whole state."""
        self.known = state
        self.measured: dict[str, Any] = {}
        self.boot_time_ms = state.boot_time_ms

    def get(self) -> VehicleState:
        """Return the state; the same object until something comes."""
        if self.measured:
            self.known = evolve(self.known, self.measured)
            self.measured = {}
        return self.known

    @property
    def global_position(self) -> GlobalPosition | None:
        """The position; the state need not be made for it."""
        position: GlobalPosition | None = self.measured.get(
            "global_position", self.known.global_position
        )
        return position

    def measure(self, attribute: str, value: object, time_boot_ms: int, now: float) -> None:
        """Take a measurement that is not older than anything that came before."""
        self.measured[attribute] = value
        self.tell_time(time_boot_ms, now)

    def tell_time(self, time_boot_ms: int, now: float) -> None:
        """Take a time since boot that is not older than anything that came before."""
        self.measured["boot_time_ms"] = self.boot_time_ms = time_boot_ms
        self.measured["boot_time_s"] = now
