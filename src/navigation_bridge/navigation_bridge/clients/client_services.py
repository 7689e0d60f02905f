"""Services that clients call beside a goal: hold, mode, pause, parameters. No ROS."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.clients.service_requests import Service, ServiceRequests
from navigation_bridge.engine import Engine
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.reporting import Reporter
from navigation_bridge.requests.feature import Feature
from navigation_bridge.supervision.parking import Parking
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.intents import Outcome

__all__ = ["ClientServices"]

_PARAMETERS_MAX = 100
_PARAMETER = re.compile("[A-Z0-9_]{1,16}")


class ClientServices:
    """Answers services of clients.

    Attributes:
        refusal: why nothing is accepted: there is no vehicle to execute it; None while there is.
    """

    def __init__(
        self,
        engine: Engine,
        vehicle: Vehicle,
        report: Reporter,
        parking: Parking,
        service_requests: ServiceRequests,
        features: Feature,
        refusal: Rejection | None,
    ) -> None:
        """Serve with these."""
        self._engine = engine
        self._vehicle = vehicle
        self._report = report
        self._parking = parking
        self._service_requests = service_requests
        self._features = features
        self.refusal = refusal

    @property
    def occupied(self) -> Rejection | None:
        """Why the vehicle is left alone, or None."""
        goal = self._engine.goal
        if self.refusal is not None or goal is None:
            return self.refusal
        return Rejection(OutcomeCode.BUSY, "A goal is active; cancel it first.")

    def pause(self, now: float) -> tuple[bool, str]:
        """Pause the active goal until :meth:`resume`; return success and a sentence."""
        goal, why_not = self._pausable_goal()
        if goal is None:
            return False, why_not
        rejection = goal.pause(now)
        if rejection is not None:
            return False, rejection.message
        self._report.log(LogLevel.INFO, f"Goal {goal.short_id}: paused")
        return True, "The goal is paused."

    def resume(self, now: float) -> tuple[bool, str]:
        """Resume a paused goal; return success and a sentence."""
        goal, why_not = self._pausable_goal()
        if goal is None:
            return False, why_not
        why_not = goal.resume(now)
        if why_not:
            return False, why_not
        self._report.log(LogLevel.INFO, f"Goal {goal.short_id}: resumed")
        return True, "The goal is resumed."

    def _pausable_goal(self) -> tuple[ActiveGoal | None, str]:
        """Return the active goal unless it is being cancelled; else None and why."""
        goal = self._engine.goal
        if goal is None:
            return None, "No goal is active."
        if goal.cancel_requested_s is not None:
            return None, "The goal is being cancelled."
        return goal, ""

    def serve(self, number: int, service: Service, now: float, mode: str = "") -> None:
        """Execute a service request; a ``ServiceDone`` with its number is the response.

        Args:
            number: number of the request.
            service: the service.
            now: time in seconds.
            mode: for SET_MODE, the firmware's name of the mode.
        """
        goal, occupied = self._engine.goal, self.occupied
        if occupied is not None and (self.refusal is not None or service is not Service.HOLD):
            self._report.served(number, False, occupied.message)
            return
        if service is Service.ARM and not self._engine.config.goto.may_leave_ground:
            text = (
                "Parameter arming is 'never'; arm it yourself, or set arming to 'pilot' or 'auto'."
            )
            self._report.served(number, False, text)
            return
        self._features.give_way(f"The {service.value} service was called.")
        if goal is not None:
            text = "The hold service was called."
            self._engine.end(goal, Outcome(OutcomeCode.PREEMPTED, text, None), now)
        if service is Service.HOLD and self._parking.operation_id is not None:
            self._service_requests.wait_for(number, self._parking.operation_id)
        else:
            self._parking.give_up()
            self._service_requests.begin(number, service, now, mode)

    def read_parameters(self, names: Sequence[str], now: float) -> list[float]:
        """Return parameters of the vehicle; those not known yet are NaN, and are asked for.

        Raises:
            ValueError: a name that no parameter can have, or too many of them.
        """
        if len(names) > _PARAMETERS_MAX or not all(map(_PARAMETER.fullmatch, names)):
            raise ValueError(f"Give at most {_PARAMETERS_MAX} names such as WPNAV_SPEED.")
        values = self._vehicle.parameters.read(names, now)
        return [math.nan if value is None else value for value in values]
