"""Stops a flight to a point, in the air or on the ground."""

from __future__ import annotations

from navigation_core.geometry import norm
from navigation_core.tasks.base import Fly, Observation, OperationKind, Outcome, Perform, Wait
from navigation_core.tasks.flying.goto_base import Answer
from navigation_core.tasks.flying.goto_departure import GotoDeparture
from navigation_core.tasks.flying.goto_phases import PhaseEvent
from navigation_core.tasks.leading.pursuit import without_turn
from navigation_core.tasks.measurement import is_located

# A setpoint slower than this has come to its end.
_STANDS_M_S = 0.01


class GotoStopping(GotoDeparture):
    """The end after the flight, or instead of it."""

    def _brake(self, observation: Observation, now: float) -> Answer:
        located = is_located(observation, self._config.position_stale_s)
        if located and (self._follower.is_stale or self._follower.carrot is None):
            self._follower.plan_stop(observation)
        self._follower.walk(None)
        carrot = self._follower.carrot
        commanded_m_s = 0.0 if carrot is None else norm(carrot.state.velocity_enu_m_s)
        still = self._stopped.holds(observation, self._config.position_stale_s)
        if still and commanded_m_s < _STANDS_M_S:
            return self._ended("The vehicle has stopped.", observation)
        timeout_s = self._config.cancel_timeout_s
        if now - self._phase_since_s > timeout_s:
            return self._ended(self._stopped.failure(timeout_s), observation)
        return self._led(observation)

    def _led(self, observation: Observation) -> Answer:
        """Return the carrot's setpoint, for a vehicle that is being stopped."""
        carrot = self._follower.carrot
        if carrot is None:
            return Wait()
        setpoint = carrot.setpoint
        return Fly(setpoint if self._traits.flies else without_turn(setpoint, observation))

    def _disarm(self, observation: Observation, now: float) -> Answer:
        assert self._ending is not None
        holds = not self._armed_for_us and self._operation is not None
        if self._traits.flies and self._flies(observation) and not holds:
            self._follower.plan_stop(observation)
            self._go(PhaseEvent.STOP_IN_AIR, now)
            return None
        if not self._armed_for_us:
            return self._cut_take_off(observation, now)
        answer = self._perform(Perform(OperationKind.DISARM), self._ending.code, observation, now)
        if answer is None:
            return self._ended("The vehicle is disarmed.", observation)
        if isinstance(answer, Outcome):
            return self._ended(f"{answer.message} It may still be armed.", observation)
        return answer

    def _cut_take_off(self, observation: Observation, now: float) -> Answer:
        """Stop a take-off of a vehicle that somebody else armed: theirs to disarm."""
        assert self._ending is not None
        answer = self._perform(Perform(OperationKind.HOLD), self._ending.code, observation, now)
        if answer is None:
            return self._ended("The vehicle holds; whoever armed it may disarm it.", observation)
        if isinstance(answer, Outcome):
            return self._ended(f"{answer.message} It is still armed.", observation)
        return answer
