"""Evasions of planes: where one is sent to, to circle there, so that intruders pass far away."""

from __future__ import annotations

import math

import numpy as np

from navigation_core.geometry import KinematicState, Vector3
from navigation_core.limits import Limits
from navigation_core.tasks.traffic.evasions import AFTER_S, EvasionSearch
from navigation_core.tasks.traffic.intruders import Intruders
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traffic.volumes import Array, Volume, densified, joined

__all__ = ["PLANE_ROOM_M", "PlaneEvasionSearch"]

PLANE_ROOM_M = (15.0, 8.0)
"""By how much a plane strays from its predicted path, level and in height"""

# Centres of circles that are tried: at such multiples of the radius, and such times at full climb.
_BEARINGS = np.exp(1j * np.arange(16) * math.tau / 16)
_RADII = (2.0, 4.0)
_TIMES_S = (3.0, 6.0, 12.0, 20.0)
# A circle is flown wider than its parameter says: as much as ArduPlane and PX4 are recorded to, and
# as much as is allowed for.
_CIRCLE_SHARE, _WIDEST_SHARE = 1.06, 2.0
_RING = np.exp(1j * np.linspace(0.0, math.tau, 17))
# Every small plane can do this, or more: turn at a bank of 27 degrees, and follow a change of its
# bank and its climb at these rates. Nearer to its circle than it flies in _TURN_IN_S it turns in.
_TURN_M_S2, _BANK_LAG_S, _TURN_GAIN_1_S = 5.0, 0.5, 0.8
_CLIMB_CHANGE_M_S2, _CLIMB_GAIN_1_S = 1.5, 0.3
_TURN_IN_S, _TURN_SHARE = 7.0, 1.3
_SPEED_MIN_M_S = 8.0
_PARTS = 2


class PlaneEvasionSearch(EvasionSearch):
    """Compares the places that a plane can be sent to now.

    It flies to each by itself, and circles it: first it turns there, then along the circle.
    """

    tried_max = 80

    def __init__(
        self,
        view: TrafficView,
        intruders: Intruders,
        limits: Limits,
        circle_radius_m: float,
        circles_left: bool,
        sinks_along_leg: bool,
        height_min_enu_m: float,
    ) -> None:
        """Prepare.

        Args:
            view: the traffic.
            intruders: those that may come near.
            limits: of its climb; a plane keeps its own speed.
            circle_radius_m: of its circles by its parameter.
            circles_left: whether it flies them to the left, counter-clockwise.
            sinks_along_leg: whether it descends gradually on its way, not at once.
            height_min_enu_m: lowest map z that it may be sent to.
        """
        super().__init__(view, intruders, limits, can_turn=True)
        self._radius_m = circle_radius_m
        self._side = 1.0 if circles_left else -1.0
        self._sinks_along_leg = sinks_along_leg
        self._height_min_m = height_min_enu_m

    def towards(self, state: KinematicState, place_enu_m: Vector3) -> Array:
        """Return where it is at each moment if it is sent to a place, shape (1, T, 3)."""
        return self._motions(state, np.array([place_enu_m]))

    def _ends(self, state: KinematicState, target_enu_m: Vector3) -> Array:
        """Return the target at other heights, and places aside; all are circled."""
        x, y, z = state.position_enu_m
        assert self._view.heights_m is not None
        low, high = self._view.heights_m
        low, high = max(low, self._height_min_m), high - PLANE_ROOM_M[1]
        rises_m = [0.0, target_enu_m[2] - z]
        for time_s in _TIMES_S:
            rises_m += [self._limits.speed_up_m_s * time_s, -self._limits.speed_down_m_s * time_s]
        heights = np.unique(np.clip(z + np.array(rises_m), low, max(low, high)))
        aside = np.outer(self._radius_m * np.array(_RADII), _BEARINGS).ravel()
        level = np.array([complex(*target_enu_m[:2]), *(complex(x, y) + aside)])
        ends = np.empty((len(level), len(heights), 3))
        ends[..., 0], ends[..., 1] = level.real[:, None], level.imag[:, None]
        ends[..., 2] = heights
        return ends.reshape(-1, 3)

    def _costs(
        self, state: KinematicState, target_enu_m: Vector3, ends_enu_m: Array
    ) -> tuple[Array, ...]:
        """Prefer another height to another place."""
        gaps_m = ends_enu_m - np.array(target_enu_m)
        aside_m = np.hypot(gaps_m[:, 0], gaps_m[:, 1])
        height_m = np.abs(gaps_m[:, 2]) + np.abs(ends_enu_m[:, 2] - state.position_enu_m[2])
        return height_m, aside_m

    def _line(self, motion_enu_m: Array, end_enu_m: Array) -> Array:
        """Return its path, and the circles, usual and widest, that it may get on to."""
        circles = self._radius_m * np.concatenate([_CIRCLE_SHARE * _RING, _WIDEST_SHARE * _RING])
        ring = np.broadcast_to(end_enu_m, (len(circles), 3)).copy()
        ring[:, 0] += circles.real
        ring[:, 1] += circles.imag
        return np.concatenate([motion_enu_m, ring])

    def _is_unreserved(self, line: Array, end_enu_m: Array) -> bool:
        """Whether nobody holds its path or its circle."""
        level_m, rise_m = PLANE_ROOM_M
        traffic_frame, view = self._view.traffic_frame, self._view
        path, _ = densified(line[: len(AFTER_S)], AFTER_S)
        circle = Volume.along(
            traffic_frame.traffic(end_enu_m[None]), level_m + _CIRCLE_SHARE * self._radius_m, rise_m
        )
        volume = joined(Volume.along(traffic_frame.traffic(path), level_m, rise_m), circle)
        return view.reservations.blocked_by(view.name, volume) is None

    def _motions(self, state: KinematicState, ends_enu_m: Array) -> Array:
        """Return where it is at each moment on its way to some ends, (K, T, 3).

        Far from the circle it flies straight to it, near it along it, as the guidance of PX4 does
        (NPFG) and the L1 law of ArduPilot.
        """
        x, y, z = state.position_enu_m
        v_x, v_y, v_z = state.velocity_enu_m_s
        speed, radius_m = max(math.hypot(v_x, v_y), _SPEED_MIN_M_S), _CIRCLE_SHARE * self._radius_m
        count, step_s = len(ends_enu_m), float(AFTER_S[1]) / _PARTS
        centres = ends_enu_m[:, 0] + 1j * ends_enu_m[:, 1]
        place, height = np.full(count, complex(x, y)), np.full(count, z)
        course = np.full(count, np.exp(1j * math.atan2(v_y, v_x)))
        rate, climb = np.zeros(count), np.full(count, v_z)
        up_m_s = max(self._limits.speed_up_m_s, v_z)
        down_m_s = max(self._limits.speed_down_m_s, -v_z)
        turn_max = max(_TURN_M_S2 / speed, _TURN_SHARE * speed / radius_m)
        motions = np.empty((count, len(AFTER_S), 3))
        for moment in range(len(AFTER_S)):
            motions[:, moment] = np.stack([place.real, place.imag, height], axis=1)
            for _ in range(_PARTS):
                out = place - centres
                away_m = np.maximum(np.abs(out), 1e-6)
                beside_m = away_m - radius_m
                far = np.minimum(np.abs(beside_m) / (_TURN_IN_S * speed), 1.0)
                look_rad = 0.5 * math.pi * (1.0 - far) ** 2
                inwards = np.where(beside_m > 0.0, -1.0, 1.0) * np.cos(look_rad)
                wanted = (inwards + self._side * 1j * np.sin(look_rad)) * out / away_m
                turn = _TURN_GAIN_1_S * np.angle(wanted * course.conj())
                turn += self._side * speed / radius_m * np.sin(look_rad)
                rate += (np.clip(turn, -turn_max, turn_max) - rate) * (step_s / _BANK_LAG_S)
                course = course * np.exp(1j * rate * step_s)
                place = place + speed * step_s * course
                rise_m = ends_enu_m[:, 2] - height
                lowest = np.full(count, -down_m_s)
                if self._sinks_along_leg:
                    lowest = np.maximum(lowest, np.minimum(rise_m, 0.0) * speed / away_m)
                wished = np.clip(_CLIMB_GAIN_1_S * rise_m, lowest, up_m_s)
                most = _CLIMB_CHANGE_M_S2 * step_s
                climb = climb + np.clip(wished - climb, -most, most)
                height = height + climb * step_s
        return motions
