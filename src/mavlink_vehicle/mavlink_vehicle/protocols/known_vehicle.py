"""The vehicle as far as it is known, and the order of its packets.

Its state, its kind and the addresses of the conversation. Packets are sorted into the order of
sending by MAVLink's sequence number: HEARTBEAT carries no time, and an old one that arrives after a
newer one would show a mode that has been left since: it would look like a pilot's intervention.
"""

from __future__ import annotations

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.profiles import Profile, profile_for, vehicle_rank
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.state.vehicle_state import LiveState, VehicleState
from mavlink_vehicle.vehicle_config import VehicleConfig

_HALF = 128
_RESYNC_S = 1.0


class SequenceOrder:
    """Follows the sequence numbers (0 to 255, wrapping) of one sender.

    Attributes:
        last: place of the last packet in the order of sending.
        arrived: number of packets that came.
        missing: number of packets that did not come, or have not yet.
    """

    def __init__(self) -> None:
        """Begin with whatever comes first."""
        self.last = -1
        self.arrived = self.missing = 0
        self._newest: int | None = None
        self._advanced_s = 0.0

    def place(self, sequence: int, now: float) -> int:
        """Return the packet's place in the order of sending; it grows from packet to packet.

        A number up to half the circle behind the newest is a late packet. After a second
        without progress any number is taken as a new one: the sender restarted, or half a circle
        or more was lost.
        """
        self.arrived += 1
        newest = self._newest
        if newest is None:
            self.last = self._newest = sequence
            self._advanced_s = now
            return sequence
        ahead = (sequence - newest) & 0xFF
        if ahead >= _HALF and now - self._advanced_s < _RESYNC_S:
            self.last = newest + ahead - 256
            self.missing -= 1
            return self.last
        if ahead:
            self.missing += ahead - 1
            self._newest = newest + ahead
            self._advanced_s = now
        self.last = newest + ahead
        return self.last


class ModeOrder(SequenceOrder):
    """Sorts the messages of one vehicle, of which some show its mode."""

    def __init__(self) -> None:
        """Begin with whatever comes first."""
        super().__init__()
        self._mode_place = self._beat_place = -1

    def begin_again(self) -> None:
        """Follow another sender from now on."""
        self._newest = None
        self._mode_place = self._beat_place = -1

    def follow(self, sequence: int, is_heartbeat: bool, is_mode: bool, now: float) -> bool | None:
        """Record a message; returns whether its mode has been left since, None if all it says.

        A HEARTBEAT that was overtaken by CURRENT_MODE would show a mode that has been left
        since, but it is a sign of life, and shows whether the vehicle is armed.

        Args:
            sequence: its sequence number.
            is_heartbeat: whether it is a HEARTBEAT.
            is_mode: whether it is a CURRENT_MODE.
            now: time in seconds.
        """
        place = self.place(sequence, now)
        if not is_heartbeat and not is_mode:
            return False
        is_old = place < self._mode_place
        if is_old and (is_mode or place < self._beat_place):
            return None
        self._mode_place = max(self._mode_place, place)
        if is_heartbeat:
            self._beat_place = place
        return is_old


# HEARTBEAT comes once a second; two may be lost.
_KIND_ENDS_S = 3.5
_BEST_RANK = 3


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

    def is_other_kind(self, heartbeat: mavlink.MAVLink_heartbeat_message) -> bool:
        """Return whether a HEARTBEAT with its ids is that of another kind of vehicle."""
        profile = self.profile
        ours = heartbeat._header.srcSystem == self.live.known.system_id
        if profile is None or not ours or self.rank_of(heartbeat) < self.rank:
            return False
        return profile_for(heartbeat.autopilot, heartbeat.type) is not profile

    def is_replaced_by(self, heartbeat: mavlink.MAVLink_heartbeat_message, now: float) -> bool:
        """Return whether the sender of a HEARTBEAT may replace it.

        It is better known as a vehicle, or has its ids, but is of another kind, while this one is
        silent.
        """
        rank, known = self.rank_of(heartbeat), self.rank
        if rank > known > 0:
            return True
        beat_s = self.live.known.last_heartbeat_s
        silent = beat_s is not None and now - beat_s > _KIND_ENDS_S
        return silent and self.is_other_kind(heartbeat)

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
            clock_count=self.state.clock_count + 1,
        )
