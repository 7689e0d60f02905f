"""Shortest ways between the lines of a survey, which enter no hole."""

from __future__ import annotations

import numpy as np
import scipy
import shapely

from navigation_core.surveys.lines import Lines, Points

__all__ = ["FreeSpace"]

# Ways lead past simplified corners: so much more is kept from a hole, and so much less of a border.
_SIMPLER_SHARE = 0.1
# Lines end at the edge of the space, and count as inside by this.
_TOUCH_M = 1e-6


class FreeSpace:
    """The space between holes, within a border that leaves room for all lines."""

    def __init__(self, outline: shapely.Polygon, lines: Lines) -> None:
        """Prepare.

        Args:
            outline: boundary of the area; lines may end outside.
            lines: the lines that are joined.
        """
        simpler_m = _SIMPLER_SHARE * lines.spacing_m
        ends = [line_m for cell in lines.cells for line_m in cell.lines_m]
        outside = shapely.distance(outline, shapely.points(np.concatenate(ends)))
        room_m = float(outside.max()) + simpler_m + _TOUCH_M
        border = shapely.simplify(outline, simpler_m).buffer(room_m, quad_segs=2)
        self._free = shapely.difference(border, lines.kept_clear.buffer(-_TOUCH_M))
        shapely.prepare(self._free)
        around = shapely.simplify(lines.kept_clear.buffer(simpler_m, quad_segs=2), simpler_m / 2.0)
        corners = shapely.get_coordinates([border, around])
        self._corners = corners[shapely.covers(self._free, shapely.points(corners))]
        seen = self._straight(self._corners, self._corners)
        self._lengths_m, self._before = scipy.sparse.csgraph.dijkstra(
            scipy.sparse.csr_array(np.where(np.isfinite(seen), seen, 0.0)), return_predecessors=True
        )

    def lengths(self, places_m: Points) -> Points:
        """Return the lengths of the shortest ways between places, shape (n, n).

        Where there is none within the border, it is that of the straight one.
        """
        lengths = self._straight(places_m, places_m)
        to_corner = self._straight(places_m, self._corners)
        from_place = np.stack([(row[:, None] + self._lengths_m).min(axis=0, initial=np.inf)
                               for row in to_corner])  # fmt: skip
        for place, row in enumerate(lengths):
            hidden = ~np.isfinite(row)
            ways = from_place[place] + to_corner[hidden]
            row[hidden] = ways.min(axis=1, initial=np.inf)
        straight = np.hypot(*(places_m[:, None] - places_m).transpose(2, 0, 1))
        return np.asarray(np.where(np.isfinite(lengths), lengths, straight))

    def way(self, start_m: Points, end_m: Points) -> Points:
        """Return the shortest way, shape (n, 2), with both ends."""
        straight = np.stack([start_m, end_m])
        (first,), (last,) = (self._straight(place[None], self._corners) for place in straight)
        ways = first[:, None] + self._lengths_m + last
        is_seen = shapely.covers(self._free, shapely.LineString(straight))
        if is_seen or not np.isfinite(ways).any():
            return straight
        begin, at = np.unravel_index(ways.argmin(), ways.shape)
        corners = [int(at)]
        while corners[-1] != begin:
            corners.append(int(self._before[begin, corners[-1]]))
        return np.concatenate([start_m[None], self._corners[corners[::-1]], end_m[None]])

    def _straight(self, from_m: Points, to_m: Points) -> Points:
        """Return the lengths of straight ways, infinite for those that are not free."""
        shape = (len(from_m), len(to_m), 2)
        starts, ends = np.broadcast_to(from_m[:, None], shape), np.broadcast_to(to_m, shape)
        seen = shapely.covers(self._free, shapely.linestrings(np.stack([starts, ends], axis=2)))
        lengths = np.hypot(*(ends - starts).transpose(2, 0, 1))
        return np.asarray(np.where(seen, lengths, np.inf))
