"""One autopilot: its protocols combined, without I/O or a clock.

`VehicleCore` gets what arrives (`receive`) and the time (`handle_timer`), and returns what to send,
what happened and when it wants to be called again. `vehicle.Vehicle` adds the requests that it
accepts.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from mavlink_vehicle.codec import Intake, Message, mavlink, with_source
from mavlink_vehicle.drag import Drag
from mavlink_vehicle.events import (
    ArmedChanged,
    HeartbeatLost,
    HeartbeatRegained,
    LandedChanged,
    LandedState,
    ModeChanged,
    ModeOvertaken,
    OperationFinished,
    OperationResult,
    StationActed,
    StatusTextReceived,
    StoodStill,
    StoredListFinished,
    SystemStatusChanged,
    VehicleDiscovered,
    VehicleEvent,
    VehicleRebooted,
)
from mavlink_vehicle.mission_items import HOME_PLACEHOLDER, MissionItem, MissionType
from mavlink_vehicle.profiles import Profile, profile_for, vehicle_rank
from mavlink_vehicle.protocols.job_slot import ListJobs, ParameterJobs
from mavlink_vehicle.protocols.logs.log_transfer import LogTransfer
from mavlink_vehicle.protocols.message_rates import MessageRates
from mavlink_vehicle.protocols.message_requests import MessageRequests
from mavlink_vehicle.protocols.mission.mission_operation import (
    MissionJob,
    MissionOperation,
    MissionTiming,
)
from mavlink_vehicle.protocols.mission.stored_lists import StoredLists, lists_taken
from mavlink_vehicle.protocols.mission.transfer import TransferTiming
from mavlink_vehicle.protocols.monitoring.answer_watch import AnswerWatch
from mavlink_vehicle.protocols.monitoring.data_age import DataAge
from mavlink_vehicle.protocols.monitoring.direct_measurements import DirectMeasurements
from mavlink_vehicle.protocols.monitoring.failsafe_watch import FailsafeWatch
from mavlink_vehicle.protocols.monitoring.heartbeat import HeartbeatSender, HeartbeatWatch
from mavlink_vehicle.protocols.monitoring.own_gap import OwnGap
from mavlink_vehicle.protocols.monitoring.stream_gap import StreamGap
from mavlink_vehicle.protocols.monitoring.timesync import Timesync
from mavlink_vehicle.protocols.operation_slot import OperationSlot
from mavlink_vehicle.protocols.operations.command import Address, CommandTiming
from mavlink_vehicle.protocols.parameters import ParameterReader
from mavlink_vehicle.protocols.sequence import ModeOrder
from mavlink_vehicle.protocols.service import Conversation, VehicleService
from mavlink_vehicle.protocols.stations.station_observer import StationObserver
from mavlink_vehicle.protocols.streams.external_position import ExternalPose, ExternalPositionSender
from mavlink_vehicle.protocols.streams.range_sensors import RangeSensors
from mavlink_vehicle.protocols.streams.rtcm import RtcmSender
from mavlink_vehicle.protocols.streams.setpoint_stream import SetpointStream, StreamStatistics
from mavlink_vehicle.ranges import RangeReader
from mavlink_vehicle.state.live_state import LiveState
from mavlink_vehicle.state.measurements import MEASUREMENTS
from mavlink_vehicle.state.reducer import VehicleState, reduce
from mavlink_vehicle.state.restarts import evolve
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
_BEST_RANK = 3
_MODE_FIELDS = ("custom_mode", "intended_mode")
_SETPOINTS = frozenset(
    {
        mavlink.MAVLink_set_position_target_local_ned_message,
        mavlink.MAVLink_set_position_target_global_int_message,
    }
)


class VehicleCore:
    """One autopilot as far as it is listened to; sans I/O."""

    def __init__(
        self, config: VehicleConfig | None = None, further: Iterable[VehicleService] = ()
    ) -> None:
        """Prepare; nothing happens before `start`. `further` services run beside those of here."""
        self.config = config or VehicleConfig()
        self._live = LiveState(
            VehicleState(
                system_id=self.config.target_system, component_id=self.config.target_component
            )
        )
        self.profile: Profile | None = None
        self.command_timing = CommandTiming(
            self.config.command_timeout_s, self.config.command_retries
        )
        self._sender = HeartbeatSender(
            self.config.heartbeat_interval_s,
            # Until it is known who is there: a PX4 that has seen an onboard computer would say
            # that it is lost.
            mavlink.MAV_TYPE_GCS
            if self.config.heartbeat_type is None
            else self.config.heartbeat_type,
        )
        self._watch = HeartbeatWatch(self.config.heartbeat_timeout_s)
        self._rates = MessageRates(
            self.config.message_rates_hz, self.command_timing, self.config.optional_rates_hz
        )
        self._requests = MessageRequests(_WANTED_ONCE, lambda: self.state.position_valid)
        self._data_age = DataAge()
        self._timesync = Timesync(self.config.timesync_interval_s, self._clock_answered)
        self._parameters = ParameterReader()
        self._lists = StoredLists(
            TransferTiming(self.config.mission_timeout_s, self.config.mission_retries),
            lambda: not self.transfers_mission,
        )
        self.list_jobs = ListJobs()
        self.parameter_jobs = ParameterJobs()
        self._stream = SetpointStream()
        self._own_gap = OwnGap(lambda: self.address)
        self._drag = Drag()
        self._order = ModeOrder()
        self._gap = StreamGap()
        self._answers_by_name = False
        self._failsafes = FailsafeWatch()
        self.slot = OperationSlot(self.command_timing, self.config.grace_s)
        self._direct = DirectMeasurements(
            self._live,
            self._order,
            self._rates,
            self._own_gap,
            self._gap,
            self._watch,
            self.slot,
        )
        self._answer_watch = AnswerWatch(
            self._timesync, lambda: self.address, lambda: self._gap.heard_s
        )
        self._stations = StationObserver(lambda: self.address, lambda: self.profile)
        self._last_mission: MissionOperation | None = None
        self._range_sensors = RangeSensors()
        self.logs = LogTransfer(lambda: self.address, self.config.log_means)
        self.rtcm = RtcmSender()
        self._external = ExternalPositionSender(self.config.external_origin)
        self._events: deque[VehicleEvent] = deque()
        # In the order of their timers and events; a stream is closed before its operation ends.
        self._services: tuple[VehicleService, ...] = (
            self._own_gap,
            self._stream,
            self._sender,
            self._watch,
            self._rates,
            self._requests,
            self._timesync,
            self._answer_watch,
            self._parameters,
            self.parameter_jobs,
            self._lists,
            self.list_jobs,
            self.slot,
            self._failsafes,
            self._stations,
            self._range_sensors,
            self.logs,
            self.rtcm,
            self._external,
            *further,
        )
        self._timed = _with(self._services, "next_deadline")
        self._reporting = _with(self._services, "next_event")
        self._senders = sorted(_with(self._services, "messages_to_send"), key=_rank)
        self._routes: dict[type[Message], list[VehicleService]] = {}
        for service in self._services:
            for kind in service.handles:
                self._routes.setdefault(kind, []).append(service)
        self._reactions: dict[type[VehicleEvent], Callable[[Any, float], None]] = {
            HeartbeatLost: self._link_lost,
            HeartbeatRegained: self._link_regained,
            OperationFinished: self._operation_ended,
            StationActed: self._station_acted,
            StoredListFinished: self._list_ended,
        }

    # State

    @property
    def state(self) -> VehicleState:
        """All that is known about it."""
        return self._live.get()

    @state.setter
    def state(self, state: VehicleState) -> None:
        self._live.set(state)

    @property
    def ranges(self) -> RangeReader:
        """The reader of range sensors, with its counts."""
        return self._range_sensors.reader

    @property
    def transfers_mission(self) -> bool:
        """Whether an operation on the mission, the fence or the rally points is under way."""
        return isinstance(self.slot.pending, MissionOperation) or bool(self.list_jobs.pending)

    @property
    def live(self) -> LiveState:
        """The state for those who need not all of it."""
        return self._live

    @property
    def connected(self) -> bool:
        """Whether its HEARTBEAT is fresh."""
        return self._watch.alive

    @property
    def discovered(self) -> bool:
        """Whether it was ever heard."""
        return self.profile is not None

    @property
    def mode_name(self) -> str:
        """The mode's name; empty before the vehicle was heard."""
        return "" if self.profile is None else self.profile.mode_name(self.state.custom_mode)

    @property
    def in_control_mode(self) -> bool:
        """Whether it is in the mode in which it follows setpoints."""
        return self._is_in_control_mode(self.state)

    @property
    def operation(self) -> int | None:
        """Id of the operation in progress, None when there is none."""
        pending = self.slot.pending
        return None if pending is None else pending.operation_id

    @property
    def choice_is_unclear(self) -> bool:
        """Whether a mode command on its way may still overtake the mode that somebody chose."""
        return self.slot.choice_is_unclear

    @property
    def stream_open(self) -> bool:
        """Whether setpoints may be sent."""
        return self._stream.is_open

    @property
    def stream_statistics(self) -> StreamStatistics:
        """Counters since the stream was last opened."""
        return self._stream.statistics

    @property
    def mode_unseen(self) -> bool:
        """Whether we stood still, and nothing that commands is sent before the mode is seen."""
        return self._own_gap.is_open

    @property
    def refused_messages(self) -> dict[str, str]:
        """Telemetry that the autopilot will not send, with its answer."""
        return self._rates.refusals

    def message_refusal(self, name: str) -> str | None:
        """Return the answer with which the autopilot will not send a message, or None."""
        return self._rates.refusal(name)

    @property
    def round_trip_s(self) -> float | None:
        """Time of a message to the vehicle and back; None before it was measured."""
        return self._timesync.round_trip_s

    def sample_age_s(self, time_boot_ms: int | None, now: float) -> float | None:
        """Return how old a sample of the vehicle is by the vehicle's clock; None while unknown.

        The shortest time on the link does not count.

        Args:
            time_boot_ms: when the vehicle took it; None: not known.
            now: time in seconds.
        """
        return self._data_age.age_s(time_boot_ms, self._live.known.boot_count, now)

    @property
    def is_one_way(self) -> bool:
        """Whether it is heard, but no longer answers requests that it used to answer."""
        return self._answer_watch.one_way

    def unanswered_s(self, now: float) -> float:
        """Return for how long it has answered nothing, while `expect_answers` is on."""
        return self._answer_watch.unanswered_s(now)

    def expect_answers(self, expected: bool, now: float) -> None:
        """Ask often enough to notice soon that nothing arrives, or stop that."""
        self._answer_watch.expect(expected and self.connected, now)

    @property
    def parameters(self) -> Mapping[str, float]:
        """The parameters of its profile's `wanted_parameters` that it has reported, by name."""
        return self._parameters.values

    def read_parameters(self, names: Iterable[str], now: float) -> list[float | None]:
        """Return any parameters; those not known yet are None, and are asked for."""
        names = tuple(names)
        self._parameters.ask(names, now)
        return [self._parameters.value(name) for name in names]

    @property
    def fence_items(self) -> tuple[MissionItem, ...] | None:
        """The items of the fence that was uploaded to it; None while they are not known."""
        return self._lists.of(MissionType.FENCE)

    @property
    def rally_items(self) -> tuple[MissionItem, ...] | None:
        """The rally points that it stores; None while they are not known."""
        return self._lists.of(MissionType.RALLY)

    @property
    def mission_items(self) -> tuple[MissionItem, ...] | None:
        """The mission that it stores, without ArduPilot's home; None while it is not known."""
        items = self._lists.of(MissionType.MISSION)
        return None if items is None else items[self.mission_offset :]

    @property
    def mission_offset(self) -> int:
        """The autopilot's own number of the first of `mission_items`."""
        rules = None if self.profile is None else self.profile.missions
        return 0 if rules is None else rules.offset

    @property
    def stored_mission(self) -> tuple[MissionItem, ...] | None:
        """The items read by the last operation on the mission; None before."""
        return None if self._last_mission is None else self._last_mission.stored

    @property
    def mission_change(self) -> str:
        """The change of the mission that we uploaded last; empty while it is ours.

        Part of a sentence, for example "MISSION_CURRENT shows 4 items instead of 5".
        """
        return self._stations.mission_change

    @property
    def stations_heard(self) -> tuple[tuple[int, int], ...]:
        """System and component of who was heard to talk to the vehicle, the last one last."""
        return self._stations.stations

    @property
    def address(self) -> Address:
        """The addresses of the conversation, as far as known."""
        system = self.state.system_id
        source = self.config.source_system
        return Address(
            source_system=(system or 1) if source is None else source,
            source_component=self.config.source_component,
            target_system=system,
            target_component=self.config.target_component,
        )

    # The six methods

    def start(self, now: float) -> None:
        """Begin to send HEARTBEAT and to listen."""
        for service in self._services:
            service.start(now)

    def intakes(self, system: int, component: int) -> dict[int, Intake]:
        """Return what takes measurements of a sender straight from their frames, by number.

        None of them if the sender is not this vehicle's autopilot, or not known yet. A measurement
        taken this way changes nothing but the state, is no answer, and makes no event.
        """
        state = self._live.known
        ours = (state.system_id, state.component_id) == (system, component)
        # Of a sender that another one may replace nothing is taken past `receive`.
        stays = self.config.target_system != 0 or self._rank == _BEST_RANK
        return dict(self._direct.intakes) if ours and stays and self.profile is not None else {}

    def receive(self, message: Message, now: float) -> None:
        """Process one message, whoever sent it."""
        is_known = self.profile is not None and self._is_sender(message)
        if is_known and self._direct.take(message, now):
            return
        self.notice(now)
        header = message._header
        if not self._is_from_vehicle(message, now):
            self._overhear(message, now)
            return
        before = self.state
        kind = message.__class__
        shows_mode = kind is _HEARTBEAT or kind is _CURRENT_MODE
        before = self.state = self._gap.heard(self.state, self.profile, shows_mode, now)
        newer = self._follow_order(kind, header.seq, now)
        if newer is None or self._is_for_another(message, now):
            return
        state = reduce(before, message, now)
        if state.system_id == 0:
            return
        if newer:
            state = evolve(state, {name: getattr(before, name) for name in newer})
        self._hand_out(message, now)
        if state is before:
            return
        self.state = state
        if kind is _HEARTBEAT:
            self._heartbeat(message, now)
        # A measurement can show an event only by its time since boot.
        if kind not in _TELEMETRY or state.boot_count != before.boot_count:
            self._compare(before, kind is _HEARTBEAT, now)
            self._compare_mission(before, now)
        self._observe(now)

    @property
    def _rank(self) -> int:
        """How well the vehicle is known as one; 0 before it is found."""
        state = self._live.known
        return 0 if self.profile is None else vehicle_rank(state.autopilot, state.vehicle_type)

    def _is_from_vehicle(self, message: Message, now: float) -> bool:
        if isinstance(message, _HEARTBEAT):
            return self._is_vehicle(message, now)
        return self._is_sender(message)

    def _is_sender(self, message: Message) -> bool:
        header, state = message._header, self._live.known
        return header.srcComponent == state.component_id and (
            state.system_id in (0, header.srcSystem)
        )

    def _is_vehicle(self, message: mavlink.MAVLink_heartbeat_message, now: float) -> bool:
        """Return whether a HEARTBEAT is the vehicle's.

        The first is that of a vehicle of any kind. One that is better known replaces it while
        nothing flies, also from the same ids.
        """
        header, state, config = message._header, self._live.known, self.config
        if header.srcComponent != config.target_component:
            return False
        if config.target_system not in (0, header.srcSystem):
            return False
        rank, known = vehicle_rank(message.autopilot, message.type), self._rank
        if rank > known > 0 and not (state.armed and self.connected) and not self.slot.pending:
            self._replace_by(header.srcSystem, now)
            return True
        return rank >= max(known, 1) and state.system_id in (0, header.srcSystem)

    def _replace_by(self, system_id: int, now: float) -> None:
        """Forget the vehicle that was found first, for a better one."""
        boots = self.state.boot_count + 1  # all that is kept of the first one is dropped
        self._forget_vehicle("another vehicle was found", now)
        self._timesync.pause()
        self._order.begin_again()
        self._failsafes.observe(None, now)
        self._collect(self._failsafes, now)
        self._answers_by_name = False
        self.profile = None
        self.state = VehicleState(
            system_id=system_id, component_id=self.config.target_component, boot_count=boots
        )

    def _observe(self, now: float) -> None:
        """Let the pending operation see the state."""
        if self.slot.pending is not None:
            self.slot.observe(self.state, self.connected, now)
            self.collect(now)

    def overhear(self, message: Message, now: float) -> None:
        """Process what a ground station sends to the vehicle, and nothing else.

        It is never taken for the vehicle's word. Its effect on the vehicle is reported as
        `StationActed`.
        """
        self._lists.overhear(message, now)
        self._stations.overhear(message, now)
        self._collect(self._stations, now)

    def send_external_pose(self, pose: ExternalPose, now: float) -> None:
        """Send a pose from outside to the autopilot's estimator.

        Raises:
            ExternalPositionError: it is not sent, and why.
        """
        self._external.offer(
            pose,
            now,
            target_system=self.state.system_id,
            is_px4=self.state.autopilot == mavlink.MAV_AUTOPILOT_PX4,
            needs_origin=self._needs_origin,
        )
        self._collect(self._external, now)

    def external_silence_s(self, now: float) -> float | None:
        """Return how long no external pose has been sent; None if none is in use."""
        return self._external.silent_s(now)

    def external_difference_m(self, now: float) -> float | None:
        """Return how far its local position is from the last external pose; None without either."""
        local = self.state.local_position
        return None if local is None else self._external.difference_m(local.position_ned_m, now)

    def _needs_origin(self) -> bool:
        state = self.state
        return state.origin is None and not state.position_valid and not state.armed

    def note_setpoint(self, now: float) -> None:
        """Record that a setpoint goes out, ours or another computer's."""
        self.state = self._gap.sent(self.state, self.profile, now)

    def _hand_out(self, message: Message, now: float) -> None:
        """Give a message to the services that handle it."""
        for service in self._routes.get(message.__class__, ()):
            service.receive(message, now)
            self._collect(service, now)
        for taken in lists_taken(message):
            if not self.transfers_mission:
                self._lists.refresh(taken, now)

    def _clock_answered(self, round_trip_s: float, vehicle_ns: int, now: float) -> None:
        state = self.state
        self._data_age.answered(round_trip_s, vehicle_ns, state.boot_time_ms, state.boot_count, now)

    def _is_for_another(self, message: Message, now: float) -> bool:
        """Return whether it is a COMMAND_ACK to somebody else, and let that be heard."""
        if not isinstance(message, _COMMAND_ACK) or self._is_ours(message):
            return False
        self._stations.receive(message, now)
        return True

    def _overhear(self, message: Message, now: float) -> None:
        """Take what sensors say that hang on a computer beside the autopilot, and its setpoints."""
        if message.__class__ in _SETPOINTS:
            self.note_setpoint(now)
        if message._header.srcSystem == self._live.known.system_id != 0:
            for service in self._routes.get(message.__class__, ()):
                if service.hears_companions:
                    service.receive(message, now)
                    self._collect(service, now)
        self.overhear(message, now)

    def _is_ours(self, ack: mavlink.MAVLink_command_ack_message) -> bool:
        """Return whether a COMMAND_ACK is for us.

        Without target fields it is, until the autopilot is known to fill them in: from then on
        it answers somebody else, on board or on another link (a PX4, observed).
        """
        if ack.target_system or ack.target_component:
            ours = self.address.is_for_us(ack)
            self._answers_by_name = self._answers_by_name or (ours and ack.target_component != 0)
            return ours
        return not self._answers_by_name

    def next_deadline(self) -> float | None:
        """Return when `handle_timer` wants to be called."""
        earliest = None
        for service in self._timed:
            time = service.next_deadline()
            if time is not None and (earliest is None or time < earliest):
                earliest = time
        return earliest

    def handle_timer(self, now: float) -> None:
        """Do what is due."""
        self.notice(now)
        due = False
        for service in self._timed:
            time = service.next_deadline()
            if time is not None and time <= now:
                due = True
                service.handle_timer(now)
        if due:
            self.collect(now)

    def messages_to_send(self) -> list[Message]:
        """Return and clear what is to be sent, with our ids in it."""
        messages: list[Message] = []
        for service in self._senders:
            made = service.messages_to_send()
            # A service that repeats its command takes this for a loss on the link.
            if made and not (service.commands and self._own_gap.is_open):
                messages += made
        if messages:
            address = self.address
            for message in messages:
                with_source(message, address.source_system, address.source_component)
        return messages

    def next_event(self) -> VehicleEvent | None:
        """Return and remove the next event."""
        # Transfers of logs are begun and stopped past this class.
        return self._events.popleft() if self._events else self.logs.next_event()

    # Inside

    def collect(self, now: float) -> None:
        """Take the events of all services."""
        for service in self._reporting:
            self._collect(service, now)

    def _collect(self, service: VehicleService, now: float) -> None:
        while (event := service.next_event()) is not None:
            self._events.append(event)
            react = self._reactions.get(event.__class__)
            if react is not None:
                react(event, now)

    def _link_lost(self, _: HeartbeatLost, now: float) -> None:
        for service in self._services:
            service.link_lost(self.state, now)

    def _link_regained(self, _: HeartbeatRegained, now: float) -> None:
        self._ask(now)

    def notice(self, now: float) -> None:
        """Record that we run, and whether we did not for too long."""
        own_gap, boot_ms = self._own_gap, self._live.boot_time_ms
        ran = own_gap.ran
        if ran is not None and now - ran[0] <= own_gap.safe_s:
            own_gap.ran = (now, boot_ms)
            return
        if self.profile is None:
            return
        longest_s = self.config.heartbeat_interval_s + _LATE_S
        stream_s = _STREAM_SHARE * (self.profile.setpoints.lost_s or math.inf)
        own_gap.safe_s = min(longest_s, stream_s)
        gap_s = own_gap.notice(now, boot_ms, own_gap.safe_s if self._stream.is_open else longest_s)
        if gap_s is not None:
            self._watch.excuse(gap_s)
            self._answer_watch.excuse(now)
            self.slot.excuse(gap_s)
            self._events.append(StoodStill(gap_s))

    def _follow_order(
        self, kind: type[Message], sequence: int, now: float
    ) -> tuple[str, ...] | None:
        """Return what the state knows from newer messages than this one; None: all it says."""
        if self.profile is None:
            return ()
        self._watch.heard_s = now
        is_old = self._order.follow(sequence, kind is _HEARTBEAT, kind is _CURRENT_MODE, now)
        if is_old is None:
            return None
        return _MODE_FIELDS if is_old else ()

    def _heartbeat(self, message: Message, now: float) -> None:
        """Record a HEARTBEAT of the vehicle, already in the state."""
        state = self.state
        self._own_gap.see_mode(now, state.boot_time_ms)
        if self.profile is None:
            self.profile = profile_for(state.autopilot, state.vehicle_type)
            if self.config.heartbeat_type is None:
                self._sender.mav_type = self.profile.messages.heartbeat_type
            self._events.append(
                VehicleDiscovered(
                    state.system_id,
                    state.component_id,
                    state.autopilot,
                    state.vehicle_type,
                    self.profile.name,
                )
            )
            self._ask(now)
        self._watch.observe_boots(state.boot_count)
        self._watch.receive(message, now)
        self._collect(self._watch, now)

    def _ask(self, now: float) -> None:
        """Ask for the telemetry and for what is wanted once, from the beginning."""
        if self.profile is not None:
            conversation = Conversation(self.address, self.profile)
            for service in self._services:
                service.vehicle_came(conversation, now)

    def _compare(self, before: VehicleState, heartbeat: bool, now: float) -> None:
        """Turn the difference of two states into events."""
        state = self.state
        if state.boot_count != before.boot_count:
            self._restarted(now)
        if before.last_heartbeat_s is not None:
            if heartbeat:
                self._compare_armed(before, now)
            if state.custom_mode != before.custom_mode:
                self._mode_changed(before, now)
            if state.system_status != before.system_status:
                self._events.append(SystemStatusChanged(before.system_status, state.system_status))
        if state.landed_state is not before.landed_state:
            self._events.append(LandedChanged(before.landed_state, state.landed_state))
        if state.texts is not before.texts:
            new_texts = state.texts.count - before.texts.count
            for text in state.status_texts[-new_texts:] if new_texts else ():
                self._events.append(StatusTextReceived(text.text, text.severity))
        if state.failsafe is not before.failsafe:
            self._failsafes.observe(state.failsafe, now)
            self._collect(self._failsafes, now)

    def _restarted(self, now: float) -> None:
        self._events.append(VehicleRebooted(self.state.boot_count))
        self._forget_vehicle("the autopilot restarted", now)
        self._ask(now)

    def _forget_vehicle(self, reason: str, now: float) -> None:
        """Drop what was learned from the vehicle, and end what was under way with it."""
        for service in self._services:
            service.vehicle_gone(reason, now)
        self.collect(now)

    def _compare_mission(self, before: VehicleState, now: float) -> None:
        mission, earlier = self.state.mission, before.mission
        if mission is not earlier and mission and earlier and not self.transfers_mission:
            self._lists.compare(earlier, mission, now)
        if self.profile is not None:
            self._stations.compare(before, self.state, self.profile, self._order.last, now)
        self._collect(self._stations, now)

    def _compare_armed(self, before: VehicleState, now: float) -> None:
        state = self.state
        if state.armed != before.armed:
            requested = self.slot.armed_changed(state.armed, now)
            self._events.append(ArmedChanged(state.armed, requested))
            if not state.armed:
                self._stream.close_for("the vehicle was disarmed")
            else:
                for service in self._services:
                    service.vehicle_armed()
            self.collect(now)

    def _mode_changed(self, before: VehicleState, now: float) -> None:
        state, name = self.state, self.mode_name
        requested, overtaken = self.slot.mode_changed(state, name, now)
        requested = requested or self._went_back(before)
        self._events.append(ModeChanged(before.custom_mode, state.custom_mode, name, requested))
        if overtaken is not None and self.profile is not None:
            chosen_name = self.profile.mode_name(overtaken)
            self._events.append(ModeOvertaken(overtaken, chosen_name, name))
        self.collect(now)
        if self.in_control_mode:
            return
        if not requested:
            self._stream.close_for(f"the vehicle was switched to {name}, not at our request")
        elif self._is_in_control_mode(before):
            self._stream.close_for(f"control was released for {name}")
        self._collect(self._stream, now)

    def _went_back(self, before: VehicleState) -> bool:
        """Return whether it went back to an earlier mode because it has landed (PX4)."""
        profile, state = self.profile, self.state
        if profile is None or not profile.earlier_mode_after_landing:
            return False
        down = not state.armed or state.landed_state is LandedState.ON_GROUND
        landing = (
            profile.mode_number(profile.land_mode), profile.mode_number(profile.return_mode)
        )  # fmt: skip
        return down and before.custom_mode in landing

    def _is_in_control_mode(self, state: VehicleState) -> bool:
        profile = self.profile
        if profile is None or state.custom_mode != profile.mode_number(profile.control_mode):
            return False
        return not (profile.status_tells_runnable and state.mode_may_not_run)

    def begin_mission(self, job: MissionJob, timing: MissionTiming, now: float) -> int:
        """Begin an operation on the mission; returns its id."""

        def make(operation_id: int) -> MissionOperation:
            self._last_mission = MissionOperation(operation_id, job, self.address, timing)
            return self._last_mission

        self._stations.mission_sent(job.kind)
        self._lists.make_way(now)
        self.notice(now)
        operation_id = self.slot.begin_mission(make, self.state, now, connected=self.connected)
        self.collect(now)
        return operation_id

    def make_way_for_list(self, now: float) -> None:
        """End the reading of lists, and read the fence's parameters again: one is written."""
        self._lists.make_way(now)
        self._parameters.refresh(now)

    def _operation_ended(self, event: OperationFinished, now: float) -> None:
        stored = self.stored_mission or ()
        self._stations.operation_ended(event, stored, self.profile, self._order.last)
        last = self._last_mission
        if last is not None and last.operation_id == event.operation_id:
            self._keep_list(event, now)

    def _list_ended(self, event: StoredListFinished, now: float) -> None:
        if event.items is None:
            self._lists.refresh(event.kind, now)
        else:
            self._lists.put(event.kind, event.items, now)

    def _keep_list(self, event: OperationFinished, now: float) -> None:
        """Take the mission that an operation has read; another end leaves it unknown."""
        stored = self.stored_mission
        if stored is None or event.result is not OperationResult.ACHIEVED:
            self._lists.refresh(MissionType.MISSION, now)
        else:
            home = (HOME_PLACEHOLDER,) * self.mission_offset
            self._lists.put(MissionType.MISSION, home + stored, now)

    def _station_acted(self, event: StationActed, now: float) -> None:
        if event.mode is not None and event.mode != self.state.custom_mode:
            self.slot.mode_asked(event.mode, now)


def _with(services: Iterable[VehicleService], method: str) -> tuple[VehicleService, ...]:
    """Return the services that have a method of their own."""
    default = getattr(VehicleService, method)
    return tuple(service for service in services if getattr(type(service), method) is not default)


def _rank(service: VehicleService) -> int:
    return service.rank
