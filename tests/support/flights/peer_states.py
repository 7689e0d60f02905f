"""The state of another server as a message brings it: in the receiver's traffic frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from navigation_bridge.traffic.shared_traffic import SharedTraffic
from navigation_core.tasks.traffic.negotiation import PeerState
from navigation_core.tasks.traffic.volumes import Volume


def moved_state(state: PeerState, sender: SharedTraffic, receiver: SharedTraffic) -> PeerState:
    """Return a state in the receiver's traffic frame; both have one."""
    assert sender.earth is not None
    assert receiver.earth is not None
    here, there = sender.earth, receiver.earth

    def moved(volume: Volume) -> Volume:
        points = [there.metres(here.geodetic(point)) for point in volume.points_m]
        return Volume.along(np.array(points), volume.radius_m, volume.rise_m)

    vehicles = tuple(
        replace(
            one,
            held=moved(one.held),
            alone=moved(one.alone),
            reach=moved(one.reach),
            path=moved(one.path),
            target=moved(one.target),
        )
        for one in state.vehicles
    )
    return replace(state, vehicles=vehicles)
