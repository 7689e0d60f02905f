"""One vehicle's MAVLink side: composes the services, sans-IO.

Frames come in through `receive`, time through `tick`, frames go out through `take_frames`. As
recorded: HEARTBEAT once a second and at once at a mode change; TIMESYNC every ten seconds;
texts after the acknowledgement; nothing else unasked but HOME_POSITION and GPS_GLOBAL_ORIGIN
when home is set. Commands are answered for any component of the own system, from component
1; another system's are met with silence. On several links telemetry goes out on each; what is
for somebody goes where that one was heard last, and what others say is handed on (`Routes`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeVar

from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter
from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover
from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.exchange import (
    Event,
    HomeChanged,
    ItemReached,
    ModeChanged,
    ParameterSaved,
    PhotoTaken,
    RebootRequested,
    Severity,
    StatusText,
)
from mavlink_sitl.mavlink import commands, setpoints, sticks
from mavlink_sitl.mavlink.codec import Decoder, Encoder, Message, dialect
from mavlink_sitl.mavlink.corrections import Corrections
from mavlink_sitl.mavlink.external_position import ExternalPositionReceiver
from mavlink_sitl.mavlink.files.ftp_server import FtpServer
from mavlink_sitl.mavlink.logs.log_server import LogServer
from mavlink_sitl.mavlink.logs.logbook import Logbook
from mavlink_sitl.mavlink.messages import telemetry
from mavlink_sitl.mavlink.messages.snapshot import Builder, Snapshot
from mavlink_sitl.mavlink.messages.status_messages import heartbeat
from mavlink_sitl.mavlink.messages.statustext import StatusTextEncoder
from mavlink_sitl.mavlink.messages.streams import NEVER_US, StreamSchedule
from mavlink_sitl.mavlink.missions.mission_transfer import MissionServer
from mavlink_sitl.mavlink.parameters import ParameterServer, saved_parameter
from mavlink_sitl.mavlink.received_command import from_message
from mavlink_sitl.mavlink.routes import Routes, private_links
from mavlink_sitl.mavlink.traffic import ADSB_VEHICLE, TrafficList, TrafficQueue

T = TypeVar("T")

HEARTBEAT_US = 1_000_000
TIMESYNC_US = 10_000_000
COMPLAINT_US = 1_000_000
COMPONENT_AUTOPILOT = 1
LATEST_SIGNATURE = 2**48 - 2**40
"""Signatures have 48 bits for the time; this leaves room for four months"""
SCANNER_US = 100_000
"""A scanner turns ten times a second"""
_HOME_POSITION, _GPS_GLOBAL_ORIGIN, _OBSTACLE_DISTANCE = 242, 49, 330
_CAMERA_FEEDBACK = 180


class PoweredUp(NamedTuple):
    """A vehicle from one power-up to the next, as its servers know it.

    Attributes:
        firmware: that which it speaks for.
        system_id: its MAVLink id.
        now_us: simulated time of power-up.
        snapshot: what it would report now.
        logbook: its own logs.
    """

    firmware: Commander
    system_id: int
    now_us: int
    snapshot: Callable[[], Snapshot]
    logbook: Logbook


class MavlinkServer:
    """Speaks for one vehicle, from one power-up to the next.

    Args:
        served: the vehicle.
        encoders: one for each link; they keep the sequence numbers, over reboots too.

    Attributes:
        outboxes: for each link frames to send, oldest first.
        now_us: simulated time.
        reboot_requested: the firmware is to start again.
        corrections: what the GPS receiver was given.
        traffic: the aircraft that were heard.
        heartbeat_us: from HEARTBEAT to HEARTBEAT; 0 for none.
    """

    vehicle: Commander
    external_class: type[ExternalPositionReceiver] = ExternalPositionReceiver
    ftp_class: type[FtpServer] = FtpServer
    logs_class: type[LogServer] = LogServer
    steady: frozenset[int] = frozenset({0, _OBSTACLE_DISTANCE})
    """Messages that come whatever anybody asks for: HEARTBEAT, a companion's scan"""
    builders: Mapping[int, Builder]
    """By message id: what can be streamed and requested"""

    def __init__(self, served: PoweredUp, encoders: Sequence[Encoder]) -> None:
        vehicle, system_id, now_us, snapshot, logbook = served
        self.vehicle = vehicle
        self.builders = self.make_builders(vehicle.personality.kind)
        self.system_id = system_id
        self.now_us = now_us
        self.streams = StreamSchedule()
        self.outboxes: list[list[bytes]] = [[] for _ in encoders]
        self.reboot_requested = False
        self.corrections = self.make_corrections()
        self.traffic = self.make_traffic()
        self._encoders = encoders
        count = len(encoders)
        self._routes = Routes(system_id, count, private_links(vehicle.parameters, count))
        self._snapshot = snapshot
        self._decoders = [Decoder(encoder.signing, encoder.hears) for encoder in encoders]
        self._texts = StatusTextEncoder()
        self._parameters = ParameterServer(vehicle.parameters)
        self._missions = MissionServer(vehicle, self.send, self.send_later)
        self._logbook = logbook
        self._logs = self.logs_class(logbook, vehicle, self.send)
        self._files = self.ftp_class(logbook, vehicle, self.send)
        self._later: list[int] = []
        self.heartbeat_us = HEARTBEAT_US
        self._next_complaint_us = now_us
        self._boot_us = now_us
        first_s = vehicle.estimator.scaled(vehicle.personality.first_heartbeat_s)
        self._heartbeat_due_us = self._first_us = round(first_s * 1e6)
        self._timesync_due_us = now_us + TIMESYNC_US
        self._handlers: dict[str, Callable[[Message], None]] = {
            "HEARTBEAT": self._on_heartbeat,
            "TIMESYNC": self._on_timesync,
            "COMMAND_LONG": self._on_command,
            "COMMAND_INT": self._on_command,
            "SET_MODE": self._on_set_mode,
            "SET_POSITION_TARGET_LOCAL_NED": self._on_local_setpoint,
            "SET_POSITION_TARGET_GLOBAL_INT": self._on_global_setpoint,
            "SET_ATTITUDE_TARGET": self._on_attitude,
            "REQUEST_DATA_STREAM": self._on_request_data_stream,
            "RC_CHANNELS_OVERRIDE": self._on_rc_override,
            "PARAM_REQUEST_LIST": lambda _: self._parameters.request_list(),
            "PARAM_REQUEST_READ": self._on_param_read,
            "PARAM_SET": self._on_param_set,
            "MANUAL_CONTROL": self._on_manual_control,
            "SETUP_SIGNING": self._on_setup_signing,
            "GPS_RTCM_DATA": self.corrections.take,
            "ADSB_VEHICLE": self._on_traffic,
            "LANDING_TARGET": self._on_landing_target,
            **dict.fromkeys(self._missions.handlers, self._now(self._missions.receive)),
            **dict.fromkeys(self._logs.handlers, self._now(self._logs.receive)),
            "FILE_TRANSFER_PROTOCOL": self._now(self._files.receive),
            **self.external_class(vehicle).handlers,
        }

    def make_builders(self, kind: str) -> Mapping[int, Builder]:
        """By message id, of a kind of vehicle."""
        return telemetry.BUILDERS[kind]

    def make_corrections(self) -> Corrections:
        """How this firmware puts the corrections for its GPS together."""
        return Corrections()

    def make_traffic(self) -> TrafficList | TrafficQueue:
        """How this firmware passes on the aircraft that it hears."""
        return TrafficList(self.vehicle.parameters)

    def begin_scanning(self) -> None:
        """The vehicle has a scanner: what it sees is sent unasked, from the first heartbeat on.

        An ArduPilot makes no OBSTACLE_DISTANCE itself: a companion's, which comes as often as
        the scanner turns, is handed on to all links as every message that is for nobody.
        """
        self._begin_stream(_OBSTACLE_DISTANCE, SCANNER_US)

    def _begin_stream(self, message_id: int, interval_us: int) -> None:
        self.streams.set(message_id, interval_us, max(self._first_us, self.now_us) - interval_us)

    # Out.

    def send(self, message: Message) -> None:
        """Put a message into the outboxes of all links, or of that where its target is."""
        encoders = self._encoders
        for place in self._routes.to(message) if len(encoders) > 1 else (0,):
            if frame := encoders[place].encode(message):
                self.outboxes[place].append(frame)

    def take_frames(self, place: int) -> list[bytes]:
        """The frames to send on a link, once."""
        frames, self.outboxes[place] = self.outboxes[place], []
        return frames

    def beat(self, interval_us: int) -> None:
        """Send HEARTBEAT at another interval; 0 for no more."""
        self.heartbeat_us = interval_us
        self._heartbeat_due_us = self.now_us + interval_us if interval_us else NEVER_US

    def send_later(self, message_id: int) -> None:
        """Send a telemetry message once the answer to the request is out."""
        self._later.append(message_id)

    def _send_telemetry(self, message_id: int) -> None:
        builder = self.builders.get(message_id)
        if builder is not None:
            self._send_built(builder(self._snapshot()))

    def _send_built(self, built: Message | list[Message] | None) -> None:
        if built is None:
            return
        for message in built if isinstance(built, list) else (built,):
            self.send(message)

    # Time.

    def next_due_us(self) -> int:
        """The time at which `tick` has something to do."""
        if self._parameters.busy:
            return self.now_us
        due_us = self.streams.next_due_us
        if self._heartbeat_due_us < due_us:
            due_us = self._heartbeat_due_us
        if self._timesync_due_us < due_us:
            due_us = self._timesync_due_us
        return min(
            due_us,
            self._missions.next_due_us(),
            self._logs.next_due_us(),
            self._files.next_due_us(),
        )

    def tick(self, now_us: int) -> None:
        """Send what is due."""
        self.now_us = now_us
        if now_us >= self._heartbeat_due_us:
            self._heartbeat_due_us += self.heartbeat_us
            self.send(heartbeat(self._snapshot()))
        if now_us >= self._timesync_due_us:
            self._timesync_due_us += TIMESYNC_US
            self.send(dialect.MAVLink_timesync_message(0, self._boot_ns()))
        if now_us >= self.streams.next_due_us:
            snapshot, builders = self._snapshot(), self.builders
            for message_id in self.streams.take_due(now_us):
                builder = builders.get(message_id)
                if message_id == ADSB_VEHICLE:
                    self._send_built(self.traffic.due(now_us))
                elif builder is not None:  # else it may be asked for, and there is nothing to say
                    self._send_built(builder(snapshot))
        self._tick_services(now_us)
        if self._parameters.busy:
            for message in self._parameters.take_portion():
                self.send(message)

    def _tick_services(self, now_us: int) -> None:
        if now_us >= self._missions.next_due_us():
            self._missions.tick(now_us)
            self.flush_events()
        for part in (self._logs, self._files):
            if now_us >= part.next_due_us():
                part.tick(now_us)

    def _boot_ns(self) -> int:
        return (self.now_us - self._boot_us) * 1000 + 1

    def flush_events(self) -> None:
        """Report the events of the firmware to the outside."""
        events = self.vehicle.events
        while events:
            event = events.popleft()
            self.log_event(event)
            self._report(event)
        while self._later:
            self._send_telemetry(self._later.pop(0))

    def _report(self, event: Event) -> None:
        """Report to all links."""
        if isinstance(event, StatusText):
            for message in self._texts.messages(event):
                self.send(message)
        elif isinstance(event, ModeChanged):
            was = event.previously_position_controlled
            self.send(heartbeat(self._snapshot(), was))
        elif isinstance(event, HomeChanged):
            self._send_telemetry(_HOME_POSITION)
            self._send_telemetry(_GPS_GLOBAL_ORIGIN)
        elif isinstance(event, ItemReached):
            self.send(dialect.MAVLink_mission_item_reached_message(event.seq))
        elif isinstance(event, PhotoTaken):
            self._send_telemetry(_CAMERA_FEEDBACK)
        elif isinstance(event, ParameterSaved):
            self.send(saved_parameter(event, self.vehicle.parameters))
        elif isinstance(event, RebootRequested):
            self.reboot_requested = True

    def log_event(self, event: Event) -> None:
        """Put an event into the vehicle's own log."""
        self._logbook.note(event, self.now_us - self._boot_us)

    # In.

    def receive(
        self, data: bytes, now_us: int, datagram: bool = True, place: int = 0
    ) -> list[bytes]:
        """Process the messages in bytes from the link.

        Args:
            data: the bytes.
            now_us: simulated time.
            datagram: whether a frame that is cut short ends here.
            place: of the link.

        Returns:
            The well-formed frames among them, for a log.
        """
        self.now_us = now_us
        frames = []
        decoder = self._decoders[place]
        for message in decoder.feed(data):
            frames.append(bytes(message.get_msgbuf()))
            for other in self._routes.hand_on(message, place):
                self.outboxes[other].append(frames[-1])
            self._dispatch(message)
            self.flush_events()
        if datagram:
            decoder.reset()
        return frames

    def _now(self, receive: Callable[[Message, int], None]) -> Callable[[Message], None]:
        return lambda message: receive(message, self.now_us)

    def _dispatch(self, message: Message) -> None:
        sender = (message.get_srcSystem(), message.get_srcComponent())
        if sender == (self.system_id, COMPONENT_AUTOPILOT):
            return  # our own words come back
        target = getattr(message, "target_system", 0)
        if target not in (0, self.system_id):
            return
        handler = self._handlers.get(message.get_type())
        if handler is not None:
            handler(message)

    def _on_heartbeat(self, message: Message) -> None:
        if message.get_srcSystem() == int(self.vehicle.parameters["MAV_GCS_SYSID"]):
            self.vehicle.failsafe.gcs_heartbeat(self.now_us / 1e6)

    def _on_traffic(self, message: Message) -> None:
        self.traffic.take(message, self.now_us)

    def _on_timesync(self, message: Message) -> None:
        if message.tc1 == 0:
            self.send(dialect.MAVLink_timesync_message(self._boot_ns(), message.ts1))

    def _on_command(self, message: Message) -> None:
        result = commands.handle(self, from_message(message))
        self.send(
            dialect.MAVLink_command_ack_message(
                message.command,
                int(result),
                0,
                0,
                message.get_srcSystem(),
                message.get_srcComponent(),
            )
        )

    def _on_set_mode(self, message: Message) -> None:
        if message.base_mode & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            self.vehicle.set_mode(message.custom_mode)

    def _on_local_setpoint(self, message: Message) -> None:
        self._take_setpoint(lambda: setpoints.from_local_ned(message), self.vehicle.setpoint)

    def _on_global_setpoint(self, message: Message) -> None:
        self._take_setpoint(
            lambda: setpoints.from_global_int(message, self.vehicle), self.vehicle.setpoint
        )

    def _on_attitude(self, message: Message) -> None:
        """Only rovers and boats follow it here."""
        if isinstance(self.vehicle, Rover):
            take = self.vehicle.attitude
            self._take_setpoint(lambda: setpoints.from_attitude_target(message), take)

    def _on_landing_target(self, message: Message) -> None:
        """Take where a landing target is, in a copter's axes; the message has no addressee."""
        seen = (message.x, message.y, message.z)
        usable = all(map(math.isfinite, (*seen, message.distance)))
        if not isinstance(self.vehicle, Copter) or message.position_valid != 1 or not usable:
            return
        if message.frame == dialect.MAV_FRAME_BODY_FRD:
            self.vehicle.landing_target.hear(seen, message.distance)
        else:
            self.vehicle.landing_target.refuse_frame()

    def _take_setpoint(self, decode: Callable[[], T | None], take: Callable[[T], None]) -> None:
        try:
            setpoint = decode()
        except setpoints.UnusableError as error:
            # Once a second is enough: setpoints come in streams.
            if self.now_us >= self._next_complaint_us:
                self._next_complaint_us = self.now_us + COMPLAINT_US
                self.vehicle.say(Severity.WARNING, f"Setpoint ignored: {error}")
            return
        if setpoint is not None:
            take(setpoint)

    def _on_request_data_stream(self, message: Message) -> None:
        rate_hz = message.req_message_rate
        for message_id in self.vehicle.personality.streams.get(message.req_stream_id, ()):
            wanted = message.start_stop and rate_hz
            interval_us = 1_000_000 // rate_hz if wanted else None
            self.streams.set_default(message_id, interval_us, self.now_us)

    def _on_rc_override(self, message: Message) -> None:
        if message.get_srcSystem() == int(self.vehicle.parameters["MAV_GCS_SYSID"]):
            self.vehicle.pilot.override(sticks.overrides(message), self.now_us / 1e6)
            self.vehicle.failsafe.gcs_heartbeat(self.now_us / 1e6)

    def _on_manual_control(self, message: Message) -> None:
        mine = message.get_srcSystem() == int(self.vehicle.parameters["MAV_GCS_SYSID"])
        if mine and message.target == self.system_id:
            channels = sticks.of_manual_control(message, self.vehicle)
            self.vehicle.pilot.override(channels, self.now_us / 1e6)
            self.vehicle.failsafe.gcs_heartbeat(self.now_us / 1e6)

    def _on_setup_signing(self, message: Message) -> None:
        """A new key, unless the vehicle is armed; there is no answer to it."""
        if self.vehicle.armed:
            self.vehicle.say(Severity.CRITICAL, "ERROR: Won't setup signing when armed")
            return
        self._take_key(message)

    def _take_key(self, message: Message) -> None:
        if message.initial_timestamp >= LATEST_SIGNATURE:
            return  # no clock shows that, and nothing could be signed after it
        for encoder in self._encoders:
            encoder.set_up_signing(bytes(message.secret_key), message.initial_timestamp)

    def send_mode_list(self, place: int) -> bool:
        """AVAILABLE_MODES: one of them, from 1, or with 0 all; whether there is such a one."""
        modes = list(self.vehicle.personality.modes.values())
        if not 0 <= place <= len(modes):
            return False
        for index, spec in enumerate(modes, 1):
            if place in (0, index):
                name = spec.name.encode("ascii")
                message = (len(modes), index, 0, spec.number, 0, name)
                self.send(dialect.MAVLink_available_modes_message(*message))
        return True

    def _on_param_read(self, message: Message) -> None:
        answer = self._parameters.read(_name(message.param_id), message.param_index)
        if answer is not None:
            self.send(answer)
        elif message.param_index < 0:
            self._reject_parameter(message, dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST)

    def _on_param_set(self, message: Message) -> None:
        answer = self._parameters.set(_name(message.param_id), float(message.param_value))
        if answer is None:
            self._reject_parameter(message, dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST)
        elif not self._report_bad_value(message):
            self.send(answer)

    def _report_bad_value(self, message: Message) -> bool:
        bad = not math.isfinite(message.param_value)
        return bad and self._reject_parameter(message, dialect.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE)

    def _reject_parameter(self, message: Message, error: int) -> bool:
        """PARAM_ERROR to the asker; whether this release sends one."""
        sends = self.vehicle.personality.reports_parameter_errors
        if sends:
            name = _name(message.param_id).encode("ascii", "replace")
            asker = (message.get_srcSystem(), message.get_srcComponent())
            self.send(dialect.MAVLink_param_error_message(*asker, name, -1, error))
        return sends


def _name(param_id: str | bytes) -> str:
    text = param_id.decode("ascii", "replace") if isinstance(param_id, bytes) else param_id
    return text.split("\0")[0]
