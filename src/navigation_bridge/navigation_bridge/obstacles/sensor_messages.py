"""`LaserScan` and `PointCloud2` as validated arrays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from navigation_bridge.names import FRAME_MAP
from navigation_bridge.obstacles.obstacle_feed import SensorPoints, SensorScan

POINTS_MAX = 20_000
"""A larger cloud is thinned to this number of points."""

# sensor_msgs/PointField: INT8 is 1.
_DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
_RAYS_MAX = 100_000
# No sensor sends this many bytes per point; NumPy accepts 2 GiB at most.
_POINT_STEP_MAX = 65_536
_FAR_M = 1e6


class SensorMessageError(ValueError):
    """A message is inconsistent; the text says why."""


def scan_of(message: Any) -> SensorScan:
    """Return a `sensor_msgs/LaserScan` as arrays, by REP 117.

    Infinity: nothing within range; minus infinity: too close to be measured; NaN and values outside
    the limits: no reading.

    Raises:
        SensorMessageError: inconsistent angles or limits.
    """
    step, low, high = message.angle_increment, message.range_min, message.range_max
    if not (math.isfinite(step) and math.isfinite(message.angle_min)) or step == 0.0:
        raise SensorMessageError(
            f"a LaserScan with angles from {message.angle_min} in steps of {step} rad"
        )
    if not 0.0 <= low < high < math.inf:
        raise SensorMessageError(f"a LaserScan with ranges from {low} to {high} m")
    # The last ray of a full turn often repeats the first one.
    once = min(len(message.ranges), math.ceil(math.tau / abs(step) - 1e-3), _RAYS_MAX)
    ranges = np.array(message.ranges[:once], dtype=np.float64)
    angles = message.angle_min + step * np.arange(len(ranges))
    outside = np.isfinite(ranges) & ((ranges < low) | (ranges > high))
    ranges[outside] = np.nan
    ranges[np.isneginf(ranges)] = low
    directions = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    in_map = message.header.frame_id == FRAME_MAP
    return SensorScan(in_map, directions, ranges, low, high, 0.5 * abs(step))


def points_of(message: Any) -> SensorPoints:
    """Return a `sensor_msgs/PointCloud2` as an array, without NaN points.

    Raises:
        SensorMessageError: it lacks x, y or z, or has less data than declared.
    """
    layout, width, height = _layout(message), message.width, message.height
    row_step = message.row_step or width * message.point_step
    in_map = message.header.frame_id == FRAME_MAP
    if width * height == 0:
        return SensorPoints(in_map, np.empty((0, 3)))
    needed = row_step * (height - 1) + width * message.point_step
    if row_step < width * message.point_step or len(message.data) < needed:
        raise SensorMessageError(
            f"a PointCloud2 of {width} x {height} points with {len(message.data)} bytes in rows of "
            f"{row_step}"
        )
    grid = np.ndarray(
        (height, width), layout, bytes(message.data), strides=(row_step, message.point_step)
    )
    every = math.ceil(width * height / POINTS_MAX)
    some = grid.reshape(-1)[::every]
    points = np.column_stack([some[name].astype(np.float64) for name in "xyz"])
    # A comparison with NaN is false, too.
    return SensorPoints(in_map, points[(np.abs(points) < _FAR_M).all(axis=1)])


def _layout(message: Any) -> np.dtype[np.void]:
    order = ">" if message.is_bigendian else "<"
    formats, offsets = [], []
    if message.point_step > _POINT_STEP_MAX:
        raise SensorMessageError(f"a PointCloud2 with points of {message.point_step} bytes")
    fields = {field.name: field for field in message.fields}
    for name in "xyz":
        field = fields.get(name)
        if field is None or field.datatype not in _DATATYPES:
            raise SensorMessageError(f"a PointCloud2 without {name}")
        formats.append(np.dtype(order + _DATATYPES[field.datatype]))
        offsets.append(field.offset)
        if field.offset + formats[-1].itemsize > message.point_step:
            raise SensorMessageError(
                f"a PointCloud2 with {name} at byte {field.offset} of {message.point_step}"
            )
    return np.dtype(
        {
            "names": ["x", "y", "z"],
            "formats": formats,
            "offsets": offsets,
            "itemsize": message.point_step,
        }
    )
