"""One autopilot: the protocols put together, still without I/O or a clock.

`Vehicle` is told what arrives (`receive`) and what time it is (`handle_timer`), and says what
to send, what happened and when it wants to be called again. `io.driver` runs it on real links;
a test runs it with a `ManualClock`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from mavlink_vehicle.codec import Message, mavlink, with_source
from mavlink_vehicle.errors import ConfigurationError, SetpointError
from mavlink_vehicle.events import (
    ArmedChanged,
    HeartbeatLost,
    LandedChanged,
    ModeChanged,
    OperationFinished,
    OperationKind,
    OperationResult,
    StatusTextReceived,
    StreamClosed,
    SystemStatusChanged,
    VehicleDiscovered,
    VehicleEvent,
    VehicleRebooted,
)
from mavlink_vehicle.profiles import Profile, profile_for
from mavlink_vehicle.protocols.command import Address, CommandTiming
from mavlink_vehicle.protocols.goals import (
    ArmGoal,
    ModeGoal,
    TakeoffGoal,
    takeoff_problem,
    takeoff_timeout_s,
)
from mavlink_vehicle.protocols.heartbeat import HeartbeatSender, HeartbeatWatch
from mavlink_vehicle.protocols.message_rates import MessageRates
from mavlink_vehicle.protocols.message_requests import MessageRequests
from mavlink_vehicle.protocols.operations import Goal, Operation, OperationTiming
from mavlink_vehicle.protocols.requested_changes import RequestedChanges
from mavlink_vehicle.protocols.sequence import SequenceOrder
from mavlink_vehicle.protocols.setpoint_stream import (
    SetpointNed,
    SetpointStream,
    StreamStatistics,
)
from mavlink_vehicle.state import VehicleState, reduce

__all__ = ["DEFAULT_RATES_HZ", "SetpointNed", "Vehicle", "VehicleConfig"]

DEFAULT_RATES_HZ: Mapping[str, float] = MappingProxyType(
    {
        "GLOBAL_POSITION_INT": 20.0,
        "LOCAL_POSITION_NED": 20.0,
        "EXTENDED_SYS_STATE": 5.0,
        "SYS_STATUS": 2.0,
        "BATTERY_STATUS": 2.0,
        "GPS_RAW_INT": 2.0,
        "EKF_STATUS_REPORT": 1.0,
        "ESTIMATOR_STATUS": 1.0,
        "ATTITUDE": 10.0,
        "SYSTEM_TIME": 1.0,
        "HOME_POSITION": 0.5,
    }
)
"""Hz by message name, asked for in this order."""

_WANTED_ONCE = ("AUTOPILOT_VERSION", "HOME_POSITION", "GPS_GLOBAL_ORIGIN")
_SETTLE_S = 1.5
"""How long a command that was sent and given up may still take effect."""
_HEARTBEAT = mavlink.MAVLink_heartbeat_message
_COMMAND_ACK = mavlink.MAVLink_command_ack_message


@dataclass(frozen=True)
class VehicleConfig:
    """How to talk to one vehicle.

    Attributes:
        target_system: its MAVLink system id; 0 takes the first autopilot that is heard.
        target_component: component id of its autopilot.
        source_system: our system id; None takes the vehicle's own, as an onboard computer
            should (1 before it is known).
        source_component: our component id; 191 is MAV_COMP_ID_ONBOARD_COMPUTER.
        heartbeat_interval_s: how often we send HEARTBEAT.
        heartbeat_timeout_s: silence of its HEARTBEAT after which it counts as lost.
        message_rates_hz: telemetry that is asked for.
        command_timeout_s: time to the repetition of a command without an answer.
        command_retries: repetitions after the first sending.
        operation_timeout_s: time for a mode change, arming or disarming to show in its state.
        takeoff_timeout_s: time for a take-off; None takes 15 s and 2 s for each metre.
        grace_s: a change that we asked for may show up this long after its operation ended.
    """

    target_system: int = 0
    target_component: int = 1
    source_system: int | None = None
    source_component: int = 191
    heartbeat_interval_s: float = 1.0
    heartbeat_timeout_s: float = 3.0
    message_rates_hz: Mapping[str, float] = field(default_factory=lambda: DEFAULT_RATES_HZ)
    command_timeout_s: float = 0.5
    command_retries: int = 4
    operation_timeout_s: float = 10.0
    takeoff_timeout_s: float | None = None
    grace_s: float = 5.0

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises:
            ConfigurationError: says which value and what it may be.
        """
        for name, low in (
            ("target_system", 0),
            ("target_component", 1),
            ("source_component", 1),
            ("source_system", 1),
        ):
            number = getattr(self, name)
            if number is not None and not low <= number <= 255:
                raise ConfigurationError(f"{name} is {number}; it must be {low} to 255.")
        for name in (
            "heartbeat_interval_s",
            "heartbeat_timeout_s",
            "command_timeout_s",
            "operation_timeout_s",
        ):
            if not 0.0 < getattr(self, name) < 1e6:
                raise ConfigurationError(f"{name} must be a positive number of seconds.")
        if self.command_retries < 0:
            raise ConfigurationError("command_retries must be 0 or more.")
        if not all(0.0 <= rate_hz <= 1000.0 for rate_hz in self.message_rates_hz.values()):
            raise ConfigurationError("message_rates_hz must be between 0 (off) and 1000 Hz.")


class Vehicle:
    """One autopilot; sans I/O. Operations are asynchronous: each ends in one event."""

    def __init__(self, config: VehicleConfig | None = None) -> None:
        """Prepare; nothing happens before `start`."""
        self.config = config or VehicleConfig()
        self.state = VehicleState(
            system_id=self.config.target_system, component_id=self.config.target_component
        )
        self.profile: Profile | None = None
        self._command_timing = CommandTiming(
            self.config.command_timeout_s, self.config.command_retries
        )
        self._sender = HeartbeatSender(
            self.config.heartbeat_interval_s, mavlink.MAV_TYPE_ONBOARD_CONTROLLER
        )
        self._watch = HeartbeatWatch(self.config.heartbeat_timeout_s)
        self._rates = MessageRates(self.config.message_rates_hz, self._command_timing)
        self._requests = MessageRequests(_WANTED_ONCE)
        self._stream = SetpointStream()
        self._heartbeat_place = 0
        self._sequence = SequenceOrder()
        self._requested = RequestedChanges(self.config.grace_s)
        self._operation: Operation | None = None
        self._next_operation_id = 1
        self._events: deque[VehicleEvent] = deque()
        self._parts = (self._sender, self._watch, self._rates, self._requests)
        self._senders = (self._stream, self._sender, self._rates, self._requests)

    # What is known

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
        return self.profile is not None and self.mode_name == self.profile.control_mode

    @property
    def operation(self) -> int | None:
        """Id of the operation under way, None when there is none."""
        return None if self._operation is None else self._operation.operation_id

    @property
    def stream_open(self) -> bool:
        """Whether setpoints may be sent."""
        return self._stream.is_open

    @property
    def stream_statistics(self) -> StreamStatistics:
        """What was streamed since the stream was last opened."""
        return self._stream.statistics

    @property
    def refused_messages(self) -> dict[str, str]:
        """Telemetry that the autopilot will not send, with its answer."""
        return self._rates.refusals

    @property
    def address(self) -> Address:
        """Who talks to whom, as far as it is known."""
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
        self._sender.start(now)

    def receive(self, message: Message, now: float) -> None:
        """Take in one message, whoever sent it."""
        header = message._header
        before = self.state
        if header.srcComponent != before.component_id or (
            header.srcSystem != before.system_id and before.system_id != 0
        ):
            return
        place = self._sequence.place(header.seq, now)
        kind = message.__class__
        if kind is _HEARTBEAT:
            if place < self._heartbeat_place:
                return  # it would show a mode that has been left since
            self._heartbeat_place = place
        state = reduce(before, message, now)
        if state.system_id == 0:
            return
        if kind is _COMMAND_ACK and self._operation is not None:
            self._operation.receive(message, now)
            self._collect(now)
        self._requests.receive(message, now)
        self._rates.receive(message, now)
        if state is before:
            return
        self.state = state
        if kind is _HEARTBEAT and state.last_heartbeat_s == now:
            self._heartbeat(before, message, now)
        self._compare(before, now)
        if self._operation is not None:
            self._operation.observe(state, self.connected, now)
            self._collect(now)

    def next_deadline(self) -> float | None:
        """Return when `handle_timer` wants to be called."""
        earliest = None if self._operation is None else self._operation.next_deadline()
        for part in self._parts:
            time = part.next_deadline()
            if time is not None and (earliest is None or time < earliest):
                earliest = time
        return earliest

    def handle_timer(self, now: float) -> None:
        """Do what is due."""
        for part in self._parts:
            part.handle_timer(now)
        while (event := self._watch.next_event()) is not None:
            self._events.append(event)
            if isinstance(event, HeartbeatLost):
                self._rates.pause(now)
                self._requests.pause()
                if self._operation is not None:
                    self._operation.observe(self.state, False, now)
        if self._operation is not None:
            self._operation.handle_timer(now)
            self._collect(now)

    def messages_to_send(self) -> list[Message]:
        """Take what is to be sent, with our ids in it."""
        messages = [] if self._operation is None else self._operation.messages_to_send()
        for part in self._senders:
            messages += part.messages_to_send()
        if messages:
            address = self.address
            for message in messages:
                with_source(message, address.source_system, address.source_component)
        return messages

    def next_event(self) -> VehicleEvent | None:
        """Take the next event."""
        return self._events.popleft() if self._events else None

    # Operations: one at a time; a new one cancels the pending one

    def change_mode(self, name: str, now: float) -> int:
        """Change to the mode called `name`; returns the operation's id."""
        profile = self.profile
        if profile is not None and name not in profile.modes:
            known = ", ".join(sorted(profile.modes)) or "none that is known"
            return self._refuse(
                OperationKind.CHANGE_MODE,
                f"{profile.name} has no mode {name!r}; its modes are {known}",
                now,
            )
        if profile is None:
            return self._nobody(OperationKind.CHANGE_MODE, now)
        mode = profile.modes[name]
        return self._begin(ModeGoal(name, mode), self.config.operation_timeout_s, now, mode=mode)

    def arm(self, now: float) -> int:
        """Arm the motors; returns the operation's id."""
        if self.profile is None:
            return self._nobody(OperationKind.ARM, now)
        return self._begin(ArmGoal(True), self.config.operation_timeout_s, now, armed=True)

    def disarm(self, now: float, force: bool = False) -> int:
        """Disarm the motors, with `force` even in the air; returns the operation's id."""
        if self.profile is None:
            return self._nobody(OperationKind.DISARM, now)
        goal = ArmGoal(False, force)
        return self._begin(goal, self.config.operation_timeout_s, now, armed=False)

    def take_off(self, height_above_home_m: float, now: float) -> int:
        """Take off to a height above home; returns the operation's id.

        The vehicle must be armed and in its control mode. Setpoints are refused until it ends.
        """
        profile = self.profile
        if profile is None:
            return self._nobody(OperationKind.TAKE_OFF, now)
        problem = takeoff_problem(height_above_home_m, self.state, profile)
        if problem is not None:
            return self._refuse(OperationKind.TAKE_OFF, f"Take-off refused: {problem}", now)
        timeout_s = self.config.takeoff_timeout_s or takeoff_timeout_s(height_above_home_m)
        goal = TakeoffGoal(height_above_home_m, self.state, profile)
        return self._begin(goal, timeout_s, now, doubt_s=6.0)

    def cancel_operation(self, now: float) -> None:
        """End the operation under way, if any, as CANCELLED. The vehicle is not told."""
        self._cancel("we stopped waiting for it", now)

    # Setpoints

    def open_stream(self, now: float) -> None:
        """Allow setpoints."""
        self._stream.open(now)

    def close_stream(self) -> None:
        """Forbid setpoints; those not yet handed out are dropped."""
        self._stream.close()

    def send_setpoint(self, setpoint: SetpointNed, now: float) -> None:
        """Send SET_POSITION_TARGET_LOCAL_NED.

        Raises:
            SetpointError: says why this must not be sent, or not now.
        """
        profile = self.profile
        if profile is None:
            raise SetpointError("No vehicle has been heard yet; wait for its HEARTBEAT.")
        operation = self._operation
        if (
            operation is not None
            and operation.goal.kind is OperationKind.TAKE_OFF
            and not profile.setpoints_before_takeoff
        ):
            raise SetpointError(
                f"{profile.name} takes off; setpoints would keep it on the ground. Wait for the "
                "end of the take-off."
            )
        if self._stream.is_open:
            self._check_interlock(profile)
        self._stream.offer(
            setpoint,
            now,
            profile=profile,
            address=self.address,
            time_boot_ms=int(now * 1000.0) % (1 << 32),
        )

    def _check_interlock(self, profile: Profile) -> None:
        if not self.in_control_mode and not profile.setpoints_outside_control_mode:
            raise SetpointError(
                f"{profile.name} is in {self.mode_name}, where setpoints must not be sent; "
                f"change to {profile.control_mode} first."
            )
        if not self.state.armed and not profile.setpoints_while_disarmed:
            raise SetpointError(
                f"{profile.name} is disarmed; a setpoint could set it off later. Arm it first."
            )

    # Inside

    def _heartbeat(self, before: VehicleState, message: Message, now: float) -> None:
        """Take note of a HEARTBEAT of the vehicle, already in the state."""
        state = self.state
        if self.profile is None:
            self.profile = profile_for(state.autopilot, state.vehicle_type)
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
        while (event := self._watch.next_event()) is not None:
            self._events.append(event)
            self._ask(now)

    def _ask(self, now: float) -> None:
        """Ask for the telemetry and for what is wanted once, from the beginning."""
        if self.profile is not None:
            address = self.address
            self._rates.resume(address, self.profile.unsupported_messages, now)
            self._requests.resume(address, now)

    def _compare(self, before: VehicleState, now: float) -> None:
        """Turn the difference of two states into events."""
        state = self.state
        if state.boot_count != before.boot_count:
            self._events.append(VehicleRebooted(state.boot_count))
            self._close_by_interlock("the autopilot restarted")
            self._ask(now)
            if self._operation is not None:
                self._operation.lose("the autopilot restarted", now)
                self._collect(now)
        if before.last_heartbeat_s is not None:
            self._compare_heartbeats(before, now)
        if state.landed_state is not before.landed_state:
            self._events.append(LandedChanged(before.landed_state, state.landed_state))
        new_texts = state.texts.count - before.texts.count
        if new_texts:
            for text in state.status_texts[-new_texts:]:
                self._events.append(StatusTextReceived(text.text, text.severity))

    def _compare_heartbeats(self, before: VehicleState, now: float) -> None:
        state = self.state
        if state.armed != before.armed:
            requested = self._requested.take_armed(state.armed, now)
            self._events.append(ArmedChanged(state.armed, requested))
            self._settle(requested)
            if not state.armed:
                self._close_by_interlock("the vehicle was disarmed")
        if state.custom_mode != before.custom_mode:
            requested = self._requested.take_mode(state.custom_mode, now)
            self._events.append(
                ModeChanged(before.custom_mode, state.custom_mode, self.mode_name, requested)
            )
            self._settle(requested)
            self._judge_mode_change(requested, now)
        if state.system_status != before.system_status:
            self._events.append(SystemStatusChanged(before.system_status, state.system_status))

    def _settle(self, requested: bool) -> None:
        if requested and self._operation is not None:
            self._operation.settle()

    def _judge_mode_change(self, requested: bool, now: float) -> None:
        """End what a change of mode cuts short; never repeat a command against a pilot."""
        operation = self._operation
        if operation is not None:
            kind = operation.goal.kind
            wanted = operation.goal.reached(self.state)
            cut = kind is OperationKind.TAKE_OFF or (
                kind is OperationKind.CHANGE_MODE and not requested and not wanted
            )
            if cut:
                self._cancel(f"the vehicle was switched to {self.mode_name} meanwhile", now)
        if not requested and not self.in_control_mode:
            self._close_by_interlock(
                f"the vehicle was switched to {self.mode_name}, not by our request"
            )

    def _close_by_interlock(self, reason: str) -> None:
        if self._stream.is_open:
            self._stream.close()
            self._events.append(StreamClosed(reason))

    def _begin(
        self,
        goal: Goal,
        timeout_s: float,
        now: float,
        *,
        mode: int | None = None,
        armed: bool | None = None,
        doubt_s: float = 3.0,
    ) -> int:
        self._cancel(f"{goal.kind.value} was asked for instead", now)
        operation = Operation(
            self._take_id(),
            goal,
            self.address,
            self._command_timing,
            OperationTiming(timeout_s, doubt_s=doubt_s),
            first_ack_counts=self.profile is None
            or goal.request.command not in self.profile.later_ack_counts,
        )
        self._operation = operation
        contradicted = self._requested.contradicted(now, mode=mode, armed=armed)
        operation.begin(self.state, self.connected, now, _SETTLE_S if contradicted else 0.0)
        if not operation.finished and (mode is not None or armed is not None):
            self._requested.add(mode=mode, armed=armed)
        self._collect(now)
        return operation.operation_id

    def _collect(self, now: float) -> None:
        """Take the end of the operation, if it has come."""
        if self._operation is None:
            return
        event = self._operation.next_event()
        if event is not None:
            self._operation = None
            self._requested.end(now)
            self._events.append(event)

    def _cancel(self, reason: str, now: float) -> None:
        if self._operation is not None:
            self._operation.cancel(reason, now)
            self._collect(now)

    def _refuse(self, kind: OperationKind, reason: str, now: float) -> int:
        return self._end_at_once(kind, OperationResult.REFUSED, f"{reason}.", now)

    def _nobody(self, kind: OperationKind, now: float) -> int:
        reason = "No vehicle has been heard yet; check the link and the vehicle's power."
        return self._end_at_once(kind, OperationResult.LINK_LOST, reason, now)

    def _end_at_once(
        self, kind: OperationKind, result: OperationResult, reason: str, now: float
    ) -> int:
        self._cancel(f"{kind.value} was asked for instead", now)
        operation_id = self._take_id()
        self._events.append(OperationFinished(operation_id, kind, result, reason))
        return operation_id

    def _take_id(self) -> int:
        operation_id = self._next_operation_id
        self._next_operation_id += 1
        return operation_id
