"""Setpoint tracking error of a vehicle. Pure."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flight_reports.contents.log_reader import Floats
from flight_reports.contents.track import TrackSamples

# A setpoint that is this far from the one before, or comes this long after it, is a new aim.
_STEP_M = 2.0
_STEP_M_S = 3.0
_PAUSE_S = 1.0
# A vehicle that is nearer than this has come to where its setpoints are.
_ARRIVED_M = 1.0
_DELAY_STEP_S = 0.02
_DELAY_MAX_S = 3.0
_SAMPLES_MIN = 20
_DELAY_SPREAD = 0.2


@dataclass(frozen=True)
class Tracking:
    """Tracking error; metres for positions, m/s for velocities.

    Attributes:
        unit: "m" or "m/s".
        horizontal_rms: of the horizontal error.
        horizontal_max: the largest.
        vertical_rms: of the vertical error.
        vertical_max: the largest.
        delay_s: by which the vehicle followed, where the errors are smallest; None when the
            setpoints moved too little to show it.
        count: of setpoints that were compared.
        left_out: of setpoints that were not, as the vehicle was still on its way to them.
        time_s: shape (count,).
        horizontal: shape (count,), the errors.
        vertical: shape (count,), positive above the setpoint.
    """

    unit: str
    horizontal_rms: float
    horizontal_max: float
    vertical_rms: float
    vertical_max: float
    delay_s: float | None
    count: int
    left_out: int
    time_s: Floats
    horizontal: Floats
    vertical: Floats


def tracking(setpoints: TrackSamples, followed: TrackSamples, unit: str) -> Tracking | None:
    """Compare setpoints with the response.

    Of positions, those are left out that the vehicle was still on its way to: after a step of
    the setpoints it has first to come within a metre. The rest shows how well it followed.

    Args:
        setpoints: that were sent.
        followed: the vehicle's own positions or velocities.
        unit: "m" for positions, "m/s" for velocities.

    Returns:
        None if there is too little to compare.
    """
    if len(setpoints.time_s) < _SAMPLES_MIN or len(followed.time_s) < _SAMPLES_MIN:
        return None
    reported = (setpoints.time_s >= followed.time_s[0]) & (setpoints.time_s <= followed.time_s[-1])
    reported &= _is_reported(setpoints.time_s, followed.time_s)
    error = followed.at(setpoints.time_s) - setpoints.vectors_ned
    kept = reported & _follows(setpoints, error) if unit == "m" else reported
    if int(kept.sum()) < _SAMPLES_MIN:
        return None
    horizontal = np.hypot(*error[kept, :2].T)
    vertical = -error[kept, 2]
    return Tracking(
        unit=unit,
        horizontal_rms=_rms(horizontal),
        horizontal_max=float(horizontal.max()),
        vertical_rms=_rms(vertical),
        vertical_max=float(np.abs(vertical).max()),
        delay_s=_delay_s(setpoints, followed, kept),
        count=int(kept.sum()),
        left_out=int((~kept).sum()),
        time_s=setpoints.time_s[kept],
        horizontal=horizontal,
        vertical=vertical,
    )


def _is_reported(time_s: Floats, reported_s: Floats) -> NDArray[np.bool_]:
    """Return which times lie between two adjacent ones."""
    after = np.clip(np.searchsorted(reported_s, time_s), 1, len(reported_s) - 1)
    return reported_s[after] - reported_s[after - 1] <= _PAUSE_S


def _follows(setpoints: TrackSamples, error: Floats) -> NDArray[np.bool_]:
    """Return which setpoints the vehicle was tracking, not still approaching."""
    time_s = setpoints.time_s
    moved_m = np.linalg.norm(np.diff(setpoints.vectors_ned, axis=0), axis=1)
    paused_s = np.diff(time_s)
    steps = (moved_m > _STEP_M) & (moved_m > _STEP_M_S * 3.0 * paused_s) | (paused_s > _PAUSE_S)
    begins = np.concatenate([[0], np.flatnonzero(steps) + 1, [len(time_s)]])
    off_m = np.linalg.norm(error, axis=1)
    follows = np.zeros(len(time_s), dtype=np.bool_)
    for begin, end in itertools.pairwise(begins):
        # A vehicle that begins at its setpoints follows them, however far it falls behind.
        near_m = _STEP_M if off_m[begin] <= _STEP_M else _ARRIVED_M
        arrived = np.flatnonzero(off_m[begin:end] <= near_m)
        if len(arrived):
            follows[begin + arrived[0] : end] = True
    return follows


def _delay_s(
    setpoints: TrackSamples, followed: TrackSamples, kept: NDArray[np.bool_]
) -> float | None:
    """Return the delay with the smallest error between response and setpoints."""
    time_s, wanted = setpoints.time_s[kept], setpoints.vectors_ned[kept]
    if np.linalg.norm(wanted.std(axis=0)) < _DELAY_SPREAD:
        return None
    delays_s = np.arange(0.0, _DELAY_MAX_S, _DELAY_STEP_S)
    errors = [
        float(np.square(followed.at(time_s + delay_s) - wanted).mean()) for delay_s in delays_s
    ]
    best = int(np.argmin(errors))
    return None if best == len(errors) - 1 else float(delays_s[best])


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.square(values).mean()))
