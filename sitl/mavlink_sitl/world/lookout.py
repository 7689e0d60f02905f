"""A vehicle's camera, which looks for the mark: with noise, loss, a field of view and a delay."""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl.exchange import Sighting
from mavlink_sitl.world.model import Mark, MarkCamera

Array = NDArray[np.float64]

_KEPT = 100
"""Sightings that wait at most, where nobody asks for them"""


class Lookout:
    """The camera of one vehicle.

    Args:
        mark: what it looks for.
        camera: what it can.
        seed: of noise and loss.
        pose: returns the vehicle's true position in the world, NED metres, and the matrix of shape
            (3, 3) from its forward, right and down axes to NED.
    """

    def __init__(
        self,
        mark: Mark,
        camera: MarkCamera,
        seed: str,
        pose: Callable[[], tuple[Array, Array]],
    ) -> None:
        self._mark_ned_m = np.array((*mark.at_m, -mark.height_m))
        self._camera = camera
        self._random = random.Random(seed)
        self._pose = pose
        self._due_us = 0
        self._seen: deque[Sighting] = deque(maxlen=_KEPT)

    def step(self, now_us: int) -> None:
        """Take a picture, if one is due."""
        if now_us < self._due_us:
            return
        self._due_us = now_us + round(1e6 / self._camera.rate_hz)
        position, turn = self._pose()
        forward, right, down = ((self._mark_ned_m - position) @ turn).tolist()
        # Drawn for each picture: what one picture shows does not change the noise of the next.
        is_lost = self._random.random() < self._camera.loss
        errors = [self._random.gauss(0.0, self._camera.noise) for _ in range(3)]
        angle_rad = math.atan2(math.hypot(forward, right), down)
        if is_lost or angle_rad > math.radians(self._camera.half_view_deg):
            return
        far_m = math.hypot(forward, right, down)
        x, y, z = (
            value + far_m * error
            for value, error in zip((forward, right, down), errors, strict=True)
        )
        self._seen.append(Sighting(now_us, (x, y, z)))

    def results(self, now_us: int) -> list[Sighting]:
        """The sightings that have been processed since the last call, the oldest first."""
        limit_us = now_us - round(1e6 * self._camera.delay_s)
        found = []
        while self._seen and self._seen[0].measured_us <= limit_us:
            found.append(self._seen.popleft())
        return found
