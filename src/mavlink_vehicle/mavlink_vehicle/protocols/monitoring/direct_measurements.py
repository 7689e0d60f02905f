"""Takes measurements of the vehicle straight from their frames, as nothing else comes so often.

The messages of `state.reducer.MEASUREMENTS`, and EXTENDED_SYS_STATE while it says the same, go from
the bytes into the state without a message object, and no other part is asked. Anything that is not
plain is left to `VehicleCore.receive`: a value that is not a number, a time since boot that is
older or of another clock, the first message after a silence, ours or the vehicle's, and what a
pending operation waits for.
"""

from __future__ import annotations

from collections.abc import Callable

from mavlink_vehicle.codec import PAYLOAD_START, Intake, mavlink
from mavlink_vehicle.protocols.message_rates import MessageRates
from mavlink_vehicle.protocols.monitoring.heartbeat import HeartbeatWatch
from mavlink_vehicle.protocols.monitoring.own_gap import OwnGap
from mavlink_vehicle.protocols.monitoring.stream_gap import STREAM_GAP_S, StreamGap
from mavlink_vehicle.protocols.sequence import ModeOrder
from mavlink_vehicle.state.live_state import LiveState
from mavlink_vehicle.state.measurements import attitude, global_position, local_position
from mavlink_vehicle.state.restarts import REORDER_LIMIT_MS
from mavlink_vehicle.state.vehicle_state import is_on_ground

_GLOBAL_POSITION = mavlink.MAVLink_global_position_int_message
_LOCAL_POSITION = mavlink.MAVLink_local_position_ned_message
_ATTITUDE = mavlink.MAVLink_attitude_message
_SYSTEM_TIME = mavlink.MAVLink_system_time_message
_EXTENDED_SYS_STATE = mavlink.MAVLink_extended_sys_state_message
_read_global_position = _GLOBAL_POSITION.unpacker.unpack_from
_read_local_position = _LOCAL_POSITION.unpacker.unpack_from
_read_attitude = _ATTITUDE.unpacker.unpack_from
_read_system_time = _SYSTEM_TIME.unpacker.unpack_from
_LANDED_STATE = PAYLOAD_START + _EXTENDED_SYS_STATE.ordered_fieldnames.index("landed_state")
_SEQUENCE = 4


class DirectMeasurements:
    """The measurements of one vehicle, as it is known by its HEARTBEAT.

    Attributes:
        intakes: what takes them, by message number.
    """

    def __init__(
        self,
        live: LiveState,
        order: ModeOrder,
        rates: MessageRates,
        own_gap: OwnGap,
        gap: StreamGap,
        watch: HeartbeatWatch,
        is_busy: Callable[[], bool],
    ) -> None:
        """Work on the parts of one vehicle; with `is_busy` an operation waits for its state."""
        self._live = live
        self._order = order
        self._rates = rates
        self._own_gap = own_gap
        self._gap = gap
        self._watch = watch
        self._is_busy = is_busy
        self.intakes: dict[int, Intake] = {
            _GLOBAL_POSITION.id: self._take_global_position,
            _LOCAL_POSITION.id: self._take_local_position,
            _ATTITUDE.id: self._take_attitude,
            _SYSTEM_TIME.id: self._take_system_time,
            _EXTENDED_SYS_STATE.id: self._take_extended_sys_state,
        }

    def _take_global_position(self, data: bytes, now: float) -> bool:
        values = _read_global_position(data, PAYLOAD_START)
        live, time_boot_ms = self._live, values[0]
        if not self._is_plain(time_boot_ms, now):
            return False
        self._count(_GLOBAL_POSITION.id, data, now)
        position = global_position(now, *values)
        live.measure("global_position", position, time_boot_ms, now)
        if position is not None and is_on_ground(live.known):
            live.measured["ground_altitude_amsl_m"] = position.altitude_amsl_m
        return True

    def _take_local_position(self, data: bytes, now: float) -> bool:
        values = _read_local_position(data, PAYLOAD_START)
        live, time_boot_ms = self._live, values[0]
        position = local_position(now, *values)
        if position is None or not self._is_plain(time_boot_ms, now):
            return False
        self._count(_LOCAL_POSITION.id, data, now)
        live.measure("local_position", position, time_boot_ms, now)
        if is_on_ground(live.known):
            live.measured["ground_down_m"] = position.position_ned_m[2]
        return True

    def _take_attitude(self, data: bytes, now: float) -> bool:
        values = _read_attitude(data, PAYLOAD_START)
        turned = attitude(now, *values)
        if turned is None or not self._is_plain(values[0], now):
            return False
        self._count(_ATTITUDE.id, data, now)
        self._live.measure("attitude", turned, values[0], now)
        return True

    def _take_system_time(self, data: bytes, now: float) -> bool:
        _, time_boot_ms = _read_system_time(data, PAYLOAD_START)
        if not self._is_plain(time_boot_ms, now):
            return False
        self._count(_SYSTEM_TIME.id, data, now)
        self._live.tell_time(time_boot_ms, now)
        return True

    def _take_extended_sys_state(self, data: bytes, now: float) -> bool:
        live = self._live
        if data[_LANDED_STATE] != live.known.landed_state or not self._is_plain(None, now):
            return False
        self._count(_EXTENDED_SYS_STATE.id, data, now)
        return True

    def _is_plain(self, time_boot_ms: int | None, now: float) -> bool:
        """Return whether a message is nothing but a measurement, and comes when it should."""
        live, ran = self._live, self._own_gap.ran
        newest_ms = live.boot_time_ms
        return (
            (
                time_boot_ms is None
                or (
                    newest_ms is not None
                    and newest_ms <= time_boot_ms <= newest_ms + REORDER_LIMIT_MS
                    and live.known.restart_signs.doubt is None
                )
            )
            and ran is not None
            and now - ran[0] <= self._own_gap.safe_s
            and now - self._gap.heard_s <= STREAM_GAP_S
            and not self._is_busy()
        )

    def _count(self, number: int, data: bytes, now: float) -> None:
        """Do what is done for every message of the vehicle."""
        self._own_gap.ran = (now, self._live.boot_time_ms)
        self._gap.heard_s = self._watch.heard_s = now
        self._order.place(data[_SEQUENCE], now)
        self._rates.count(number)
