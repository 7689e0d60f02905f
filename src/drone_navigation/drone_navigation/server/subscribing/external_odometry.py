"""The topic of a position from outside: nav_msgs/Odometry for the autopilot's estimator."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.publishing.telemetry_messages import diagnostic_status
from drone_navigation.server.subscribing.sensor_topics import Newest
from mavlink_vehicle.positions.frames import enu_to_ned, quaternion_enu_flu_to_ned_frd
from mavlink_vehicle.protocols.streams.external_position import (
    FRESH_S,
    ExternalPose,
    ExternalPositionError,
)
from navigation_bridge.bridge import Bridge
from navigation_bridge.names import FRAME_BASE_LINK, FRAME_MAP
from navigation_bridge.requests.external_positions import ExternalPositions

__all__ = ["ExternalOdometry", "external_diagnostic", "external_pose"]

_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT
)
_AGAIN_S = 10.0


def external_pose(message: Odometry, age_s: float, now: float) -> ExternalPose:
    """Return an Odometry message in the autopilot's axes.

    Args:
        message: pose in `map` (ENU), twist in `base_link` (FLU), without a vehicle's prefix.
            Variances of 0 mean that they are unknown; a twist with unknown variance is not used.
        age_s: time since its stamp; NaN if it has none.
        now: time in seconds.

    Raises:
        ExternalPositionError: its frames are others, or it has no stamp.
    """
    frames = (message.header.frame_id, message.child_frame_id)
    if frames != (FRAME_MAP, FRAME_BASE_LINK):
        raise ExternalPositionError(
            f"External odometry is in the frames '{frames[0]}' and '{frames[1]}'; give "
            f"'{FRAME_MAP}' and '{FRAME_BASE_LINK}'."
        )
    if math.isnan(age_s):
        raise ExternalPositionError("External odometry has no stamp: the time of the measurement.")
    place, turn = message.pose.pose.position, message.pose.pose.orientation
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    pose_variance = _variances(message.pose.covariance)
    twist_variance = _variances(message.twist.covariance)
    if pose_variance is not None:
        # ENU to NED changes the order of the axes.
        x, y, z, roll, pitch, yaw = pose_variance
        pose_variance = (y, x, z, pitch, roll, yaw)
    known = twist_variance is not None
    return ExternalPose(
        measured_s=now - age_s,
        position_ned_m=enu_to_ned((place.x, place.y, place.z)),
        attitude=quaternion_enu_flu_to_ned_frd((turn.w, turn.x, turn.y, turn.z)),
        velocity_frd_m_s=(linear.x, -linear.y, -linear.z) if known else None,
        rates_frd_rad_s=(angular.x, -angular.y, -angular.z) if known else None,
        pose_variance=pose_variance,
        twist_variance=twist_variance,
    )


def _variances(covariance: Sequence[float]) -> tuple[float, ...] | None:
    """Return the diagonal; None if one of it is unknown."""
    diagonal = tuple(float(covariance[7 * index]) for index in range(6))
    return None if 0.0 in diagonal else diagonal


def external_diagnostic(
    bridge: Bridge, name: str, hardware_id: str, now: float
) -> DiagnosticStatus | None:
    """Return the state of the external poses; None while none are in use."""
    silent_s = bridge.vehicle.external_position.silent_s(now)
    if silent_s is None:
        return None
    judged = DiagnosticStatus.OK, "External poses received"
    if silent_s > FRESH_S:
        judged = DiagnosticStatus.WARN, f"No external pose for {silent_s:.1f} s"
    values = {"age": f"{silent_s:.1f} s"}
    return diagnostic_status(f"{name}: external position", hardware_id, judged, values)


class ExternalOdometry:
    """Subscribes to the configured topic and passes on what comes, newest first."""

    def __init__(self, access: BridgeAccess) -> None:
        """Subscribe if there is a topic."""
        topic = access.config.external_odometry_topic
        self._node, self._bridge, self._frames = access.node, access.bridge, access.frames
        self._clock = access.clock
        self._reported_s: dict[str, float] = {}
        self._newest: Newest[tuple[Odometry, float]] = Newest(access.driver.post, self._take)
        access.topics.diagnostics.append(partial(external_diagnostic, access.bridge))
        if topic:
            self._node.create_subscription(
                Odometry,
                topic,
                self._hear,
                _QOS,
                callback_group=MutuallyExclusiveCallbackGroup(),
            )

    def _hear(self, message: Odometry) -> None:
        stamp = message.header.stamp
        now = self._node.get_clock().now().nanoseconds / 1e9
        age_s = now - stamp.sec - stamp.nanosec / 1e9 if stamp.sec or stamp.nanosec else math.nan
        message.header.frame_id = self._frames.plain(message.header.frame_id)
        message.child_frame_id = self._frames.plain(message.child_frame_id)
        self._newest.put((message, self._clock.now() - age_s))

    def _take(self, heard: tuple[Odometry, float]) -> None:
        """Send it; on the driver's thread."""
        message, measured_s = heard
        now = self._clock.now()
        try:
            pose = external_pose(message, now - measured_s, now)
            self._bridge.feature(ExternalPositions).send(pose, now)
        except ExternalPositionError as error:
            kind = str(error)[:30]  # the rest may have a number that changes
            if now - self._reported_s.get(kind, -_AGAIN_S) >= _AGAIN_S:
                self._reported_s[kind] = now
                self._node.get_logger().warning(f"External odometry ignored: {error}")
