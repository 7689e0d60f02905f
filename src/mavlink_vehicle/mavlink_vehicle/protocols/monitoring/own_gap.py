"""Detects gaps in our own operation: the machine hung while the vehicle continued.

Meanwhile a PX4 takes the missing setpoints for a failure and leaves OFFBOARD, or a pilot takes the
vehicle over. A server that then continues with its old knowledge brings a PX4 back to OFFBOARD
with a single setpoint (observed). So after a gap nothing that commands may leave before a HEARTBEAT
has shown the mode again.

Messages that arrived during the gap are still in the buffers of this machine, and show the past. A
HEARTBEAT counts only when it was sent after the gap: when the vehicle's clock, its time since boot,
had advanced by more than the gap by then. Where no message has that clock, it counts when it
comes later than a buffer takes to be read.

It comes once a second by itself, and a moving vehicle would follow its last setpoint for that long.
So it is requested: ArduPilot and PX4 answer MAV_CMD_REQUEST_MESSAGE of HEARTBEAT within
milliseconds (measured on both).
"""

from __future__ import annotations

from collections.abc import Callable

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.protocols.operations.command import Address, CommandRequest
from mavlink_vehicle.protocols.service import SendingRank, VehicleService

_MARGIN_S = 0.1
_BUFFERED_S = 1.5
# By then the vehicle's clock has been seen to have advanced by more than the gap.
_ASK_AFTER_S, _ASK_EVERY_S = 0.15, 0.3
_REQUEST = CommandRequest(mavlink.MAV_CMD_REQUEST_MESSAGE, (mavlink.MAVLINK_MSG_ID_HEARTBEAT,))


class OwnGap(VehicleService):
    """Knows whether the mode has been seen since we last stood still.

    Attributes:
        is_open: whether the vehicle's mode has not been seen since a gap.
        ran: when we ran last, and the vehicle's newest time since boot then; who knows that it
            is not too long ago may set it instead of calling `notice`.
        safe_s: what is not too long ago in any case; 0 until that is known.
    """

    rank = SendingRank.MODE_QUESTION

    def __init__(self, address: Callable[[], Address]) -> None:
        """Begin without a gap; `address` returns source and target of a request."""
        super().__init__()
        self._address = address
        self.is_open = False
        self.ran: tuple[float, int | None] | None = None
        self.safe_s = 0.0
        self._before: tuple[float, int | None] = (0.0, None)
        self._noticed_s = 0.0

    def notice(self, now: float, boot_time_ms: int | None, longest_s: float) -> float | None:
        """Record that we run; return how long we have not, if that was too long.

        Args:
            now: time in seconds.
            boot_time_ms: the vehicle's newest time since boot, or None.
            longest_s: what is not too long.
        """
        ran, self.ran = self.ran, (now, boot_time_ms)
        if ran is None or now - ran[0] <= longest_s:
            return None
        if not self.is_open:
            self.is_open, self._before, self._noticed_s = True, ran, now
            self.deadline_s = now + _ASK_AFTER_S
        return now - ran[0]

    def _on_deadline(self, now: float) -> None:
        """Ask for a HEARTBEAT."""
        self.deadline_s = now + _ASK_EVERY_S
        self.outbox.append(_REQUEST.message(self._address(), 0))

    def see_mode(self, now: float, boot_time_ms: int | None) -> None:
        """Process a HEARTBEAT; `boot_time_ms` is the newest time since boot that came before it."""
        if not self.is_open:
            return
        before_s, before_ms = self._before
        current = False
        if boot_time_ms is not None and before_ms is not None:
            gone_s = (boot_time_ms - before_ms) * 1e-3
            # A restarted vehicle reports its mode again, too.
            current = gone_s < 0.0 or gone_s >= self._noticed_s - before_s + _MARGIN_S
        if current or now - self._noticed_s >= _BUFFERED_S:
            self.is_open, self.deadline_s = False, None
