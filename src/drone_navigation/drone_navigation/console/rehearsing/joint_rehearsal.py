"""Flights of several vehicles, rehearsed one after the other and then compared. No ROS, no clock.

Each is rehearsed alone: that they keep apart, and wait for each other, is the server's part. The
comparison is therefore of what they would do if nobody waited.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

from drone_navigation.console import plans
from drone_navigation.console.page_types import HomeValue, JsonObject
from drone_navigation.console.rehearsing.separations import Meeting, TimedFlight, meetings
from navigation_core.geometry import Vector3
from navigation_core.tasks.traffic.volumes import Separation

__all__ = ["JointRehearsal", "RehearsedVehicle"]

_MEETINGS = 10
"""As many pairs are reported, the worst ones"""


@dataclass(frozen=True)
class RehearsedVehicle:
    """A vehicle as the others of a joint rehearsal meet it.

    Attributes:
        autopilot: as in VehicleStatus.
        home: as of `page_values.home`, or None.
        position_enu_m: in its own map, or None while it is unknown.
        parked: whether it is disarmed on the ground.
        flies: whether a goal is active that is not rehearsed here.
    """

    autopilot: str
    home: HomeValue | None
    position_enu_m: Sequence[float] | None
    parked: bool
    flies: bool


class JointRehearsal:
    """Collects the results of the single rehearsals."""

    def __init__(
        self,
        ordered: Sequence[str],
        vehicles: Mapping[str, RehearsedVehicle],
        separation: Separation,
        is_separated: bool | None,
    ) -> None:
        """Wait for the results.

        Args:
            ordered: names of the vehicles that are rehearsed.
            vehicles: all, by name, as they were when it began.
            separation: what they are to keep.
            is_separated: whether the server has vehicles wait; None while that is unknown.
        """
        self._ordered = tuple(ordered)
        self._vehicles = dict(vehicles)
        self._separation = separation
        self._is_separated = is_separated
        self._results: dict[str, JsonObject] = {}

    def take(self, vehicle: str, message: Mapping[str, object]) -> bool:
        """Take an answer about a vehicle; return whether it was the last that was missing."""
        if vehicle in self._results or not ("rehearsal" in message or "error" in message):
            return False
        names = ("rehearsal", "error", "lacks")
        self._results[vehicle] = {name: message[name] for name in names if name in message}
        return len(self._results) == len(self._ordered)

    def result(self) -> JsonObject:
        """Compare the flights.

        Returns:
            vehicles: for each its `rehearsal` or `error`. meetings: of pairs, the worst first,
            each position in its own vehicle's map. lacks: what is not considered, for
            people. is_separated.
        """
        flights: dict[str, TimedFlight] = {}
        lacks = []
        if self._is_separated is None:
            lacks.append("the server's separation, which it has not reported")
        for name, vehicle in self._vehicles.items():
            path = self._path(name)
            if path is None:
                why = "which flies another goal" if vehicle.flies else "whose flight is unknown"
                lacks.append(f"{name.removeprefix('/')}, {why}")
                continue
            points, times_s = path
            # All are compared in the map of the first.
            first = next(iter(flights), name)
            try:
                flights[name] = TimedFlight(
                    self._moved(points, name, first), times_s, vehicle.parked
                )
            except plans.PlanError:
                lacks.append(f"{name.removeprefix('/')}, whose home is unknown")
        return {
            "vehicles": self._results,
            "meetings": [
                self._in_own_maps(each, next(iter(flights))) for each in self._found(flights)
            ],
            "lacks": lacks,
            "is_separated": self._is_separated,
        }

    def _found(self, flights: Mapping[str, TimedFlight]) -> list[Meeting]:
        """Return the worst pairs; two that have no route have nothing to do with this rehearsal."""
        found = meetings(flights, self._separation)
        return [each for each in found if set(each.vehicles) & set(self._ordered)][:_MEETINGS]

    def _in_own_maps(self, meeting: Meeting, first: str) -> dict[str, object]:
        pairs = zip(meeting.vehicles, meeting.positions_m, strict=True)
        own = [self._moved((position,), first, name)[0] for name, position in pairs]
        return {**asdict(meeting), "positions_m": own}

    def _moved(self, points: Sequence[Vector3], name: str, other: str) -> tuple[Vector3, ...]:
        """Return points in the map of another vehicle."""
        one, two = self._vehicles[name], self._vehicles[other]
        return plans.in_map_of(points, (one.autopilot, one.home), (two.autopilot, two.home))

    def _path(self, name: str) -> tuple[tuple[Vector3, ...], tuple[float, ...]] | None:
        """Return the points and times of a flight; None if it is unknown."""
        result, vehicle = self._results.get(name), self._vehicles[name]
        flown = result.get("rehearsal") if result else None
        if flown and flown["accepted"]:
            points = tuple((east, north, up) for east, north, up in flown["path_enu_m"])
            return points, tuple(flown["times_s"])
        if (result and flown is None) or vehicle.flies or vehicle.position_enu_m is None:
            return None
        # Without a route, or with one that is rejected, it stays.
        east, north, up = vehicle.position_enu_m
        return ((east, north, up),), (0.0,)
