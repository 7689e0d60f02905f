"""Stops a flight, in the air or on the ground."""

from __future__ import annotations

from dataclasses import dataclass

from navigation_core.geometry import norm
from navigation_core.tasks.conditions import Dwell, Requester, can_move, is_located
from navigation_core.tasks.departure import Departure, is_pending
from navigation_core.tasks.flying.arrival import Arrival
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.intents import Fly, Intent, Outcome, Perform, Wait
from navigation_core.tasks.leading.path_follower import PathFollower
from navigation_core.tasks.leading.pursuit import without_turn
from navigation_core.tasks.observation import Observation, TaskOperation
from navigation_core.tasks.phased_task import Answer
from navigation_core.tasks.phases import Phase
from navigation_core.tasks.standstill import Standstill
from navigation_core.tasks.traits import Traits

FLYING = frozenset(
    {
        Phase.NAVIGATING,
        Phase.SETTLING,
        Phase.BLOCKED,
        Phase.HOLDING,
        Phase.PAUSED,
        Phase.STOPPING,
    }
)
"""The phases in which the vehicle is led by setpoints"""

# A setpoint slower than this has come to its end.
_STANDS_M_S = 0.01
_STOPPED = "The vehicle has stopped."


@dataclass(frozen=True)
class FlightParts:
    """The parts of a flight that its phases share.

    Attributes:
        config: how to fly.
        traits: what the vehicle can do.
        requests: the operations that are requested.
        follower: leads along the path.
        arrival: judges the distance to the stop.
        still: judges whether the vehicle stands.
        landed: judges whether it has been on the ground for long.
    """

    config: GotoConfig
    traits: Traits
    requests: Requester
    follower: PathFollower
    arrival: Arrival
    still: Standstill
    landed: Dwell

    def forget(self) -> None:
        """Drop what a time without steps makes worthless."""
        self.follower.sent.outdate()
        self.arrival.forget()
        self.still.reset()
        self.landed.reset()


class Stopping:
    """The phases after the flight, or instead of it."""

    def __init__(
        self,
        parts: FlightParts,
        ending: Outcome,
        departure: Departure,
        observation: Observation,
        now: float,
    ) -> None:
        """Begin to stop.

        Args:
            parts: of the flight that is stopped.
            ending: the outcome that it is stopped for.
            departure: what was asked of the vehicle before the flight.
            observation: what is known.
            now: time in seconds.
        """
        self._parts, self._ending = parts, ending
        # A vehicle that was armed for this flight is to be disarmed.
        self._armed_for_us = departure.arming_asked or _is_arming(observation)
        self._since_s = now
        self._watched_s: float | None = None
        parts.still.reset()

    def brake(self, observation: Observation, now: float) -> Answer:
        """Brake in the air, or on the road."""
        located = is_located(observation, self._parts.config.position_stale_s)
        if located and (self._parts.follower.sent.is_stale or self._parts.follower.carrot is None):
            self._parts.follower.plan_stop(observation)
        self._parts.follower.walk(None)
        carrot = self._parts.follower.carrot
        commanded_m_s = 0.0 if carrot is None else norm(carrot.state.velocity_enu_m_s)
        return self._at_rest(observation, now, self._since_s, commanded_m_s) or led(
            self._parts, observation
        )

    def _at_rest(
        self,
        observation: Observation,
        now: float,
        since_s: float,
        commanded_m_s: float = 0.0,
        done: str = _STOPPED,
    ) -> Outcome | None:
        """Return the outcome once the vehicle stands, or its time to stop is over."""
        still = self._parts.still.holds(observation, self._parts.config.position_stale_s)
        if still and commanded_m_s < _STANDS_M_S:
            return self.ended(done, observation)
        timeout_s = self._parts.config.cancel_timeout_s
        if now - since_s > timeout_s:
            return self.ended(self._parts.still.failure(timeout_s), observation)
        return None

    def _hold(self, done: str, failed: str, observation: Observation, now: float) -> Answer:
        """Let the autopilot stop in a mode of its own, and wait for that.

        A PX4 ends a climb so, and a rover that drives by itself rolls on for some time.
        """
        if self._watched_s is None:
            answer = self._asked(TaskOperation.HOLD, failed, observation, now)
            if answer is not None:
                return answer
            self._watched_s = now
        return self._at_rest(observation, now, self._watched_s, done=done) or Wait()

    def disarm(self, observation: Observation, now: float) -> Answer:
        """Disarm on the ground, or stop the take-off of a vehicle that somebody else armed."""
        flies = self._parts.traits.flies and can_move(
            observation, self._parts.traits, self._parts.config.airborne_height_m
        )
        holds = not self._armed_for_us and self._parts.requests.current is not None
        if flies and not observation.in_control:
            return self._hold(_STOPPED, "It may still be flying.", observation, now)
        if flies and not holds:
            self._parts.follower.plan_stop(observation)
            self._parts.still.reset()
            self._since_s = now
            return Phase.STOPPING
        if not self._armed_for_us:
            holding = "The vehicle holds; whoever armed it may disarm it."
            return self._hold(holding, "It is still armed.", observation, now)
        answer = self._asked(TaskOperation.DISARM, "It may still be armed.", observation, now)
        return answer or self.ended("The vehicle is disarmed.", observation)

    def _asked(
        self, kind: TaskOperation, failed: str, observation: Observation, now: float
    ) -> Intent | Outcome | None:
        """Have a last operation done; return the outcome if it failed, and None once it is done."""
        timeout_s = self._parts.config.cancel_timeout_s
        answer = self._parts.requests.perform(
            Perform(kind), self._ending.code, observation, now, timeout_s
        )
        if isinstance(answer, Outcome):
            return self.ended(f"{answer.message} {failed}", observation)
        return answer

    def ended(self, text: str, observation: Observation) -> Outcome:
        """Return the outcome that the stop was for, and how the stop went."""
        return self._ending.after(text, self._parts.arrival.error_m(observation))


def first_phase(
    parts: FlightParts, departure: Departure, phase: Phase, by_itself: bool, now: Observation
) -> Phase | None:
    """Return the phase that a stop begins with; None if nothing is to be stopped.

    Args:
        parts: of the flight that is stopped.
        departure: its operations.
        phase: its phase.
        by_itself: whether the vehicle moves by itself, as a replaced goal asked for.
        now: what is known.
    """
    preparing, moves = phase is Phase.PREPARING, departure.moves(now)
    inherited = preparing and parts.follower.sent.commanded is not None
    # It has come out of another mode just now, perhaps at speed.
    taken = preparing and parts.requests.current is not None and moves
    if phase in FLYING or (now.in_control and (inherited or taken)):
        return Phase.STOPPING
    taking_off = phase is Phase.TAKING_OFF or is_pending(now, TaskOperation.TAKE_OFF)
    asked = departure.arming_asked or departure.take_off_asked
    # It would get into a mode without setpoints, in which a PX4 soon returns by itself.
    taking_control = now.airborne is True and is_pending(now, TaskOperation.TAKE_CONTROL)
    moves_by_itself = by_itself and not now.in_control and moves
    if taking_off or asked or taking_control or moves_by_itself or _is_arming(now):
        return Phase.DISARMING
    return None


def _is_arming(observation: Observation) -> bool:
    """Whether the vehicle arms or disarms, perhaps because of a replaced goal."""
    kinds = (TaskOperation.ARM, TaskOperation.DISARM)
    return any(is_pending(observation, kind) for kind in kinds)


def led(parts: FlightParts, observation: Observation) -> Intent:
    """Return the carrot's setpoint, for a vehicle that is being stopped."""
    carrot = parts.follower.carrot
    if carrot is None:
        return Wait()
    setpoint = carrot.setpoint
    return Fly(setpoint if parts.traits.flies else without_turn(setpoint, observation))
