"""The samples of the target that a goal follows, and where they come from. No ROS."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.positions.frames import ned_to_enu, yaw_ned_to_enu, yaw_of_quaternion
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.goals.requests import TargetSource
from navigation_bridge.requests.feature import Feature, FeatureParts
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode
from navigation_core.tasks.inputs.tracked_target import TargetFilter, TargetSample, TrackedTarget

__all__ = ["FollowedTarget"]

# Least time between two log lines about samples that are rejected.
_LOG_PERIOD_S = 5.0
_FOLLOW_TARGET = mavlink.MAVLink_follow_target_message
_GLOBAL_POSITION = mavlink.MAVLink_global_position_int_message
# The bits of FOLLOW_TARGET.est_capabilities, which the vehicle's own firmwares set, too.
_HAS_VELOCITY, _HAS_ATTITUDE = 2, 8
_NO_HEADING = 65535


class FollowedTarget(Feature):
    """Filters the samples of one target.

    Attributes:
        on_source: called with the source when a goal begins to follow one, and with None when it
            has ended.
    """

    hears: ClassVar[frozenset[str]] = frozenset({"FOLLOW_TARGET", "GLOBAL_POSITION_INT"})
    # QGroundControl sends its own position. Other positions on its link may be of other vehicles.
    overhears: ClassVar[frozenset[str]] = frozenset({"FOLLOW_TARGET"})

    def __init__(self, parts: FeatureParts) -> None:
        """Begin without a target."""
        super().__init__(parts)
        self.on_source: Callable[[TargetSource | None], None] = lambda _source: None
        self._goal_id = ""
        self._source: TargetSource | None = None
        self._filter = TargetFilter()
        self._stamp_ms = -1
        self._logged_s = -math.inf

    @property
    def source(self) -> TargetSource | None:
        """The source of the target that is followed now."""
        return self._source

    @property
    def followed(self) -> TrackedTarget | None:
        """The target; None while none is followed."""
        return None if self._source is None else self._filter.tracked

    def goal_began(self) -> None:
        """Listen to the source of the active goal, if it has one."""
        goal = self.parts.goals().active
        if goal is None or goal.followed is None:
            return
        self._goal_id, self._source = goal.goal_id, goal.followed
        self._filter, self._stamp_ms = TargetFilter(), -1
        self.on_source(goal.followed)

    def goal_ended(self, goal: ActiveGoal, code: OutcomeCode) -> None:
        """Listen no more."""
        if self._source is not None and goal.goal_id == self._goal_id:
            self._source = None
            self.on_source(None)

    def offer(self, source: TargetSource, sample: TargetSample | str, now: float) -> None:
        """Process a sample.

        Args:
            source: where it comes from; a sample of another source than the goal's is ignored.
            sample: the sample, or why it cannot be used, as a sentence.
            now: when it was received.
        """
        if source != self._source:
            return
        pose = self.parts.map_frame.pose(self.parts.vehicle.live.get())
        if pose is None:
            return
        if isinstance(sample, str):
            fault = self._filter.reject(sample)
        else:
            fault = self._filter.take(sample, pose.position_enu_m, now)
        if fault and now - self._logged_s >= _LOG_PERIOD_S:
            self._logged_s = now
            self.parts.report.log(LogLevel.WARN, f"A sample of the target was rejected: {fault}")

    def hear(self, message: Message, now: float) -> None:
        """Process a position of another system, if it is the target."""
        source = self._source
        if source is None or message.get_srcSystem() != source.system_id:
            return
        if isinstance(message, _FOLLOW_TARGET):
            self._take(source, message.timestamp, self._of_follow_target(message, now), now)
        elif isinstance(message, _GLOBAL_POSITION):
            self._take(source, message.time_boot_ms, self._of_global_position(message, now), now)

    def _take(self, source: TargetSource, stamp_ms: int, sample: TargetSample, now: float) -> None:
        """Process a sample of MAVLink, whose stamp counts from the start of its sender."""
        if stamp_ms == self._stamp_ms:
            self.offer(source, "Its stamp is that of the sample before.", now)
            return
        self._stamp_ms = stamp_ms
        self.offer(source, sample, now)

    def _of_follow_target(
        self, message: mavlink.MAVLink_follow_target_message, now: float
    ) -> TargetSample:
        velocity = yaw = None
        if message.est_capabilities & _HAS_VELOCITY:
            north, east, down = message.vel
            velocity = ned_to_enu((north, east, down))
        if message.est_capabilities & _HAS_ATTITUDE:
            w, x, y, z = message.attitude_q
            yaw = yaw_ned_to_enu(yaw_of_quaternion((w, x, y, z)))
        place = self._place(message.lat, message.lon, message.alt)
        return TargetSample(now, place, velocity, yaw)

    def _of_global_position(
        self, message: mavlink.MAVLink_global_position_int_message, now: float
    ) -> TargetSample:
        velocity = ned_to_enu((0.01 * message.vx, 0.01 * message.vy, 0.01 * message.vz))
        yaw = None
        if message.hdg != _NO_HEADING:
            yaw = yaw_ned_to_enu(math.radians(0.01 * message.hdg))
        place = self._place(message.lat, message.lon, 1e-3 * message.alt)
        return TargetSample(now, place, velocity, yaw)

    def _place(self, latitude_e7: int, longitude_e7: int, altitude_amsl_m: float) -> Vector3:
        """Return a position in the map frame; not finite while that has no origin."""
        frame = self.parts.map_frame
        if frame.origin is None or not math.isfinite(altitude_amsl_m):
            return (math.nan, math.nan, math.nan)
        return frame.enu((1e-7 * latitude_e7, 1e-7 * longitude_e7, altitude_amsl_m))
