"""Failure injection in flight, by MAV_CMD_INJECT_FAILURE and by SIM_* parameters.

Part of `simulation` (the same layer). A command of unit and type is looked up in a table;
what is not in it is UNSUPPORTED. The parameters are the firmware's own: ArduPilot's SIM_*
and PX4's SIM_GPS_USED; those that a personality does not have are not looked at.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.exchange import Result
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.links.faults import LinkFaults

if TYPE_CHECKING:
    from mavlink_sitl.vehicles.vehicle import SimulatedVehicle

GPS, BATTERY, MOTOR, RC_SIGNAL, MAVLINK_SIGNAL = 4, 100, 101, 104, 105
"""FAILURE_UNIT"""
OK, OFF, GARBAGE, WRONG, SLOW, DELAYED, INTERMITTENT = 0, 1, 3, 4, 5, 6, 7
"""FAILURE_TYPE"""

MOTORS = 4
EMPTY_V = 1.0
WEAK_MOTORS = 0.8
"""Thrust left of motors that are SLOW"""
WRONG_GPS_M = (60.0, 60.0, 0.0)
"""How far off a WRONG receiver is: more than an estimator believes"""
LINK_FAULTS = {
    GARBAGE: LinkFaults(corrupt=0.3),
    WRONG: LinkFaults(duplicate=0.5),
    SLOW: LinkFaults(delay_s=0.3, jitter_s=0.3),
    DELAYED: LinkFaults(delay_s=1.0),
    INTERMITTENT: LinkFaults(loss=0.3),
}


class Failures:
    """The injected failures of a vehicle."""

    def __init__(self, vehicle: SimulatedVehicle) -> None:
        self._vehicle = vehicle
        self._motors_off: set[int] = set()
        self._weak = self._multiplier = 1.0
        self._mask = 0
        self._revision = -1
        self._consumed_mah: float | None = None
        self._units: dict[int, Callable[[int, int], bool]] = {
            GPS: self._gps,
            BATTERY: self._battery,
            MOTOR: self._motor,
            RC_SIGNAL: self._rc,
            MAVLINK_SIGNAL: self._link,
        }
        self._followers: dict[tuple[str, ...], Callable[..., None]] = {
            ("SIM_BATT_VOLTAGE",): vehicle.force_voltage,
            ("SIM_GPS1_ENABLE",): self._follow_gps,
            ("SIM_GPS_USED",): lambda used: self._follow_gps(used >= 4.0),
            ("SIM_GPS1_GLTCH_X", "SIM_GPS1_GLTCH_Y", "SIM_GPS1_GLTCH_Z"): self._follow_glitch,
            ("SIM_RC_FAIL",): self._follow_radio,
            ("SIM_ENGINE_MUL", "SIM_ENGINE_FAIL"): self._follow_engine,
            ("SIM_WIND_SPD", "SIM_WIND_DIR"): self._follow_wind,
        }
        # As long as they have their defaults nothing is broken.
        self._followed: dict[tuple[str, ...], list[float]] = {
            names: Parameters(vehicle.parameters.table).values_of(names)
            for names in self._followers
            if all(map(vehicle.parameters.acts, names))
        }

    def _follow_radio(self, fail: float) -> None:
        """SIM_RC_FAIL: 1 no pulses, 2 a throttle below the failsafe's."""
        self._vehicle.lose_radio(fail > 0.0, fail == 2.0)

    def inject(self, unit: int, kind: int, instance: int) -> Result:
        """MAV_CMD_INJECT_FAILURE.

        Args:
            unit: FAILURE_UNIT.
            kind: FAILURE_TYPE.
            instance: which one, from 1; 0 for all.
        """
        parameters = self._vehicle.parameters
        if "SYS_FAILURE_EN" in parameters and not parameters["SYS_FAILURE_EN"]:
            return Result.DENIED
        handler = self._units.get(unit)
        if handler is None or not handler(kind, instance):
            return Result.UNSUPPORTED
        return Result.ACCEPTED

    def _gps(self, kind: int, _: int) -> bool:
        vehicle = self._vehicle
        if kind == OFF:
            vehicle.lose_gps("injected")
        elif kind == WRONG:
            vehicle.shift_gps(WRONG_GPS_M)
        elif kind == OK:
            vehicle.restore_gps("injected")
            vehicle.shift_gps((0.0, 0.0, 0.0))
        return kind in (OK, OFF, WRONG)

    def _battery(self, kind: int, _: int) -> bool:
        vehicle = self._vehicle
        if "SIM_BAT_DRAIN" in vehicle.parameters:  # the firmware simulates the pack itself
            if kind in (OK, OFF):
                vehicle.set_battery_voltage(EMPTY_V if kind == OFF else 0.0)
        elif kind == OFF and self._consumed_mah is None:
            self._consumed_mah = vehicle.battery_consumed_mah
            vehicle.set_battery_remaining(0.0)
        elif kind == OK and self._consumed_mah is not None:
            capacity = vehicle.config.battery.capacity_mah
            vehicle.set_battery_remaining(1.0 - self._consumed_mah / capacity)
            self._consumed_mah = None
        return kind in (OK, OFF)

    def _motor(self, kind: int, instance: int) -> bool:
        if not 0 <= instance <= MOTORS:
            return False
        which = {instance} if instance else set(range(1, MOTORS + 1))
        if kind == OFF:
            self._motors_off |= which
        elif kind == SLOW:
            self._weak = WEAK_MOTORS
        elif kind == OK:
            self._motors_off -= which
            self._weak = 1.0
        self._set_thrust()
        return kind in (OK, OFF, SLOW)

    def _rc(self, kind: int, _: int) -> bool:
        self._vehicle.lose_radio(kind == OFF)
        return kind in (OK, OFF)

    def _link(self, kind: int, _: int) -> bool:
        """OFF silences the vehicle only: it still receives the command that ends the failure."""
        for link in self._vehicle.links:
            if kind in (OK, OFF):
                link.mute = kind == OFF
                link.set_faults(self._vehicle.config.faults)
            elif kind in LINK_FAULTS:
                link.set_faults(LINK_FAULTS[kind])
        return kind in (OK, OFF, *LINK_FAULTS)

    def _set_thrust(self) -> None:
        """A quadrotor without one motor keeps two, to stay level; others have only one."""
        off = self._motors_off | {i + 1 for i in range(MOTORS) if self._mask >> i & 1}
        quadrotor = self._vehicle.config.vehicle == "copter"
        left = {0: 1.0, 1: 0.5 * quadrotor}.get(len(off), 0.0)
        self._vehicle.weaken_motors(left * self._weak * self._multiplier)

    # Parameters.

    def follow_parameters(self) -> None:
        """Do what the SIM_* parameters say, when one of them has changed."""
        parameters = self._vehicle.parameters
        if parameters.revision == self._revision:
            return
        self._revision = parameters.revision
        for names, follow in self._followers.items():
            if not all(map(parameters.acts, names)):
                continue
            values = parameters.values_of(names)
            if values != self._followed.get(names):
                self._followed[names] = values
                follow(*values)

    def _follow_gps(self, enabled: float) -> None:
        vehicle = self._vehicle
        (vehicle.restore_gps if enabled else vehicle.lose_gps)("parameter")

    def _follow_glitch(self, latitude_deg: float, longitude_deg: float, height_m: float) -> None:
        frame = self._vehicle.frame
        latitude, longitude, altitude = frame.origin
        point = GeoPoint(latitude + latitude_deg, longitude + longitude_deg, altitude + height_m)
        self._vehicle.shift_gps(frame.to_local(point))

    def _follow_wind(self, speed_m_s: float, from_deg: float) -> None:
        speed = min(max(speed_m_s, 0.0), 60.0)
        angle = math.radians(math.fmod(from_deg, 360.0))
        self._vehicle.blow((-speed * math.cos(angle), -speed * math.sin(angle), 0.0))

    def _follow_engine(self, multiplier: float, failed: float) -> None:
        self._multiplier = min(max(multiplier, 0.0), 2.0)
        self._mask = int(failed) & 0xF
        self._set_thrust()
