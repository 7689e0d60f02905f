"""False reports of one server to those that it shares traffic with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from navigation_core.tasks.traffic.negotiation import PeerState, PeerVehicle
from navigation_core.tasks.traffic.volumes import Volume

__all__ = ["MISREPORTS", "misreported"]

MISREPORTS = ("elsewhere", "everything", "silent")
_MOVED_M = np.array([40.0, 25.0, 0.0])
_EVERYTHING_M = 500.0


def misreported(state: PeerState, what: str) -> PeerState:
    """Return the state that is sent instead of a true one.

    Args:
        state: the true one.
        what: of `MISREPORTS`; empty for the truth.
    """
    change = {"elsewhere": _elsewhere, "everything": _everything}.get(what)
    if change is None:
        return state
    return replace(state, vehicles=tuple(change(one) for one in state.vehicles))


def _elsewhere(vehicle: PeerVehicle) -> PeerVehicle:
    return replace(
        vehicle,
        held=_moved(vehicle.held),
        alone=_moved(vehicle.alone),
        path=_moved(vehicle.path),
        target=_moved(vehicle.target),
    )


def _moved(volume: Volume) -> Volume:
    points = np.array([np.asarray(point) + _MOVED_M for point in volume.points_m])
    return Volume.along(points, volume.radius_m, volume.rise_m)


def _everything(vehicle: PeerVehicle) -> PeerVehicle:
    held = vehicle.held
    grown = np.full_like(np.asarray(held.radius_m), _EVERYTHING_M)
    return replace(vehicle, held=Volume.along(np.array(held.points_m), grown, held.rise_m))
