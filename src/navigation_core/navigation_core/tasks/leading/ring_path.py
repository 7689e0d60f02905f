"""The part of a flight that leads along a circle, and how far obstacles leave it free."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np

from navigation_core.geometry import KinematicState, Vector3, distance, norm
from navigation_core.limits import Limits
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.planning.conflicts import MotionSamples, clearance_at_m, first_conflict
from navigation_core.planning.planner import NoPath
from navigation_core.tasks.leading.carrot import Carrot
from navigation_core.tasks.leading.checked_path import CheckedPath
from navigation_core.tasks.leading.flight_terms import FlightTerms
from navigation_core.tasks.observation import Observation
from navigation_core.trajectories.ring import Ring, RingMotion, plan_ring
from navigation_core.trajectories.trajectory import plan_to

__all__ = ["RingGuide", "RingPart", "RingWalk", "RingYaw", "free_turn_rad"]

# Chords by which a circle is looked at for obstacles: their angle, and their length at most.
_CHORD_RAD, _CHORD_M = math.radians(5.0), 1.0
# The setpoint stands for a vehicle that is this far away from it, for no longer than this.
_WAITS_M, _WAITS_S = 0.8, 3.0
# How fast the setpoint is moved aside by the vehicle's distance from the circle, and how far at
# most; not while it is slower than this share of its speed.
_TRIM_PER_S, _TRIM_SHARE, _TRIM_MAX_M, _STEADY_SHARE = 0.15, 0.05, 0.8, 0.5
# A boat drifts further than a copter.
_DRIFT_TIMES = 3.0
# Nearer than this to the circle's beginning, and slower, a motion begins there.
_AT_M, _STANDS_M_S = 1e-6, 1e-6


class RingYaw(Enum):
    """The yaw on a circle."""

    CENTRE = auto()
    """Towards the centre."""
    TANGENT = auto()
    """In the direction of travel."""
    KEEP = auto()
    """Always the same."""


@dataclass(frozen=True)
class RingPart:
    """A part of a circle that is flown without a stop.

    Attributes:
        ring: the circle.
        from_rad: where it begins.
        turn_rad: how far it leads; infinite for a part without an end.
        yaw: the yaw on it.
        yaw_enu_rad: the yaw that is kept.
    """

    ring: Ring
    from_rad: float
    turn_rad: float
    yaw: RingYaw
    yaw_enu_rad: float

    def yaw_at(self, position_enu_m: Vector3) -> float:
        """Return the yaw at a position on the circle, in the map frame."""
        angle = self.ring.angle_rad(position_enu_m)
        if self.yaw is RingYaw.CENTRE:
            return angle + math.pi
        return self.ring.tangent_rad(angle) if self.yaw is RingYaw.TANGENT else self.yaw_enu_rad


class RingWalk:
    """The motion along one part of a circle, which is wound back lap by lap."""

    def __init__(self, part: RingPart, start: KinematicState, limits: Limits, *, led: bool) -> None:
        """Plan.

        Args:
            part: what is flown.
            start: where the setpoint is; elsewhere than at the beginning, it goes there first.
            limits: what to keep to.
            led: whether the vehicle is led by the setpoint. What drives is led by the line.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        motion = plan_ring(part.ring, part.from_rad, part.turn_rad, limits)
        begin_enu_m = motion.trajectory.start.position_enu_m
        is_there = (
            distance(start.position_enu_m, begin_enu_m) < _AT_M
            and norm(start.velocity_enu_m_s) < _STANDS_M_S
        )
        if led and not is_there:
            motion = motion.after(plan_to(start, begin_enu_m, limits))
        self.part = part
        self._motion: RingMotion = motion
        self._windings = motion.windings
        self.trajectory = motion.trajectory

    def wind(self, carrot: Carrot) -> None:
        """Wind the motion back by a lap where more laps follow."""
        motion = self._motion
        at_s = motion.steady_s + motion.lap_s
        if self._windings > 0.0 and carrot.time_s >= at_s:
            self._windings -= 1.0
            self.trajectory = carrot.wind_back(motion.lap_s)


class RingGuide:
    """Leads a flight along parts of circles.

    Attributes:
        part: what leads to the goal; None for a goal that no circle leads to.
    """

    def __init__(self, terms: FlightTerms) -> None:
        """Prepare a flight with these terms."""
        self._avoidance = terms.avoidance
        self._led = terms.traits.flies
        self._room_m = terms.config.tracking_error_max_m
        self.part: RingPart | None = None
        self._walk: RingWalk | None = None
        # How far outside of the circle the setpoint is, at full speed.
        self._trim_m = 0.0

    def lead_along(self, part: RingPart | None) -> None:
        """Lead along a part from the next plan on."""
        self.part, self._walk = part, None

    def plan(
        self, start: KinematicState, limits: Limits, observation: Observation
    ) -> CheckedPath | NoPath:
        """Return the motion from a state along the part, or why it may not be flown.

        Raises:
            TrajectoryError: no trajectory could be calculated.
        """
        if self.part is None:
            return NoPath("No circle leads to the goal.")
        walk = self._walk = RingWalk(self.part, start, limits, led=self._led)
        path = CheckedPath(
            walk.trajectory, (walk.trajectory.duration_s,), MotionSamples.of(walk.trajectory)
        )
        return self._conflict(path.samples, observation) or path

    def another_path(self, observation: Observation) -> NoPath:
        """Return why the vehicle stops on the circle: it is left, if at all, from a standstill."""
        blocked = None
        if self._walk is not None:
            blocked = self._conflict(MotionSamples.of(self._walk.trajectory), observation)
        return blocked or NoPath("The circle is free; there is no shorter path along it.")

    def lead(self, carrot: Carrot, position_enu_m: Vector3 | None, dt_s: float) -> None:
        """Begin another lap where one ends, and lead a vehicle back that goes round beside.

        The integrator of an autopilot, which holds it against its own drag, turns with it, and
        comes late. So a vehicle that follows each setpoint well goes round outside of them all. The
        setpoint is moved sideways until that is made up for; at rest it is not. It waits sooner
        than elsewhere for a vehicle that is away from it: one that the wind pushes as hard as it
        can lean against would leave the circle. Where no waiting helps, it continues.

        Args:
            carrot: the setpoint.
            position_enu_m: where the vehicle is; None where it is not known.
            dt_s: time since the last call.
        """
        walk = self._walk
        if walk is None or carrot.trajectory is not walk.trajectory:
            return
        walk.wind(carrot)
        waits = carrot.stalled_s < _WAITS_S
        carrot.room_m = min(_WAITS_M, self._room_m) if waits else self._room_m
        ring, velocity = walk.part.ring, carrot.state.velocity_enu_m_s
        speed_m_s = math.hypot(velocity[0], velocity[1])
        share = min(speed_m_s / carrot.trajectory.limits.speed_horizontal_m_s, 1.0)
        if position_enu_m is not None and share > _STEADY_SHARE:
            most_m = _TRIM_SHARE * ring.radius_m
            most_m = min(most_m, _TRIM_MAX_M) if self._led else _DRIFT_TIMES * most_m
            trim_m = self._trim_m - _TRIM_PER_S * dt_s * ring.error_m(position_enu_m)
            self._trim_m = min(max(trim_m, -most_m), most_m)
        angle = ring.angle_rad(carrot.state.position_enu_m)
        out_m = self._trim_m * share * share
        carrot.aside_enu_m = (out_m * math.cos(angle), out_m * math.sin(angle), 0.0)

    def _conflict(self, samples: MotionSamples, observation: Observation) -> NoPath | None:
        if self._avoidance is None:
            return None
        clearance_m = self._avoidance.flown_clearance_m
        index = first_conflict(samples.positions_enu_m, observation.obstacles, clearance_m)
        if index is None:
            return None
        x, y, _ = samples.positions_enu_m[index]
        return NoPath(
            f"An obstacle is nearer than {clearance_m:g} m to the circle at ({x:.1f}, {y:.1f}) m."
        )


def free_turn_rad(
    ring: Ring, from_rad: float, turn_rad: float, obstacles: Obstacles, clearance_m: float
) -> float:
    """Return how far a circle keeps a clearance, up to a turn; 0 if not even where it begins.

    Args:
        ring: the circle, with its direction.
        from_rad: where to begin.
        turn_rad: how far to look.
        obstacles: the known obstacles.
        clearance_m: what is to be kept.
    """
    if clearance_at_m(ring.point(from_rad), obstacles, clearance_m) < clearance_m:
        return 0.0
    step_rad = min(_CHORD_RAD, _CHORD_M / ring.radius_m)
    count = max(math.ceil(turn_rad / step_rad), 1)
    angles = from_rad + ring.sign * np.linspace(0.0, turn_rad, count + 1)
    points = np.array([ring.point(float(angle)) for angle in angles])
    index = first_conflict(points, obstacles, clearance_m)
    return turn_rad if index is None else turn_rad * max(index - 1, 0) / count
