"""Gives way with a plane to intruders: by another height, or another place, and back after them.

A plane cannot stop, nor get slower. It can be sent to circle elsewhere. The flight to its place is
compared with the motion of the intruders; as long as enough is kept, nothing changes. Else it is
sent to where most is kept, preferably above or below its place.
"""

from __future__ import annotations

import math

from navigation_core.geometry import Vector3, horizontal_norm
from navigation_core.limits import Limits
from navigation_core.tasks.conditions import is_located, measured_state
from navigation_core.tasks.observation import Observation
from navigation_core.tasks.traffic.entries import TrafficWait
from navigation_core.tasks.traffic.evasions import ENOUGH
from navigation_core.tasks.traffic.flight_detours import IsFree
from navigation_core.tasks.traffic.plane_evasions import PLANE_ROOM_M, PlaneEvasionSearch
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traits import Traits

__all__ = ["PlaneGivingWay"]

_LOOK_S = 0.4
# An evasion is flown for this time at least; another one replaces it if its penalty is at most this
# share of the present one's.
_KEEP_S, _BETTER_SHARE = 2.0, 0.8
# One that the vehicle has not taken by then is given up.
_TAKEN_S = 4.0
# Least rates of climb and descent of planes (PX4's FW_T_CLMB_R_SP and FW_T_SINK_R_SP; ArduPlane's
# TECS_CLMB_MAX and TECS_SINK_MAX are 5 m/s).
_CLIMBS = Limits(speed_up_m_s=3.0, speed_down_m_s=2.0)
# From a position that is older nothing is predicted.
_STALE_S = 2.0


class PlaneGivingWay:
    """Lets a plane give way that is sent from place to place."""

    def __init__(self, traits: Traits) -> None:
        """Prepare; ``traits`` are the plane's."""
        self._traits = traits
        self.circle_m: float | None = None
        """The radius of the circles that it is sent to, negative clockwise; None: its usual one."""
        self._evasion: Vector3 | None = None
        self._looked_s = self._chosen_s = self._given_up_s = -math.inf
        self.waiting: TrafficWait | None = None
        """The traffic that it gives way to, or None."""
        self.waited_s = 0.0
        """For how long it has given way since :meth:`restart`."""

    @property
    def evades(self) -> bool:
        """Whether it is sent elsewhere."""
        return self._evasion is not None

    def restart(self) -> None:
        """Count from now on: the plane has come nearer to its target."""
        self.waited_s = 0.0

    def give_up(self, now: float) -> None:
        """Fly to the wanted place for a while: the evasion cannot be had."""
        self._evasion, self._given_up_s = None, now

    def place(
        self, wanted_enu_m: Vector3, is_taken: bool, observation: Observation, now: float
    ) -> Vector3:
        """Return where the plane is to be sent to.

        Args:
            wanted_enu_m: where it is to get to.
            is_taken: whether it flies to the place that was returned last.
            observation: what is known.
            now: time in seconds.
        """
        if now - self._looked_s >= _LOOK_S:
            since_s = now - self._looked_s
            self._looked_s = now
            if self.waiting is not None:
                self.waited_s += since_s
            if self._evasion is not None and not is_taken and now - self._chosen_s > _TAKEN_S:
                self.give_up(now)
            self._look(wanted_enu_m, observation, now)
        return wanted_enu_m if self._evasion is None else self._evasion

    def _look(self, wanted_enu_m: Vector3, observation: Observation, now: float) -> None:
        view = TrafficView.of(observation)
        if view is not None and not is_located(observation, _STALE_S):
            return
        search = None
        if view is not None and not observation.position_doubt:
            search = self._search(view, observation, now)
        if search is None:
            self._evasion = self.waiting = None
            return
        state = measured_state(observation)
        kept, _, who = search.judged(search.towards(state, wanted_enu_m))
        if kept >= (1.0 if self._evasion is None else ENOUGH):
            self._evasion = self.waiting = None
            return
        motion = search.towards(state, self._evasion or wanted_enu_m)
        kept, penalty, _ = search.judged(motion)
        may_choose = now - max(self._chosen_s + _KEEP_S, self._given_up_s + _TAKEN_S) >= 0.0
        if kept < 1.0 and may_choose:
            is_free = IsFree(observation, PLANE_ROOM_M[0], avoids=True)
            found = search.evasions(state, wanted_enu_m, _BETTER_SHARE * penalty, is_free)
            for evasion in found:
                self._evasion, self._chosen_s = evasion.end_enu_m, now
                motion = search.towards(state, evasion.end_enu_m)
                break
        self.waiting = search.wait(self.waiting, who, motion[0], now)

    def _search(
        self, view: TrafficView, observation: Observation, now: float
    ) -> PlaneEvasionSearch | None:
        state = measured_state(observation)
        speed_m_s = horizontal_norm(state.velocity_enu_m_s) + _CLIMBS.speed_up_m_s
        # It flies into what stands, too, if it does not turn in time.
        intruders = view.intruders(
            state.position_enu_m, speed_m_s, now, PLANE_ROOM_M, with_standing=True
        )
        if not len(intruders):
            return None
        traits, circle_m = self._traits, self.circle_m
        height_min_enu_m = observation.ground_enu_m + traits.height_min_m
        return PlaneEvasionSearch(
            view,
            intruders,
            _CLIMBS,
            abs(circle_m or traits.circle_radius_m),
            traits.circles_left if circle_m is None else circle_m > 0.0,
            traits.sinks_along_leg,
            height_min_enu_m,
        )
