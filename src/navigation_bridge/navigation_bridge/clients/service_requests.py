"""Services that command the vehicle outside of goals. No ROS."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from mavlink_vehicle.events import LandedState, OperationFinished, OperationResult
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.goals.operations import begin_operation
from navigation_bridge.reporting import Reporter
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.tasks.intents import Perform
from navigation_core.tasks.observation import TaskOperation


class Service(Enum):
    """The services."""

    HOLD = "hold"
    ARM = "arm"
    DISARM = "disarm"
    SET_MODE = "set_mode"


_OPERATIONS = {
    Service.HOLD: TaskOperation.HOLD,
    Service.ARM: TaskOperation.ARM,
    Service.DISARM: TaskOperation.DISARM,
}
# Another autopilot with the vehicle's ids would obey them, too.
_MOVING = (Service.ARM, Service.SET_MODE)


class _Pending(NamedTuple):
    """A request that is answered at the end of an operation."""

    number: int
    operation_id: int


class ServiceRequests:
    """Executes one service request at a time; a later one replaces it."""

    def __init__(self, vehicle: Vehicle, map_frame: MapFrame, report: Reporter) -> None:
        """Prepare."""
        self._map_frame = map_frame
        self._vehicle = vehicle
        self._report = report
        self._pending: _Pending | None = None

    def begin(self, number: int, service: Service, now: float, mode: str = "") -> None:
        """Request it from the vehicle; the arguments are those of :meth:`ClientServices.serve`."""
        self.give_up("Replaced by another request.", now)
        twins = self._vehicle.twins.reason
        if twins and service in _MOVING:
            self._report.served(number, False, twins)
            return
        if service is Service.SET_MODE:
            self._set_mode(number, mode, now)
            return
        intent = Perform(_OPERATIONS[service])
        self.wait_for(number, begin_operation(self._vehicle, self._map_frame, intent, now))

    def _set_mode(self, number: int, mode: str, now: float) -> None:
        vehicle, profile = self._vehicle, self._vehicle.profile
        name = mode.strip().upper()
        if profile is not None and name in (profile.mission_mode, profile.takeoff.mode):
            state = vehicle.state
            if state.armed and state.landed_state is not LandedState.IN_AIR:
                text = (
                    f"{name} was not set: the vehicle is armed on the ground and would move "
                    "immediately. Send a goal instead."
                )
                self._report.served(number, False, text)
                return
        vehicle.setpoints.end()
        self.wait_for(number, vehicle.change_mode(name, now))

    def wait_for(self, number: int, operation_id: int) -> None:
        """Respond at the end of an operation in progress."""
        self._pending = _Pending(number, operation_id)

    def give_up(self, why: str, now: float) -> None:
        """End the pending request, if any, as failed."""
        pending, self._pending = self._pending, None
        if pending is not None:
            self._vehicle.operations.abandon(now)
            self._report.served(pending.number, False, why)

    def finish(self, event: OperationFinished) -> bool:
        """Process the end of an operation; True if it was this one's."""
        pending = self._pending
        if pending is None or event.operation_id != pending.operation_id:
            return False
        self._pending = None
        self._report.served(pending.number, event.result is OperationResult.ACHIEVED, event.reason)
        return True
