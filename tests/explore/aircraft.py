"""Reports of aircraft by ADS-B that cannot be, or that are of the vehicle itself."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field

from mavlink_vehicle.codec import Codec, Message, make, mavlink

__all__ = ["AIRCRAFT", "Aircraft"]

AIRCRAFT = ("anonymous", "echo", "faster than sound", "hundred")
_RECEIVER = mavlink.MAV_COMP_ID_ADSB
_FLAGS = (
    mavlink.ADSB_FLAGS_VALID_COORDS
    | mavlink.ADSB_FLAGS_VALID_ALTITUDE
    | mavlink.ADSB_FLAGS_VALID_HEADING
    | mavlink.ADSB_FLAGS_VALID_VELOCITY
    | mavlink.ADSB_FLAGS_VERTICAL_VELOCITY_VALID
)
_FASTEST_CM_S = 65000
_PERIOD_S = 1.0
_DEGREES_E7_PER_M = 90.0
_OWN_ADDRESS = 0x4B1A2C


@dataclass
class Aircraft:
    """The vehicle's receiver, which passes on what somebody sends, once a second.

    Attributes:
        system: the vehicle's id.
        claim: of `AIRCRAFT`.
        seed: of where they are.
    """

    system: int
    claim: str
    seed: int
    _own: Message | None = None
    _due_s: float = -math.inf
    _number: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Begin before anything is heard."""
        self._ears, self._receiver = Codec(255, 190), Codec(self.system, _RECEIVER)

    def turn(self, arrived: list[bytes], now_s: float) -> list[bytes]:
        """Hear where the vehicle says that it is; return what is reported about it.

        Args:
            arrived: datagrams of the vehicle.
            now_s: simulated time.
        """
        for data in arrived:
            for message in self._ears.decode(data):
                if message.get_type() == "GLOBAL_POSITION_INT":
                    self._own = message
        if self._own is None or now_s < self._due_s:
            return []
        self._due_s = now_s + _PERIOD_S
        self._number += 1
        return [self._receiver.encode(report) for report in self._reports(self._own)]

    def _reports(self, own: Message) -> list[Message]:
        rng = random.Random(f"{self.seed} {self._number if self.claim == 'anonymous' else 0}")
        if self.claim == "echo":
            speed_cm_s = round(math.hypot(own.vx, own.vy))
            heading = round(100.0 * math.degrees(math.atan2(own.vy, own.vx))) % 36000
            return [_report(own, (2.0, -1.0), 1.0, _OWN_ADDRESS, speed_cm_s, heading)]
        if self.claim == "faster than sound":
            north_m = 3000.0 - 650.0 * (self._number % 10)
            return [_report(own, (north_m, 40.0), 10.0, 0x100, _FASTEST_CM_S, 18000)]
        count, reach_m = (100, 900.0) if self.claim == "hundred" else (3, 150.0)
        first = 1 if self.claim == "hundred" else None
        return [
            _report(
                own,
                (rng.uniform(-reach_m, reach_m), rng.uniform(-reach_m, reach_m)),
                rng.uniform(-20.0, 60.0),
                0 if first is None else first + number,
                rng.randrange(0, 4000),
                rng.randrange(36000),
            )
            for number in range(count)
        ]


def _report(
    own: Message,
    north_east_m: tuple[float, float],
    above_m: float,
    address: int,
    speed_cm_s: int,
    heading_cdeg: int,
) -> Message:
    """Return an ADSB_VEHICLE at a place from the vehicle's own."""
    north_m, east_m = north_east_m
    shrunk = max(math.cos(math.radians(1e-7 * own.lat)), 0.1)
    return make(
        "ADSB_VEHICLE", ICAO_address=address, lat=own.lat + round(_DEGREES_E7_PER_M * north_m),
        lon=_around(own.lon + round(_DEGREES_E7_PER_M * east_m / shrunk)),
        altitude_type=mavlink.ADSB_ALTITUDE_TYPE_GEOMETRIC,
        altitude=own.alt + round(1000.0 * above_m), heading=heading_cdeg,
        hor_velocity=speed_cm_s, ver_velocity=0, callsign=b"" if not address else b"ONE",
        emitter_type=1, tslc=0, flags=_FLAGS, squawk=0,
    )  # fmt: skip


def _around(longitude_e7: int) -> int:
    half = 180 * 10**7
    return (longitude_e7 + half) % (2 * half) - half
