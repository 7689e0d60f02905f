"""Evasions of intruders: where a vehicle flies to so that they pass as far away as possible."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.limits import Limits
from navigation_core.tasks.traffic.entries import TrafficWait, wait_for
from navigation_core.tasks.traffic.intruders import HORIZON_S, Intruders
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traffic.volumes import Array

__all__ = ["AFTER_S", "ENOUGH", "TOO_NEAR", "AvoidingMotion", "EvasionSearch"]

AFTER_S: Array = np.linspace(0.0, HORIZON_S, 41)
"""The moments at which motions are compared, from now on"""

ENOUGH = 1.1
"""Share of the required distance that a changed flight must keep: a little more than 1"""

TOO_NEAR = "which would come too near"
"""Why a vehicle gives way"""

# Bearings and times at full speed of the ends that are tried; heights: those reached in the times.
_BEARINGS = np.arange(16) * math.tau / 16
_TIMES_S = (3.0, 6.0, 12.0)
# Delay of a change of velocity; a driving vehicle has to turn first, which takes this time.
_RESPONSE_S, _TURN_S = 0.5, 2.0
# Penalties count as equal within this difference.
_EQUAL = 0.02


@dataclass(frozen=True)
class AvoidingMotion:
    """A motion out of the path of intruders.

    Attributes:
        end_enu_m: its end, in the map frame.
        penalty: its penalty (:class:`~navigation_core.tasks.traffic.intruders.Passage`).
    """

    end_enu_m: Vector3
    penalty: float


class EvasionSearch:
    """Compares the motions that a vehicle can make now.

    Attributes:
        tried_max: number of evasions that are checked for obstacles, the best ones first.
    """

    tried_max = 24

    def __init__(
        self, view: TrafficView, intruders: Intruders, limits: Limits, can_turn: bool
    ) -> None:
        """Prepare.

        Args:
            view: the traffic.
            intruders: those that may come near.
            limits: of the flight.
            can_turn: whether it can move to any side at once; what drives cannot.
        """
        self._view = view
        self._intruders = intruders
        self._limits = limits
        self._can_turn = can_turn

    def along(
        self, state: KinematicState, points_enu_m: Sequence[Vector3]
    ) -> tuple[float, float, str]:
        """Return share, penalty and intruder of a flight by way of points, begun now.

        Args:
            state: the vehicle's, in the map frame.
            points_enu_m: the points; the vehicle stops at the last.
        """
        legs = np.array([state.position_enu_m, *points_enu_m])
        times_s = np.concatenate([[0.0], np.cumsum(self._durations_s(np.diff(legs, axis=0)))])
        drift, moving_s = self._change(state, self._limits.speed_horizontal_m_s)
        columns = [np.interp(moving_s, times_s, column) for column in legs.T]
        return self.judged((np.stack(columns, axis=1) + drift)[None])

    def judged(self, motions_enu_m: Array) -> tuple[float, float, str]:
        """Return share, penalty and intruder of one motion, shape (1, T, 3), at ``AFTER_S``."""
        passage = self._intruders.passage(self._traffic(motions_enu_m), AFTER_S, ENOUGH)
        who = self._intruders.names[passage.worst[0]]
        return float(passage.shares[0]), float(passage.penalties[0]), who

    def wait(
        self, before: TrafficWait | None, whom: str, motion_enu_m: Array, now: float
    ) -> TrafficWait:
        """Return for whom a motion gives way, and whether it is of use.

        Args:
            before: for whom it did until now, or None.
            whom: the intruder that comes nearest.
            motion_enu_m: what is flown, shape (T, 3), at ``AFTER_S``.
            now: time in seconds.
        """
        why = "which may come nearer than the separation, whatever is flown"
        why = why if self._may_meet(motion_enu_m) else TOO_NEAR
        return wait_for(before, whom, why, now)

    def _may_meet(self, motion_enu_m: Array) -> bool:
        """Whether a motion, shape (T, 3) at ``AFTER_S``, may come nearer than the separation."""
        exact = self._intruders.without_errors(self._view.reservations.separation)
        return bool(exact.passage(self._traffic(motion_enu_m[None]), AFTER_S).shares[0] < 1.0)

    def evasions(
        self,
        state: KinematicState,
        target_enu_m: Vector3,
        penalty_max: float,
        is_free: Callable[[Array], bool],
    ) -> Iterator[AvoidingMotion]:
        """Return the evasions with less than a penalty, the best one first.

        Args:
            state: the vehicle's, in the map frame.
            target_enu_m: the target; between equal penalties the end nearest to it comes first.
            penalty_max: penalty that they must be better than.
            is_free: whether a line of points (N, 3) of the map is clear of obstacles.
        """
        ends = self._ends(state, target_enu_m)
        motions = self._motions(state, ends)
        passage = self._intruders.passage(self._traffic(motions), AFTER_S, ENOUGH)
        level = np.round(passage.penalties / _EQUAL)
        tried = 0
        for row in np.lexsort((*self._costs(state, target_enu_m, ends), level)):
            if passage.penalties[row] > penalty_max - _EQUAL or tried == self.tried_max:
                return
            line = self._line(motions[row], ends[row])
            if not self._view.admits(line, ends_where_asked=False):
                continue
            tried += 1
            if is_free(line) and self._is_unreserved(line, ends[row]):
                x, y, z = ends[row].tolist()
                yield AvoidingMotion((x, y, z), float(passage.penalties[row]))

    def _costs(
        self, state: KinematicState, target_enu_m: Vector3, ends_enu_m: Array
    ) -> tuple[Array, ...]:
        """Return what decides between evasions that keep equally apart; the last counts most."""
        here = np.array(state.position_enu_m)
        detours_m = np.linalg.norm(ends_enu_m - target_enu_m, axis=1)
        return (detours_m + np.linalg.norm(ends_enu_m - here, axis=1),)

    def _line(self, motion_enu_m: Array, end_enu_m: Array) -> Array:
        """Return the path of a motion, shape (N, 3)."""
        return np.array([motion_enu_m[0], end_enu_m])

    def _is_unreserved(self, line: Array, end_enu_m: Array) -> bool:
        """Whether nobody holds what a path needs; the caller asks for a path that setpoints fly."""
        return True

    def _ends(self, state: KinematicState, target_enu_m: Vector3) -> Array:
        """Return where evasions may end, shape (K, 3)."""
        limits, here = self._limits, np.array(state.position_enu_m)
        rises_m = [0.0]
        if self._view.heights_m is not None:
            low, high = self._view.heights_m
            up_m, down_m = max(high - here[2], 0.0), max(here[2] - low, 0.0)
            for time_s in _TIMES_S:
                rises_m += [min(up_m, limits.speed_up_m_s * time_s)]
                rises_m += [-min(down_m, limits.speed_down_m_s * time_s)]
        offsets = [np.zeros((1, 2))]
        for time_s in _TIMES_S:
            around = np.stack([np.cos(_BEARINGS), np.sin(_BEARINGS)], axis=1)
            offsets.append(limits.speed_horizontal_m_s * time_s * around)
        level, rises = np.concatenate(offsets), np.unique(rises_m)
        # Ends count from the position where the vehicle comes to rest from its present velocity.
        drift, _ = self._change(state, limits.speed_horizontal_m_s)
        rest = here + drift[-1]
        ends = np.empty((len(level), len(rises), 3))
        ends[..., :2] = rest[:2] + level[:, None]
        ends[..., 2] = here[2] + rises
        return ends.reshape(-1, 3)

    def _motions(self, state: KinematicState, ends_enu_m: Array) -> Array:
        """Return where the vehicle is at each moment on its way to some ends, (K, T, 3)."""
        drift, moving_s = self._change(state, self._limits.speed_horizontal_m_s)
        start = np.array(state.position_enu_m)
        spans = ends_enu_m - start - drift[-1]
        durations_s = np.maximum(self._durations_s(spans), 1e-3)
        parts = np.clip(moving_s[None, :] / durations_s[:, None], 0.0, 1.0)
        return np.asarray(start + drift + parts[..., None] * spans[:, None])

    def _change(self, state: KinematicState, speed_m_s: float) -> tuple[Array, Array]:
        """Return the displacement by the present velocity, (T, 3), and the time at the new, (T,).

        The present velocity is braked while the new one begins.
        """
        limits, velocity = self._limits, np.array(state.velocity_enu_m_s)
        speed_now_m_s = float(np.linalg.norm(velocity))
        change_m_s = max(speed_now_m_s, speed_m_s) if self._can_turn else speed_now_m_s
        changes_s = _RESPONSE_S + change_m_s / limits.acceleration_horizontal_m_s2
        left_s = np.minimum(AFTER_S, changes_s)
        drift_s = left_s - 0.5 * left_s * left_s / changes_s
        begins_s = drift_s if self._can_turn else changes_s + _TURN_S
        return drift_s[:, None] * velocity, np.maximum(AFTER_S - begins_s, 0.0)

    def _durations_s(self, spans_m: Array) -> Array:
        """Return how long straight motions take, shape (N,)."""
        level_s = np.hypot(spans_m[:, 0], spans_m[:, 1]) / self._limits.speed_horizontal_m_s
        speed_m_s = np.where(
            spans_m[:, 2] > 0.0, self._limits.speed_up_m_s, self._limits.speed_down_m_s
        )
        return np.asarray(np.maximum(level_s, np.abs(spans_m[:, 2]) / speed_m_s))

    def _traffic(self, motions_enu_m: Array) -> Array:
        count, moments = motions_enu_m.shape[:2]
        placed = self._view.traffic_frame.traffic(motions_enu_m.reshape(-1, 3))
        return placed.reshape(count, moments, 3)
