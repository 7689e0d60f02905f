"""Slows a commanded velocity down so that its run-out keeps apart from other vehicles."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from navigation_core.geometry import ZERO, norm, scale
from navigation_core.limits import stopping_distance_m
from navigation_core.tasks.intents import Setpoint
from navigation_core.tasks.traffic.evasions import AFTER_S
from navigation_core.tasks.traffic.reserved_path import REACTION_S
from navigation_core.tasks.traffic.traffic_view import TrafficView
from navigation_core.tasks.traffic.volumes import Volume

__all__ = ["CommandedSpeed", "free_share"]

# Shares of a commanded velocity that are tried.
_SHARES = (1.0, 0.75, 0.5, 0.35, 0.2, 0.1)
# Used where none of them is free: the vehicle stands, and its course stays known.
_STANDS_SHARE, _STANDS_M_S = 1e-3, 0.05
# After a longer pause a setpoint continues none before.
_CONTINUES_S = 0.5


class CommandedSpeed:
    """Slows down the setpoints of one vehicle; it slows down at once, and hastens gradually."""

    def __init__(self) -> None:
        """Begin without a setpoint."""
        self._share, self._share_s = 1.0, -math.inf

    def slowed(
        self,
        view: TrafficView,
        setpoint: Setpoint,
        timeout_s: float,
        braking_m_s2: float,
        acceleration_m_s2: float,
        now: float,
    ) -> Setpoint:
        """Return a setpoint as fast as a run-out from it is free, and hold its volume.

        Args:
            view: the traffic.
            setpoint: the command.
            timeout_s: for how long the vehicle follows its last setpoint.
            braking_m_s2: how hard it brakes then.
            acceleration_m_s2: how fast it may become faster again.
            now: time in seconds.
        """
        speed_m_s = norm(setpoint.velocity_enu_m_s)
        if speed_m_s < _STANDS_M_S:
            self._share = 1.0
            return setpoint
        share, volume = free_share(view, setpoint, timeout_s, braking_m_s2, now)
        if volume is not None:
            view.reservations.stand(view.name, volume, now, moves=True)
        since_s = now - self._share_s
        if since_s < _CONTINUES_S:
            share = min(share, self._share + acceleration_m_s2 * since_s / speed_m_s)
        self._share, self._share_s = share, now
        if volume is None:
            setpoint, share = replace(setpoint, acceleration_enu_m_s2=ZERO), _STANDS_SHARE
        return replace(setpoint, velocity_enu_m_s=scale(setpoint.velocity_enu_m_s, share))


def free_share(
    view: TrafficView, setpoint: Setpoint, timeout_s: float, braking_m_s2: float, now: float
) -> tuple[float, Volume | None]:
    """Return the greatest share of a speed whose run-out is free, and its volume; 0 and None.

    Args:
        view: the traffic.
        setpoint: the command.
        timeout_s: for how long the vehicle follows its last setpoint.
        braking_m_s2: how hard it brakes then.
        now: time in seconds.
    """
    start = np.array(setpoint.position_enu_m)
    for share in _shares(view, setpoint, now):
        velocity = np.array(setpoint.velocity_enu_m_s) * share
        speed = float(np.linalg.norm(velocity))
        stop_m = stopping_distance_m(speed, timeout_s + REACTION_S, braking_m_s2)
        line = start + np.linspace(0.0, 1.0, max(math.ceil(stop_m), 1) + 1)[:, None] * (
            velocity * (stop_m / max(speed, 1e-9))
        )
        volume = view.volume(line)
        if view.reservations.blocked_by(view.name, volume) is None:
            return share, volume
    return 0.0, None


def _shares(view: TrafficView, setpoint: Setpoint, now: float) -> tuple[float, ...]:
    """Return the shares of a commanded velocity that keep most from intruders, and less."""
    speed_m_s = norm(setpoint.velocity_enu_m_s)
    intruders = view.intruders(setpoint.position_enu_m, speed_m_s, now)
    if not len(intruders):
        return _SHARES
    shares = np.array([*_SHARES, 0.0])
    course = AFTER_S[:, None] * np.array(setpoint.velocity_enu_m_s)
    motions = np.array(setpoint.position_enu_m) + shares[:, None, None] * course
    placed = view.traffic_frame.traffic(motions.reshape(-1, 3)).reshape(motions.shape)
    penalties = intruders.passage(placed, AFTER_S).penalties
    return _SHARES[int(penalties.argmin()) :]
