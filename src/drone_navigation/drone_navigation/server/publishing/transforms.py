"""The tree of frames of REP 105: earth, map, odom, base_link and the sensors.

`/tf` has what moves, with the time of the measurement. `/tf_static` is latched with depth 1, as
tf2 expects it: each message has all transforms of this vehicle that stand still.
"""

from __future__ import annotations

from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from drone_navigation.qos import LATCHED_QOS
from drone_navigation.server.frame_names import FRAME_EARTH, FrameNames
from drone_navigation.server.publishing.audience import Audience
from drone_navigation.server.publishing.publishing_node import Advertiser
from mavlink_vehicle.positions.earth import earth_position_m, enu_in_earth
from mavlink_vehicle.positions.frames import Geodetic, quaternion_from_euler
from mavlink_vehicle.state.reducer import VehicleState
from navigation_bridge.configuration.sensor_poses import SensorPose
from navigation_bridge.configuration.server_config import PublishTf
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_bridge.vehicle.odom_frame import OdomFrame, OdomPose

__all__ = ["Transforms", "geoid_height_m"]

_HERE: OdomPose = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
# The geoid's height is a difference of two numbers of a receiver, which change with its fixes.
_GEOID_STEP_M = 1.0


def geoid_height_m(state: VehicleState) -> float | None:
    """Return the height of mean sea level above the ellipsoid, as the GPS reports it."""
    gps = state.gps
    if gps is None or gps.altitude_ellipsoid_m is None or gps.altitude_amsl_m is None:
        return None
    return gps.altitude_ellipsoid_m - gps.altitude_amsl_m


class Transforms:
    """Publishes the tree of one vehicle; used by the driver thread only."""

    def __init__(self, node: Advertiser, frames: FrameNames, which: PublishTf) -> None:
        """Advertise the topics.

        Args:
            node: who publishes.
            frames: names of the vehicle's frames.
            which: of the transforms are published.
        """
        self._frames = frames
        self._which = which
        self._odom = OdomFrame()
        self._sensors: set[str] = set()
        self._geoid_m = 0.0
        self._origin: Geodetic | None = None
        self._still: dict[str, tuple[str, OdomPose]] = {}
        self._published: dict[str, tuple[str, OdomPose]] = {}
        self._followed = False
        self._moving = self._static = self._audience = None
        if which is not PublishTf.NONE:
            self._moving = node.create_publisher(TFMessage, "/tf", 100)
            self._audience = Audience(self._moving)
            self._static = node.create_publisher(TFMessage, "/tf_static", LATCHED_QOS)
            self._still[frames.gps] = (frames.base_link, _HERE)

    def begin_again(self) -> None:
        """Reset: the recording is played from its start."""
        self._odom = OdomFrame()
        self._published = {}

    def add_sensor(self, frame_id: str) -> None:
        """Take the frame that the messages of the sensor with a configured pose name.

        A frame without the prefix of one of several vehicles may be that of another vehicle too.
        """
        is_named = frame_id.startswith(self._frames.prefix) and frame_id != self._frames.prefix
        if self._which is PublishTf.ALL and is_named and not self._frames.is_own(frame_id):
            self._sensors.add(frame_id)

    def are_heard(self, now: float) -> bool:
        """Return whether anyone gets what `publish` publishes."""
        return self._audience is not None and self._audience.is_there(now)

    def are_followed(self, now: float) -> bool:
        """Return whether anyone gets or got it: `odom` stays continuous for who listens again."""
        self._followed = self._followed or self.are_heard(now)
        return self._followed

    def follow(self, pose: MapPose, state: VehicleState) -> None:
        """Follow the vehicle.

        Args:
            pose: attitude and position of one time.
            state: that it is of.
        """
        if self._moving is not None:
            self._odom.follow(pose, state)

    def publish(self, stamp: Time) -> None:
        """Publish where the vehicle was last followed to, at the time of that."""
        if self._moving is None:
            return
        odom, frames = self._odom, self._frames
        self._moving.publish(
            TFMessage(
                transforms=[
                    _transform(frames.map, frames.odom, odom.in_map, stamp),
                    _transform(frames.odom, frames.base_link, odom.base_link, stamp),
                ]
            )
        )

    def publish_still(
        self, origin: Geodetic | None, state: VehicleState, sensor: SensorPose, stamp: Time
    ) -> None:
        """Publish what stands still, if it has changed.

        Args:
            origin: of the map; None if unknown.
            state: with the GPS receiver's two altitudes.
            sensor: pose of the sensors on the vehicle; one at base_link itself is taken for one
                that nothing is known of.
            stamp: of the message.
        """
        if self._static is None:
            return
        self._place_map(origin, geoid_height_m(state))
        turn = quaternion_from_euler(sensor.roll_rad, sensor.pitch_rad, sensor.yaw_rad)
        for frame_id in self._sensors:
            self._still[frame_id] = (self._frames.base_link, (sensor.position_flu_m, turn))
            if sensor == SensorPose():
                del self._still[frame_id]
        if self._still != self._published:
            self._published = dict(self._still)
            transforms = [
                _transform(parent, child, pose, stamp)
                for child, (parent, pose) in self._still.items()
            ]
            self._static.publish(TFMessage(transforms=transforms))

    def _place_map(self, origin: Geodetic | None, geoid_m: float | None) -> None:
        if origin is None or geoid_m is None:
            return
        if origin == self._origin and abs(geoid_m - self._geoid_m) < _GEOID_STEP_M:
            return
        self._origin, self._geoid_m = origin, geoid_m
        latitude_deg, longitude_deg, altitude_amsl_m = origin
        place = earth_position_m(latitude_deg, longitude_deg, altitude_amsl_m + geoid_m)
        turn = enu_in_earth(latitude_deg, longitude_deg)
        self._still[self._frames.map] = (FRAME_EARTH, (place, turn))


def _transform(parent: str, child: str, pose: OdomPose, stamp: Time) -> TransformStamped:
    message = TransformStamped(child_frame_id=child)
    message.header.stamp, message.header.frame_id = stamp, parent
    translation, rotation = message.transform.translation, message.transform.rotation
    translation.x, translation.y, translation.z = pose[0]
    rotation.w, rotation.x, rotation.y, rotation.z = pose[1]
    return message
