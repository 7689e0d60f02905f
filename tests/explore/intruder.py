"""Another aircraft that a vehicle of an exploration meets: its motion, and reports of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from mavlink_vehicle.codec import Codec, make, mavlink
from navigation_core.geometry import Vector3
from tests.explore.exploration import Ship
from tests.explore.log import Met
from tests.fleets.encounters import Intruder

__all__ = ["MetIntruder"]

_PERIOD_S = 1.0
_TRUTH_S = 0.1
_FIRST_ADDRESS = 0xABC000
_FLAGS = (
    mavlink.ADSB_FLAGS_VALID_COORDS
    | mavlink.ADSB_FLAGS_VALID_ALTITUDE
    | mavlink.ADSB_FLAGS_VALID_HEADING
    | mavlink.ADSB_FLAGS_VALID_VELOCITY
    | mavlink.ADSB_FLAGS_VERTICAL_VELOCITY_VALID
)


@dataclass
class MetIntruder:
    """An intruder that flies on whatever happens; the vehicle's receiver reports it each second.

    Attributes:
        ship: the vehicle that it would hit.
        intruder: how it flies, in the vehicle's map.
        meeting_enu_m: where it would hit.
        begun_s: since when it is reported.
        ends_s: until when.
        number: which one of several it is.
    """

    ship: Ship
    intruder: Intruder
    meeting_enu_m: Vector3
    begun_s: float
    ends_s: float
    number: int
    _reported_s: float = field(default=-math.inf, init=False)
    _logged_s: float = field(default=-math.inf, init=False)

    def turn(self, now_s: float) -> list[bytes]:
        """Return what is reported of it, if that is due."""
        if now_s > self.ends_s:
            return []
        place, velocity = self.intruder.at(self.meeting_enu_m, now_s - self.begun_s)
        if now_s - self._logged_s >= _TRUTH_S - 1e-9:
            self._logged_s = now_s
            self.ship.log("intruder", Met(self.number, self.begun_s, place, velocity))
        if now_s - self._reported_s < _PERIOD_S - 1e-9:
            return []
        self._reported_s = now_s
        return [self._report(place, velocity)]

    def _report(self, place: Vector3, velocity: Vector3) -> bytes:
        east, north, up = place
        there = self.ship.sim.frame.to_geodetic(north, east, -up)
        course_deg = math.degrees(math.atan2(velocity[0], velocity[1]))
        message = make(
            "ADSB_VEHICLE", ICAO_address=_FIRST_ADDRESS + self.number,
            lat=round(there.latitude_deg * 1e7), lon=round(there.longitude_deg * 1e7),
            altitude_type=mavlink.ADSB_ALTITUDE_TYPE_GEOMETRIC,
            altitude=round(there.altitude_amsl_m * 1e3), heading=round(course_deg * 100) % 36000,
            hor_velocity=round(math.hypot(velocity[0], velocity[1]) * 100),
            ver_velocity=round(velocity[2] * 100), callsign=b"INTRUDER", emitter_type=1, tslc=0,
            flags=_FLAGS, squawk=0,
        )  # fmt: skip
        return Codec(self.ship.index + 1, mavlink.MAV_COMP_ID_ADSB).encode(message)
