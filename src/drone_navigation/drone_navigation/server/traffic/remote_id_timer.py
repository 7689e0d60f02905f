"""Passes the Remote ID of the settings, and a moving operator, on to the vehicle; its state."""

from __future__ import annotations

import math

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import NavSatFix, NavSatStatus

from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.publishing.telemetry_messages import diagnostic_status
from drone_navigation.steady_timer import steady_timer
from mavlink_vehicle.protocols.streams.remote_id import OperatorFix, fix_fault

__all__ = ["RemoteIdTimer"]

_PERIOD_S = 1.0
# A transponder reports once a second.
_SILENT_S = 5.0
# Best effort, so that any publisher matches.
_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
# The same kind of warning is logged this often.
_AGAIN_S = 10.0


class RemoteIdTimer:
    """Sends the identity once a second, if there is one, and reports the transponder's state."""

    def __init__(self, access: BridgeAccess) -> None:
        """Start the timer."""
        self._driver, self._identity = access.driver, access.config.remote_id
        self._sender = access.bridge.vehicle.remote_id
        self._node, self._steady, self._warned_s = access.node, access.clock, -math.inf
        # Not the node's, which may be that of a simulation.
        self._clock = Clock(clock_type=ClockType.SYSTEM_TIME)
        access.topics.diagnostics.append(self._diagnostic)
        if not self._identity.is_empty:
            self._timer = steady_timer(access.node, _PERIOD_S, self._send)
            access.node.create_subscription(
                NavSatFix,
                "~/operator_position",
                self._hear,
                _QOS,
                callback_group=MutuallyExclusiveCallbackGroup(),
            )

    def _send(self) -> None:
        unix_s = 1e-9 * self._clock.now().nanoseconds
        self._driver.post(lambda: self._sender.offer(self._identity, unix_s))

    def _hear(self, message: NavSatFix) -> None:
        """Take where the operator is; what is no position is ignored with a warning."""
        now = self._steady.now()
        fault = fix_fault(message.latitude, message.longitude)
        if message.status.status == NavSatStatus.STATUS_NO_FIX:
            fault = "the receiver has no fix."
        if not fault:
            fix = OperatorFix(message.latitude, message.longitude, message.altitude, now)
            self._driver.post(lambda: self._take(fix))
        elif now - self._warned_s >= _AGAIN_S:
            self._warned_s = now
            self._node.get_logger().warning(f"A position of the operator is ignored: {fault}")

    def _take(self, fix: OperatorFix) -> None:
        self._sender.operator = fix

    def _diagnostic(self, name: str, hardware_id: str, now: float) -> DiagnosticStatus | None:
        """Return whether the transponder is ready; None without an identity and a transponder."""
        status = self._sender.status
        if status is None:
            if self._identity.is_empty:
                return None
            judged = DiagnosticStatus.STALE, "No transponder heard"
        elif now - status.heard_s > _SILENT_S:
            age_s = now - status.heard_s
            judged = DiagnosticStatus.STALE, f"The transponder has been silent for {age_s:.0f} s"
        elif status.fault:
            judged = DiagnosticStatus.ERROR, f"Not ready: {status.fault}"
        else:
            judged = DiagnosticStatus.OK, "Ready"
        fix = self._sender.operator
        if fix is not None and now - fix.heard_s > _SILENT_S:
            level, text = judged
            judged = (
                DiagnosticStatus.WARN if level == DiagnosticStatus.OK else level,
                f"{text}; the operator's position is {now - fix.heard_s:.0f} s old",
            )
        return diagnostic_status(f"{name}: Remote ID", hardware_id, judged)
