"""The setpoint sent last, and where a plan begins: at it, or where the vehicle is."""

from __future__ import annotations

from dataclasses import dataclass

from navigation_core.geometry import KinematicState, distance, norm
from navigation_core.safety.braking import STANDING_M_S
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.measurement import is_located, measured_state
from navigation_core.tasks.observation import Observation

__all__ = ["Commanded", "SentSetpoint"]

# A setpoint this many times the greatest tracking error away is no start for a new flight.
_START_ERROR_SHARE = 1.5
# Farther than a vehicle that follows is from a setpoint that stands.
_RUN_OUT_M = 0.5


@dataclass(frozen=True)
class Commanded:
    """A setpoint.

    Attributes:
        state: its position and true derivatives.
        yaw_enu_rad: its yaw.
    """

    state: KinematicState
    yaw_enu_rad: float


class SentSetpoint:
    """The setpoint of one flight that was sent last, by this flight or the one that it replaces.

    Attributes:
        commanded: the setpoint; None before the first.
        is_stale: whether time has passed without setpoints, so that the last one says nothing.
    """

    def __init__(self, terms: FlightTerms) -> None:
        """Begin with that of the flight that is replaced, if there is one."""
        self._config = terms.config
        # A rover or boat is led from its measured position, not from the planned one.
        self._begins_here = not terms.traits.flies
        self.commanded: Commanded | None = None
        state, yaw_enu_rad = terms.handover.commanded, terms.handover.yaw_enu_rad
        if state is not None and yaw_enu_rad is not None:
            self.commanded = Commanded(state, yaw_enu_rad)
        self.is_stale = False
        self._handover_s = terms.handover.time_s
        self._stepped_s = self._to_walk_s = 0.0

    def start(self, now: float) -> None:
        """Count the time from now on, or from when another flight sent its last setpoint."""
        self._stepped_s = now if self._handover_s is None else self._handover_s

    def step_begins(self, now: float) -> bool:
        """Count the time since the last step; return whether that was too long a gap."""
        self._to_walk_s = max(now - self._stepped_s, 0.0)
        self._stepped_s = now
        return self._to_walk_s > self._config.step_gap_s

    def take_time_s(self) -> float:
        """Return the time that the setpoint has yet to move on in this step: once."""
        time_s, self._to_walk_s = self._to_walk_s, 0.0
        return time_s

    def note(self, carrot: Carrot) -> None:
        """Remember the setpoint that is sent."""
        self.commanded = Commanded(carrot.state, carrot.yaw_enu_rad)

    def outdate(self) -> None:
        """Let the next plan begin where the vehicle is."""
        self.is_stale = True

    def beginning(self, observation: Observation) -> Commanded | None:
        """Return the last setpoint if that still makes sense, else where the vehicle is.

        Returns:
            The setpoint to begin with; None if nothing is known.
        """
        located, sent = is_located(observation, self._config.position_stale_s), self.commanded
        if sent is None or (located and self._is_no_start(sent, observation)):
            yaw_enu_rad = observation.yaw_enu_rad
            if not located or yaw_enu_rad is None:
                return None
            sent = self.commanded = Commanded(self._measured(observation), yaw_enu_rad)
            self.is_stale = False
            self._to_walk_s = 0.0
        return sent

    def start_around(self, sent: Commanded, observation: Observation) -> KinematicState:
        """Return where a path around obstacles begins."""
        located = is_located(observation, self._config.position_stale_s)
        if located and self.is_left(sent, observation):
            return self._measured(observation)
        return sent.state

    def is_left(self, sent: Commanded, observation: Observation) -> bool:
        """Whether a path begins where the vehicle is, and not at its setpoint.

        It does for a rover or boat; and for an aircraft that has not stopped at its setpoint but
        somewhere further on: an emergency's brake may be harder than the autopilot follows. A
        path that began at the setpoint would lead back first, or to another side of an approaching
        obstacle.
        """
        if self._begins_here:
            return True
        if norm(sent.state.velocity_enu_m_s) > STANDING_M_S:
            return False
        if not is_located(observation, self._config.position_stale_s):
            return False
        here = measured_state(observation).position_enu_m
        return distance(here, sent.state.position_enu_m) > _RUN_OUT_M

    def _is_no_start(self, sent: Commanded, observation: Observation) -> bool:
        """Whether the last setpoint is nothing to continue from."""
        if self._begins_here or self.is_stale:
            return True
        here = measured_state(observation).position_enu_m
        error_m = distance(sent.state.position_enu_m, here)
        return error_m > _START_ERROR_SHARE * self._config.tracking_error_max_m

    def _measured(self, observation: Observation) -> KinematicState:
        """Return the state that a flight begins with where the vehicle is."""
        here = measured_state(observation)
        if self._begins_here and norm(here.velocity_enu_m_s) < STANDING_M_S:
            # A standstill is measured with a little speed, in any direction. A brake that begins
            # with it, asked for again and again, would pass it on, and the vehicle would creep.
            return KinematicState(here.position_enu_m)
        return here
