"""Judges whether the vehicle's own position can be trusted. Pure.

An estimator that is misled by its GPS continues to give a position. These signs show it, on both
firmwares' own simulators with a receiver that is 20 m off:

- The estimate continues by itself at first, and the GPS is elsewhere than it. The estimator says
  that it rejects it: EKF3 after 1.3 s, for as long as that lasts and 10 s more; EKF2 at once.
- After 10 s (EKF3) or 7 s (EKF2) the estimate jumps to the GPS, in one message to the next.
  A vehicle that follows positions then flies the jump back, 20 m in truth; and from then on
  (EKF2), or 10 s later (EKF3), all reports are good again. Only the jump shows the fault.

So the two are followed apart. A jump is remembered until it has jumped back, or the vehicle is
disarmed: which of the two places was the right one is not known here.

A fix that is lost is another fault: without it the estimate goes astray, and when it comes back the
estimate jumps to it. On their own simulators ArduCopter did so 0.3 s later, by 6.5 m after 6 s, and
PX4 1.3 s later, 1.0 s after it reported the fix. That jump ends the fault, and is none of its own.

Where reports contradict each other (`contradictions`), the position is in doubt like all the rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import LandedState
from mavlink_vehicle.positions.frames import AzimuthalEquidistant
from mavlink_vehicle.state.contradictions import Contradictions
from mavlink_vehicle.state.health import sees_glitch
from mavlink_vehicle.state.telemetry import EstimatorReport, GlobalPosition, GpsFix
from mavlink_vehicle.state.vehicle_state import VehicleState

JUMP_MAX_M = 2.0
"""How far the position may have jumped, all jumps added up, before it is in doubt."""

# Difference allowed between a change of the position and the velocity over the same time: a
# velocity is off by up to 0.7 m/s (PX4, see the tasks' `standstill`), and changes by 5 m/s2.
_SLACK_M, _VELOCITY_ERROR_M_S, _ACCELERATION_M_S2 = 1.0, 0.7, 5.0
# After a longer silence, nothing can be said of a jump.
_SILENCE_MS = 2000
# A bad word must hold this long: EKF_STATUS_REPORT and ESTIMATOR_STATUS come once a second.
_CONFIRM_S = 0.9
# A good word must hold this long after bad ones: the estimate comes back to its GPS within it
# (a PX4 1.0 s after its fix), and moves as the vehicle does not.
_SETTLED_S = 2.0
# How far the GPS may be from the estimate: its latency, and its own accuracy.
_GPS_OFF_M, _GPS_LATENCY_S, _GPS_SIGMAS = 5.0, 0.5, 3.0
# The reports of which the first one with a fault counts.
_SOURCES = (Contradictions, GpsFix, EstimatorReport)
# Near enough to the metres of every firmware.
_SPHERE = AzimuthalEquidistant(6_371_000.0, 6_371_000.0)


class PositionFault(NamedTuple):
    """Why a position is in doubt.

    Attributes:
        source: the report that shows it.
        reason: part of a sentence.
    """

    source: type
    reason: str

    @property
    def is_contradiction(self) -> bool:
        """Whether reports contradict each other: then none of them counts."""
        return self.source is Contradictions


class PositionTrust:
    """Follows one vehicle's state.

    Attributes:
        jump_ned_m: north and east of all jumps since it was armed, added up.
        jumped_s: when the last one came, or None.
        fault: the first fault of the estimate that reports show; None if there is none.
    """

    def __init__(self) -> None:
        """Begin without observations."""
        self.jump_ned_m = (0.0, 0.0)
        self.jumped_s: float | None = None
        self._agreed = False
        self._contradictions = Contradictions()
        self._fix_back_s = -math.inf
        # The faults by the message that reports them, with the time of the first such message;
        # and those that have held for long enough.
        self._since_s: dict[type, float] = {}
        self._complaints: dict[type, str] = {}
        # The times of the first good messages after them.
        self._good_s: dict[type, float] = {}
        self.fault: PositionFault | None = None

    @property
    def complaint(self) -> str:
        """The fault of the reported estimate; empty if there is none."""
        return "" if self.fault is None else self.fault.reason

    def observe(self, before: VehicleState, state: VehicleState, now: float) -> None:
        """Process what a message has changed."""
        if state.boot_count != before.boot_count or not state.armed:
            self.jump_ned_m, self.jumped_s = (0.0, 0.0), None
            self._agreed = False
        if before.signs.fix_s is not None and state.signs.fix_s is None:
            self._fix_back_s = now
        if state.global_position is not before.global_position:
            self.follow(before.global_position, state, state.global_position, now)
        if state.gps is not before.gps:
            self._judge(GpsFix, self._of_gps(state, now), now)
        if state.estimator is not before.estimator:
            self._judge(EstimatorReport, _of_estimator(state), now)
        self._contradictions.observe(before, state, now)
        self._take_contradiction()

    def jump_m(self, since_ned_m: tuple[float, float] = (0.0, 0.0)) -> float:
        """Return how far the position has jumped since the jumps added up to another vector."""
        north_m, east_m = self.jump_ned_m
        return math.hypot(north_m - since_ned_m[0], east_m - since_ned_m[1])

    def follow(
        self,
        last: GlobalPosition | None,
        state: VehicleState,
        here: GlobalPosition | None,
        now: float,
    ) -> None:
        """Process a position.

        Args:
            last: the position before.
            state: the state, whose own position is of no account.
            here: the position.
            now: time in seconds.
        """
        # On the ground an estimator may be reset.
        if not state.armed or state.landed_state is LandedState.ON_GROUND:
            return
        if last is None or here is None:
            return
        if state.signs.fix_s is not None or now - self._fix_back_s < _SETTLED_S:
            return  # the lost fix is a fault of its own, and its end resets the estimate
        passed_ms = here.time_boot_ms - last.time_boot_ms
        if not 0 < passed_ms <= _SILENCE_MS:
            return
        jump = _jump_ned_m(last, here, passed_ms / 1000.0)
        if jump is not None:
            # The vehicle's clock may be coarse, or set meanwhile: our own time explains it then.
            by_ours = _jump_ned_m(last, here, here.time_s - last.time_s)
            jump = by_ours and min(jump, by_ours, key=lambda ned_m: math.hypot(*ned_m))
        if jump is not None:
            self.jump_ned_m = (self.jump_ned_m[0] + jump[0], self.jump_ned_m[1] + jump[1])
            self.jumped_s = now
            self._contradictions.jumped(self.jump_ned_m, now)
            self._take_contradiction()

    def _take_contradiction(self) -> None:
        """Let a contradiction be a fault, for as long as it holds."""
        words = self._contradictions.reason
        if words != self._complaints.get(Contradictions, ""):
            if words:
                self._complaints[Contradictions] = words
            else:
                del self._complaints[Contradictions]
            self._choose()

    def _of_gps(self, state: VehicleState, now: float) -> str:
        """Return what is wrong with the GPS; it must have been right before."""
        if state.signs.fix_s is not None:
            return "the GPS has lost its 3D fix"
        gps, here = state.gps, state.global_position
        if gps is None or here is None or gps.fix_type < mavlink.GPS_FIX_TYPE_3D_FIX:
            return ""
        if gps.latitude_deg is None or gps.longitude_deg is None:
            return ""
        off_m = math.hypot(*_between_ned_m(here, gps.latitude_deg, gps.longitude_deg))
        speed_m_s = math.hypot(*here.velocity_ned_m_s[:2])
        bound_m = _GPS_OFF_M + (_GPS_LATENCY_S + max(now - here.time_s, 0.0)) * speed_m_s
        bound_m += _GPS_SIGMAS * (gps.horizontal_accuracy_m or 0.0)
        self._agreed = self._agreed or off_m <= bound_m
        if off_m <= bound_m or not self._agreed:
            return ""
        return f"the GPS is {off_m:.0f} m from the estimated position"

    def _judge(self, source: type, words: str, now: float) -> None:
        if words:
            self._good_s.pop(source, None)
            if now - self._since_s.setdefault(source, now) >= _CONFIRM_S:
                self._complaints.setdefault(source, words)
        else:
            self._since_s.pop(source, None)
            good_s = self._good_s.setdefault(source, now) if source in self._complaints else now
            if now - good_s >= _SETTLED_S:
                del self._complaints[source], self._good_s[source]
        self._choose()

    def _choose(self) -> None:
        """Choose the first of the faults."""
        faults = self._complaints
        self.fault = next(
            (PositionFault(kind, faults[kind]) for kind in _SOURCES if kind in faults), None
        )


def _of_estimator(state: VehicleState) -> str:
    if sees_glitch(state):
        return "the estimator reports GPS glitches"
    if state.estimator is not None and state.estimator.rejects_position:
        return "the estimator rejects its GPS"
    return ""


def _between_ned_m(
    here: GlobalPosition, latitude_deg: float, longitude_deg: float
) -> tuple[float, float]:
    """Return the offset from a position to a place near it."""
    origin = (here.latitude_deg, here.longitude_deg, 0.0)
    return _SPHERE.to_local(latitude_deg, longitude_deg, origin)


def _jump_ned_m(
    last: GlobalPosition, here: GlobalPosition, passed_s: float
) -> tuple[float, float] | None:
    """Return what of a change of the position its velocity does not explain; None: all of it is."""
    north_m, east_m = _between_ned_m(last, here.latitude_deg, here.longitude_deg)
    north_m -= 0.5 * (last.velocity_ned_m_s[0] + here.velocity_ned_m_s[0]) * passed_s
    east_m -= 0.5 * (last.velocity_ned_m_s[1] + here.velocity_ned_m_s[1]) * passed_s
    slack_m = _SLACK_M + _VELOCITY_ERROR_M_S * passed_s + 0.25 * _ACCELERATION_M_S2 * passed_s**2
    return (north_m, east_m) if math.hypot(north_m, east_m) > slack_m else None
