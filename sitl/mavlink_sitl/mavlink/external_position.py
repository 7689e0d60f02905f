"""A position from outside: ODOMETRY, VISION_POSITION_ESTIMATE, and the origin that goes with it."""

from __future__ import annotations

import math
from collections.abc import Callable

from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.autopilot.state.estimator import ExternalEstimator
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.mavlink.codec import Message, dialect


def take_origin(vehicle: Commander, origin: GeoPoint) -> None:
    """Only an estimator without an origin takes one."""
    estimator = vehicle.estimator
    if isinstance(estimator, ExternalEstimator) and not estimator.origin_given:
        estimator.origin_given = True
        vehicle.navigator.move_origin(origin)


class ExternalPositionReceiver:
    """Takes what an ArduPilot takes (GCS_Common.cpp).

    Attributes:
        handlers: by the name of the message.
    """

    frames: frozenset[int] = frozenset({dialect.MAV_FRAME_LOCAL_FRD})
    """frame_id of ODOMETRY"""

    def __init__(self, vehicle: Commander) -> None:
        self._vehicle = vehicle
        self._reset_counter: int | None = None
        self.handlers: dict[str, Callable[[Message], None]] = {
            "ODOMETRY": self._on_odometry,
            "VISION_POSITION_ESTIMATE": self._take,
            "SET_GPS_GLOBAL_ORIGIN": self._on_origin,
        }

    def _on_odometry(self, message: Message) -> None:
        body = message.child_frame_id == dialect.MAV_FRAME_BODY_FRD
        if body and message.frame_id in self.frames:
            self._take(message)

    def _take(self, message: Message) -> None:
        place = (message.x, message.y, message.z)
        if not self._vehicle.estimator.is_external or not all(map(math.isfinite, place)):
            return
        before, self._reset_counter = self._reset_counter, message.reset_counter
        reset = before not in (None, message.reset_counter)
        self._vehicle.body.take_external_position(place, reset)

    def _on_origin(self, message: Message) -> None:
        latitude_deg, longitude_deg = message.latitude / 1e7, message.longitude / 1e7
        if abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0:
            take_origin(
                self._vehicle, GeoPoint(latitude_deg, longitude_deg, message.altitude / 1e3)
            )


class Px4ExternalPositionReceiver(ExternalPositionReceiver):
    """Takes what a PX4 takes (mavlink_receiver.cpp), in the frame that has a heading."""

    frames = frozenset({dialect.MAV_FRAME_LOCAL_NED})
