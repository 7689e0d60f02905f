"""Events of a recorded vehicle: modes, failsafes, restarts, status texts. No ROS."""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

from flight_logs.vehicles import Source
from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import (
    ArmedChanged,
    FailsafeBegan,
    FailsafeEnded,
    ModeChanged,
    StationActed,
    StatusTextReceived,
    VehicleEvent,
    VehicleRebooted,
)
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.vehicle import Vehicle
from mavlink_vehicle.vehicle_config import VehicleConfig
from navigation_bridge import notes
from navigation_bridge.recording.recorded_notes import NotesReader

TEXT = "text"
"""The kind of a moment in which the vehicle said something, from warnings upwards."""

# Beginnings of texts that an autopilot sends on the ground, as severe as those of an accident.
_GROUNDED = ("prearm:", "arm:", "preflight")


class EventSeverity(enum.Enum):
    """Severity of an event."""

    BAD = "bad"
    WARNING = "warning"
    INFO = "info"


class Moment(NamedTuple):
    """An event.

    Attributes:
        time_s: when.
        kind: one word, for people.
        text: a sentence or what was said; not to be trusted.
        severity: how much it deserves a look.
        by: the station that did it, if one did.
    """

    time_s: float
    kind: str
    text: str
    severity: EventSeverity
    by: Source | None = None


@dataclass
class Retold:
    """Events and state of one vehicle in a recording. Times are in s.

    Attributes:
        name: of the vehicle, "ArduPilot copter"; empty if there was no HEARTBEAT.
        modes: (time, name) of each mode, the first included.
        armed: (time, whether the motors are armed), the first included.
        led: (time, whether it follows setpoints: armed, in the mode for them), the first included.
        battery: (time, percent).
        voltage: (time, V).
        moments: what happened, in order.
        noted: notes of the server about this vehicle.
        state: at the end.
    """

    name: str = ""
    modes: list[tuple[float, str]] = field(default_factory=list)
    armed: list[tuple[float, bool]] = field(default_factory=list)
    led: list[tuple[float, bool]] = field(default_factory=list)
    battery: list[tuple[float, float]] = field(default_factory=list)
    voltage: list[tuple[float, float]] = field(default_factory=list)
    moments: list[Moment] = field(default_factory=list)
    noted: NotesReader = field(default_factory=NotesReader)
    state: VehicleState = field(default_factory=VehicleState)


class Teller:
    """Follows one vehicle through a recording with the flight code.

    Attributes:
        vehicle: as the flight code knows it by now.
        retold: the events up to now.
    """

    def __init__(
        self,
        source: Source,
        others: Iterable[int] = (),
        on_event: Callable[[float, VehicleEvent], None] | None = None,
    ) -> None:
        """Follow a vehicle.

        Args:
            source: its autopilot.
            others: systems of the other vehicles in the recording, whose notes aren't taken.
            on_event: takes the time (s) and each event of the vehicle.
        """
        self._on_event = on_event
        self._source = source
        self._others = frozenset(others) - {source[0]}
        self.vehicle = Vehicle(VehicleConfig(target_system=source[0], target_component=source[1]))
        self.retold = Retold()

    def take(self, time_s: float, message: Message) -> None:
        """Process the next message of the recording, from any sender."""
        if message.get_srcComponent() == notes.COMPONENT_ID:
            if message.get_srcSystem() not in self._others:
                self.retold.noted.take(time_s, message)
            return
        vehicle, before = self.vehicle, self.vehicle.state
        deadline = vehicle.next_deadline()
        if deadline is not None and deadline <= time_s:
            vehicle.handle_timer(time_s)
        vehicle.receive(message, time_s)
        vehicle.messages_to_send()
        while (event := vehicle.next_event()) is not None:
            self._take_event(time_s, event)
        self._take_state(time_s, before, vehicle.state)

    def _take_state(self, time_s: float, before: VehicleState, state: VehicleState) -> None:
        retold = self.retold
        if state is before:
            return
        retold.state = state
        if state.last_heartbeat_s is not None:
            if not retold.modes or retold.modes[-1][1] != self.vehicle.mode_name:
                retold.modes.append((time_s, self.vehicle.mode_name))
            if not retold.armed or retold.armed[-1][1] != state.armed:
                retold.armed.append((time_s, state.armed))
            profile = self.vehicle.profile
            modeless = profile is None or profile.control_mode is None
            led = state.armed and (modeless or self.vehicle.in_control_mode)
            if not retold.led or retold.led[-1][1] != led:
                retold.led.append((time_s, led))
            if profile is not None:  # a better known vehicle replaces the first
                retold.name = profile.name
        battery = state.battery
        if battery is not None and battery is not before.battery:
            if battery.remaining is not None:
                retold.battery.append((time_s, 100.0 * battery.remaining))
            if battery.voltage_v is not None:
                retold.voltage.append((time_s, battery.voltage_v))

    def _take_event(self, time_s: float, event: VehicleEvent) -> None:
        if self._on_event is not None:
            self._on_event(time_s, event)
        moment = _moment(time_s, event)
        if moment is not None:
            self.retold.moments.append(moment)


def _moment(time_s: float, event: VehicleEvent) -> Moment | None:
    if isinstance(event, ModeChanged):
        return Moment(time_s, "mode", f"Mode {event.name}", EventSeverity.INFO)
    if isinstance(event, ArmedChanged):
        text = "Motors armed" if event.armed else "Motors disarmed"
        return Moment(time_s, "arming", text, EventSeverity.INFO)
    if isinstance(event, FailsafeBegan):
        text = f"Failsafe ({event.kind.value}): {event.text}"
        return Moment(time_s, "failsafe", text, EventSeverity.BAD)
    if isinstance(event, FailsafeEnded):
        return Moment(time_s, "failsafe", f"Failsafe ({event.kind.value}) over", EventSeverity.INFO)
    if isinstance(event, VehicleRebooted):
        return Moment(time_s, "restart", "The autopilot restarted", EventSeverity.BAD)
    if isinstance(event, StationActed):
        who = "Unknown" if event.station is None else f"Ground station {named(event.station)}"
        text = f"{who} {event.act.value} ({event.how})"
        return Moment(time_s, "station", text, EventSeverity.WARNING, event.station)
    if isinstance(event, StatusTextReceived) and event.severity <= mavlink.MAV_SEVERITY_WARNING:
        grounded = event.text.lower().startswith(_GROUNDED)
        bad = event.severity <= mavlink.MAV_SEVERITY_CRITICAL and not grounded
        return Moment(time_s, TEXT, event.text, EventSeverity.BAD if bad else EventSeverity.WARNING)
    return None


def named(source: Source) -> str:
    """Return the usual notation of a sender."""
    return f"{source[0]}/{source[1]}"
