"""An order flown, and what came of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from flight_rehearsal.approaches import Approach
from flight_rehearsal.rehearsed_flight import RehearsedFlight
from flight_rehearsal.request import RehearsalRequest, RehearsalStep
from navigation_bridge.goals.requests import (
    LandRequest,
    NavigateRequest,
    OrbitRequest,
    Request,
    ReturnRequest,
    TakeoffRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_core.geometry import Vector3, distance
from navigation_core.outcomes import OutcomeCode

__all__ = ["Lost", "Rehearsal", "StoppedError", "lose_link", "rehearse"]

FLIGHT_MAX_S = 3600.0
_LOST_MAX_S = 600.0
_GOAL_ID = 32 * "0"
_STEP_M = 0.5
_STEP_S = 1.0
"""Also one that stays adds its position to the path this often: another one may come near"""
_STILL_M_S = 0.05
_STILL_S = 30.0
"""Longer than failsafes wait for a link (FS_GCS_TIMEOUT, COM_DL_LOSS_T)"""
IsOver = Callable[[], bool]


class StoppedError(Exception):
    """The result is not wanted any more."""


@dataclass(frozen=True)
class Rehearsal:
    """How the goal would go.

    Attributes:
        code: of the rejection or the end, as the server names it.
        text: a sentence about it.
        accepted: whether the goal would be taken.
        path_enu_m: where the vehicle would be, beginning where it is.
        duration_s: from the goal to its end.
        battery: charge at the end, from 0 to 1; None if nothing supports a number: the vehicle's
            consumption was not measured, and it is no simulated PX4, whose own parameter has it.
        approach: where its hull hits an obstacle, or comes nearest to one; None without obstacles.
        times_s: when it is at each point of the path, from the goal on.
        step: that of a plan which was rejected or ended it, from 1; 0: none.
    """

    code: str
    text: str
    accepted: bool
    path_enu_m: tuple[Vector3, ...] = ()
    duration_s: float = 0.0
    battery: float | None = None
    approach: Approach | None = None
    times_s: tuple[float, ...] = ()
    step: int = 0


@dataclass(frozen=True)
class Lost:
    """The flight after a loss of the link.

    Attributes:
        mode: the last mode in which motors run.
        position_enu_m: where it would end.
        landed: whether it would be there with its motors off.
        path_enu_m: the path there from where the link was lost.
        approach: as that of a `Rehearsal`, for this path.
    """

    mode: str
    position_enu_m: Vector3
    landed: bool
    path_enu_m: tuple[Vector3, ...]
    approach: Approach | None = None


def rehearse(order: RehearsalRequest, is_over: IsOver = lambda: False) -> Rehearsal:
    """Fly an order.

    Args:
        order: what to fly.
        is_over: is asked now and then whether to stop.

    Raises:
        RequestError: it cannot be rehearsed.
        StoppedError: `is_over`.
    """
    stage = RehearsedFlight(order)
    began_s, charged = stage.now, stage.battery
    track, ended = _Track(stage), _End("SUCCESS", "Nothing was to be flown.", True)
    for number, part in enumerate(order.steps or (None,), 1):
        ended = _fly_part(stage, order, part, track, began_s + FLIGHT_MAX_S, is_over)
        if ended.code != OutcomeCode.SUCCESS.value:
            failed = number if order.steps else 0
            break
    else:
        failed = 0
    if not ended.accepted and failed < 2:
        return Rehearsal(ended.code, ended.text, False, step=failed)
    track.end()
    approach = stage.surroundings.approach(track.points_enu_m)
    duration_s = stage.now - began_s
    battery = _battery_left(order, charged - stage.battery, duration_s)
    times_s = tuple(time_s - began_s for time_s in track.times_s)
    path = tuple(track.points_enu_m)
    return Rehearsal(
        ended.code, ended.text, ended.accepted, path, duration_s, battery, approach, times_s, failed
    )


@dataclass(frozen=True)
class _End:
    """How a goal ended, or was rejected."""

    code: str
    text: str
    accepted: bool


def _fly_part(
    stage: RehearsedFlight,
    order: RehearsalRequest,
    step: RehearsalStep | None,
    track: _Track,
    until_s: float,
    is_over: IsOver,
) -> _End:
    """Fly the goal of an order, or a step of its plan, until it ends or it is too late."""
    if step is not None and step.kind == "wait":
        end_s = min(stage.now + step.seconds, until_s)
        while stage.now < end_s:
            _go_on(stage, is_over)
            track.extend()
        return _End(OutcomeCode.SUCCESS.value, "Waited.", True)
    request = _request(order) if step is None else _step_request(step)
    rejection = stage.bridge.goals.check(request, stage.now)
    if rejection is not None:
        return _End(rejection.code.value, rejection.message, False)
    stage.ends.clear()
    stage.bridge.goals.start(_GOAL_ID, request, stage.now)
    while not stage.ends:
        if stage.now >= until_s:
            return _End("UNFINISHED", f"It would take longer than {FLIGHT_MAX_S:g} s.", True)
        _go_on(stage, is_over)
        track.extend()
    return _End(stage.ends[0].code.value, stage.ends[0].message, True)


def _battery_left(order: RehearsalRequest, used: float, duration_s: float) -> float | None:
    """Return the charge at the end, from 0 to 1; None if nothing supports a number.

    Args:
        order: what was flown.
        used: the share that the simulated vehicle has used.
        duration_s: of the flight.
    """
    if order.battery is None:
        return None
    if order.consumption_per_s is not None:
        used = order.consumption_per_s * duration_s
    elif "SIM_BAT_DRAIN" not in (order.parameters or {}):  # PX4's own simulator has it
        return None
    return max(order.battery - used, 0.0)


def lose_link(order: RehearsalRequest, after_s: float, is_over: IsOver = lambda: False) -> Lost:
    """Fly an order again, and lose the link for good some time after its start.

    Args:
        order: what to fly; it was accepted.
        after_s: how long after the goal the link is lost.
        is_over: is asked now and then whether to stop.

    Raises:
        RequestError: it cannot be rehearsed.
        StoppedError: `is_over`.
    """
    stage = RehearsedFlight(order)
    stage.bridge.goals.start(_GOAL_ID, _request(order), stage.now)
    lost_s = stage.now + after_s
    while stage.now < lost_s:
        _go_on(stage, is_over)
    stage.link_up = False
    copter, mode = stage.simulated.firmware, ""
    track, still_s = _Track(stage), stage.now
    while copter.armed and stage.now < min(lost_s + _LOST_MAX_S, still_s + _STILL_S):
        mode = copter.mode.spec.name
        _go_on(stage, is_over)
        track.extend()
        if stage.speed_m_s > _STILL_M_S:
            still_s = stage.now
    track.end()
    path = tuple(track.points_enu_m)
    return Lost(mode, path[-1], not copter.armed, path, stage.surroundings.approach(path))


def _go_on(stage: RehearsedFlight, is_over: IsOver) -> None:
    stage.tick()
    if is_over():
        raise StoppedError


def _request(order: RehearsalRequest) -> Request:
    """The request that the console sends."""
    first = order.waypoints[0]
    if order.radius_m:
        return OrbitRequest(
            "map",
            first.position_enu_m,
            order.radius_m,
            first.position_enu_m[2],
            order.laps,
            order.speed_m_s,
            avoid_obstacles=order.avoid_obstacles,
        )
    if len(order.waypoints) == 1 and not first.hold_time_s and order.laps == 1:
        facing_travel = (0.0, 0.0, 0.0, 0.0)
        return NavigateRequest(
            "map", first.position_enu_m, facing_travel, order.avoid_obstacles, order.speed_m_s
        )
    return WaypointsRequest(
        tuple(
            WaypointRequest(w.position_enu_m, hold_time_s=w.hold_time_s) for w in order.waypoints
        ),
        laps=order.laps,
        max_speed_m_s=order.speed_m_s,
        avoid_obstacles=order.avoid_obstacles,
    )


def _step_request(step: RehearsalStep) -> Request:
    """The request that a plan sends for a step."""
    if step.kind == "takeoff":
        return TakeoffRequest(step.height_m or 0.0)
    if step.kind == "land":
        return LandRequest()
    if step.kind == "return":
        return ReturnRequest()
    if step.kind == "route":
        return WaypointsRequest(
            tuple(WaypointRequest(point) for point in step.points_enu_m),
            max_speed_m_s=step.speed_m_s,
            avoid_obstacles=step.avoid_obstacles,
        )
    place = step.points_enu_m[0]
    if step.kind == "orbit":
        height_m = math.nan if step.height_m is None else step.height_m
        return OrbitRequest(
            "map", place, step.radius_m, height_m, step.laps, step.speed_m_s,
            avoid_obstacles=step.avoid_obstacles,
        )  # fmt: skip
    facing_travel = (0.0, 0.0, 0.0, 0.0)
    return NavigateRequest("map", place, facing_travel, step.avoid_obstacles, step.speed_m_s)


class _Track:
    """Where a vehicle was, and when, in steps of distance and time."""

    def __init__(self, stage: RehearsedFlight) -> None:
        """Begin where it is."""
        self._stage = stage
        self.points_enu_m = [stage.position_enu_m]
        self.times_s = [stage.now]

    def extend(self) -> None:
        """Add where it is, after a step."""
        moved_m = distance(self.points_enu_m[-1], self._stage.position_enu_m)
        if moved_m >= _STEP_M or self._stage.now >= self.times_s[-1] + _STEP_S:
            self.end()

    def end(self) -> None:
        """Add where it is."""
        self.points_enu_m.append(self._stage.position_enu_m)
        self.times_s.append(self._stage.now)
