"""Timer that passes the Remote ID of the settings on to the vehicle, and its state."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.clock import Clock, ClockType

from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.publishing.telemetry_messages import diagnostic_status
from drone_navigation.steady_timer import steady_timer

__all__ = ["RemoteIdTimer"]

_PERIOD_S = 1.0
# A transponder reports once a second.
_SILENT_S = 5.0


class RemoteIdTimer:
    """Sends the identity once a second, if there is one, and reports the transponder's state."""

    def __init__(self, access: BridgeAccess) -> None:
        """Start the timer."""
        self._driver, self._identity = access.driver, access.config.remote_id
        self._sender = access.bridge.vehicle.remote_id
        # Not the node's, which may be that of a simulation.
        self._clock = Clock(clock_type=ClockType.SYSTEM_TIME)
        access.topics.diagnostics.append(self._diagnostic)
        if not self._identity.is_empty:
            self._timer = steady_timer(access.node, _PERIOD_S, self._send)

    def _send(self) -> None:
        unix_s = 1e-9 * self._clock.now().nanoseconds
        self._driver.post(lambda: self._sender.offer(self._identity, unix_s))

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
        return diagnostic_status(f"{name}: Remote ID", hardware_id, judged)
