"""The operation, and the act, that the task of a goal has asked the vehicle for."""

from __future__ import annotations

from dataclasses import dataclass

from navigation_core.tasks.inputs.waypoint_acts import ActOrder, ActReport
from navigation_core.tasks.intents import Perform
from navigation_core.tasks.observation import OperationReport, OperationStatus


@dataclass
class GoalOperation:
    """One operation at a time.

    Attributes:
        asked: the last operation that the task requested, or None.
        report: its state; None without one, and once the task knows the result.
        operation_id: the vehicle's number for it.
    """

    asked: Perform | None = None
    report: OperationReport | None = None
    operation_id: int | None = None

    def is_new(self, intent: Perform) -> bool:
        """Whether the task asks for another operation than the one in progress."""
        elsewhere = self.asked is None or self.asked.target_enu_m != intent.target_enu_m
        return self.report is None or self.report.kind is not intent.kind or elsewhere

    def is_pending(self, operation_id: int) -> bool:
        """Whether it is the operation with this number, and the task does not know its end yet."""
        return self.report is not None and self.operation_id == operation_id

    def began(self, intent: Perform, operation_id: int) -> None:
        """The vehicle was asked for it."""
        self.asked, self.operation_id = intent, operation_id
        self.report = OperationReport(intent.kind, OperationStatus.PENDING, "")

    def ended(self, status: OperationStatus, reason: str) -> None:
        """It has ended."""
        if self.report is not None:
            self.report = OperationReport(self.report.kind, status, reason)

    def known(self) -> None:
        """The task knows the result of an operation that has ended."""
        if self.report is not None and self.report.state is not OperationStatus.PENDING:
            self.report = None

    def dropped(self) -> None:
        """It was given up."""
        self.report = self.operation_id = None


@dataclass
class GoalAct:
    """One act at a time.

    Attributes:
        order: the act that the task has asked for last, or None.
        report: its end, or None.
    """

    order: ActOrder | None = None
    report: ActReport | None = None

    def is_new(self, order: ActOrder) -> bool:
        """Whether the task asks for another act than the last one."""
        return order is not self.order

    def began(self, order: ActOrder) -> None:
        """The vehicle was asked for it."""
        self.order, self.report = order, None

    def ended(self, number: int, failure: str) -> ActOrder | None:
        """The vehicle has answered, or not; return the act, or None if it is another one."""
        if self.order is None or self.order.number != number:
            return None
        self.report = ActReport(number, failure)
        return self.order
