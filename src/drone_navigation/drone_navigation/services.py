"""Services that ask something of the vehicle beside any goal. No ROS."""

from __future__ import annotations

from enum import Enum

from drone_navigation.map_frame import MapFrame
from drone_navigation.operations import begin_operation
from drone_navigation.reporting import Reporter
from mavlink_vehicle.events import OperationFinished, OperationResult
from mavlink_vehicle.vehicle import Vehicle
from navigation_core.tasks.base import OperationKind, Perform


class Service(Enum):
    """What can be asked."""

    HOLD = "hold"
    ARM = "arm"
    DISARM = "disarm"


_OPERATIONS = {
    Service.HOLD: OperationKind.HOLD,
    Service.ARM: OperationKind.ARM,
    Service.DISARM: OperationKind.DISARM,
}


class ServiceDesk:
    """Works one service request at a time; a later one replaces it."""

    def __init__(self, vehicle: Vehicle, map_frame: MapFrame, report: Reporter) -> None:
        """Prepare."""
        self._map_frame = map_frame
        self._vehicle = vehicle
        self._report = report
        self._number: int | None = None
        self._operation_id: int | None = None

    def begin(self, number: int, service: Service, now: float) -> None:
        """Ask the vehicle."""
        self.give_up("Another request came.", now)
        self._number = number
        intent = Perform(_OPERATIONS[service])
        self._operation_id = begin_operation(self._vehicle, self._map_frame, intent, now)

    def wait_for(self, number: int, operation_id: int) -> None:
        """Answer when an operation ends that is under way already."""
        self._number, self._operation_id = number, operation_id

    def give_up(self, why: str, now: float) -> None:
        """End the request under way, if any, as not done."""
        if self._number is None:
            return
        number, self._number, self._operation_id = self._number, None, None
        self._vehicle.cancel_operation(now)
        self._report.served(number, False, why)

    def finish(self, event: OperationFinished) -> bool:
        """Take note of an operation's end; True if it was this one's."""
        if self._operation_id is None or event.operation_id != self._operation_id:
            return False
        assert self._number is not None
        number, self._number, self._operation_id = self._number, None, None
        self._report.served(number, event.result is OperationResult.ACHIEVED, event.reason)
        return True
