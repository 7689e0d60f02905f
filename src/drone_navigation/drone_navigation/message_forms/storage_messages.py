"""The areas of a fence and rally points as ROS messages, for both the client and the server."""

from __future__ import annotations

from custom_interfaces.msg import FenceArea
from custom_interfaces.msg import RallyPoint as RallyPointMessage
from navigation_bridge.goals.requests import AltitudeReference
from navigation_bridge.storage.geographic import GeoArea, RallyPoint

REFERENCES = {
    RallyPointMessage.ABOVE_HOME: AltitudeReference.HOME,
    RallyPointMessage.ABOVE_MEAN_SEA_LEVEL: AltitudeReference.AMSL,
    RallyPointMessage.ABOVE_GROUND: AltitudeReference.GROUND,
}
"""Altitude references by their numbers in RallyPoint.msg"""
_NUMBERS = {reference: number for number, reference in REFERENCES.items()}


def area_message(area: GeoArea) -> FenceArea:
    """Return an area of a fence as a message."""
    message = FenceArea(inclusion=area.inclusion, radius=area.radius_m or 0.0)
    message.shape = FenceArea.POLYGON if area.radius_m is None else FenceArea.CIRCLE
    message.latitudes = [latitude_deg for latitude_deg, _ in area.points_deg]
    message.longitudes = [longitude_deg for _, longitude_deg in area.points_deg]
    return message


def rally_message(point: RallyPoint) -> RallyPointMessage:
    """Return a rally point as a message."""
    latitude_deg, longitude_deg = point.place_deg
    return RallyPointMessage(
        latitude=latitude_deg,
        longitude=longitude_deg,
        altitude=point.altitude_m,
        altitude_reference=_NUMBERS[point.reference],
    )
