"""FOLLOW_TARGET: where the target of AUTO.FOLLOW_TARGET is. It has no addressee."""

from __future__ import annotations

from collections.abc import Callable

from mavlink_sitl.autopilot.px4.multicopter.copter import Px4Copter
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.mavlink.codec import Message
from mavlink_sitl.mavlink.setpoints import usable


def handlers(vehicle: Px4Vehicle) -> dict[str, Callable[[Message], None]]:
    """By the name of the message; nothing for those that cannot follow."""
    if not isinstance(vehicle, Px4Copter):
        return {}
    return {"FOLLOW_TARGET": lambda message: take(message, vehicle)}


def take(message: Message, copter: Px4Copter) -> None:
    """Take a message; without a velocity the estimate makes one (read in the firmware)."""
    latitude_deg, longitude_deg = message.lat / 1e7, message.lon / 1e7
    if abs(latitude_deg) > 90.0 or abs(longitude_deg) > 180.0 or not usable(message.alt):
        return
    north, east, down = message.vel
    known = all(map(usable, (north, east, down)))
    place = GeoPoint(latitude_deg, longitude_deg, message.alt)
    copter.see_target(place, (north, east, down) if known else None)
