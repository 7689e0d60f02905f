"""Poses from outside, such as a camera's, for the autopilot's estimator. No ROS."""

from __future__ import annotations

from mavlink_vehicle.events import ExternalPosesResumed, ExternalPosesStopped, VehicleEvent
from mavlink_vehicle.protocols.streams.external_position import ExternalPose, ExternalPositionError
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.requests.feature import Feature
from navigation_core.outcomes import OutcomeCode, Rejection

__all__ = ["ExternalPositions"]

# Beyond what a fast vehicle moves between the two.
_OFF_M = 3.0


class ExternalPositions(Feature):
    """Sends poses to the vehicle, and watches whether it uses them."""

    def send(self, pose: ExternalPose, now: float) -> None:
        """Send a pose to the autopilot's estimator.

        Args:
            pose: of the vehicle, in the local frame.
            now: time in seconds.

        Raises:
            ExternalPositionError: it is not sent, and why.
        """
        if self.parts.unreached:
            raise ExternalPositionError(self.parts.unreached)
        vehicle = self.parts.vehicle
        vehicle.external_position.offer(pose, vehicle.state, now)

    def objection(self, now: float) -> Rejection | None:
        """Return that the vehicle is elsewhere by its own estimate."""
        off_m = self.parts.vehicle.external_position.difference_m(
            self.parts.vehicle.state.local_position, now
        )
        if off_m is None or off_m <= _OFF_M:
            return None
        # A PX4 with EKF2_HGT_REF 3 counts these heights from sea level, not from the origin.
        text = (
            f"The vehicle's position is {off_m:.1f} m from that of external_odometry_topic; "
            "check the autopilot's origin, its altitude included, and its estimator."
        )
        return Rejection(OutcomeCode.UNHEALTHY, text)

    def take(self, event: VehicleEvent) -> bool:
        """Log that poses stop or come again."""
        if isinstance(event, ExternalPosesStopped):
            text = (
                f"No external pose for {event.silent_s:.1f} s; a vehicle without GPS loses its "
                "position. Check the source of external_odometry_topic"
            )
            self.parts.report.log(LogLevel.WARN, text)
        elif isinstance(event, ExternalPosesResumed):
            text = f"External poses again, after {event.silent_s:.1f} s"
            self.parts.report.log(LogLevel.INFO, text)
        else:
            return False
        return True
