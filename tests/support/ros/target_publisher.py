"""A target as ROS sees it: poses on a topic, in a frame of its own that stands in the map."""

from __future__ import annotations

from geometry_msgs.msg import PoseStamped, TransformStamped
from tf2_msgs.msg import TFMessage

from tests.support.ros.ros_flight import Flight

__all__ = ["TargetPublisher"]


class TargetPublisher:
    """Publishes poses on `/target` and transforms at 10 Hz, 2 m to the east of a place.

    Attributes:
        is_silent: whether it publishes nothing.
    """

    def __init__(self, flight: Flight, field_m: tuple[float, float]) -> None:
        """Begin.

        Args:
            flight: whose node publishes.
            field_m: east and north of the frame "field" in the map.
        """
        self._clock = flight.node.get_clock()
        self._field_m = field_m
        self._poses = flight.advertise(PoseStamped, "/target", 10)
        self._transforms = flight.advertise(TFMessage, "/tf", 10)
        self._timer = flight.node.create_timer(0.1, self._publish)
        self.is_silent = False

    def _publish(self) -> None:
        if self.is_silent:
            return
        stamp = self._clock.now().to_msg()
        pose = PoseStamped()
        pose.header.stamp, pose.header.frame_id = stamp, "field"
        pose.pose.position.x = 2.0
        self._poses.publish(pose)
        field = TransformStamped(child_frame_id="field")
        field.header.stamp, field.header.frame_id = stamp, "map"
        field.transform.translation.x, field.transform.translation.y = self._field_m
        tag = TransformStamped(child_frame_id="tag")
        tag.header.stamp, tag.header.frame_id = stamp, "field"
        tag.transform.translation.x = 2.0
        self._transforms.publish(TFMessage(transforms=[field, tag]))
