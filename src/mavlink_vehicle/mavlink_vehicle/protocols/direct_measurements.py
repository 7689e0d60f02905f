"""Takes measurements of the vehicle straight into its state, as nothing else comes so often.

The messages of `state.measurements.MEASUREMENTS` go from the bytes of their frames, or from message
objects, into the state, and no other part is asked. Anything that is not plain is left to
`VehicleCore.receive`: a time since boot that is older or of another clock, the first message after
a silence, ours or the vehicle's, another landed state, and what a pending operation waits for. A
TIMESYNC that answers somebody else is taken the same way, as a sign of life.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from mavlink_vehicle.codec import PAYLOAD_START, Intake, Message, mavlink
from mavlink_vehicle.protocols.known_vehicle import ModeOrder
from mavlink_vehicle.protocols.message_rates import MessageRates
from mavlink_vehicle.protocols.monitoring.heartbeat import HeartbeatWatch
from mavlink_vehicle.protocols.monitoring.own_gap import OwnGap
from mavlink_vehicle.protocols.monitoring.timesync import Timesync
from mavlink_vehicle.protocols.operation_slot import OperationSlot
from mavlink_vehicle.protocols.streams.setpoint_stream import STREAM_GAP_S, StreamGap
from mavlink_vehicle.state.measurements import MEASUREMENTS, Measurement, Values, measurement
from mavlink_vehicle.state.vehicle_state import LiveState

_SEQUENCE = 4
_Take: TypeAlias = Callable[[Values, int, float], bool]
"""Takes the fields of a message with its sequence number, at a time in seconds."""


class DirectMeasurements:
    """The measurements of one vehicle, as it is known by its HEARTBEAT.

    Attributes:
        intakes: takes them from their frames, by message number.
    """

    def __init__(
        self,
        live: LiveState,
        order: ModeOrder,
        rates: MessageRates,
        own_gap: OwnGap,
        gap: StreamGap,
        heartbeats: HeartbeatWatch,
        operations: OperationSlot,
        timesync: Timesync,
    ) -> None:
        """Work on the parts of one vehicle."""
        self._live = live
        self._order = order
        self._rates = rates
        self._own_gap = own_gap
        self._gap = gap
        self._heartbeats = heartbeats
        self._operations = operations
        self._takes: dict[type[Message], tuple[Callable[[Message], Values], _Take]] = {}
        self.intakes: dict[int, Intake] = {}
        answers = measurement(mavlink.MAVLink_timesync_message, timesync.changes)
        measurements = {**MEASUREMENTS, mavlink.MAVLink_timesync_message: answers}
        for kind, taken in measurements.items():
            take = self._taker(taken)
            self._takes[kind] = (taken.values, take)
            self.intakes[taken.number] = _intake(taken, take)

    def take(self, message: Message, now: float) -> bool:
        """Take a message of the vehicle; False: it must be received like any other."""
        found = self._takes.get(message.__class__)
        if found is None:
            return False
        values, take = found
        return take(values(message), message._header.seq, now)

    def _taker(self, measurement: Measurement) -> _Take:
        """Return what takes a kind of measurement.

        It is a closure, as it runs for most messages: attributes would cost a tenth (measured).
        """
        number, time_index, changes_of = (
            measurement.number, measurement.time_index, measurement.changes
        )  # fmt: skip
        live, own_gap, gap, heartbeats = self._live, self._own_gap, self._gap, self._heartbeats
        operations, place, count = self._operations, self._order.place, self._rates.count

        def take(values: Values, sequence: int, now: float) -> bool:
            ran = own_gap.ran
            if (
                ran is None
                or now - ran[0] > own_gap.safe_s
                or now - gap.heard_s > STREAM_GAP_S
                or operations.pending is not None
            ):
                return False
            time_boot_ms = None if time_index < 0 else values[time_index]
            if time_boot_ms is not None and not live.is_next(time_boot_ms):
                return False
            changes = changes_of(live.known, now, values)
            if changes is None:
                return False
            own_gap.ran = (now, live.boot_time_ms)
            gap.heard_s = heartbeats.heard_s = now
            place(sequence, now)
            count(number)
            if time_boot_ms is not None:
                live.measure(changes, time_boot_ms, now)
            return True

        return take


def _intake(measurement: Measurement, take: _Take) -> Intake:
    unpack = measurement.unpack

    def take_frame(data: bytes, now: float) -> bool:
        return take(unpack(data, PAYLOAD_START), data[_SEQUENCE], now)

    return take_frame
