"""One simulated vehicle: firmware, MAVLink side, link, and the test operations on it.

Part of `simulation` (the same layer): joins the autopilot and the MAVLink services with the
lanes of `physics`.
"""

from __future__ import annotations

import struct
from typing import BinaryIO

from mavlink_sitl.autopilot.common.commander import PowerUp
from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.plans.plans import Plans
from mavlink_sitl.autopilot.px4.sticks import ManualControl
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from mavlink_sitl.config import Underway, VehicleConfig
from mavlink_sitl.environment import Environment
from mavlink_sitl.exchange import (
    GRAVITY_M_S2,
    ZERO,
    BatteryReading,
    FurtherBattery,
    GpsReading,
    Guidance,
    Observation,
    Result,
    Severity,
    Vector,
)
from mavlink_sitl.links.simulated_link import SimulatedLink
from mavlink_sitl.mavlink.codec import Encoder
from mavlink_sitl.mavlink.messages.snapshot import Snapshot
from mavlink_sitl.mavlink.messages.streams import NEVER_US
from mavlink_sitl.mavlink.server import COMPONENT_AUTOPILOT, MavlinkServer, PoweredUp
from mavlink_sitl.physics.fleets import Fleet
from mavlink_sitl.vehicles.body import VehicleBody
from mavlink_sitl.vehicles.firmwares import firmware_class, make_logbook, make_servers
from mavlink_sitl.vehicles.injection import Failures

REBOOT_US = 1_200_000
"""Silence from the acknowledgement of a reboot to the first HEARTBEAT"""


class SimulatedVehicle(VehicleBody):
    """A vehicle of a simulation, made by it.

    Attributes:
        index: its row in `Simulation.truth`.
        system_id: its MAVLink system id.
        link: to talk to it.
        links: all of them, one for each of `VehicleConfig.links`; `link` is the first.
        firmware: that which it runs, another one after a reboot.
        parameters: its parameters; they survive reboots.
        plans: its mission, fence and rally points; they survive, too.
        logbook: its own logs; they survive, too.
        offset_ned_m: where its local origin is, from home.
        now_us: simulated time.
        wake_us: when it has something to send; before, `tick` is only needed to act.
        damage: why it will not fly again; None when it is whole.
    """

    def __init__(
        self,
        index: int,
        config: VehicleConfig,
        system_id: int,
        fleet: Fleet,
        seed: int,
        log: BinaryIO | None,
        epoch_us: int,
    ) -> None:
        super().__init__(index, config, fleet)
        self.system_id = system_id
        personality = config.personality()
        values = dict(config.parameters)
        if "BATT_CAPACITY" in personality.parameter_table.acting:
            values.setdefault("BATT_CAPACITY", config.battery.capacity_mah)
        self.parameters = Parameters(personality.parameter_table, values)
        self.plans = Plans()
        self.logbook = make_logbook(personality)
        self.offset_ned_m = (0.0, 0.0, 0.0)
        self._log = log
        self._epoch_us = epoch_us
        self._encoders = [
            Encoder(system_id, COMPONENT_AUTOPILOT, config.mavlink_1) for _ in config.links
        ]
        self._servers: list[MavlinkServer] = []
        self.damage: str | None = None
        self._failures = Failures(self)
        self._boot_at_us: int | None = None
        self._further_batteries: dict[int, FurtherBattery] = {}
        self._battery_turn = -1
        self.wake_us = 0
        self._underway = config.underway
        self._snapshot_cache: tuple[int, Snapshot] | None = None
        self._capacity = (-1, 0.0)
        """Revision of the parameters, and the capacity by them, mAh"""
        self._boot()
        self.links = [self._make_link(place, seed) for place in range(len(config.links))]
        self.link = self.links[0]

    def _make_link(self, place: int, seed: int) -> SimulatedLink:
        name = f"link:{seed}:{self.index}" + (f":{place}" if place else "")

        def receive(data: bytes, datagram: bool) -> None:
            self.receive(data, datagram, place)

        return SimulatedLink(name, self.config.faults, receive, lambda: self.now_us, self.wake)

    def _boot(self) -> None:
        if self._boot_at_us is not None:
            self._move_origin()
        self._boot_at_us = None
        self.parameters.power_up()
        self._boot_us = self.now_us
        self._snapshot_cache = None
        self._resets = self._regains = 0
        start = PowerUp(
            self.config.personality(),
            self.parameters,
            self.plans,
            self,
            self.origin,
            self._observation(),
            self.config.ready_after_s,
            self.config.external_position,
            self.config.photo_camera,
        )
        self.firmware = firmware_class(start.personality)(start)
        self.logbook.power_up()
        self._revision = -1
        served = PoweredUp(self.firmware, self.system_id, self.now_us, self.snapshot, self.logbook)
        self._servers = make_servers(served, self._encoders, self.config.links)
        self._begin_scanning()
        self._pass_guidance()

    def enter(self, environment: Environment) -> None:
        """Be in a world; called once by the simulation."""
        super().enter(environment)
        self._begin_scanning()

    def _begin_scanning(self) -> None:
        if self._environment is not None and self._environment.world.range_sensor is not None:
            for server in self._servers:
                server.begin_scanning()
            self._plan_wake()

    # Time.

    def tick(self, now_us: int, acts: bool) -> None:
        """A tick has passed; `acts` when the firmware acts, too."""
        self.now_us = now_us
        if not self.wake_us and not self._moves_on(now_us):
            return
        if acts:
            self._act()
        if now_us >= self.wake_us:
            for server in self._servers:
                if now_us >= server.next_due_us():
                    server.tick(now_us)
            self._plan_wake()
            self._send_all()

    def _act(self) -> None:
        """The firmware acts."""
        self._failures.follow_parameters()
        if self.config.external_position:
            self._watch_external_position()
        firmware = self.firmware
        firmware.update(self._observation())
        self._follow_resets(firmware.estimator.resets, firmware.estimator.regains)
        if self._underway is not None and firmware.started and firmware.estimator.position_ok:
            self._put_underway(self._underway)
        if firmware.events:
            self._flush_events()
            self._plan_wake()
            self._send_all()
            if self._servers[0].reboot_requested:
                self._shut_down()
                return
        if firmware.revision != self._revision:
            self._pass_guidance()
        self.logbook.watch(self.now_us, firmware.armed, self.snapshot)

    def _put_underway(self, underway: Underway) -> None:
        """Put it where it is to begin, once."""
        self._underway = None
        velocity = underway.velocity_ned_m_s if underway.moves else ZERO
        self._physics.put(self._lane, underway.place_ned_m, velocity)
        self.firmware.observe(self._observation())
        if underway.moves:
            self.firmware.begin_underway()

    def _moves_on(self, now_us: int) -> bool:
        """Deliver late bytes on links, continue a start, and return whether the firmware runs."""
        for link in self.links:
            if link.late:
                link.pump()
        if self._boot_at_us is not None:
            if now_us < self._boot_at_us:
                return False
            self._boot()
        return True

    def wake(self) -> None:
        """Tick it at once: something may be late on a link."""
        self.wake_us = 0

    def _plan_wake(self) -> None:
        wake_us = NEVER_US if self._boot_at_us is None else 0
        for server in self._servers:
            wake_us = min(wake_us, server.next_due_us())
        for link in self.links:
            if link.late:
                wake_us = 0
        self.wake_us = wake_us

    def _flush_events(self) -> None:
        for server in self._servers:
            server.now_us = self.now_us
        self._servers[0].flush_events()

    def receive(self, data: bytes, datagram: bool, place: int = 0) -> None:
        """Bytes arrive at the vehicle, on one of its links."""
        if self._boot_at_us is not None:
            return
        self.firmware.observe(self._observation())
        for server in self._servers:
            server.now_us = self.now_us
        alone = len(self._servers) == 1
        server = self._servers[0 if alone else place]
        for frame in server.receive(data, self.now_us, datagram, place if alone else 0):
            self._record(frame)
        self._pass_guidance()
        self._send_all()
        if server.reboot_requested:
            self._shut_down()
        self._plan_wake()

    def _send_all(self) -> None:
        for place, server in enumerate(self._servers):
            links = self.links if len(self._servers) == 1 else self.links[place : place + 1]
            for own, link in enumerate(links):
                for frame in server.take_frames(own):
                    self._record(frame)
                    link.deliver(frame)

    def _record(self, frame: bytes) -> None:
        """Into the telemetry log: big-endian microseconds since 1970, then the raw frame."""
        if self._log is not None:
            self._log.write(struct.pack(">Q", self._epoch_us + self.now_us) + frame)

    def _pass_guidance(self) -> None:
        if self.firmware.revision != self._revision:
            self._revision = self.firmware.revision
            self._physics.guide(self._lane, self.firmware.guidance)

    def _move_origin(self) -> None:
        """A firmware that starts takes the place where it is for its origin."""
        self.origin = self.truth_point()
        home = self.frame._replace(origin=self.config.home)
        self.offset_ned_m = home.to_local(self.origin)
        self._physics.put_at_origin(self._lane)
        if self._environment is not None:
            self._environment.move_origin(self._lane, self.origin)

    def _shut_down(self) -> None:
        """The firmware stops, and the motors; it will start again where the vehicle then is."""
        # It is silent for a while after it has started, too; that counts in.
        first_s = self.config.personality().first_heartbeat_s * self.firmware.estimator.time_scale
        self._boot_at_us = self.now_us + REBOOT_US - round(first_s * 1e6)
        self.wake_us = 0
        self._physics.guide(self._lane, Guidance())

    @property
    def corrections(self) -> list[bytes]:
        """The RTCM corrections that its GPS receiver was given since it started, on any link."""
        return [data for server in self._servers for data in server.corrections.given]

    # Requests by the firmware, as `firmware.Body`.

    def moving_target(self) -> Vector:
        """Where the controllers' moving target is, NED metres."""
        return self._physics.moving_target(self._lane)

    def inject_failure(self, unit: int, kind: int, instance: int) -> Result:
        """Break something, by MAV_CMD_INJECT_FAILURE."""
        return self._failures.inject(unit, kind, instance)

    # State.

    def _observation(self) -> Observation:
        physics, index = self._physics, self._lane
        touching, impact_m_s, thrust_m_s2 = physics.contact(index)
        return Observation(  # by position, which is twice as fast
            self.now_us / 1e6,
            physics.motion(index),
            self._gps_lost_at_s is None,
            self._battery_reading(),
            touching,
            impact_m_s,
            thrust_m_s2 / GRAVITY_M_S2,
            physics.airspeed_m_s(index),
            self._gps_off_m(),
        )

    def _gate_m(self) -> float:
        return self.firmware.estimator.glitch_rules.gate_m

    def _capacity_mah(self) -> float:
        """The pack's capacity that the firmware assumes: BATT_CAPACITY where it exists."""
        revision = self.parameters.revision
        if revision != self._capacity[0]:
            known = "BATT_CAPACITY" in self.parameters
            pack_mah = self._physics.pack.capacity_mah
            self._capacity = (revision, self.parameters["BATT_CAPACITY"] if known else pack_mah)
        return self._capacity[1]

    def _battery_reading(self) -> BatteryReading:
        """The power monitor's reading; BATTERY_RESET shifts its count of the charge."""
        capacity_mah = self._capacity_mah()
        reading = self._physics.battery_reading(self._lane, capacity_mah)
        firmware = getattr(self, "firmware", None)
        if firmware is None or not firmware.charge_added_mah:
            return reading
        consumed = reading.consumed_mah - firmware.charge_added_mah
        left = min(max(100.0 * (1.0 - consumed / max(capacity_mah, 1.0)), 0.0), 100.0)
        return reading._replace(consumed_mah=consumed, remaining_percent=left)

    def snapshot(self) -> Snapshot:
        """Everything telemetry is made of, now."""
        if self._snapshot_cache is None or self._snapshot_cache[0] != self.now_us:
            self._snapshot_cache = (self.now_us, self._make_snapshot())
        return self._snapshot_cache[1]

    def _make_snapshot(self) -> Snapshot:
        physics, index = self._physics, self._lane
        thrust = physics.contact(index)[2]
        started = self.firmware.estimator.gps_started
        return Snapshot(
            time_boot_us=self.now_us - self._boot_us,
            unix_time_us=self._epoch_us + self.now_us if started else 0,
            vehicle=self.firmware,
            motion=physics.motion(index),
            battery=self._battery_reading(),
            thrust_over_hover=thrust / GRAVITY_M_S2,
            throttle_fraction=thrust / physics.body_model.max_thrust_m_s2,
            airspeed_m_s=physics.airspeed_m_s(index),
        )

    # Values that few messages contain, computed when asked for.

    def gps_reading(self) -> GpsReading | None:
        """The reading of the receiver, or None before it is found."""
        estimator = self.firmware.estimator
        has_receiver = estimator.gps_started and not estimator.is_external
        return self.receiver() if has_receiver else None

    # Actions on the vehicle: pilot, failures, batteries.

    def pilot_mode_change(self, mode: str | int) -> bool:
        """The pilot turns the mode switch.

        Args:
            mode: the firmware's name for it, or its number.

        Returns:
            Whether the firmware took it.

        Raises:
            ValueError: there is no such mode.
        """
        modes = self.firmware.personality.modes
        numbers = [n for n, spec in modes.items() if mode in (n, spec.name)]
        if not numbers:
            names = ", ".join(spec.name for spec in modes.values())
            raise ValueError(f"no mode {mode!r}; there are: {names}")
        self.firmware.observe(self._observation())
        taken = self.firmware.set_mode(numbers[0]) is Result.ACCEPTED
        self._flush_events()
        self._pass_guidance()
        self._send_all()
        return taken

    def pilot_throttle(self, raw_us: int) -> None:
        """The pilot moves the throttle stick: 1000 (lowest) to 2000."""
        self.firmware.pilot.receive((0, 0, raw_us))

    def hold_sticks(
        self, pitch: float = 0.0, roll: float = 0.0, yaw: float = 0.0, throttle: float = 0.5
    ) -> None:
        """A PX4 hears from the pilot's transmitter where the sticks are: -1 to 1, throttle 0 to 1.

        It has to hear that again within COM_RC_LOSS_T. Without its radio it hears nothing.
        """
        firmware = self.firmware
        if isinstance(firmware, Px4Vehicle) and not firmware.pilot.lost:
            firmware.observe(self._observation())
            firmware.sticks.hear(ManualControl(pitch, roll, yaw, throttle))
            self._flush_events()
            self._pass_guidance()
            self._send_all()

    def silence_streams(self) -> None:
        """Stop all streams until the next start, except the ones that cannot be stopped."""
        for server in self._servers:
            server.streams.stop_all(but=server.steady)
        self._plan_wake()

    def power_cycle(self) -> None:
        """The firmware stops and starts again where the vehicle is, as after a crash of it."""
        self._shut_down()

    # Its world.

    def crash(self, obstacle: str, speed_m_s: float) -> None:
        """It has hit something: the flight is over, and it says so.

        The severity is that of ArduPilot's crash check ("Crash: Disarming").
        """
        self.damage = f"Crashed into {obstacle}"
        self.firmware.say(Severity.EMERGENCY, f"Crash: hit {obstacle} at {speed_m_s:.1f} m/s")
        self.firmware.disarm(force=True)

    def set_further_battery(self, battery: FurtherBattery) -> None:
        """Report a battery beside the first, as BATT2_* (ArduPilot) and BAT2_* (PX4) add one."""
        self._further_batteries[battery.number] = battery

    def remove_further_battery(self, number: int) -> None:
        """Report it no more."""
        del self._further_batteries[number]

    def next_battery(self) -> FurtherBattery | None:
        """Return the battery to report in BATTERY_STATUS; None for the first one.

        An ArduPilot sends one battery at a time, in turn (GCS_MAVLINK::send_battery_status).
        """
        batteries = (None, *self._further_batteries.values())
        self._battery_turn = (self._battery_turn + 1) % len(batteries)
        return batteries[self._battery_turn]

    def set_battery_remaining(self, fraction: float) -> None:
        """Fill or empty the pack, 0..1; a PX4's own discharges with time, from there on."""
        super().set_battery_remaining(fraction)
        if isinstance(self.firmware, Px4Vehicle):
            self.firmware.battery.remaining = fraction

    def set_battery_voltage(self, voltage_v: float) -> None:
        """Force the pack's voltage, as SIM_BATT_VOLTAGE does; 0 gives the model back."""
        if isinstance(self.firmware, Px4Vehicle):
            self.firmware.battery.forced_v = voltage_v
        else:
            self.parameters.set("SIM_BATT_VOLTAGE", voltage_v)

    def lose_radio(self, lost: bool, throttle_low: bool = False) -> None:
        """The pilot's radio goes silent or only lowers the throttle, or it comes back."""
        self.firmware.pilot.fail(lost and not throttle_low, throttle_low)
