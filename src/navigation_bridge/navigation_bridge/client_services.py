"""Services that clients call beside a goal: hold, mode, pause, parameters, corrections. No ROS."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from mavlink_vehicle.protocols.streams.external_position import ExternalPose, ExternalPositionError
from mavlink_vehicle.protocols.streams.rtcm import RtcmError
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.engine import Engine
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.log_requests import LogRequests
from navigation_bridge.reporting import Reporter
from navigation_bridge.services import Service, ServiceDesk
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
        logs: the autopilot's own logs; takes requests.
    """

    def __init__(
        self,
        engine: Engine,
        vehicle: Vehicle,
        report: Reporter,
        parking: Parking,
        desk: ServiceDesk,
        refusal: Rejection | None,
    ) -> None:
        """Serve with these."""
        self._engine = engine
        self._vehicle = vehicle
        self._report = report
        self._parking = parking
        self._desk = desk
        self.refusal = refusal
        self.logs = LogRequests(vehicle, report.put_out, self._log_refusal)

    @property
    def occupied(self) -> str | None:
        """Why the vehicle is left alone, a sentence, or None."""
        if self.refusal is not None:
            return self.refusal.message
        goal = self._engine.goal
        return None if goal is None else f"Goal {goal.goal_id} is active; cancel it first."

    def _log_refusal(self) -> Rejection | None:
        """Return why logs are not transferred now."""
        text = self.occupied
        if self.refusal is not None or text is None:
            return self.refusal
        return Rejection(OutcomeCode.BUSY, text)

    def pause(self, now: float) -> tuple[bool, str]:
        """Pause the active goal until :meth:`resume`; return success and a sentence."""
        goal, why_not = self._pausable_goal()
        if goal is None:
            return False, why_not
        rejection = goal.pause(now)
        if rejection is not None:
            return False, rejection.message
        self._report.log(LogLevel.INFO, f"Goal {goal.short_id}: paused")
        return True, f"Goal {goal.goal_id} is paused."

    def resume(self, now: float) -> tuple[bool, str]:
        """Resume a paused goal; return success and a sentence."""
        goal, why_not = self._pausable_goal()
        if goal is None:
            return False, why_not
        why_not = goal.resume(now)
        if why_not:
            return False, why_not
        self._report.log(LogLevel.INFO, f"Goal {goal.short_id}: resumed")
        return True, f"Goal {goal.goal_id} is resumed."

    def _pausable_goal(self) -> tuple[ActiveGoal | None, str]:
        """Return the active goal unless it is being cancelled; else None and why."""
        goal = self._engine.goal
        if goal is None:
            return None, "No goal is active."
        if goal.cancel_requested_s is not None:
            return None, f"Goal {goal.goal_id} is being cancelled."
        return goal, ""

    def serve(self, number: int, service: Service, now: float, mode: str = "") -> None:
        """Execute a service request; a ``ServiceDone`` with its number is the response.

        Args:
            number: number of the request.
            service: the service.
            now: time in seconds.
            mode: for SET_MODE, the firmware's name of the mode.
        """
        goal, text = self._engine.goal, self.occupied
        if text is not None and (self.refusal is not None or service is not Service.HOLD):
            self._report.served(number, False, text)
            return
        if service is Service.ARM and not self._engine.config.goto.may_leave_ground:
            text = (
                "Parameter arming is 'never'; arm it yourself, or set arming to 'pilot' or 'auto'."
            )
            self._report.served(number, False, text)
            return
        self.logs.give_way(f"The {service.value} service was called.")
        if goal is not None:
            text = "The hold service was called."
            self._engine.end(goal, Outcome(OutcomeCode.PREEMPTED, text, None), now)
        if service is Service.HOLD and self._parking.operation_id is not None:
            self._desk.wait_for(number, self._parking.operation_id)
        else:
            self._parking.give_up()
            self._desk.begin(number, service, now, mode)

    def read_parameters(self, names: Sequence[str], now: float) -> list[float]:
        """Return parameters of the vehicle; those not known yet are NaN, and are asked for.

        Raises:
            ValueError: a name that no parameter can have, or too many of them.
        """
        if len(names) > _PARAMETERS_MAX or not all(map(_PARAMETER.fullmatch, names)):
            raise ValueError(f"Give at most {_PARAMETERS_MAX} names such as WPNAV_SPEED.")
        values = self._vehicle.parameters.read(names, now)
        return [math.nan if value is None else value for value in values]

    def correct_gps(self, data: bytes, now: float) -> None:
        """Send RTCM corrections to the vehicle.

        Args:
            data: whole RTCM 3 messages, one after the other.
            now: time in seconds.

        Raises:
            RtcmError: they are not sent, and why.
        """
        unreached = self._unreached
        if unreached:
            raise RtcmError(unreached)
        self._vehicle.rtcm.offer(data, now)

    def take_external_pose(self, pose: ExternalPose, now: float) -> None:
        """Send a pose from outside, such as a camera's, to the autopilot's estimator.

        Args:
            pose: of the vehicle, in the local frame.
            now: time in seconds.

        Raises:
            ExternalPositionError: it is not sent, and why.
        """
        unreached = self._unreached
        if unreached:
            raise ExternalPositionError(unreached)
        self._vehicle.external_position.offer(pose, self._vehicle.state, now)

    @property
    def _unreached(self) -> str:
        """Why nothing reaches the vehicle, a sentence; empty while it is reached."""
        if self.refusal is not None:
            return self.refusal.message
        return "" if self._vehicle.heartbeats.alive else "There is no connection to a vehicle."
