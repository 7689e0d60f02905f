"""The consequences of what happens to the vehicle: a HEARTBEAT, a mode, arming, a restart, an end.

This is the one place that turns a difference of two states into events, and that has the services
do what follows from it: close the setpoints, end operations, read lists again.
"""

from __future__ import annotations

from mavlink_vehicle.codec import Message
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
    StoredListFinished,
    SystemStatusChanged,
    VehicleDiscovered,
    VehicleEvent,
    VehicleRebooted,
)
from mavlink_vehicle.mission_items import MissionType
from mavlink_vehicle.profiles import profile_for
from mavlink_vehicle.protocols.known_vehicle import KnownVehicle
from mavlink_vehicle.protocols.mission.stored_lists import StoredLists
from mavlink_vehicle.protocols.monitoring.heartbeat import HeartbeatWatch
from mavlink_vehicle.protocols.monitoring.own_gap import OwnGap
from mavlink_vehicle.protocols.operation_slot import OperationSlot
from mavlink_vehicle.protocols.service import Conversation, Services
from mavlink_vehicle.protocols.stations.station_observer import StationObserver
from mavlink_vehicle.protocols.streams.setpoint_stream import SetpointStream
from mavlink_vehicle.state.vehicle_state import VehicleState


class Consequences:
    """Has the services of one vehicle do what follows."""

    def __init__(
        self,
        vehicle: KnownVehicle,
        services: Services,
        *,
        heartbeats: HeartbeatWatch,
        own_gap: OwnGap,
        setpoints: SetpointStream,
        operations: OperationSlot,
        stored_lists: StoredLists,
        stations: StationObserver,
    ) -> None:
        """Work on one vehicle; the services by name are also among `services`."""
        self._vehicle = vehicle
        self._services = services
        self._heartbeats = heartbeats
        self._own_gap = own_gap
        self._setpoints = setpoints
        self._operations = operations
        self._stored_lists = stored_lists
        self._stations = stations
        services.follow_with(self._follow)

    # The vehicle

    def heartbeat(self, message: Message, now: float) -> None:
        """Process a HEARTBEAT of the vehicle, already in the state; the first one finds it."""
        vehicle, state = self._vehicle, self._vehicle.state
        self._own_gap.see_mode(now, state.boot_time_ms)
        if vehicle.profile is None:
            profile = profile_for(state.autopilot, state.vehicle_type)
            vehicle.identify(profile)
            self._services.report(
                VehicleDiscovered(
                    state.system_id,
                    state.component_id,
                    state.autopilot,
                    state.vehicle_type,
                    profile.name,
                )
            )
            self._ask(now)
        self._heartbeats.observe_boots(state.boot_count)
        self._heartbeats.receive(message, now)
        self._services.take_events(self._heartbeats, now)

    def _ask(self, now: float) -> None:
        """Ask for the telemetry and for what is wanted once, from the beginning."""
        vehicle = self._vehicle
        if vehicle.profile is not None:
            self._services.vehicle_came(Conversation(vehicle.address, vehicle.profile), now)

    # The state

    def state_changed(self, before: VehicleState, is_heartbeat: bool, now: float) -> None:
        """Turn the difference to an earlier state into events."""
        state, report = self._vehicle.state, self._services.report
        if state.boot_count != before.boot_count:
            report(VehicleRebooted(state.boot_count))
            self._services.vehicle_gone("the autopilot restarted", now)
            self._ask(now)
        if before.last_heartbeat_s is not None:
            if is_heartbeat and state.armed != before.armed:
                self._armed_changed(state.armed, now)
            if state.custom_mode != before.custom_mode:
                self._mode_changed(before, now)
            if state.system_status != before.system_status:
                report(SystemStatusChanged(before.system_status, state.system_status))
        if state.landed_state is not before.landed_state:
            report(LandedChanged(before.landed_state, state.landed_state))
        if state.texts is not before.texts:
            new_texts = state.texts.count - before.texts.count
            for text in state.status_texts[-new_texts:] if new_texts else ():
                report(StatusTextReceived(text.text, text.severity))
        self._services.state_changed(before, self._vehicle.state, now)

    def _armed_changed(self, armed: bool, now: float) -> None:
        requested = self._operations.armed_changed(armed, now)
        self._services.report(ArmedChanged(armed, requested))
        if armed:
            self._services.vehicle_armed()
        else:
            self._setpoints.close_for("the vehicle was disarmed")
        self._services.collect(now)

    def _mode_changed(self, before: VehicleState, now: float) -> None:
        vehicle, state, name = self._vehicle, self._vehicle.state, self._vehicle.mode_name
        requested, overtaken = self._operations.mode_changed(state, name, now)
        requested = requested or self._went_back(before)
        self._services.report(ModeChanged(before.custom_mode, state.custom_mode, name, requested))
        if overtaken is not None and vehicle.profile is not None:
            chosen_name = vehicle.profile.mode_name(overtaken)
            self._services.report(ModeOvertaken(overtaken, chosen_name, name))
        self._services.collect(now)
        if vehicle.in_control_mode:
            return
        if not requested:
            self._setpoints.close_for(f"the vehicle was switched to {name}, not at our request")
        elif vehicle.is_in_control_mode(before):
            self._setpoints.close_for(f"control was released for {name}")
        self._services.take_events(self._setpoints, now)

    def _went_back(self, before: VehicleState) -> bool:
        """Return whether it went back to an earlier mode because it landed or never flew (PX4)."""
        profile, state = self._vehicle.profile, self._vehicle.state
        if profile is None or not profile.earlier_mode_after_landing:
            return False
        down = not state.armed or state.landed_state is LandedState.ON_GROUND
        target = profile.landing_target
        on_target = None if target is None else target.mode
        landing = (profile.land_mode, on_target, profile.return_mode)
        if not state.armed and before.custom_mode == profile.mode_number(profile.takeoff.mode):
            return True
        return down and before.custom_mode in map(profile.mode_number, landing)

    # Events of the services

    def _follow(self, event: VehicleEvent, now: float) -> None:
        """Do what follows from an event of a service."""
        if isinstance(event, HeartbeatLost):
            self._services.link_lost(self._vehicle.state, now)
        elif isinstance(event, HeartbeatRegained):
            self._ask(now)
        elif isinstance(event, OperationFinished):
            self._operation_ended(event, now)
        elif isinstance(event, StationActed):
            if event.mode is not None and event.mode != self._vehicle.state.custom_mode:
                self._operations.mode_asked(event.mode, now)
        elif isinstance(event, StoredListFinished):
            self._stored_lists.ended(event, now)

    def _operation_ended(self, event: OperationFinished, now: float) -> None:
        last = self._operations.last_mission
        stored = None if last is None else last.stored
        self._stations.operation_ended(event, stored or ())
        if last is None or last.operation_id != event.operation_id:
            return
        if stored is None or event.result is not OperationResult.ACHIEVED:
            self._stored_lists.refresh(MissionType.MISSION, now)
        else:
            self._stored_lists.put_mission(stored, now)
