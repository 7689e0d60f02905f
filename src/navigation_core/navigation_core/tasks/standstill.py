"""Detects a standstill over a window of positions. Pure."""

from __future__ import annotations

from collections import deque
from itertools import combinations

from navigation_core.geometry import Vector3, distance
from navigation_core.tasks.conditions import measured_speed
from navigation_core.tasks.goto_config import GotoConfig
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traits import Traits

# A PX4 v1.17 that held reported 0.2 to 0.7 m/s for half a minute, while its position, and the
# vehicle, moved by less than 0.25 m in a second (observed on its own simulator).
HOVERING_VELOCITY_ERROR_M_S = 0.7
# The estimated position wanders, too. While a PX4 was recorded to hover, its true speed was below
# a limit in 98 % of the samples that were measured below this share of it, and in a quarter of
# those whose reported velocity had been below the limit itself for half a second.
_SHARE = 0.7
# Over a shorter time the resolution of GLOBAL_POSITION_INT, 1 cm, would look like a speed.
_SHORTEST_S = 0.3
# Between earlier positions. A recorded PX4 that hovers wanders so that a shorter time would take it
# for moving for 2.5 s and more.
_BETWEEN_S = 0.6


class Standstill:
    """Measures the speed of a vehicle by how far its position moves.

    The speed is the greatest mean speed from any position of the window to the last one, and
    between those that are 0.6 s apart: a sway counts as much as a drift, and a vehicle that turns
    round after an overshoot counts as moving. The reported velocity only has to be plausible beside
    it, as its errors last longer than any dwell. So neither one noisy sample nor a biased velocity
    keeps a stop from being seen.
    """

    def __init__(
        self,
        speed_max_m_s: float,
        window_s: float,
        velocity_error_m_s: float = HOVERING_VELOCITY_ERROR_M_S,
    ) -> None:
        """Begin without observations.

        Args:
            speed_max_m_s: slower than this is still.
            window_s: how long it must have been; at least 0.3 s are looked at.
            velocity_error_m_s: of the reported velocity.
        """
        self._speed_max_m_s = speed_max_m_s
        self._reported_max_m_s = speed_max_m_s + velocity_error_m_s
        self._window_s = max(window_s, _SHORTEST_S)
        self._places: deque[tuple[float, Vector3]] = deque()
        self.speed_m_s: float | None = None
        """Measured over the last window; None while there is no whole one."""

    @classmethod
    def of_stop(cls, config: GotoConfig, traits: Traits) -> Standstill:
        """Return the judge of whether a vehicle that was commanded to stop has done so.

        A rover that rolls back after its stop has hardly moved on the whole: for vehicles that
        drive the reported velocity counts as it is.
        """
        error_m_s = HOVERING_VELOCITY_ERROR_M_S if traits.flies else 0.0
        return cls(config.stop_speed_m_s, config.stop_dwell_s, error_m_s)

    def reset(self) -> None:
        """Forget what was seen."""
        self._places.clear()
        self.speed_m_s = None

    def holds(self, observation: Observation, stale_s: float) -> bool:
        """Process an observation, and return whether the vehicle stands still.

        Args:
            observation: what is known now.
            stale_s: age from which a position says nothing.
        """
        place, age_s = observation.position_enu_m, observation.position_age_s
        reported_m_s = measured_speed(observation)
        if place is None or reported_m_s is None or not age_s <= stale_s:
            self.reset()
            return False
        self._take(observation.time_s - age_s, place)
        plausible = reported_m_s < self._reported_max_m_s
        slow = self.speed_m_s is not None and self.speed_m_s < _SHARE * self._speed_max_m_s
        return plausible and slow

    def failure(self, timeout_s: float) -> str:
        """Report that it had not stopped in time."""
        speed = "an unknown speed" if self.speed_m_s is None else f"{self.speed_m_s:.2f} m/s"
        return f"The vehicle had not stopped after {timeout_s:g} s; it moves at {speed}."

    def _take(self, time_s: float, place: Vector3) -> None:
        places = self._places
        if places and time_s <= places[-1][0]:
            return  # a position that is only repeated adds nothing
        places.append((time_s, place))
        while len(places) > 1 and places[1][0] <= time_s - self._window_s:
            places.popleft()
        if time_s - places[0][0] < self._window_s:
            self.speed_m_s = None
            return
        self.speed_m_s = max(
            distance(first, last) / (end_s - start_s)
            for (start_s, first), (end_s, last) in combinations(places, 2)
            if end_s - start_s >= (_SHORTEST_S if end_s == time_s else _BETWEEN_S)
        )
