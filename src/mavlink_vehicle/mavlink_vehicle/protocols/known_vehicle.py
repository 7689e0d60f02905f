"""The vehicle as far as it is known: its state, its kind, the addresses of the conversation."""

from __future__ import annotations

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.profiles import Profile, vehicle_rank
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.state.restarts import REORDER_LIMIT_MS
from mavlink_vehicle.state.telemetry import GlobalPosition
from mavlink_vehicle.state.vehicle_state import Changes, VehicleState, evolve
from mavlink_vehicle.vehicle_config import VehicleConfig

_BEST_RANK = 3


class LiveState:
    """The latest state, made when it is asked for: measurements come more often than that.

    Attributes:
        known: the state without the measurements that came since it was asked for last.
        measured: these measurements, by attribute of the state.
        boot_time_ms: the newest time since boot.
    """

    __slots__ = ("boot_time_ms", "known", "measured")

    def __init__(self, state: VehicleState) -> None:
        """Begin with a state."""
        self.set(state)

    def set(self, state: VehicleState) -> None:
        """Replace the whole state."""
        self.known = state
        self.measured: Changes = {}
        self.boot_time_ms = state.boot_time_ms

    def get(self) -> VehicleState:
        """Return the state; the same object until something comes."""
        if self.measured:
            self.known = evolve(self.known, self.measured)
            self.measured = {}
        return self.known

    @property
    def global_position(self) -> GlobalPosition | None:
        """The position; the state need not be made for it."""
        position = self.measured.get("global_position", self.known.global_position)
        return position if isinstance(position, GlobalPosition) else None

    def is_next(self, time_boot_ms: int) -> bool:
        """Return whether a time since boot follows the newest, of a clock that is not in doubt."""
        newest_ms = self.boot_time_ms
        return (
            newest_ms is not None
            and newest_ms <= time_boot_ms <= newest_ms + REORDER_LIMIT_MS
            and self.known.restart_signs.doubt is None
        )

    def measure(self, changes: Changes, time_boot_ms: int, now: float) -> None:
        """Take a measurement, of a time since boot that `is_next`."""
        measured = self.measured
        measured |= changes
        measured["boot_time_ms"] = self.boot_time_ms = time_boot_ms
        measured["boot_time_s"] = now


class KnownVehicle:
    """One vehicle, found by its HEARTBEAT.

    Attributes:
        config: its settings.
        live: its state, for those who need not all of it.
        profile: the rules of its kind; None before it was heard.
        in_control_mode: whether it is in the mode in which it follows setpoints.
        address: the addresses of the conversation, as far as known.
    """

    def __init__(self, config: VehicleConfig) -> None:
        """Begin with what the settings say."""
        self.config = config
        self.live = LiveState(
            VehicleState(system_id=config.target_system, component_id=config.target_component)
        )
        self.profile: Profile | None = None
        self.in_control_mode = False
        self.address = self._address_of(config.target_system)
        self._answers_by_name = False

    @property
    def state(self) -> VehicleState:
        """All that is known about it."""
        live = self.live
        return live.get() if live.measured else live.known

    @state.setter
    def state(self, state: VehicleState) -> None:
        self.live.set(state)
        self.in_control_mode = self.is_in_control_mode(state)
        if state.system_id != self.address.target_system:
            self.address = self._address_of(state.system_id)

    def _address_of(self, system: int) -> Address:
        source = self.config.source_system
        return Address(
            source_system=(system or 1) if source is None else source,
            source_component=self.config.source_component,
            target_system=system,
            target_component=self.config.target_component,
        )

    @property
    def mode_name(self) -> str:
        """The mode's name; empty before the vehicle was heard."""
        return "" if self.profile is None else self.profile.mode_name(self.live.known.custom_mode)

    def is_in_control_mode(self, state: VehicleState) -> bool:
        """Return whether in a state it is in the mode in which it follows setpoints."""
        profile = self.profile
        if profile is None or state.custom_mode != profile.control_number:
            return False
        return not (profile.status_shows_runnable and state.mode_may_not_run)

    @property
    def rank(self) -> int:
        """How well the vehicle is known as one; 0 before it is found."""
        state = self.live.known
        return 0 if self.profile is None else vehicle_rank(state.autopilot, state.vehicle_type)

    @property
    def stays(self) -> bool:
        """Whether no other vehicle may replace it."""
        return self.config.target_system != 0 or self.rank == _BEST_RANK

    def rank_of(self, heartbeat: mavlink.MAVLink_heartbeat_message) -> int:
        """Return how well the sender of a HEARTBEAT is known as a vehicle; 0 if it is none."""
        header, config = heartbeat._header, self.config
        wanted = header.srcComponent == config.target_component and (
            config.target_system in (0, header.srcSystem)
        )
        return vehicle_rank(heartbeat.autopilot, heartbeat.type) if wanted else 0

    def is_sender(self, message: Message) -> bool:
        """Return whether a message has its ids, or may have before they are known."""
        header, state = message._header, self.live.known
        return header.srcComponent == state.component_id and (
            state.system_id in (0, header.srcSystem)
        )

    def answers_us(self, ack: mavlink.MAVLink_command_ack_message) -> bool:
        """Return whether a COMMAND_ACK is for us.

        Without target fields it is, until the autopilot is known to fill them in: from then on
        it answers somebody else, on board or on another link (a PX4, observed).
        """
        if ack.target_system or ack.target_component:
            ours = self.address.is_for_us(ack)
            self._answers_by_name = self._answers_by_name or (ours and ack.target_component != 0)
            return ours
        return not self._answers_by_name

    def identify(self, profile: Profile) -> None:
        """Follow the rules of its kind from now on."""
        self.profile = profile
        self.in_control_mode = self.is_in_control_mode(self.live.known)

    def become(self, system_id: int) -> None:
        """Take another vehicle instead, of which nothing is known yet."""
        self._answers_by_name = False
        self.profile = None
        self.state = VehicleState(
            system_id=system_id,
            component_id=self.config.target_component,
            boot_count=self.state.boot_count + 1,  # all that is kept of the first one is dropped
        )
