"""Range sensors: rays from the true position and attitude, with seeded noise.

The scanner is fixed to the body, so its beams tilt with it: they look over what is low when
the nose is up, and meet the ground when it is down.
"""

from __future__ import annotations

import math
import random

import numpy as np
from numpy.typing import NDArray

from mavlink_sitl.exchange import RangeReading
from mavlink_sitl.world.model import RangeSensor

SECTORS = 72
MOUNT_M = 0.2
"""Height of the scanner above the vehicle's position, which is that of its feet or wheels"""
BEAMS = 5
"""In each sector, a degree apart and about its middle: the sector reports the nearest hit, as
drivers of scanners do, so that a post between two middles is not lost"""
_COUNT = SECTORS * BEAMS
_ANGLES = (np.arange(_COUNT) - BEAMS // 2) * (math.tau / _COUNT)
BODY_RAYS = np.vstack(
    [np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(_COUNT)]), [0.0, 0.0, 1.0]]
)
"""Forward, right, down: the beams of the first sector, the next clockwise, ..., and one down"""

Array = NDArray[np.float64]


def to_ned(roll_rad: Array, pitch_rad: Array, yaw_rad: Array) -> Array:
    """Rotations from the bodies' axes to NED, shape (N, 3, 3), of angles of shape (N,).

    First yaw, then pitch, then roll, as ATTITUDE has them.
    """
    c_r, c_p, c_y = np.cos(roll_rad), np.cos(pitch_rad), np.cos(yaw_rad)
    s_r, s_p, s_y = np.sin(roll_rad), np.sin(pitch_rad), np.sin(yaw_rad)
    rows = [
        [c_p * c_y, s_r * s_p * c_y - c_r * s_y, c_r * s_p * c_y + s_r * s_y],
        [c_p * s_y, s_r * s_p * s_y + c_r * c_y, c_r * s_p * s_y - s_r * c_y],
        [-s_p, s_r * c_p, c_r * c_p],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def measure(sensor: RangeSensor, along_m: Array, seed: str) -> RangeReading:
    """The sensor's reading of true distances.

    Args:
        sensor: its reach and noise.
        along_m: shape (361,), the truth along BODY_RAYS.
        seed: of this reading's noise.
    """
    noisy = np.append(along_m[:-1].reshape(SECTORS, BEAMS).min(axis=1), along_m[-1])
    if sensor.noise_m:
        generator = random.Random(seed)
        noisy += [generator.gauss(0.0, sensor.noise_m) for _ in noisy]
    around = np.maximum(noisy[:-1], 0.0)
    around = np.where(around <= sensor.reach_m, around, np.inf)
    down_m = max(float(noisy[-1]) - MOUNT_M, 0.0)
    down_m = down_m if down_m <= sensor.reach_down_m else math.inf
    return RangeReading(tuple(around.tolist()), down_m, sensor.reach_m, sensor.reach_down_m)
