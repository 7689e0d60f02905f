"""Asks again for a mode that a request of this server has overtaken on its way. No ROS.

The pilot, a ground station or a failsafe chose last, and their mode is restored at once, once. A
mode that they choose meanwhile stays: the request is given up when any other mode shows.
"""

from __future__ import annotations

from mavlink_vehicle.events import ModeOvertaken, OperationFinished, OperationResult
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.reporting import Reporter


class OvertakenMode:
    """The mode that is asked for again.

    Attributes:
        operation_id: the pending request, or None.
    """

    def __init__(self, vehicle: Vehicle, report: Reporter) -> None:
        """Begin without one."""
        self._vehicle = vehicle
        self._report = report
        self.operation_id: int | None = None
        self._begun = ""

    @property
    def is_open(self) -> bool:
        """Whether it is not clear yet in which mode the vehicle stays."""
        return self.operation_id is not None or self._vehicle.operations.choice_is_unclear

    def restore(self, event: ModeOvertaken, now: float) -> None:
        """Ask for the mode again."""
        self._begun = (
            f"A request of this server for {event.current_name} was on its way and overtook "
            f"{event.chosen_name}, which was requested again"
        )
        self._report.log(LogLevel.WARN, f"{self._begun}.")
        self.operation_id = self._vehicle.restore_mode(event.chosen, now)

    def finish(self, event: OperationFinished) -> str | None:
        """Process the end of an operation; return how this one ended, None if it is another."""
        if self.operation_id is None or event.operation_id != self.operation_id:
            return None
        self.operation_id = None
        if event.result is OperationResult.ACHIEVED:
            return f"{self._begun} and is active."
        text = f"{self._begun}. {event.reason} The vehicle is in {self._vehicle.mode_name}."
        self._report.log(LogLevel.WARN, text)
        return text
