"""PX4's side of one link, sans-IO.

A vehicle has one for each of its links, and each has its own streams, parameters' transfer
and acknowledgements. As recorded: HEARTBEAT strictly once a second, whatever changes; texts
only where a ground station's heartbeat is heard; heartbeats of one link are handed on to the
others; commands are answered for component 0 and 1, others are met with silence.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from mavlink_sitl.autopilot.personality import px4
from mavlink_sitl.autopilot.px4.multicopter.copter import Px4Copter
from mavlink_sitl.autopilot.px4.safety_systems import PARACHUTE, REMOTE_ID
from mavlink_sitl.autopilot.px4.sticks import ManualControl
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from mavlink_sitl.autopilot.state.setpoint import Setpoint
from mavlink_sitl.exchange import (
    Event,
    HomeChanged,
    ItemReached,
    ModeChanged,
    PhotoTaken,
    RebootRequested,
    Result,
    Severity,
    StatusText,
)
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.mavlink.codec import Encoder, Extended, Message, dialect
from mavlink_sitl.mavlink.corrections import (
    AssembledPx4Corrections,
    Corrections,
    Px4Corrections,
)
from mavlink_sitl.mavlink.external_position import Px4ExternalPositionReceiver
from mavlink_sitl.mavlink.files.ftp_server import Px4FtpServer
from mavlink_sitl.mavlink.logs.log_server import Px4LogServer
from mavlink_sitl.mavlink.messages.snapshot import Builder, Snapshot
from mavlink_sitl.mavlink.messages.statustext import StatusTextEncoder
from mavlink_sitl.mavlink.messages.streams import NEVER_US
from mavlink_sitl.mavlink.px4 import (
    commands,
    gimbal,
    messages,
    rates,
    setpoints,
)
from mavlink_sitl.mavlink.px4.camera import IMAGE_CAPTURED, CameraComponent
from mavlink_sitl.mavlink.px4.component import Component
from mavlink_sitl.mavlink.px4.gimbal import GimbalComponent
from mavlink_sitl.mavlink.px4.parameters import HASH_CHECK, Px4ParameterServer
from mavlink_sitl.mavlink.received_command import from_message
from mavlink_sitl.mavlink.server import COMPONENT_AUTOPILOT, MavlinkServer, PoweredUp, _name
from mavlink_sitl.mavlink.setpoints import usable
from mavlink_sitl.mavlink.traffic import ADSB_VEHICLE, TrafficQueue

PARAM_ERROR_TYPE_MISMATCH = 7
"""MAV_PARAM_ERROR; the dialect lacks it"""
GCS_TIMEOUT_US = 2_500_000
"""A ground station that has been silent for longer gets no texts"""
REACHED_REPEATS = 10
"""MISSION_ITEM_REACHED comes again once a second, this many times"""
GIMBAL_US, GIMBAL_REPEATS = 500_000, 4
"""The vehicle itself asks for its gimbal when it lands, returns or leaves a mission, in vain"""
_NAN = float("nan")
TAKE_NEUTRAL_RELEASE = (
    (1001, (1.0, 1.0, -1.0, -1.0, 0.0, 0.0, 0.0)),
    (1000, (_NAN, _NAN, _NAN, _NAN, 2.0, 0.0, 0.0)),
    (1001, (-3.0, -3.0, -1.0, -1.0, 0.0, 0.0, 0.0)),
)
"""DO_GIMBAL_MANAGER_CONFIGURE, _PITCHYAW and _CONFIGURE as recorded; only the first is repeated"""
HANDED_ON = ("HEARTBEAT", "SET_MODE")
"""Messages that are forwarded from the link they came on to the vehicle's other links"""
CALIBRATES = "[cal]"
"""How texts of a calibration begin"""
ONBOARD, GCS = "onboard", "gcs"
_HOME_POSITION, _OBSTACLE_DISTANCE, _CURRENT_MODE = 242, 330, 436
COMMANDER_US = 10_000
"""The commander judges a mode at most this much later: OFFBOARD with its first setpoint 0.3 ms
behind the command was accepted, after 10.8 ms"""
STATUS_US = 500_000
"""Period at which the commander publishes vehicle_status; it also does so at each change"""
_SAFETY_SYSTEMS = {dialect.MAV_TYPE_PARACHUTE: PARACHUTE, dialect.MAV_TYPE_ODID: REMOTE_ID}
_WELL = (dialect.MAV_STATE_STANDBY, dialect.MAV_STATE_ACTIVE)
_UNSIGNED = frozenset(
    {
        dialect.MAVLINK_MSG_ID_HEARTBEAT,
        dialect.MAVLINK_MSG_ID_RADIO_STATUS,
        dialect.MAVLINK_MSG_ID_ADSB_VEHICLE,
        dialect.MAVLINK_MSG_ID_COLLISION,
    }
)
"""Messages that a 1.18 with a key takes unsigned (its page on message signing)"""
_RATES = {ONBOARD: rates.ONBOARD_HZ, GCS: rates.GCS_HZ}


def _may_be_unsigned(_decoder: object, message_id: int) -> bool:
    return message_id in _UNSIGNED


class Px4Server(MavlinkServer):
    """Speaks for one vehicle on one link, from one power-up to the next.

    Args:
        served: the vehicle, with the same firmware.
        vehicle: its firmware.
        encoder: keeps the link's sequence numbers, over reboots too.
        role: "onboard" for a companion computer's link, "gcs" for a ground station's.

    Attributes:
        peers: the servers of all links of the vehicle, this one among them.
        asker: system and component whose message it is that is answered.
    """

    vehicle: Px4Vehicle
    external_class = Px4ExternalPositionReceiver
    ftp_class = Px4FtpServer
    logs_class = Px4LogServer
    steady = frozenset({0, 42})
    """HEARTBEAT, and MISSION_CURRENT of the mission service"""

    def __init__(self, served: PoweredUp, vehicle: Px4Vehicle, encoder: Encoder, role: str) -> None:
        super().__init__(served, (encoder,))
        self.vehicle = vehicle
        self.role = role
        vehicle.payload.own = (self.system_id, COMPONENT_AUTOPILOT)
        self._rates_hz = dict(_RATES[role])
        of_gimbal = gimbal.GIMBAL_HZ.items()
        self._rates_hz.update(each for each in of_gimbal if each[0] in self.builders)
        payload = vehicle.payload
        about = (self.system_id, payload, served.snapshot, self._send_frame, served.now_us)
        self._components: list[Component] = []
        if payload.has_camera:
            self._components.append(CameraComponent(*about))
        if payload.device == GimbalComponent.number:
            self._components.append(GimbalComponent(*about))
        self.peers: list[Px4Server] = [self]
        self._parameters: Px4ParameterServer = Px4ParameterServer(vehicle.parameters)
        self._texts = StatusTextEncoder(numbers_all=True)
        self._gcs_heard_us: int | None = None
        self._ping_seq = 0
        self._ping_us = round(1e6 / rates.PING_HZ[role])
        self._ping_due_us = served.now_us + self._ping_us
        self._timesync_due_us = NEVER_US
        self.asker = (0, 0)
        self._reached: tuple[int, int, int] | None = None
        self._gimbal: tuple[int, int] | None = None
        self._undecided: tuple[int, tuple[int, int]] | None = None
        """When an OFFBOARD without a stream is judged, and who asked for it"""
        self._mode_name = ""
        self._scans = False
        self._reported_mode: tuple[int, int, int] | None = None
        begin_us = self._heartbeat_due_us
        self._heartbeat_due_us = NEVER_US
        for message_id in self._rates_hz:
            interval_us = self._default_interval_us(message_id)
            self.streams.set(message_id, interval_us, begin_us - interval_us)
        self._handlers.update(
            {
                "PING": self._on_ping,
                "MANUAL_CONTROL": self._on_manual_control,
                "FOLLOW_TARGET": self._on_follow_target,
                "GIMBAL_MANAGER_SET_ATTITUDE": partial(gimbal.on_set_attitude, self),
                "GIMBAL_MANAGER_SET_MANUAL_CONTROL": partial(gimbal.on_manual_control, self),
            }
        )
        for unheard in ("REQUEST_DATA_STREAM", "RC_CHANNELS_OVERRIDE"):
            del self._handlers[unheard]

    def make_builders(self, kind: str) -> Mapping[int, Builder]:
        """See `MavlinkServer`."""
        of_gimbal = gimbal.BUILDERS[self.vehicle.payload.device]
        return {**messages.BUILDERS[kind], **of_gimbal, _CURRENT_MODE: self._current_mode}

    def _send_frame(self, frame: bytes) -> None:
        self.outboxes[0].append(frame)

    def make_corrections(self) -> Corrections:
        """How this release puts the corrections for its GPS together."""
        assembles = self.vehicle.personality.assembles_corrections
        return AssembledPx4Corrections() if assembles else Px4Corrections()

    def make_traffic(self) -> TrafficQueue:
        """Each link sends each report once."""
        return TrafficQueue(self.send, lambda: self.streams.interval_us(ADSB_VEHICLE) >= 0)

    def _on_traffic(self, message: Message) -> None:
        for peer in self.peers:
            peer.traffic.take(message, self.now_us)

    # Time and streams.

    def _default_interval_us(self, message_id: int) -> int:
        rate_hz = self._rates_hz.get(message_id)
        if message_id == _OBSTACLE_DISTANCE and self._scans:
            rate_hz = rates.SCANNER_HZ[self.role]
        return -1 if rate_hz is None else round(1e6 / rate_hz)

    def begin_scanning(self) -> None:
        """Start to stream OBSTACLE_DISTANCE: the vehicle has a scanner."""
        self._scans = True
        self._begin_stream(_OBSTACLE_DISTANCE, self._default_interval_us(_OBSTACLE_DISTANCE))

    def _current_mode(self, snapshot: Snapshot) -> Message | None:
        """CURRENT_MODE, unless the vehicle_status has not been published again since the last."""
        message = messages.current_mode(snapshot)
        published = snapshot.time_boot_us // STATUS_US
        status = (published, message.custom_mode, message.intended_custom_mode)
        if status == self._reported_mode:
            return None
        self._reported_mode = status
        return message

    def set_interval(self, message_id: int, interval_us: int) -> None:
        """SET_MESSAGE_INTERVAL: 0 is the default, -1 stops it."""
        if interval_us == 0:
            interval_us = self._default_interval_us(message_id)
        if interval_us < 0:
            self.streams.stop(message_id)
        else:
            interval_us = max(interval_us, self.vehicle.personality.shortest_interval_us)
            self.streams.set(message_id, interval_us, self.now_us)

    def next_due_us(self) -> int:
        """The time at which `tick` has something to do."""
        due_us = min(super().next_due_us(), self._ping_due_us)
        if self._reached is not None:
            due_us = min(due_us, self._reached[1])
        if self._gimbal is not None:
            due_us = min(due_us, self._gimbal[1])
        if self._undecided is not None:
            due_us = min(due_us, self._undecided[0])
        for component in self._components:
            due_us = min(due_us, component.due_us)
        return due_us

    def tick(self, now_us: int) -> None:
        """Send what is due."""
        super().tick(now_us)
        for component in self._components:
            component.tick(now_us)
        if now_us >= self._ping_due_us:
            self._ping_due_us += self._ping_us
            ping = dialect.MAVLink_ping_message(now_us - self._boot_us, self._ping_seq, 0, 0)
            self._ping_seq = (self._ping_seq + 1) % 2**32
            self.send(ping)
        if self._reached is not None and now_us >= self._reached[1]:
            self._repeat_reached()
        if self._gimbal is not None and now_us >= self._gimbal[1]:
            self._ask_for_gimbal(*self._gimbal)
        if self._undecided is not None and now_us >= self._undecided[0]:
            self._decide()

    def _ask_for_gimbal(self, confirmation: int, due_us: int) -> None:
        asked = TAKE_NEUTRAL_RELEASE if confirmation == 0 else TAKE_NEUTRAL_RELEASE[:1]
        if confirmation == 0:
            self.vehicle.payload.rest_and_release()
        for command, params in asked:
            self.send(
                dialect.MAVLink_command_long_message(
                    self.system_id, 0, command, confirmation, *params
                )
            )
        wait_us = GIMBAL_US if confirmation else 2 * GIMBAL_US
        again = confirmation + 1 < GIMBAL_REPEATS
        self._gimbal = (confirmation + 1, due_us + wait_us) if again else None

    def _repeat_reached(self) -> None:
        assert self._reached is not None
        seq, due_us, left = self._reached
        if not self.vehicle.plans.mission.items:
            self._reached = None  # what was cleared is reached no more
            return
        self.send(dialect.MAVLink_mission_item_reached_message(seq))
        self._reached = (seq, due_us + 1_000_000, left - 1) if left > 1 else None

    def send_modes(self, place: int) -> None:
        """AVAILABLE_MODES: one of them, or with 0 all."""
        count = len(self.vehicle.personality.available_modes)
        if place == 0:
            for each in range(1, count + 1):
                self.send(messages.available_mode(self.vehicle, each))
        elif 1 <= place <= count:
            self.send(messages.available_mode(self.vehicle, place))

    # Reports of the firmware.

    def _report(self, event: Event) -> None:
        for peer in self.peers:
            if isinstance(event, PhotoTaken):
                peer.report_photo()
            else:
                peer.tell(event)

    def report_photo(self) -> None:
        """Let the camera report to this link the photo that it has just taken."""
        for component in self._components:
            if isinstance(component, CameraComponent):
                component.send(IMAGE_CAPTURED)

    def tell(self, event: Event) -> None:
        """Report to this link."""
        if isinstance(event, StatusText):
            if self._gcs_connected():
                # A tab marks what is also an event; calibrations have none.
                end = "" if event.text.startswith(CALIBRATES) else "\t"
                text = StatusText(event.severity, event.text.rstrip("\t") + end)
                for message in self._texts.messages(text):
                    self.send(message)
        elif isinstance(event, HomeChanged):
            self._send_telemetry(_HOME_POSITION)
        elif isinstance(event, ItemReached):
            self._reached = (event.seq, self.now_us, REACHED_REPEATS)
            self._repeat_reached()
        elif isinstance(event, ModeChanged):
            # It shows in the next HEARTBEAT only.
            left, self._mode_name = self._mode_name, event.name
            neutral = event.name in ("AUTO.LAND", "AUTO.RTL") or left == "AUTO.MISSION"
            if neutral and self.vehicle.in_flight:
                self._gimbal = (0, self.now_us + GIMBAL_US // 2)
        elif isinstance(event, RebootRequested):
            self.reboot_requested = True

    def _gcs_connected(self) -> bool:
        heard_us = self._gcs_heard_us
        return heard_us is not None and self.now_us - heard_us < GCS_TIMEOUT_US

    # In.

    def _dispatch(self, message: Message) -> None:
        sender = (message.get_srcSystem(), message.get_srcComponent())
        if sender == (self.system_id, COMPONENT_AUTOPILOT):
            return
        component = getattr(message, "target_component", 0)
        if message.get_type() in HANDED_ON:
            for peer in self.peers:
                if peer is not self:
                    peer.outboxes[0].append(bytes(message.get_msgbuf()))
        for part in self._components:
            if part.is_asked(message):
                part.receive(message)
                self.flush_events()
        if component not in (0, COMPONENT_AUTOPILOT):
            return
        self.asker = sender
        super()._dispatch(message)

    def has_now(self, message_id: int) -> bool:
        """Whether a message has something to report now."""
        return self.builders[message_id](self._snapshot()) is not None

    def asked_by_station(self) -> bool:
        """Whether a ground station's own component asks: only it gets texts of rejected modes."""
        return bool(self.asker[1] == dialect.MAV_COMP_ID_MISSIONPLANNER)

    def acknowledge(self, command: int, result: Result) -> None:
        """COMMAND_ACK to whoever asked."""
        self.send(dialect.MAVLink_command_ack_message(command, int(result), 0, 0, *self.asker))

    def choose_mode(self, number: int) -> Result | None:
        """Change the mode; None while OFFBOARD may still get its first setpoint."""
        if number == px4.OFFBOARD and self.vehicle.armed and not self.vehicle.can_run(number):
            self._undecided = (self.now_us + COMMANDER_US, self.asker)
            return None
        return self.vehicle.set_mode(number, with_text=self.asked_by_station())

    def _decide(self) -> None:
        """Judge the OFFBOARD that waits."""
        if self._undecided is None:
            return
        now_asks, self.asker = self.asker, self._undecided[1]
        self._undecided = None
        result = self.vehicle.set_mode(px4.OFFBOARD, with_text=self.asked_by_station())
        self.flush_events()
        self.acknowledge(dialect.MAV_CMD_DO_SET_MODE, result)
        self.asker = now_asks

    def _on_command(self, message: Message) -> None:
        self._decide()
        result = commands.handle(self, from_message(message))
        # Texts come before the acknowledgement.
        later, self._later = self._later, []
        self.flush_events()
        self._later = later
        if result is not None:
            self.acknowledge(message.command, result)

    def _on_set_mode(self, message: Message) -> None:
        self._decide()
        custom = message.custom_mode
        main, sub = custom >> 16 & 0xFF, custom >> 24 & 0xFF
        number = commands.mode_number(message.base_mode, main, sub)
        result = self.choose_mode(number)
        if result is not None:
            self.acknowledge(dialect.MAV_CMD_DO_SET_MODE, result)

    def _on_heartbeat(self, message: Message) -> None:
        if message.type == dialect.MAV_TYPE_GCS:
            self._gcs_heard_us = self.now_us
            self.vehicle.failsafe.gcs_heartbeat(self.now_us / 1e6)
        system = _SAFETY_SYSTEMS.get(message.type)
        if system is not None and message.get_srcSystem() == self.system_id:
            self.vehicle.systems.hear(system, message.system_status in _WELL)

    def _on_setup_signing(self, message: Message) -> None:
        """A new key; nothing answers to it. From 1.18 on not while armed."""
        if self.vehicle.personality.signs_by_specification:
            if self.vehicle.armed:
                return
            for encoder in self._encoders:
                encoder.signing.allow_unsigned_callback = _may_be_unsigned
        self._take_key(message)

    def _on_timesync(self, message: Message) -> None:
        if message.tc1 == 0:
            now_ns = messages.wire_time(self._snapshot())
            # The target fields are uninitialised in the real one; 255 was seen.
            answer = dialect.MAVLink_timesync_message(now_ns, message.ts1)
            self.send(Extended(answer, b"\xff\xff"))

    def _on_ping(self, message: Message) -> None:
        if message.target_system == 0 or message.target_component == 0:
            sender = message.get_srcSystem(), message.get_srcComponent()
            self.send(dialect.MAVLink_ping_message(message.time_usec, message.seq, *sender))

    def _on_manual_control(self, message: Message) -> None:
        if message.target != self.system_id:
            return
        pitch, roll, yaw = (
            min(max(value / 1000.0, -1.0), 1.0) for value in (message.x, message.y, message.r)
        )
        throttle = min(max(message.z / 1000.0, 0.0), 1.0)
        self.vehicle.sticks.hear(ManualControl(pitch, roll, yaw, throttle))
        self.flush_events()

    def _on_follow_target(self, message: Message) -> None:
        """Take where the target of AUTO.FOLLOW_TARGET is; the message has no addressee.

        Without a velocity the estimate makes one (read in the firmware).
        """
        latitude_deg, longitude_deg = message.lat / 1e7, message.lon / 1e7
        if abs(latitude_deg) > 90.0 or abs(longitude_deg) > 180.0 or not usable(message.alt):
            return
        if isinstance(self.vehicle, Px4Copter):
            north, east, down = message.vel
            known = all(map(usable, (north, east, down)))
            place = GeoPoint(latitude_deg, longitude_deg, message.alt)
            self.vehicle.see_target(place, (north, east, down) if known else None)

    def _on_landing_target(self, message: Message) -> None:
        """Take where a landing target is, in the local frame; the message has no addressee."""
        seen = (message.x, message.y, message.z)
        local = message.frame == dialect.MAV_FRAME_LOCAL_NED and message.position_valid == 1
        if isinstance(self.vehicle, Px4Copter) and local and all(map(usable, seen)):
            self.vehicle.see_landing_target(seen)

    def _on_local_setpoint(self, message: Message) -> None:
        self._follow(lambda: setpoints.from_local_ned(message))

    def _on_global_setpoint(self, message: Message) -> None:
        self._follow(lambda: setpoints.from_global_int(message, self.vehicle))

    def _on_attitude(self, message: Message) -> None:
        self._follow(lambda: setpoints.from_attitude_target(message))

    def _follow(self, decode: Callable[[], Setpoint]) -> None:
        try:
            self.vehicle.setpoint(decode())
        except setpoints.RefusedError as error:
            self.vehicle.say(Severity.CRITICAL, str(error))

    def _on_param_set(self, message: Message) -> None:
        name = _name(message.param_id)
        answer = self._parameters.set_typed(name, message.param_value, message.param_type)
        if answer is not None:
            self.send(answer)
        elif name not in self.vehicle.parameters:
            if name != HASH_CHECK:
                self._reject_parameter(message, dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST)
        else:
            self._reject_parameter(message, PARAM_ERROR_TYPE_MISMATCH)
