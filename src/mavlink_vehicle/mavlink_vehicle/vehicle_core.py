"""One autopilot: its protocols combined, without I/O or a clock.

`VehicleCore` gets what arrives (`receive`) and the time (`handle_timer`), and returns what to send,
what happened and when it wants to be called again. `vehicle.Vehicle` adds the requests that it
accepts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from mavlink_vehicle.codec import Intake, Message, mavlink, with_source
from mavlink_vehicle.drag import Drag
from mavlink_vehicle.events import StoodStill, VehicleEvent
from mavlink_vehicle.protocols.consequences import Consequences
from mavlink_vehicle.protocols.direct_measurements import DirectMeasurements
from mavlink_vehicle.protocols.equipment.equipment_commands import EquipmentCommands
from mavlink_vehicle.protocols.equipment.payload_reports import PayloadReports
from mavlink_vehicle.protocols.job_slot import ListJobs, ParameterJobs
from mavlink_vehicle.protocols.known_vehicle import KnownVehicle, ModeOrder
from mavlink_vehicle.protocols.logs.log_transfer import LogTransfer
from mavlink_vehicle.protocols.message_rates import MessageRates
from mavlink_vehicle.protocols.message_requests import MessageRequests
from mavlink_vehicle.protocols.mission.mission_operation import MissionOperation
from mavlink_vehicle.protocols.mission.stored_lists import StoredLists
from mavlink_vehicle.protocols.mission.transfer import TransferTiming
from mavlink_vehicle.protocols.monitoring.answer_watch import AnswerWatch
from mavlink_vehicle.protocols.monitoring.failsafe_watch import FailsafeWatch
from mavlink_vehicle.protocols.monitoring.heartbeat import HeartbeatSender, HeartbeatWatch
from mavlink_vehicle.protocols.monitoring.own_gap import OwnGap
from mavlink_vehicle.protocols.monitoring.timesync import Timesync
from mavlink_vehicle.protocols.monitoring.twin_watch import TwinWatch
from mavlink_vehicle.protocols.operation_slot import OperationSlot
from mavlink_vehicle.protocols.operations.command import CommandTiming
from mavlink_vehicle.protocols.parameters import ParameterReader
from mavlink_vehicle.protocols.service import Services, VehicleService
from mavlink_vehicle.protocols.stations.station_observer import StationObserver
from mavlink_vehicle.protocols.streams.computer_status import ComputerStatusSender
from mavlink_vehicle.protocols.streams.external_position import ExternalPositionSender
from mavlink_vehicle.protocols.streams.landing_target import LandingTargetSender
from mavlink_vehicle.protocols.streams.range_sensors import RangeSensors
from mavlink_vehicle.protocols.streams.remote_id import RemoteIdSender
from mavlink_vehicle.protocols.streams.rtcm import RtcmSender
from mavlink_vehicle.protocols.streams.setpoint_stream import (
    STREAM_GAP_S,
    SetpointStream,
    StreamGap,
    after_gap,
)
from mavlink_vehicle.state.measurements import MEASUREMENTS
from mavlink_vehicle.state.reducer import reduce
from mavlink_vehicle.state.status_reducers import with_late_beat
from mavlink_vehicle.state.vehicle_state import DataAge, VehicleState, evolve
from mavlink_vehicle.vehicle_config import VehicleConfig

_WANTED_ONCE = ("AUTOPILOT_VERSION", "HOME_POSITION", "GPS_GLOBAL_ORIGIN")
_HEARTBEAT = mavlink.MAVLink_heartbeat_message
_COMMAND_ACK = mavlink.MAVLink_command_ack_message
_CURRENT_MODE = mavlink.MAVLink_current_mode_message
# Messages that can make no event but by their time since boot: most of the work is not for them.
_TELEMETRY = frozenset({*MEASUREMENTS, mavlink.MAVLink_gps_raw_int_message}) - {
    mavlink.MAVLink_extended_sys_state_message
}
# Without setpoints our HEARTBEAT is what we run for, at least.
_LATE_S = 0.25
# A stream that is a little shorter than what the firmware allows may be too long on its side.
_STREAM_SHARE = 0.9
_MODE_FIELDS = ("custom_mode", "intended_mode")
_SETPOINTS = frozenset(
    {
        mavlink.MAVLink_set_position_target_local_ned_message,
        mavlink.MAVLink_set_position_target_global_int_message,
    }
)


class VehicleCore(KnownVehicle):
    """One autopilot as far as it is listened to; sans I/O.

    Attributes:
        heartbeats: its HEARTBEAT, and whether that is fresh (`alive`).
        twins: whether another autopilot with its ids is heard, too.
        own_gap: whether its mode has been seen since we stood still.
        setpoints: whether they may be sent, and their counters.
        operations: the operation in progress.
        rates: the telemetry that it is asked for, and which it rejects.
        timesync: the round trip of a message.
        data_age: how old a sample is by the vehicle's clock.
        answers: whether it still answers.
        parameters: its parameters that are read all the time, and others when asked for.
        stored_lists: its mission, its fence and its rally points, as it stores them.
        stations: other stations that talk to it, and changes of our mission.
        range_sensors: the reader of range sensors, with its counts.
        logs: transfers of its own logs.
        rtcm: corrections for its GNSS receiver.
        external_position, landing_target: poses from outside, of the vehicle and of its target.
        computer_status, remote_id: the status of this computer for it, and its Remote ID.
        equipment: commands for cameras, gimbals, grippers and outputs.
        payload: what gimbal and camera report.
        list_jobs, parameter_jobs: transfers, which `Vehicle.storage` begins.
        services: all of them.
    """

    def __init__(
        self, config: VehicleConfig | None = None, further: Iterable[VehicleService] = ()
    ) -> None:
        """Prepare; nothing happens before `start`. `further` services run beside those of here."""
        config = config or VehicleConfig()
        super().__init__(config)
        timing = CommandTiming(config.command_timeout_s, config.command_retries)
        self._order, self._gap, self._drag = ModeOrder(), StreamGap(), Drag()
        self.data_age = DataAge()
        self.heartbeats, self.twins = HeartbeatWatch(config.heartbeat_timeout_s), TwinWatch()
        self.own_gap = OwnGap(lambda: self.address)
        self.setpoints = SetpointStream()
        self.rates = MessageRates(config.message_rates_hz, timing, config.optional_rates_hz)
        self.timesync = Timesync(config.timesync_interval_s, self._clock_answered)
        self.answers = AnswerWatch(
            self.timesync, lambda: self.address, lambda: self._gap.heard_s, self._order
        )
        self.parameters, self.parameter_jobs = ParameterReader(), ParameterJobs()
        self.stored_lists = StoredLists(
            TransferTiming(config.mission_timeout_s, config.mission_retries),
            lambda: not self.transfers_mission,
        )
        self.list_jobs = ListJobs()
        self.operations = OperationSlot(
            self, self.heartbeats, timing, requested=self.notice, done=self.collect
        )
        self._failsafes = FailsafeWatch()
        self.stations = StationObserver(
            lambda: self.address, lambda: self.profile, lambda: self._order.last
        )
        self.range_sensors = RangeSensors()
        self.logs = LogTransfer(lambda: self.address, config.log_means)
        self.rtcm = RtcmSender()
        self.external_position = ExternalPositionSender(config.external_origin)
        self.landing_target = LandingTargetSender()
        self.computer_status, self.remote_id = ComputerStatusSender(), RemoteIdSender()
        self.equipment = EquipmentCommands(lambda: self.address if self.profile else None, timing)
        self.payload = PayloadReports()
        self._direct = DirectMeasurements(
            self.live,
            self._order,
            self.rates,
            self.own_gap,
            self._gap,
            self.heartbeats,
            self.operations,
            self.timesync,
        )
        # In the order of their timers and events; a stream is closed before its operation ends.
        self.services = Services(
            (
                self.own_gap,
                self.setpoints,
                HeartbeatSender(config.heartbeat_interval_s, config.heartbeat_type),
                self.heartbeats,
                self.twins,
                self.rates,
                MessageRequests(_WANTED_ONCE, lambda: self.state.position_valid),
                self.timesync,
                self.answers,
                self.parameters,
                self.parameter_jobs,
                self.stored_lists,
                self.list_jobs,
                self.operations,
                self._failsafes,
                self.stations,
                self.range_sensors,
                self.logs,
                self.rtcm,
                self.external_position,
                self.landing_target,
                self.computer_status,
                self.remote_id,
                self.equipment,
                self.payload,
                *further,
            )
        )
        self._consequences = Consequences(
            self,
            self.services,
            heartbeats=self.heartbeats,
            own_gap=self.own_gap,
            setpoints=self.setpoints,
            operations=self.operations,
            stored_lists=self.stored_lists,
            stations=self.stations,
        )

    @property
    def transfers_mission(self) -> bool:
        """Whether an operation on the mission, the fence or the rally points is under way."""
        is_mission = isinstance(self.operations.pending, MissionOperation)
        return is_mission or self.list_jobs.pending is not None

    # The six methods

    def start(self, now: float) -> None:
        """Begin to send HEARTBEAT and to listen."""
        self.services.start(now)

    def intakes(self, system: int, component: int) -> dict[int, Intake]:
        """Return what takes measurements of a sender straight from their frames, by number.

        None of them if the sender is not this vehicle's autopilot, or not known yet. A measurement
        taken this way changes nothing but the state, is no answer, and makes no event.
        """
        state = self.live.known
        ours = (state.system_id, state.component_id) == (system, component)
        # Of a sender that another one may replace nothing is taken past `receive`.
        is_sure = ours and self.stays and self.profile is not None
        return dict(self._direct.intakes) if is_sure else {}

    def receive(self, message: Message, now: float) -> None:
        """Process one message, whoever sent it."""
        if self.profile is not None and self.is_sender(message) and self._direct.take(message, now):
            return
        self.notice(now)
        if self._is_from_vehicle(message, now):
            self._receive_vehicle(message, now)
        else:
            self._hear_another(message, now)

    def states_around(self, message: Message, now: float) -> tuple[VehicleState, VehicleState]:
        """Process one message; return the state before and after it."""
        before = self.live.get()
        self.receive(message, now)
        return before, self.live.get()

    def _receive_vehicle(self, message: Message, now: float) -> None:
        """Process a message of the vehicle."""
        kind, is_heartbeat = message.__class__, isinstance(message, _HEARTBEAT)
        shows_mode = is_heartbeat or kind is _CURRENT_MODE
        before = self.state = self._gap.heard(self.state, self.profile, shows_mode, now)
        kept = self._follow_order(message, now)
        if kept is None:
            self.state = with_late_beat(before, message)
            return
        if isinstance(message, _COMMAND_ACK) and not self.answers_us(message):
            self.stations.receive(message, now)
            return
        state = reduce(before, message, now)
        if state.system_id == 0:
            return
        if kept:
            state = evolve(state, {name: getattr(before, name) for name in kept})
        self.services.receive(message, now)
        self.stored_lists.refresh_taken(message, now)
        if state is before:
            return
        self.state = state
        if is_heartbeat:
            self._consequences.heartbeat(message, now)
        # A measurement can show an event only by its time since boot.
        if kind not in _TELEMETRY or state.boot_count != before.boot_count:
            self._consequences.state_changed(before, is_heartbeat, now)
        if self.operations.pending is not None:
            self.operations.observe(self.state, self.heartbeats.alive, now)
            self.collect(now)

    def _is_from_vehicle(self, message: Message, now: float) -> bool:
        """Return whether it is the vehicle's.

        The first HEARTBEAT is that of a vehicle of any kind. One that is better known replaces it
        while nothing flies, also from the same ids, as does another kind there after its end.
        """
        if not isinstance(message, _HEARTBEAT):
            return self.is_sender(message)
        system_id, state = message._header.srcSystem, self.live.known
        flies = state.armed and self.heartbeats.alive
        if self.is_replaced_by(message, now) and not flies and self.operations.pending is None:
            self._replace_by(system_id, now)
            return True
        if self.is_other_kind(message):
            self.twins.hear_other(message, now)
            return False
        return self.rank_of(message) >= max(self.rank, 1) and state.system_id in (0, system_id)

    def _replace_by(self, system_id: int, now: float) -> None:
        """Forget the vehicle that was found first, for a better one."""
        self.services.vehicle_gone("another vehicle was found", now)
        self.timesync.pause()
        self._order.begin_again()
        self._failsafes.observe(None, now)
        self.services.take_events(self._failsafes, now)
        self.become(system_id)

    def _follow_order(self, message: Message, now: float) -> tuple[str, ...] | None:
        """Return what the state knows from newer messages than this one; None: all it says."""
        if self.profile is None:
            return ()
        self.heartbeats.heard_s = now
        kind, place = message.__class__, message._header.seq
        is_old = self._order.follow(place, kind is _HEARTBEAT, kind is _CURRENT_MODE, now)
        return None if is_old is None else (_MODE_FIELDS if is_old else ())

    def _hear_another(self, message: Message, now: float) -> None:
        """Take what sensors say that hang on a computer beside the autopilot, and its setpoints."""
        if message.__class__ in _SETPOINTS:
            self.note_setpoint(now)
        if message._header.srcSystem == self.live.known.system_id != 0:
            self.services.receive(message, now, of_companion=True)
        self.overhear(message, now)

    def overhear(self, message: Message, now: float) -> None:
        """Process what a ground station sends to the vehicle, and nothing else.

        It is never taken for the vehicle's word. Its effect on the vehicle is reported as
        `StationActed`.
        """
        self.services.overhear(message, now)
        self.services.take_events(self.stations, now)

    def next_deadline(self) -> float | None:
        """Return when `handle_timer` wants to be called."""
        return self.services.next_deadline()

    def handle_timer(self, now: float) -> None:
        """Do what is due."""
        self.notice(now)
        self.services.handle_timer(now)

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent, with our ids in it."""
        messages = self.services.messages_to_send(may_command=not self.own_gap.is_open)
        if messages:
            address = self.address
            for message in messages:
                with_source(message, address.source_system, address.source_component)
        return messages

    def next_event(self) -> VehicleEvent | None:
        """Return and remove the next event."""
        return self.services.next_event()

    # For the requests

    def collect(self, now: float) -> None:
        """Take the events of all services."""
        self.services.collect(now)

    def note_setpoint(self, now: float) -> None:
        """Record that a setpoint goes out, ours or another computer's."""
        gap_s = self._gap.sent(now)
        if gap_s > STREAM_GAP_S:
            self.state = after_gap(self.state, self.profile, gap_s, now)

    def notice(self, now: float) -> None:
        """Record that we run, and whether we did not for too long."""
        own_gap, boot_ms = self.own_gap, self.live.boot_time_ms
        ran = own_gap.ran
        if ran is not None and now - ran[0] <= own_gap.safe_s:
            own_gap.ran = (now, boot_ms)
            return
        if self.profile is None:
            return
        longest_s = self.config.heartbeat_interval_s + _LATE_S
        stream_s = _STREAM_SHARE * (self.profile.setpoints.lost_s or math.inf)
        own_gap.safe_s = min(longest_s, stream_s)
        gap_s = own_gap.notice(
            now, boot_ms, own_gap.safe_s if self.setpoints.is_open else longest_s
        )
        if gap_s is not None:
            self.heartbeats.excuse(gap_s)
            self.answers.excuse(now)
            self.operations.excuse(gap_s)
            self.services.report(StoodStill(gap_s))

    def _clock_answered(self, round_trip_s: float, vehicle_ns: int, now: float) -> None:
        state = self.state
        self.data_age.answered(round_trip_s, vehicle_ns, state.boot_time_ms, state.clock_count, now)
