r"""The state machine that decides when a path is replanned and when there is none.

    KEEPING --CONFLICT--> REPLANNING --FOUND--> KEEPING
       |                      |    ^
       |            NOT_FOUND, STOP| RETRY
     LOOK                     v    |
       v                   BLOCKED ----TIME_OUT--> GIVEN_UP
    COMPARING --FOUND, NOT_FOUND--> KEEPING
    COMPARING --CONFLICT--> REPLANNING

A path that is flown is kept until it is in conflict with an obstacle, however far ahead. One
that is sound is left for a better one only now and then, and only if that is clearly shorter:
so between two sides of an obstacle that are about equally good the vehicle never hesitates.
The state, the counts and the times are all there is to remember.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

from navigation_core.geometry import Vector3, distance
from navigation_core.mapping.obstacles import Obstacles
from navigation_core.planning.conflicts import MotionSamples, first_conflict

# Less than this is not worth another path: all paths are about as short shortly before the end.
_GAIN_MIN_M = 1.0
# A vehicle that is farther than this from where it was blocked has had a path meanwhile.
_LEFT_BLOCK_M = 2.0


class State(Enum):
    """The state of the path."""

    KEEPING = auto()
    REPLANNING = auto()
    COMPARING = auto()
    BLOCKED = auto()
    GIVEN_UP = auto()


class ReplanEvent(Enum):
    """An event that changes the state."""

    CONFLICT = auto()
    LOOK = auto()
    FOUND = auto()
    NOT_FOUND = auto()
    STOP = auto()
    RETRY = auto()
    TIME_OUT = auto()


class ReplannerError(RuntimeError):
    """An event came in a state in which it cannot happen: a programming error."""


TRANSITIONS: dict[tuple[State, ReplanEvent], State] = {
    (State.KEEPING, ReplanEvent.CONFLICT): State.REPLANNING,
    (State.KEEPING, ReplanEvent.LOOK): State.COMPARING,
    # A flight that begins or continues is planned without anybody asking here.
    (State.KEEPING, ReplanEvent.FOUND): State.KEEPING,
    (State.KEEPING, ReplanEvent.STOP): State.BLOCKED,
    (State.REPLANNING, ReplanEvent.FOUND): State.KEEPING,
    (State.REPLANNING, ReplanEvent.NOT_FOUND): State.BLOCKED,
    # A search takes some steps, in which the vehicle continues.
    (State.REPLANNING, ReplanEvent.STOP): State.BLOCKED,
    (State.COMPARING, ReplanEvent.FOUND): State.KEEPING,
    (State.COMPARING, ReplanEvent.NOT_FOUND): State.KEEPING,
    # The path in use may come into conflict, or have to stop, while a shorter one is looked for.
    (State.COMPARING, ReplanEvent.CONFLICT): State.REPLANNING,
    (State.COMPARING, ReplanEvent.STOP): State.BLOCKED,
    (State.BLOCKED, ReplanEvent.RETRY): State.REPLANNING,
    (State.BLOCKED, ReplanEvent.STOP): State.BLOCKED,
    (State.BLOCKED, ReplanEvent.FOUND): State.KEEPING,
    (State.BLOCKED, ReplanEvent.TIME_OUT): State.GIVEN_UP,
}


class Decision(Enum):
    """The decision about the path."""

    KEEP = auto()
    REPLAN = auto()
    COMPARE = auto()
    WAIT = auto()
    GIVE_UP = auto()


@dataclass(frozen=True)
class ReplanRules:
    """Rules for replanning.

    Attributes:
        conflict_clearance_m: nearer than this to an obstacle, a path is in conflict.
        blocked_timeout_s: longest time without a path.
        retry_s: time between two searches while there is none.
        elective_s: least time between two looks for a shorter path.
        elective_gain: share by which a shorter path must be shorter.
    """

    conflict_clearance_m: float
    blocked_timeout_s: float
    retry_s: float
    elective_s: float
    elective_gain: float


class Replanner:
    """Decides about one path; see the module."""

    def __init__(self, rules: ReplanRules) -> None:
        """Begin with a path that has not been checked yet."""
        self._rules = rules
        self.state = State.KEEPING
        self.replans = 0
        self._path: MotionSamples | None = None
        self._obstacles: Obstacles | None = None
        self._planned_s = float("-inf")
        self._blocked_s: float | None = None
        self._blocked_at: Vector3 | None = None

    def blocked_for_s(self, now: float) -> float:
        """Return for how long there has been no path; 0 while there is one."""
        return 0.0 if self._blocked_s is None else now - self._blocked_s

    def check(
        self,
        path: MotionSamples,
        time_s: float,
        place_enu_m: Vector3,
        least_m: float,
        left_m: float,
        obstacles: Obstacles,
        now: float,
    ) -> Decision:
        """Decide about a path that is flown.

        Nothing is calculated unless path or obstacles are other objects than the last time.

        Args:
            path: what is flown.
            time_s: up to when, in its own time.
            place_enu_m: the place on it at that time.
            least_m: the length that no path can be shorter than.
            left_m: length that is left of this one.
            obstacles: what is known now.
            now: time in seconds.
        """
        if self.state is State.REPLANNING:
            return Decision.REPLAN
        comparing = self.state is State.COMPARING
        if path is self._path and obstacles is self._obstacles:
            return Decision.COMPARE if comparing else Decision.KEEP
        known = self._obstacles
        self._path, self._obstacles = path, obstacles
        clearance_m = self._rules.conflict_clearance_m
        rest = path.ahead(time_s, place_enu_m)
        if first_conflict(rest, obstacles, clearance_m) is not None:
            self._go(ReplanEvent.CONFLICT)
            return Decision.REPLAN
        if comparing:
            return Decision.COMPARE
        waited = now - self._planned_s >= self._rules.elective_s
        if obstacles is not known and waited and self.is_clearly_shorter(least_m, left_m):
            self._go(ReplanEvent.LOOK)
            return Decision.COMPARE
        return Decision.KEEP

    def is_clearly_shorter(self, length_m: float, left_m: float) -> bool:
        """Whether a path is enough shorter than another to be worth taking."""
        gain_m = max(self._rules.elective_gain * left_m, _GAIN_MIN_M)
        return length_m < left_m - gain_m

    def found(self, place_enu_m: Vector3, now: float) -> None:
        """Record that another path is flown from now on."""
        if self.state is not State.KEEPING:
            self.replans += 1
        self._go(ReplanEvent.FOUND)
        self._planned_s = now
        self._path = None
        self.moved_on(place_enu_m)

    def not_found(self, place_enu_m: Vector3, now: float) -> None:
        """Record that there is no other path, or none that is better."""
        comparing = self.state is State.COMPARING
        self._go(ReplanEvent.NOT_FOUND)
        self._planned_s = now
        if not comparing:
            self._block(place_enu_m, now)

    def stop(self, place_enu_m: Vector3, now: float) -> None:
        """Record that the vehicle is stopped, whatever was planned."""
        self._go(ReplanEvent.STOP)
        self._block(place_enu_m, now)

    def no_flight(self, place_enu_m: Vector3, now: float, *, is_undecided: bool = False) -> None:
        """Record that a flight cannot begin or continue, whatever was looked for before.

        Args:
            place_enu_m: where the vehicle is.
            now: time in seconds.
            is_undecided: whether the search continues at once.
        """
        self.stop(place_enu_m, now)
        self._planned_s = float("-inf") if is_undecided else now

    def wait(self, now: float, may_plan: bool) -> Decision:
        """Decide what to do while there is no path.

        Args:
            now: time in seconds.
            may_plan: whether a path may be looked for at all.
        """
        if self.blocked_for_s(now) > self._rules.blocked_timeout_s:
            self._go(ReplanEvent.TIME_OUT)
            return Decision.GIVE_UP
        if may_plan and now - self._planned_s >= self._rules.retry_s:
            self._go(ReplanEvent.RETRY)
            return Decision.REPLAN
        return Decision.WAIT

    def restart_clock(self) -> None:
        """Count the time without a path from its next moment on."""
        self._blocked_at = self._blocked_s = None

    def moved_on(self, place_enu_m: Vector3) -> None:
        """Forget where the vehicle was blocked once it has got away from there."""
        if self._blocked_at is not None and distance(place_enu_m, self._blocked_at) > _LEFT_BLOCK_M:
            self._blocked_at = self._blocked_s = None

    def _block(self, place_enu_m: Vector3, now: float) -> None:
        if self._blocked_s is None or self._blocked_at is None:
            self._blocked_s, self._blocked_at = now, place_enu_m

    def _go(self, event: ReplanEvent) -> None:
        try:
            self.state = TRANSITIONS[self.state, event]
        except KeyError:
            raise ReplannerError(
                f"{event.name} cannot happen in state {self.state.name}."
            ) from None
