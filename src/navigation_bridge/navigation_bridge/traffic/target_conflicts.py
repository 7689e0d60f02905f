"""Targets that are too near to those of other vehicles, or to where they stand. No ROS."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from navigation_bridge.configuration.settings import TrafficConflict
from navigation_bridge.goals.admitted import Admitted
from navigation_bridge.goals.requests import NavigateRequest, Request
from navigation_bridge.requests.feature import Redirection
from navigation_bridge.snapshot import Snapshot
from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.tasks.traffic.traffic_view import TrafficView

__all__ = ["considered"]


def considered(
    admitted: Admitted, request: Request, snapshot: Snapshot
) -> Admitted | Redirection | Rejection:
    """Return a goal whose target is free, or what `traffic_conflict` says for another one."""
    target_enu_m, view = admitted.target_enu_m, TrafficView.of(snapshot)
    if target_enu_m is None or view is None:
        return admitted
    whom = _conflict(view, target_enu_m)
    if whom is None:
        return admitted
    conflict = snapshot.config.traffic.conflict
    if conflict is TrafficConflict.REJECT:
        return Rejection(
            OutcomeCode.TRAFFIC,
            f"The target is too near to that of {whom}, or to where it stands; choose "
            "another target, or send the goal again once it has left.",
        )
    # It is also in the result, once the other one has left.
    text = (
        f"Accepted while the target was too near to that of {whom}, or to where it "
        "stood; such a goal waits until it has left."
    )
    waits = replace(admitted, warnings=(*admitted.warnings, text))
    if conflict is not TrafficConflict.REROUTE:
        return waits
    if not isinstance(request, NavigateRequest) or request.frame_id == "base_link":
        return waits
    place = _free_target(view, target_enu_m)
    if place is None:
        return waits
    text = "The target was moved to the nearest position that is free of other vehicles."
    return Redirection(replace(request, frame_id="map", position=place), text, waits)


def _free_target(view: TrafficView, target_enu_m: Vector3) -> Vector3 | None:
    """Return the nearest target where nobody stands, at the same height."""
    x, y, z = target_enu_m
    step_m = 0.5 * view.reservations.separation.horizontal_m
    for ring in range(1, 9):
        for part in range(12):
            angle = math.tau * part / 12
            away_m = ring * step_m
            place = (x + away_m * math.cos(angle), y + away_m * math.sin(angle), z)
            if _conflict(view, place) is None:
                return place
    return None


def _conflict(view: TrafficView, target_enu_m: Vector3) -> str | None:
    """Return whose target a target is too near to, or who stands there; or None."""
    place, separation = view.volume(np.array([target_enu_m])), view.reservations.separation
    for other in view.reservations.others(view.name):
        if other.target is not None and place.meets(other.target, separation)[0]:
            return other.name
        if not other.moves and len(other.whole) and place.meets(other.whole, separation)[0]:
            return other.name
    return None
