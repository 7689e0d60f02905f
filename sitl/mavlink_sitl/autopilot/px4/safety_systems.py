"""The systems that a PX4 1.18 looks after in flight: parachute, Remote ID, receivers, its altitude.

Read in the firmware: a parachute and a Remote ID are there while their HEARTBEATs come, and well
while these say STANDBY or ACTIVE. Of receivers those with a 3D fix count; a simulated vehicle has
one. A multicopter loses altitude when it is below its altitude setpoint and sinks by FD_ALT_LOSS
from the highest altitude that it has had there; where no altitude is set, but a climb rate, nothing
is watched.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

PARACHUTE, REMOTE_ID = "Parachute system", "Remote ID system"
"""As texts name them"""
_LOST_AFTER_S = 3.0
_NEEDED_FROM = {PARACHUTE: ("COM_PARACHUTE", 2), REMOTE_ID: ("COM_ARM_ODID", 2)}
"""The parameter of each, and from which value on it is needed to arm"""


class SafetySystems:
    """The state of these systems of one vehicle.

    Attributes:
        altitude_lost: whether it has sunk too far below its setpoint.
    """

    def __init__(self, vehicle: Px4Vehicle) -> None:
        """Begin without any."""
        self._vehicle = vehicle
        self._heard: dict[str, tuple[float, bool]] = {}
        self.altitude_lost = False
        self._highest_m = math.nan
        self._sinks_since_s = math.inf

    def hear(self, system: str, well: bool) -> None:
        """A HEARTBEAT of PARACHUTE or REMOTE_ID."""
        self._heard[system] = (self._vehicle.now_s, well)

    def is_well(self, system: str) -> bool:
        """Whether it is there, and well."""
        return self._heard.get(system, (0.0, False))[1]

    def has_receivers(self) -> bool:
        """Whether as many receivers have a 3D fix as SYS_HAS_NUM_GNSS says."""
        vehicle = self._vehicle
        return int(vehicle.estimator.gps_fix) >= vehicle.parameters["SYS_HAS_NUM_GNSS"]

    def value(self, name: str) -> int:
        """A parameter that says what is done; 0 for releases in which it does nothing."""
        parameters = self._vehicle.parameters
        return int(parameters[name]) if parameters.acts(name) else 0

    def missing(self) -> list[str]:
        """Return what has to be there before the motors are armed, and is not."""
        missing = []
        for system, (name, needed_from) in _NEEDED_FROM.items():
            if self.value(name) >= needed_from and not self.is_well(system):
                missing.append(f"{system} {'not ready' if system in self._heard else 'missing'}")
        if self.value("COM_GNSSLOSS_ACT") > 0 and not self.has_receivers():
            missing.append("GPS 0 lost fix")
        return missing

    def update(self) -> None:
        """Say which system is lost, and look at the altitude."""
        now_s = self._vehicle.now_s
        heard = self._heard.items()
        for system in [s for s, (heard_s, _) in heard if now_s - heard_s > _LOST_AFTER_S]:
            del self._heard[system]
            self._vehicle.say(Severity.CRITICAL, f"{system} lost")
        self.altitude_lost = self._sinks()

    def _sinks(self) -> bool:
        vehicle, wanted = self._vehicle, self._vehicle.guidance
        parameters, down_m = vehicle.parameters, self._vehicle.motion.down_m
        watched = vehicle.armed and parameters.acts("FD_ALT_LOSS") and wanted.track_position_z > 0.0
        most_m = parameters["FD_ALT_LOSS"] if watched else 0.0
        if most_m <= 0.0 or down_m <= wanted.down_m:
            self._highest_m, self._sinks_since_s = math.nan, math.inf
            return False
        if math.isnan(self._highest_m):
            self._highest_m = down_m
        self._highest_m = min(max(self._highest_m, wanted.down_m), down_m)
        if down_m - self._highest_m <= most_m:
            self._sinks_since_s = math.inf
            return False
        self._sinks_since_s = min(self._sinks_since_s, vehicle.now_s)
        return vehicle.now_s - self._sinks_since_s >= parameters["FD_ALT_LOSS_T"]
