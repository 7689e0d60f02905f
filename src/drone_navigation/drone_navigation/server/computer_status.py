"""Timer that reads the status of this computer and passes it on to the vehicle."""

from __future__ import annotations

from pathlib import Path

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.steady_timer import steady_timer
from mavlink_vehicle.io.this_computer import ComputerReader

__all__ = ["ComputerStatusTimer"]

_PERIOD_S = 1.0


class ComputerStatusTimer:
    """Sends the status once a second, if that is enabled."""

    def __init__(self, access: BridgeAccess) -> None:
        """Start the timer."""
        config = access.config
        if not config.sends_computer_status:
            return
        self._driver, self._sender = access.driver, access.bridge.vehicle.computer_status
        folder = Path(config.record_tlog).parent if config.record_tlog else Path()
        self._reader = ComputerReader(folder)
        # A disk that does not answer holds up this timer alone.
        group = MutuallyExclusiveCallbackGroup()
        self._timer = steady_timer(access.node, _PERIOD_S, self._send, group)

    def _send(self) -> None:
        status = self._reader.read()
        self._driver.post(lambda: self._sender.offer(status))
