"""Distances of points to the outlines of boxes, in the plane.

Boxes are rows of the table of :class:`~navigation_core.mapping.obstacles.Obstacles`.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["in_boxes", "outside"]

Array: TypeAlias = NDArray[np.float64]


def in_boxes(vectors: Array, boxes: Array) -> tuple[Array, Array]:
    """Turn vectors of shape (..., 2), one for each box, into the boxes' own axes."""
    cosine, sine = np.cos(boxes[:, 4]), np.sin(boxes[:, 4])
    east, north = vectors[..., 0], vectors[..., 1]
    return east * cosine + north * sine, north * cosine - east * sine


def outside(points: Array, half: Array) -> Array:
    """Distances of points to boxes around the origin, 0 inside; (..., 2) gives (...)."""
    over_x = np.maximum(np.abs(points[..., 0]) - half[..., 0], 0.0)
    over_y = np.maximum(np.abs(points[..., 1]) - half[..., 1], 0.0)
    return np.asarray(np.hypot(over_x, over_y))
