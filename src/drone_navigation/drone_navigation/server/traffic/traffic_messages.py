"""Reservations of servers as ROS messages, and back."""

from __future__ import annotations

import math

import numpy as np
from builtin_interfaces.msg import Time

from custom_interfaces.msg import TrafficAgreement, TrafficReport, TrafficState, TrafficVehicle
from custom_interfaces.msg import TrafficVolume as VolumeMessage
from navigation_bridge.traffic.other_traffic import Seen
from navigation_bridge.traffic.shared_traffic import EarthFrame
from navigation_core.tasks.traffic.entries import Claimant, Rank
from navigation_core.tasks.traffic.negotiation import PeerState, PeerVehicle
from navigation_core.tasks.traffic.volumes import Volume

__all__ = ["TrafficMessageError", "seen_from", "state_from", "state_message"]

_POINTS_MAX = 5000


class TrafficMessageError(ValueError):
    """A message of another server cannot be used; says why."""


def state_message(state: PeerState, earth: EarthFrame, stamp: Time, ends: bool) -> TrafficState:
    """Return the message of a state."""
    message = TrafficState(
        stamp=stamp, server=state.server, epoch=state.epoch, sequence=state.sequence, ends=ends
    )
    message.vehicles = [_vehicle_message(one, earth) for one in state.vehicles]
    message.agreements = [
        TrafficAgreement(
            server=server,
            epoch=epoch,
            vehicles=list(numbers),
            numbers=list(numbers.values()),
        )
        for server, (epoch, numbers) in state.agreed.items()
    ]
    return message


def state_from(message: TrafficState, earth: EarthFrame) -> PeerState:
    """Return the state of a message, whose times count from when it came.

    Args:
        message: as it came.
        earth: this server's traffic frame.

    Raises:
        TrafficMessageError: its arrays do not go together, or a number is not finite.
    """
    vehicles = tuple(_vehicle_from(one, earth) for one in message.vehicles)
    agreed = {}
    for one in message.agreements:
        if len(one.vehicles) != len(one.numbers):
            raise TrafficMessageError("an agreement's names and numbers are not as many.")
        agreed[one.server] = (one.epoch, dict(zip(one.vehicles, one.numbers, strict=True)))
    return PeerState(message.server, message.epoch, message.sequence, vehicles, agreed)


def seen_from(message: TrafficReport) -> Seen:
    """Return what a report of other traffic says.

    Raises:
        TrafficMessageError: a number is not finite or not possible.
    """
    velocity = message.velocity
    seen = Seen(
        message.name,
        (message.latitude, message.longitude, message.altitude),
        (velocity.x, velocity.y, velocity.z),
        message.position_error,
        message.altitude_error,
    )
    if not (seen.name and seen.is_sound and all(map(math.isfinite, seen.velocity_enu_m_s))):
        raise TrafficMessageError("a report lacks a name, or a number is not finite or possible.")
    return seen


def _vehicle_message(vehicle: PeerVehicle, earth: EarthFrame) -> TrafficVehicle:
    return TrafficVehicle(
        name=vehicle.name,
        claimant=int(vehicle.rank.claimant),
        since=vehicle.rank.since_s,
        number=vehicle.number,
        held=_volume_message(vehicle.held, earth),
        alone=_volume_message(vehicle.alone, earth),
        reach=_volume_message(vehicle.reach, earth),
        path=_volume_message(vehicle.path, earth),
        after=vehicle.after_s.tolist(),
        target=_volume_message(vehicle.target, earth),
        moves=vehicle.moves,
        waits_for=vehicle.waits_for,
    )


def _vehicle_from(message: TrafficVehicle, earth: EarthFrame) -> PeerVehicle:
    path = _volume_from(message.path, earth)
    after_s = np.array(message.after, dtype=np.float64)
    if len(after_s) != len(path) or not np.isfinite(after_s).all():
        raise TrafficMessageError(f"the times of {message.name}'s path cannot be used.")
    return PeerVehicle(
        name=message.name,
        rank=Rank(Claimant(min(message.claimant, 2)), message.since, message.name),
        number=message.number,
        held=_volume_from(message.held, earth),
        alone=_volume_from(message.alone, earth),
        reach=_volume_from(message.reach, earth),
        path=path,
        after_s=after_s,
        target=_volume_from(message.target, earth),
        moves=message.moves,
        waits_for=message.waits_for,
    )


def _volume_message(volume: Volume, earth: EarthFrame) -> VolumeMessage:
    places = [earth.geodetic(point) for point in volume.points_m]
    return VolumeMessage(
        latitude=[place[0] for place in places],
        longitude=[place[1] for place in places],
        altitude=[place[2] for place in places],
        radius=volume.radius_m.tolist(),
        rise=volume.rise_m.tolist(),
    )


def _volume_from(message: VolumeMessage, earth: EarthFrame) -> Volume:
    columns = [message.latitude, message.longitude, message.altitude, message.radius, message.rise]
    if len({len(column) for column in columns}) != 1 or len(message.radius) > _POINTS_MAX:
        raise TrafficMessageError("a volume's arrays do not have one length, or are too long.")
    table = np.array(columns, dtype=np.float64)
    if not np.isfinite(table).all():
        raise TrafficMessageError("a volume has a number that is not finite.")
    points = [earth.metres((a, b, c)) for a, b, c in table[:3].T.tolist()]
    return Volume.along(np.array(points), table[3], table[4])
