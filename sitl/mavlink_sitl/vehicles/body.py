"""One vehicle's row in the arrays: its sensors, its battery, and their failures.

Part of `simulation` (the same layer), below the vehicle that joins it with a firmware.
"""

from __future__ import annotations

import math

from mavlink_sitl.config import VehicleConfig
from mavlink_sitl.environment import Environment, TrueClearance
from mavlink_sitl.exchange import GpsReading, Motion, RangeReading, Vector
from mavlink_sitl.geodesy import GeoPoint, LocalFrame
from mavlink_sitl.physics.fleets import Fleet
from mavlink_sitl.world import sensors

EXTERNAL_LOST_US = 500_000
"""A position from outside that is older is none"""


class VehicleBody:
    """The body of a vehicle of a simulation, and its sensors.

    Args:
        index: its row in `Simulation.truth`.
        fleet: whose lanes it is a part of.

    Attributes:
        origin: of its local frame.
        now_us: simulated time.
    """

    def __init__(self, index: int, config: VehicleConfig, fleet: Fleet) -> None:
        self.index = index
        self.config = config
        self.now_us = 0
        self.origin = config.home
        self._projection = config.personality().projection
        self._physics = fleet.physics
        self._lane = fleet.rows.index(index)
        self._environment: Environment | None = None
        self._gps_lost_at_s: float | None = None
        self._gps_faults: set[str] = set()
        self._gps_offset_ned_m = (0.0, 0.0, 0.0)
        self._gps_believed_ned_m = (0.0, 0.0, 0.0)
        """The offset that the estimator follows"""
        self._resets = self._regains = 0
        self._external_at_us = -EXTERNAL_LOST_US
        self._gps_reading: tuple[object, GpsReading] | None = None
        """The inputs of the latest reading, and the reading"""

    # State.

    def enter(self, environment: Environment) -> None:
        """Be in a world; called once by the simulation."""
        self._environment = environment

    @property
    def frame(self) -> LocalFrame:
        """Its local frame."""
        return LocalFrame(self.origin, self._projection)

    def truth(self) -> Motion:
        """Its true state."""
        return self._physics.motion(self._lane, truth=True)

    def truth_point(self) -> GeoPoint:
        """The same on earth."""
        return self.frame.to_geodetic(*self.truth()[:3])

    @property
    def wind_ned_m_s(self) -> Vector:
        """The wind where it is, m/s."""
        return self._physics.wind_at(self._lane)

    def servos_us(self) -> tuple[int, ...]:
        """Servo outputs of vehicles other than those with four equal motors."""
        return self._physics.servos(self._lane)

    def measure_ranges(self) -> RangeReading | None:
        """The readings of its range sensors, or None if it has none."""
        return None if self._environment is None else self._environment.measure_ranges(self._lane)

    def clearance(self) -> TrueClearance:
        """The true distance to the nearest obstacle."""
        if self._environment is None:
            return TrueClearance(math.inf, "", False)
        return self._environment.clearance(self._lane)

    def receiver(self) -> GpsReading:
        """The reading of the receiver; made once per sample."""
        lost_at_s = self._gps_lost_at_s
        # The sample already includes the part of the offset that the estimator follows.
        taken = self._physics.misled_by(self._lane)
        offset = tuple(o - t for o, t in zip(self._gps_offset_ned_m, taken, strict=True))
        made_of = (self._physics.gps(self._lane), lost_at_s, offset, self.origin)
        if self._gps_reading is not None and made_of == self._gps_reading[0]:
            return self._gps_reading[1]
        time_s, place, velocity = made_of[0]
        n, e, d = (x + off for x, off in zip(place, offset, strict=True))
        if lost_at_s is not None:
            time_s = min(time_s, lost_at_s)
        model = self._physics.sensor_model
        reading = sensors.gps_reading(time_s, self.frame, (n, e, d), velocity, model)
        if lost_at_s is not None:
            reading = reading._replace(fix_type=1, satellites=0)
        self._gps_reading = (made_of, reading)
        return reading

    # Failures and other influences.

    def lose_gps(self, cause: str = "asked") -> None:
        """The receiver loses its satellites; each cause has to end before they are back."""
        self._gps_faults.add(cause)
        if self._gps_lost_at_s is None:
            self._gps_lost_at_s = self.now_us / 1e6
            self._set_fix(False)

    def restore_gps(self, cause: str = "asked") -> None:
        """The cause is gone; without another the receiver finds its satellites again."""
        self._gps_faults.discard(cause)
        if not self._gps_faults and self._gps_lost_at_s is not None:
            self._gps_lost_at_s = None
            self._set_fix(True)

    def receive_gps(self, fix: bool) -> None:
        """The world takes the satellites away for a while, or gives them back."""
        if fix:
            self.restore_gps("world")
        else:
            self.lose_gps("world")

    def shift_gps(self, offset_ned_m: Vector) -> None:
        """Give the receiver this error; beyond its gate the estimator rejects it at first."""
        self._gps_offset_ned_m = offset_ned_m
        if self._gps_off_m() <= self._gate_m():
            self._gps_believed_ned_m = offset_ned_m
            self._physics.mislead(self._lane, offset_ned_m)

    def take_external_position(self, position_ned_m: Vector, reset: bool) -> None:
        """A position from outside, in the local frame of the estimator.

        Its error becomes the error of the estimate. The estimator follows a jump at once when the
        source reports a reset, otherwise as it follows a jump of a GPS receiver.
        """
        self._external_at_us = self.now_us
        place = self.truth()[:3]
        offset = tuple(p - t for p, t in zip(position_ned_m, place, strict=True))
        self.restore_gps("external")
        if reset:
            self._gps_offset_ned_m = self._gps_believed_ned_m = (offset[0], offset[1], offset[2])
            self._physics.reset_estimate(self._lane, self._gps_offset_ned_m)
        else:
            self.shift_gps((offset[0], offset[1], offset[2]))

    def _watch_external_position(self) -> None:
        if self.now_us - self._external_at_us > EXTERNAL_LOST_US:
            self.lose_gps("external")

    def _gate_m(self) -> float:
        """The largest GPS error over ground, m, that the estimator follows at once."""
        return math.inf

    def _gps_off_m(self) -> float:
        """How far the receiver is from what the estimator follows, over ground."""
        (north, east, _), believed = self._gps_offset_ned_m, self._gps_believed_ned_m
        return math.hypot(north - believed[0], east - believed[1])

    def _follow_resets(self, resets: int, regains: int) -> None:
        """The firmware's estimator gives in to the receiver, or has it again."""
        if regains != self._regains:
            self._regains = regains
            self._physics.regain_position(self._lane)
        if resets != self._resets:
            self._resets = resets
            self._gps_believed_ned_m = self._gps_offset_ned_m
            self._physics.reset_estimate(self._lane, self._gps_offset_ned_m)

    def _set_fix(self, fix: bool) -> None:
        physics = self._physics
        physics.gps_fix = physics.with_value(physics.gps_fix, self._lane, fix)

    def force_voltage(self, voltage_v: float) -> None:
        """Force the pack's voltage until the next call; 0 V returns to the model."""
        physics = self._physics
        lane = physics.with_value(physics.battery.override_v, self._lane, voltage_v)
        physics.battery = physics.battery._replace(override_v=lane)

    @property
    def battery_consumed_mah(self) -> float:
        """The charge taken from the pack."""
        return self._physics.at(self._physics.battery.consumed_mah, self._lane)

    def set_battery_remaining(self, fraction: float) -> None:
        """Fill or empty the pack, 0..1."""
        physics = self._physics
        consumed = (1.0 - fraction) * physics.pack.capacity_mah
        lane = physics.with_value(physics.battery.consumed_mah, self._lane, consumed)
        physics.battery = physics.battery._replace(consumed_mah=lane)

    def weaken_motors(self, efficiency: float) -> None:
        """Scale the motors' thrust by a factor, 0..1; 1 is full thrust."""
        self._physics.weaken(self._lane, efficiency)

    def blow(self, velocity_ned_m_s: Vector) -> None:
        """A wind on this vehicle, on top of the world's."""
        if self._environment is not None:
            self._environment.blow(self._lane, velocity_ned_m_s)
