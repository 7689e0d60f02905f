"""The vehicle's own fence, and checks that targets and the straight lines between them keep to it.

A path may cross the fence anywhere, not only at its ends. It is cut at each crossing of a
boundary, and the middle of every piece is looked at: pieces do not change sides.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from navigation_core.geometry import Vector3, add, scale, subtract
from navigation_core.outcomes import OutcomeCode, Rejection
from navigation_core.safety.target_checks import RESOLUTION_M, beside

Point2 = tuple[float, float]

# Pieces of a path shorter than this fraction of it come from crossings that are one and the same.
_SAME = 1e-9


@dataclass(frozen=True)
class CircleArea:
    """A circle in the map frame.

    Attributes:
        centre_enu_m: its centre, east and north.
        radius_m: its radius; the rim belongs to it.
        inclusion: whether the vehicle must stay inside; otherwise outside.
        name: for sentences.
    """

    centre_enu_m: Point2
    radius_m: float
    inclusion: bool = True
    name: str = "circle"

    def contains(self, point: Point2) -> bool:
        """Whether a point is inside."""
        return math.dist(point, self.centre_enu_m) <= self.radius_m

    def margin_m(self, point: Point2) -> float:
        """Return the distance to the boundary."""
        return abs(math.dist(point, self.centre_enu_m) - self.radius_m)

    def crossings(self, start: Point2, end: Point2) -> Iterator[float]:
        """Yield where the line through two points cuts the boundary; 0 is start, 1 is end."""
        dx, dy = end[0] - start[0], end[1] - start[1]
        fx, fy = start[0] - self.centre_enu_m[0], start[1] - self.centre_enu_m[1]
        a, b = dx * dx + dy * dy, fx * dx + fy * dy
        discriminant = b * b - a * (fx * fx + fy * fy - self.radius_m**2)
        if a == 0.0 or discriminant < 0.0:
            return
        root = math.sqrt(discriminant)
        yield (-b - root) / a
        yield (-b + root) / a

    def describe(self, point: Point2) -> str:
        """Describe the position of a point, with all numbers."""
        x, y = self.centre_enu_m
        return (
            f"{math.dist(point, self.centre_enu_m):.2f} m from ({x:.2f}, {y:.2f}) m; the fence's "
            f"{self.name} has a radius of {self.radius_m:g} m"
        )


@dataclass(frozen=True)
class PolygonArea:
    """A simple polygon in the map frame, of any shape.

    Attributes:
        corners_enu_m: three or more corners, east and north, in order.
        inclusion: whether the vehicle must stay inside; otherwise outside.
        name: for sentences.
    """

    corners_enu_m: tuple[Point2, ...]
    inclusion: bool = True
    name: str = "polygon"

    def _edges(self) -> Iterator[tuple[Point2, Point2]]:
        corners = self.corners_enu_m
        return zip(corners, corners[1:] + corners[:1], strict=True)

    def contains(self, point: Point2) -> bool:
        """Whether a point is inside (even-odd rule)."""
        inside = False
        for (x0, y0), (x1, y1) in self._edges():
            if (y0 > point[1]) != (y1 > point[1]):
                inside ^= point[0] < x0 + (x1 - x0) * (point[1] - y0) / (y1 - y0)
        return inside

    def margin_m(self, point: Point2) -> float:
        """Return the distance to the boundary."""
        return min(_distance_to_edge(point, *edge) for edge in self._edges())

    def crossings(self, start: Point2, end: Point2) -> Iterator[float]:
        """Yield where the line through two points cuts the boundary; 0 is start, 1 is end."""
        dx, dy = end[0] - start[0], end[1] - start[1]
        for (x0, y0), (x1, y1) in self._edges():
            ex, ey = x1 - x0, y1 - y0
            determinant = dx * ey - dy * ex
            if determinant == 0.0:
                continue  # parallel: the neighbouring edges end the stretch
            along = ((x0 - start[0]) * ey - (y0 - start[1]) * ex) / determinant
            across = ((x0 - start[0]) * dy - (y0 - start[1]) * dx) / determinant
            if 0.0 <= across <= 1.0:
                yield along

    def describe(self, point: Point2) -> str:
        """Describe the position of a point, with all numbers."""
        side = "outside" if self.inclusion else "inside"
        return (
            f"{self.margin_m(point):.2f} m {side} the fence's {self.name} of "
            f"{len(self.corners_enu_m)} corners"
        )


Area = CircleArea | PolygonArea


def _distance_to_edge(point: Point2, start: Point2, end: Point2) -> float:
    ex, ey = end[0] - start[0], end[1] - start[1]
    px, py = point[0] - start[0], point[1] - start[1]
    length2 = ex * ex + ey * ey
    share = 0.0 if length2 == 0.0 else min(max((px * ex + py * ey) / length2, 0.0), 1.0)
    return math.hypot(px - share * ex, py - share * ey)


@dataclass(frozen=True)
class Fence:
    """A fence that the vehicle enforces itself.

    Attributes:
        areas: circles and polygons; the vehicle must be inside every inclusion and outside
            every exclusion.
        alternatives: inclusions of which one is enough.
        altitude_min_m: least height above home, or None.
        altitude_max_m: greatest height above home, or None.
    """

    areas: tuple[Area, ...] = ()
    alternatives: tuple[Area, ...] = ()
    altitude_min_m: float | None = None
    altitude_max_m: float | None = None

    def allows(self, point: Point2) -> bool:
        """Whether a place, east and north, keeps to the areas."""
        return self._broken(point) is None

    def _broken(self, point: Point2) -> Area | None:
        for area in self.areas:
            if area.contains(point) is not area.inclusion:
                return area
        if any(area.contains(point) for area in self.alternatives):
            return None
        return next(iter(self.alternatives), None)

    def check_target(
        self,
        position_enu_m: Vector3,
        home_z_enu_m: float,
        margin_m: float = 0.0,
        height_margin_m: float | None = None,
    ) -> Rejection | None:
        """Return why a target is rejected.

        Args:
            position_enu_m: the target in the map frame.
            home_z_enu_m: map height of home, from which the fence's heights count.
            margin_m: how far inside of every boundary it must be.
            height_margin_m: how far within the heights, where that differs.
        """
        if height_margin_m is None:
            height_margin_m = margin_m
        x, y, z = position_enu_m
        what = f"The target ({x:.2f}, {y:.2f}, {z:.2f}) m"
        broken = self._broken((x, y))
        if broken is not None:
            return _outside(f"{what} is {broken.describe((x, y))}.")
        for area in self.areas:
            near_m = area.margin_m((x, y))
            if near_m < margin_m - RESOLUTION_M:
                return _outside(
                    f"{what} is {beside(near_m, margin_m)} m from the boundary of the "
                    f"fence's {area.name}; keep {margin_m:g} m away (fence_margin_m)."
                )
        height_m = z - home_z_enu_m
        highest_m, lowest_m = self.altitude_max_m, self.altitude_min_m
        if highest_m is not None and height_m > highest_m - height_margin_m + RESOLUTION_M:
            height = beside(height_m, highest_m - height_margin_m)
            return _outside(
                f"{what} is {height} m above home; the fence ends at {highest_m:g} m, with "
                f"a margin of {height_margin_m:g} m (fence_margin_m)."
            )
        if lowest_m is not None and height_m < lowest_m + height_margin_m - RESOLUTION_M:
            return _outside(
                f"{what} is {beside(height_m, lowest_m + height_margin_m)} m above home; the fence "
                f"begins at {lowest_m:g} m, with a margin of {height_margin_m:g} m "
                "(fence_margin_m)."
            )
        return None

    def check_leg(self, start_enu_m: Vector3, end_enu_m: Vector3) -> Rejection | None:
        """Return where the straight line between two points leaves the fence, if it does."""
        start, end = start_enu_m[:2], end_enu_m[:2]
        cuts = {0.0, 1.0}
        for area in (*self.areas, *self.alternatives):
            cuts.update(cut for cut in area.crossings(start, end) if 0.0 < cut < 1.0)
        for before, after in itertools.pairwise(sorted(cuts)):
            if after - before < _SAME:
                continue
            middle = _along(start_enu_m, end_enu_m, 0.5 * (before + after))
            broken = self._broken(middle[:2])
            if broken is not None:
                x, y, _ = _along(start_enu_m, end_enu_m, before)
                return _outside(
                    f"The straight line from ({start[0]:.2f}, {start[1]:.2f}) m to ({end[0]:.2f}, "
                    f"{end[1]:.2f}) m leaves the fence's {broken.name} at ({x:.2f}, {y:.2f}) m; "
                    "send waypoints that stay inside."
                )
        return None


def check_targets(
    fence: Fence,
    targets_enu_m: Sequence[Vector3],
    home_z_enu_m: float,
    margin_m: float = 0.0,
    height_margin_m: float | None = None,
) -> Rejection | None:
    """Return why targets do not keep to the fence; the arguments are those of `check_route`."""
    for number, target in enumerate(targets_enu_m, start=1):
        rejection = fence.check_target(target, home_z_enu_m, margin_m, height_margin_m)
        if rejection is not None:
            return _named(rejection, number) if len(targets_enu_m) > 1 else rejection
    return None


def check_route(
    fence: Fence,
    start_enu_m: Vector3,
    targets_enu_m: Sequence[Vector3],
    home_z_enu_m: float,
    margin_m: float = 0.0,
    closed: bool = False,
    height_margin_m: float | None = None,
) -> Rejection | None:
    """Return why a flight through targets, in straight lines, does not keep to the fence.

    A vehicle that is outside may come back in: then the path to the first target is its own.
    Heights hold for the targets; between two that keep to them, a straight line does.

    Args:
        fence: the fence.
        start_enu_m: where the vehicle is.
        targets_enu_m: the targets in order.
        home_z_enu_m: map height of home.
        margin_m: how far inside of every boundary targets must be.
        closed: whether the last is followed by the first again.
        height_margin_m: how far within its heights, where that differs.
    """
    rejection = check_targets(fence, targets_enu_m, home_z_enu_m, margin_m, height_margin_m)
    if rejection is not None:
        return rejection
    points = list(targets_enu_m)
    if fence.allows(start_enu_m[:2]):
        points.insert(0, start_enu_m)
    if closed and len(targets_enu_m) > 1:
        points.append(targets_enu_m[0])
    for start, end in itertools.pairwise(points):
        rejection = fence.check_leg(start, end)
        if rejection is not None:
            return rejection
    return None


def _named(rejection: Rejection, number: int) -> Rejection:
    return Rejection(rejection.code, f"Waypoint {number}: {rejection.message}")


def _along(start: Vector3, end: Vector3, share: float) -> Vector3:
    return add(start, scale(subtract(end, start), share))


def _outside(text: str) -> Rejection:
    return Rejection(OutcomeCode.OUTSIDE_FENCE, text)
