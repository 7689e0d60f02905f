"""PX4's calibration of sensors, as ground stations see it: texts that begin with "[cal]".

QGroundControl and MAVSDK read progress and outcome from these texts (version 2 of the protocol,
`calibration_messages.h`). The simulated vehicle stands level and nobody turns it, so whatever
needs other sides fails, as it does with the real simulator. How long each step takes is not
recorded; these are the waits in the firmware's source.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import TYPE_CHECKING, TypeAlias

from mavlink_sitl.exchange import Result, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

Step: TypeAlias = tuple[float, Severity, str]
"""Seconds after the one before, severity, text"""
SIDES = "back front left right up down"
STILL_S, DEFER_S = 1.3, 0.02
"""Time at rest before a side counts; time between texts"""
FAILURES_MAX = 10
"""Sides that are done already, one after the other, before it gives up"""
GYRO, MAG, BARO, RADIO, ACCEL, AIRSPEED, ESC = range(7)
"""The number of the parameter, less 1, that starts each calibration"""
LEVEL, ACCEL_QUICK = 2, 4
"""Other values of the accelerometer's"""


def _info(after_s: float, text: str) -> Step:
    return after_s, Severity.INFO, f"[cal] {text}"


def _critical(after_s: float, text: str) -> Step:
    return after_s, Severity.CRITICAL, f"[cal] {text}"


def _measured(name: str, seconds: float, steps: int = 20) -> list[Step]:
    """A sensor that only has to be at rest."""
    each_s = seconds / steps
    shown = [_info(each_s, f"progress <{100 * (i + 1) // steps}>") for i in range(steps)]
    begun = _info(0.0, f"calibration started: 2 {name}")
    return [begun, *shown, _info(0.2, f"calibration done: {name}")]


def _side(sides: str = SIDES) -> list[Step]:
    """Waits for one of the sides, and finds the vehicle at rest."""
    return [
        _info(DEFER_S, f"pending: {sides}"),
        _info(DEFER_S, "hold vehicle still on a pending side"),
        _info(STILL_S / 2, "detected rest position, hold still..."),
    ]


def _found() -> list[Step]:
    """A side that was pending; said twice, in case one text is lost."""
    return [*_side(), *[_info(STILL_S / 2, "down orientation detected")] * 2]


def _accelerometer() -> list[Step]:
    """One side is measured; then nobody turns the vehicle."""
    done = _info(DEFER_S, "down side done, rotate to a different side")
    steps = [
        _info(0.0, "calibration started: 2 accel"),
        *_found(),
        _info(DEFER_S, "Hold still, measuring down side"),
        _info(3.0, "progress <17>"),
        *[done] * 2,
    ]
    for _ in range(FAILURES_MAX):
        again = _info(STILL_S / 2, "down side already completed")
        steps += [*_side(SIDES.removesuffix(" down")), again]
    failed = "calibration failed: timeout: no motion"
    return [*steps, _critical(DEFER_S, failed), _critical(0.2, "calibration failed: accel")]


def _magnetometer() -> list[Step]:
    """The first side is found; then nobody turns the vehicle around it."""
    return [
        _info(0.0, "calibration started: 2 mag"),
        *_found(),
        _critical(DEFER_S, "Rotate vehicle around the detected orientation"),
        _info(DEFER_S, "Continue rotation for down 7 s"),
        (7.0, Severity.CRITICAL, "Failed: This calibration requires rotation."),
        _critical(0.2, "calibration failed: mag"),
    ]


def _airspeed() -> list[Step]:
    """There is no differential pressure to measure: it gives up after 30 s and 5 s more."""
    return [
        _info(0.0, "calibration started: 2 airspeed"),
        _critical(DEFER_S, "Ensure sensor is not measuring wind"),
        _critical(35.0, "calibration failed: airspeed"),
    ]


class Calibration:
    """The sensor calibrations of one vehicle, from one power-up to the next.

    Attributes:
        busy: a calibration is in progress; it cannot be armed then.
    """

    def __init__(self, vehicle: Px4Vehicle) -> None:
        self._vehicle = vehicle
        self._steps: deque[Step] = deque()
        self._due_s = 0.0
        self._radio = False

    @property
    def busy(self) -> bool:
        """Whether a calibration is in progress."""
        return bool(self._steps)

    def command(self, params: tuple[float, ...]) -> Result:
        """PREFLIGHT_CALIBRATION: begin one, or with nothing but zeros end it.

        Args:
            params: param1 to param7; what is not a number counts as 0.
        """
        asked = next(((place, int(v)) for place, v in enumerate(params) if int(v)), None)
        if self._vehicle.armed or (self.busy and asked is not None):
            return Result.TEMPORARILY_REJECTED
        if asked is None:
            self._end()
            return Result.ACCEPTED
        return self._begin(*asked)

    def update(self) -> None:
        """Say what is due; called at the autopilot's rate."""
        while self._steps and self._vehicle.now_s >= self._due_s:
            _, severity, text = self._steps.popleft()
            self._vehicle.say(severity, text)
            if self._steps:
                self._due_s += self._steps[0][0]

    def _begin(self, what: int, kind: int) -> Result:
        if what == RADIO:
            self._radio = True
            self._vehicle.say(Severity.INFO, "Calibration: Disabling RC input")
            return Result.ACCEPTED
        if what == ESC:
            self._vehicle.say(
                Severity.CRITICAL, "[cal] calibration failed: Disconnect battery and try again"
            )
            return Result.DENIED
        steps = _STEPS.get((what, kind))
        if steps is None:
            return Result.UNSUPPORTED
        self._run(steps)
        return Result.ACCEPTED

    def _run(self, steps: Iterable[Step]) -> None:
        self._steps.extend(steps)
        self._due_s = self._vehicle.now_s

    def _end(self) -> None:
        if self.busy:
            self._steps.clear()
            self._vehicle.say(Severity.CRITICAL, "[cal] calibration cancelled")
        if self._radio:
            self._radio = False
            self._vehicle.say(Severity.INFO, "Calibration: Restoring RC input")


_STEPS: dict[tuple[int, int], list[Step]] = {
    (GYRO, 1): _measured("gyro", 4.0),
    (MAG, 1): _magnetometer(),
    (BARO, 1): _measured("baro", 3.0, 4),
    (ACCEL, 1): _accelerometer(),
    (ACCEL, LEVEL): _measured("level", 5.0),
    (ACCEL, ACCEL_QUICK): [],
    (AIRSPEED, 1): _airspeed(),
}
"""By which parameter asks, and its value"""
