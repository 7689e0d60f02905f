"""One autopilot: the protocols put together, still without I/O or a clock.

`Vehicle` is told what arrives (`receive`) and what time it is (`handle_timer`), and says what
to send, what happened and when it wants to be called again. `io.driver` runs it on real links;
a test runs it with a `ManualClock`.
"""

from __future__ import annotations

from collections import deque

from mavlink_vehicle.codec import Message, mavlink, with_source
from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.events import (
    ArmedChanged,
    HeartbeatLost,
    LandedChanged,
    ModeChanged,
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
from mavlink_vehicle.protocols.operation_slot import OperationSlot, Wanted
from mavlink_vehicle.protocols.operations import Goal, OperationTiming
from mavlink_vehicle.protocols.sequence import SequenceOrder
from mavlink_vehicle.protocols.setpoint_stream import (
    SetpointNed,
    SetpointStream,
    StreamStatistics,
)
from mavlink_vehicle.state import VehicleState, reduce
from mavlink_vehicle.vehicle_config import DEFAULT_RATES_HZ, VehicleConfig

__all__ = ["DEFAULT_RATES_HZ", "SetpointNed", "Vehicle", "VehicleConfig"]

_WANTED_ONCE = ("AUTOPILOT_VERSION", "HOME_POSITION", "GPS_GLOBAL_ORIGIN")
_TAKEOFF_DOUBT_S = 6.0
"""An ArduCopter spins its motors up for 3.5 s before anything shows that it takes off."""
_HEARTBEAT = mavlink.MAVLink_heartbeat_message
_COMMAND_ACK = mavlink.MAVLink_command_ack_message


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
        self._order = SequenceOrder()
        self._heartbeat_place = -1
        self._slot = OperationSlot(self._command_timing, self.config.grace_s)
        self._events: deque[VehicleEvent] = deque()
        self._parts = (self._sender, self._watch, self._rates, self._requests, self._slot)
        self._senders = (self._slot, self._stream, self._sender, self._rates, self._requests)

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
        pending = self._slot.pending
        return None if pending is None else pending.operation_id

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
        kind = message.__class__
        if self.profile is not None:
            place = self._order.place(header.seq, now)
            if kind is _HEARTBEAT:
                if place < self._heartbeat_place:
                    return  # it would show a mode that has been left since
                self._heartbeat_place = place
        state = reduce(before, message, now)
        if state.system_id == 0:
            return
        if kind is _COMMAND_ACK:
            self._slot.receive(message, now)
            self._take_ends()
        self._requests.receive(message, now)
        self._rates.receive(message, now)
        if state is before:
            return
        self.state = state
        if kind is _HEARTBEAT:
            self._heartbeat(message, now)
        self._compare(before, kind is _HEARTBEAT, now)
        if self._slot.pending is not None:
            self._slot.observe(state, self.connected, now)
            self._take_ends()

    def next_deadline(self) -> float | None:
        """Return when `handle_timer` wants to be called."""
        earliest = None
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
                self._slot.observe(self.state, False, now)
        self._take_ends()

    def messages_to_send(self) -> list[Message]:
        """Take what is to be sent, with our ids in it."""
        messages: list[Message] = []
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
        if profile is None:
            return self._nobody(OperationKind.CHANGE_MODE, now)
        mode = profile.modes.get(name)
        if mode is None:
            known = ", ".join(sorted(profile.modes)) or "none that is known"
            reason = f"{profile.name} has no mode {name!r}; its modes are {known}."
            return self._refuse(OperationKind.CHANGE_MODE, reason, now)
        timing = OperationTiming(self.config.operation_timeout_s)
        return self._begin(profile, ModeGoal(name, mode), Wanted(mode=mode), timing, now)

    def arm(self, now: float) -> int:
        """Arm the motors; returns the operation's id."""
        return self._set_armed(ArmGoal(True), now)

    def disarm(self, now: float, force: bool = False) -> int:
        """Disarm the motors, with `force` even in the air; returns the operation's id."""
        return self._set_armed(ArmGoal(False, force), now)

    def take_off(self, height_above_home_m: float, now: float) -> int:
        """Take off to a height above home; returns the operation's id.

        The vehicle must be armed and in its control mode. Setpoints are refused until it ends.
        """
        profile = self.profile
        if profile is None:
            return self._nobody(OperationKind.TAKE_OFF, now)
        problem = takeoff_problem(height_above_home_m, self.state, profile)
        if problem is not None:
            return self._refuse(OperationKind.TAKE_OFF, f"Take-off refused: {problem}.", now)
        timeout_s = self.config.takeoff_timeout_s or takeoff_timeout_s(height_above_home_m)
        goal = TakeoffGoal(height_above_home_m, self.state, profile)
        timing = OperationTiming(timeout_s, doubt_s=_TAKEOFF_DOUBT_S)
        return self._begin(profile, goal, Wanted(), timing, now)

    def cancel_operation(self, now: float) -> None:
        """End the operation under way, if any, as CANCELLED. The vehicle is not told."""
        self._slot.cancel("we stopped waiting for it", now)
        self._take_ends()

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
        pending = self._slot.pending
        if (
            pending is not None
            and pending.goal.kind is OperationKind.TAKE_OFF
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

    def _heartbeat(self, message: Message, now: float) -> None:
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

    def _compare(self, before: VehicleState, heartbeat: bool, now: float) -> None:
        """Turn the difference of two states into events."""
        state = self.state
        if state.boot_count != before.boot_count:
            self._events.append(VehicleRebooted(state.boot_count))
            self._close_by_interlock("the autopilot restarted")
            self._ask(now)
            self._slot.lose("the autopilot restarted", now)
            self._take_ends()
        if heartbeat and before.last_heartbeat_s is not None:
            self._compare_heartbeats(before, now)
        if state.landed_state is not before.landed_state:
            self._events.append(LandedChanged(before.landed_state, state.landed_state))
        if state.texts is not before.texts:
            new_texts = state.texts.count - before.texts.count
            for text in state.status_texts[-new_texts:] if new_texts else ():
                self._events.append(StatusTextReceived(text.text, text.severity))

    def _compare_heartbeats(self, before: VehicleState, now: float) -> None:
        state = self.state
        if state.armed != before.armed:
            requested = self._slot.armed_changed(state.armed, now)
            self._events.append(ArmedChanged(state.armed, requested))
            if not state.armed:
                self._close_by_interlock("the vehicle was disarmed")
        if state.custom_mode != before.custom_mode:
            name = self.mode_name
            requested = self._slot.mode_changed(state, name, now)
            self._events.append(ModeChanged(before.custom_mode, state.custom_mode, name, requested))
            self._take_ends()
            if not requested and not self.in_control_mode:
                self._close_by_interlock(f"the vehicle was switched to {name}, not by our request")
        if state.system_status != before.system_status:
            self._events.append(SystemStatusChanged(before.system_status, state.system_status))

    def _close_by_interlock(self, reason: str) -> None:
        if self._stream.is_open:
            self._stream.close()
            self._events.append(StreamClosed(reason))

    def _set_armed(self, goal: ArmGoal, now: float) -> int:
        if self.profile is None:
            return self._nobody(goal.kind, now)
        timing = OperationTiming(self.config.operation_timeout_s)
        return self._begin(self.profile, goal, Wanted(armed=goal.armed), timing, now)

    def _begin(
        self, profile: Profile, goal: Goal, wanted: Wanted, timing: OperationTiming, now: float
    ) -> int:
        operation_id = self._slot.begin(
            goal,
            wanted,
            timing,
            self.address,
            self.state,
            now,
            connected=self.connected,
            first_ack_counts=goal.request.command not in profile.later_ack_counts,
        )
        self._take_ends()
        return operation_id

    def _refuse(self, kind: OperationKind, reason: str, now: float) -> int:
        operation_id = self._slot.end_at_once(kind, OperationResult.REFUSED, reason, now)
        self._take_ends()
        return operation_id

    def _nobody(self, kind: OperationKind, now: float) -> int:
        reason = "No vehicle has been heard yet; check the link and the vehicle's power."
        operation_id = self._slot.end_at_once(kind, OperationResult.LINK_LOST, reason, now)
        self._take_ends()
        return operation_id

    def _take_ends(self) -> None:
        """Put the ends of operations into their place among the events."""
        while (event := self._slot.next_event()) is not None:
            self._events.append(event)
