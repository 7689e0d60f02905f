"""Seeded errors of the position estimate, and the GPS receiver.

The estimate wanders around the truth as a first-order Gauss-Markov process: a few
centimetres with GPS, as in the recordings, and without bound (a random walk of the velocity)
after the signal is lost, until it comes back and the estimate jumps home.

Each vehicle draws from its own generator, so adding a vehicle changes nothing for the
others.
"""

from __future__ import annotations

import math
import random
from typing import NamedTuple

from mavlink_sitl.array_ops import Lane, Ops
from mavlink_sitl.exchange import GpsReading
from mavlink_sitl.geodesy import LocalFrame

ASTRAY_M = 1.0
"""An estimate that is farther off than this when a receiver has its fix again jumps to it."""


class SensorModel(NamedTuple):
    """The accuracy of the vehicles' estimates."""

    update_s: float = 0.2
    """The GPS runs at 5 Hz; the error changes course as often."""
    position_sigma_m: float = 0.015
    """Standard deviation of each axis with a fix."""
    correlation_s: float = 30.0
    drift_m_s2: float = 0.08
    """Standard deviation of the velocity error's growth in a second without GPS."""
    satellites: int = 10


class EstimateError(NamedTuple):
    """Estimate minus truth. Every field is a lane, NED metres and m/s."""

    north_m: Lane
    east_m: Lane
    down_m: Lane
    rate_north_m_s: Lane
    rate_east_m_s: Lane
    rate_down_m_s: Lane


def no_error(o: Ops) -> EstimateError:
    """An estimate that is the truth."""
    zero = o.full(0.0)
    return EstimateError(zero, zero, zero, zero, zero, zero)


def advance(error: EstimateError, dt: float) -> EstimateError:
    """Between two updates the error grows at its rate."""
    n, e, d, rate_n, rate_e, rate_d = error
    return EstimateError(n + rate_n * dt, e + rate_e * dt, d + rate_d * dt, rate_n, rate_e, rate_d)


def update(
    error: EstimateError,
    noise: tuple[Lane, Lane, Lane],
    fix: Lane,
    model: SensorModel,
    o: Ops,
    around: tuple[Lane, ...] = (0.0, 0.0, 0.0),
) -> EstimateError:
    """Give the error a new rate, once per `update_s`.

    Args:
        error: the error now.
        noise: three independent standard normal numbers per vehicle.
        fix: whether the vehicle has a GPS fix, per lane.
        model: how good the sensors are.
        o: float or array arithmetic.
        around: NED metres; what the error wanders around.
    """
    step = model.update_s
    keep = math.exp(-step / model.correlation_s)
    kick = model.position_sigma_m * math.sqrt(1.0 - keep * keep)
    walk = model.drift_m_s2 * math.sqrt(step)

    def axis(value: Lane, rate: Lane, z: Lane, gps_bound: Lane, mean: Lane) -> Lane:
        share = o.where(abs(mean) > 0.0, 0.2, 0.0)
        follow = mean * (1.0 - keep) + (mean - value) * share
        bounded = (keep * value + kick * z + follow - value) / step
        return o.where(gps_bound, bounded, rate + walk * z)

    return error._replace(
        rate_north_m_s=axis(error.north_m, error.rate_north_m_s, noise[0], fix, around[0]),
        rate_east_m_s=axis(error.east_m, error.rate_east_m_s, noise[1], fix, around[1]),
        # Height comes from the barometer, which does not fail with the GPS.
        rate_down_m_s=axis(
            error.down_m, error.rate_down_m_s, 0.5 * noise[2], fix == fix, around[2]
        ),
    )


class Noise:
    """Standard normal numbers for each vehicle, from its own seeded generator."""

    def __init__(self, seed: int, count: int) -> None:
        self._generators = [random.Random(f"sensors:{seed}:{i}") for i in range(count)]

    def draw(self, o: Ops) -> tuple[Lane, Lane, Lane]:
        """Three independent lanes."""
        draws = [[g.gauss(0.0, 1.0) for _ in range(3)] for g in self._generators]
        north, east, down = ([three[axis] for three in draws] for axis in range(3))
        return o.pack(north), o.pack(east), o.pack(down)


def gps_reading(
    time_s: float,
    frame: LocalFrame,
    position_ned_m: tuple[float, float, float],
    velocity_ned_m_s: tuple[float, float, float],
    model: SensorModel,
) -> GpsReading:
    """The reading of a receiver with a fix; the numbers were recorded from the firmware."""
    north, east, _ = velocity_ned_m_s
    return GpsReading(
        fix_type=6,
        satellites=model.satellites,
        point=frame.to_geodetic(*position_ned_m),
        speed_m_s=math.hypot(north, east),
        course_deg=math.degrees(math.atan2(east, north)) % 360.0,
        time_s=time_s,
        eph=121,
        epv=200,
        horizontal_accuracy_m=0.3,
    )
