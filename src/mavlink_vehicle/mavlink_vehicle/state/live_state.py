"""The state of a vehicle that is being listened to."""

from __future__ import annotations

from mavlink_vehicle.state.restarts import REORDER_LIMIT_MS, Changes, evolve
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
        self.measured: Changes = {}
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
        position = self.measured.get("global_position", self.known.global_position)
        return position if isinstance(position, GlobalPosition) else None

    def is_next(self, time_boot_ms: int) -> bool:
        """Return whether a time since boot follows the newest, of a clock that is not in doubt."""
        newest_ms = self.boot_time_ms
        return (
            newest_ms is not None
            and newest_ms <= time_boot_ms <= newest_ms + REORDER_LIMIT_MS
            and self.known.restart_signs.doubt is None
        )

    def measure(self, changes: Changes, time_boot_ms: int, now: float) -> None:
        """Take a measurement, of a time since boot that `is_next`."""
        measured = self.measured
        measured |= changes
        measured["boot_time_ms"] = self.boot_time_ms = time_boot_ms
        measured["boot_time_s"] = now
