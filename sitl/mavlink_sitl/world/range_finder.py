"""What the range sensors see: rays from the true position, with seeded noise."""

from __future__ import annotations

import math
import random

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl.exchange import RangeReading
from mavlink_sitl.world.model import RangeSensor

SECTORS = 72
_OFFSETS = np.arange(SECTORS) * (math.tau / SECTORS)


def bearings(yaw_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bearings of all sectors, shape (N, 72), from the noses' headings, shape (N,)."""
    return np.asarray(yaw_rad)[:, None] + _OFFSETS


def measure(
    sensor: RangeSensor,
    sectors_m: NDArray[np.float64],
    down_m: float,
    tilt_cosine: float,
    seed: str,
) -> RangeReading:
    """What the sensor makes of true distances.

    Args:
        sensor: its reach and noise.
        sectors_m: shape (72,), the truth.
        down_m: straight down, the truth.
        tilt_cosine: of the angle between the vehicle's axis and straight down.
        seed: of this reading's noise.
    """
    generator = random.Random(seed)
    noisy = sectors_m
    if sensor.noise_m:
        noise = np.array([generator.gauss(0.0, sensor.noise_m) for _ in range(SECTORS)])
        noisy = np.maximum(sectors_m + noise, 0.0)
    noisy = np.where(noisy <= sensor.reach_m, noisy, np.inf)
    slant = down_m / max(tilt_cosine, 0.1) + generator.gauss(0.0, sensor.noise_m)
    down = max(slant, 0.0) if slant <= sensor.reach_down_m else math.inf
    return RangeReading(tuple(noisy.tolist()), down, sensor.reach_m, sensor.reach_down_m)
