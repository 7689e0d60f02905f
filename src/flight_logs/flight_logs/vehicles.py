"""Choice of the vehicles among all that sends HEARTBEAT in a log."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flight_logs.frames.records import Records
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.profiles import vehicle_rank

Source: TypeAlias = tuple[int, int]
"""MAVLink system and component of a sender."""


def vehicle_ranks(heartbeats: Records) -> dict[Source, int]:
    """Return the senders that are vehicles, each with its rank, the best known first.

    The rule is that of the bridge, over the whole log: type and autopilot decide, and whoever is
    better known replaces another sender of the same system. Between two that are known equally well
    the component of an autopilot is chosen, then the first. Equal ranks are in order of appearance.

    Args:
        heartbeats: records of HEARTBEAT from any sender, by time.
    """
    ranks: dict[Source, int] = {}
    for source, rank in zip(_sources(heartbeats), _ranks(heartbeats).tolist(), strict=True):
        ranks[source] = max(rank, ranks.get(source, 0))
    best: dict[int, Source] = {}
    for source in ranks:
        system = source[0]
        best[system] = max(best.get(system, source), source, key=lambda one: _order(one, ranks))
    vehicles = [source for source in ranks if ranks[source] and source in best.values()]
    return {source: ranks[source] for source in sorted(vehicles, key=lambda one: -ranks[one])}


def of_vehicle(heartbeats: Records) -> Records:
    """Return the vehicle's own records of HEARTBEAT, where others have the same ids.

    Args:
        heartbeats: records of HEARTBEAT with one system and component.
    """
    ranks = _ranks(heartbeats)
    chosen: Records = heartbeats[ranks == ranks.max(initial=0)]
    return chosen


def _order(source: Source, ranks: dict[Source, int]) -> tuple[int, bool]:
    return ranks[source], source[1] == mavlink.MAV_COMP_ID_AUTOPILOT1


def _sources(records: Records) -> list[Source]:
    return list(zip(records["system"].tolist(), records["component"].tolist(), strict=True))


def _ranks(heartbeats: Records) -> NDArray[np.int64]:
    """Return the rank of each record's sender, by this record alone."""
    kinds, places = np.unique(heartbeats[["autopilot", "type"]], return_inverse=True)
    of_kinds = np.array([vehicle_rank(*kind) for kind in kinds.tolist()], dtype=np.int64)
    ranks: NDArray[np.int64] = of_kinds[places]
    return ranks
