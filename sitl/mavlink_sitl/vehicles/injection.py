"""Failures in flight, by MAV_CMD_INJECT_FAILURE and by SIM_* parameters.

Part of `simulation` (the same layer). The command breaks the GPS receiver; all else is UNSUPPORTED.
The parameters are the firmware's own: ArduPilot's SIM_* and PX4's SIM_GPS_USED; those that a
personality does not have are not looked at.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Result
from mavlink_sitl.geodesy import GeoPoint

if TYPE_CHECKING:
    from mavlink_sitl.vehicles.vehicle import SimulatedVehicle

GPS = 4
"""FAILURE_UNIT"""
OK, OFF = 0, 1
"""FAILURE_TYPE"""


class Failures:
    """The injected failures of a vehicle."""

    def __init__(self, vehicle: SimulatedVehicle) -> None:
        self._vehicle = vehicle
        self._revision = -1
        self._followers: dict[tuple[str, ...], Callable[..., None]] = {
            ("SIM_BATT_VOLTAGE",): vehicle.force_voltage,
            ("SIM_GPS1_ENABLE",): self._follow_gps,
            ("SIM_GPS_USED",): lambda used: self._follow_gps(used >= 4.0),
            ("SIM_GPS1_GLTCH_X", "SIM_GPS1_GLTCH_Y", "SIM_GPS1_GLTCH_Z"): self._follow_glitch,
            ("SIM_RC_FAIL",): self._follow_radio,
        }
        # As long as they have their defaults nothing is broken.
        self._followed: dict[tuple[str, ...], list[float]] = {
            names: [vehicle.parameters.specs[name].default for name in names]
            for names in self._followers
            if all(map(vehicle.parameters.acts, names))
        }

    def _follow_radio(self, fail: float) -> None:
        """SIM_RC_FAIL: 1 no pulses, 2 a throttle below the failsafe's."""
        self._vehicle.lose_radio(fail > 0.0, fail == 2.0)

    def inject(self, unit: int, kind: int) -> Result:
        """MAV_CMD_INJECT_FAILURE.

        Args:
            unit: FAILURE_UNIT.
            kind: FAILURE_TYPE.
        """
        vehicle = self._vehicle
        if "SYS_FAILURE_EN" in vehicle.parameters and not vehicle.parameters["SYS_FAILURE_EN"]:
            return Result.DENIED
        if unit != GPS or kind not in (OK, OFF):
            return Result.UNSUPPORTED
        (vehicle.lose_gps if kind == OFF else vehicle.restore_gps)("injected")
        return Result.ACCEPTED

    # Parameters.

    def follow_parameters(self) -> None:
        """Do what the SIM_* parameters say, when one of them has changed."""
        parameters = self._vehicle.parameters
        if parameters.revision == self._revision:
            return
        self._revision = parameters.revision
        for names, follow in self._followers.items():
            values = [parameters[name] for name in names if parameters.acts(name)]
            if len(values) == len(names) and values != self._followed.get(names):
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
