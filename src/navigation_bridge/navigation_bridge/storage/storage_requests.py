"""Requests about what the autopilot stores: fence, rally points, parameters. No ROS."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from mavlink_vehicle.events import (
    OperationResult,
    Parameter,
    ParameterOutcome,
    ParametersFinished,
    StoredListFinished,
    VehicleEvent,
)
from mavlink_vehicle.mission_items import MissionItem, MissionType
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.requests.feature import Feature, FeatureParts
from navigation_bridge.storage.geographic import (
    GeoFence,
    RallyPoint,
    fence_items,
    fence_of_items,
    rally_items,
    rally_of_items,
)
from navigation_bridge.vehicle.fence import areas_of, enforcement, has_areas, uploaded_fence
from navigation_core.outcomes import OutcomeCode, Rejection


@dataclass(frozen=True)
class ListAnswer:
    """The answer to a request about a fence or rally points.

    Attributes:
        success: whether it was done.
        message: a sentence.
        fence: what was read; None in another answer.
        in_force: whether its areas are enforced.
        points: the rally points that were read.
    """

    success: bool
    message: str
    fence: GeoFence | None = None
    in_force: bool = False
    points: tuple[RallyPoint, ...] = ()


@dataclass(frozen=True)
class ParametersAnswer:
    """The answer to a request about parameters.

    Attributes:
        success: whether all of it was done.
        message: a sentence.
        parameters: all that were read, if all were to be.
        outcomes: one for each name that was asked for.
    """

    success: bool
    message: str
    parameters: tuple[Parameter, ...] = ()
    outcomes: tuple[ParameterOutcome, ...] = ()


TakeList = Callable[[ListAnswer], object]
TakeParameters = Callable[[ParametersAnswer], object]


class StorageRequests(Feature):
    """Answers each request once, at once or when the vehicle has done it.

    Of lists and of parameters one request at a time is worked on; another is rejected.
    """

    def __init__(self, parts: FeatureParts) -> None:
        """Prepare."""
        super().__init__(parts)
        self._vehicle, self._map_frame, self._report = parts.vehicle, parts.map_frame, parts.report
        self._take_list: TakeList | None = None
        self._take_parameters: TakeParameters | None = None
        self._writes = False

    @property
    def is_writing(self) -> bool:
        """Whether a fence or rally points are being written."""
        return self._vehicle.storage.writes_list

    def objection(self, now: float) -> Rejection | None:
        """Return that a goal has to wait for what is being written."""
        if not self.is_writing:
            return None
        text = "The vehicle's fence or rally points are being written; send the goal again."
        return Rejection(OutcomeCode.BUSY, text)

    def _occupied(self) -> str | None:
        """Return why nothing may be written now, a sentence, or None."""
        occupied = self.parts.occupied()
        return None if occupied is None else occupied.message

    @property
    def parameter_progress(self) -> tuple[bool, int, int]:
        """Whether parameters are changed by now, how many are done, and of how many."""
        return self._vehicle.storage.parameter_progress

    # --- fence and rally points --------------------------------------------------------

    def read_list(self, kind: MissionType, take: TakeList, now: float) -> None:
        """Read the fence or the rally points."""
        self._begin_list(self._vehicle.storage.read_list(kind, now), take, writes=False)

    def write_fence(self, fence: GeoFence, take: TakeList, now: float) -> None:
        """Store a fence without a `fence_problem`; an empty one removes what is stored."""
        items = fence_items(fence)
        obstacle = self._occupied() or self._outside(items)
        if obstacle is None:
            obstacle = self._vehicle.storage.write_list(MissionType.FENCE, items, now)
        self._begin_list(obstacle, take, writes=True)

    def write_rally(self, points: Sequence[RallyPoint], take: TakeList, now: float) -> None:
        """Store rally points without a `rally_problem`; none of them removes what is stored."""
        obstacle = self._occupied()
        if obstacle is None:
            items = rally_items(points)
            obstacle = self._vehicle.storage.write_list(MissionType.RALLY, items, now)
        self._begin_list(obstacle, take, writes=True)

    def _begin_list(self, obstacle: str | None, take: TakeList, writes: bool) -> None:
        if obstacle is not None:
            take(ListAnswer(False, obstacle))
        else:
            self._take_list, self._writes = take, writes

    def _outside(self, items: Sequence[MissionItem]) -> str | None:
        """Return why an armed vehicle gets no such fence: it would be outside at once."""
        vehicle, profile = self._vehicle, self._vehicle.profile
        if not vehicle.state.armed or profile is None or not items:
            return None
        pose = self._map_frame.pose(vehicle.state)
        if pose is None or not vehicle.state.position_valid:
            return "The vehicle is armed and its position is unknown; it may be outside the fence."
        areas = areas_of(items, self._map_frame.enu)
        fence = uploaded_fence(profile, vehicle.parameters.values, areas)
        if fence.allows(pose.position_enu_m[:2]):
            return None
        return "The armed vehicle would be outside of this fence, which could end its flight."

    # --- parameters --------------------------------------------------------------------

    def read_parameter(self, name: str, take: TakeParameters, now: float) -> None:
        """Read one parameter."""
        obstacle = self._vehicle.storage.change_parameters({name: None}, lambda: None, now)
        self._begin_parameters(obstacle, take)

    def list_parameters(self, take: TakeParameters, now: float) -> None:
        """Read all parameters."""
        self._begin_parameters(self._vehicle.storage.list_parameters(now), take)

    def change_parameters(
        self, wanted: Mapping[str, float], while_armed: bool, take: TakeParameters, now: float
    ) -> None:
        """Change parameters, many after a reading of all; the values are finite.

        Without `while_armed` nothing is changed while the vehicle is armed or a goal is active.
        """

        def objection() -> str | None:
            if while_armed:
                return None
            if self._vehicle.state.armed:
                return (
                    "the vehicle is armed, and parameters can move a flying vehicle; disarm it, or "
                    "give while_armed"
                )
            return (self._occupied() or "").rstrip(".") or None

        first = objection()
        obstacle = None if first is None else f"Not changed: {first}."
        if obstacle is None:
            obstacle = self._vehicle.storage.change_parameters(
                wanted, objection, now, list_first=len(wanted) > 1
            )
        self._begin_parameters(obstacle, take)

    def stop_parameters(self, take: TakeParameters, reason: str, now: float) -> None:
        """End the request of this taker, if it is under way; changes made until then stay.

        Args:
            take: of the request.
            reason: part of a sentence, such as "it was cancelled".
            now: seconds.
        """
        if self._take_parameters == take:
            self._vehicle.storage.stop_parameters(reason, now)

    def _begin_parameters(self, obstacle: str | None, take: TakeParameters) -> None:
        if obstacle is not None:
            take(ParametersAnswer(False, obstacle))
        else:
            self._take_parameters = take

    # --- the vehicle's answers ---------------------------------------------------------

    def take(self, event: VehicleEvent) -> bool:
        """Pass an end on to who waits for it; return whether it was one of these."""
        if isinstance(event, StoredListFinished):
            self._list_ended(event)
        elif isinstance(event, ParametersFinished):
            self._parameters_ended(event)
        else:
            return False
        return True

    def _list_ended(self, event: StoredListFinished) -> None:
        take, self._take_list = self._take_list, None
        success = event.result is OperationResult.ACHIEVED
        message, is_fence = event.reason, event.kind is MissionType.FENCE
        profile, parameters = self._vehicle.profile, self._vehicle.parameters.values
        if is_fence and success and event.items and profile is not None:
            message += f" {enforcement(profile, parameters)}"
        if self._writes or not success:
            self._report.log(LogLevel.INFO if success else LogLevel.WARN, message)
        if take is None:
            return
        items = event.items or ()
        if self._writes:
            take(ListAnswer(success, message))
        elif is_fence:
            in_force = profile is not None and has_areas(profile, parameters)
            take(ListAnswer(success, message, fence_of_items(items), in_force))
        else:
            take(ListAnswer(success, message, points=rally_of_items(items)))

    def _parameters_ended(self, event: ParametersFinished) -> None:
        take, self._take_parameters = self._take_parameters, None
        success = event.result is OperationResult.ACHIEVED
        if event.outcomes and any(o.new != o.old for o in event.outcomes):
            for outcome in event.outcomes:
                if outcome.new != outcome.old:
                    self._report.log(LogLevel.INFO, f"Parameter {outcome.reason}")
        if take is not None:
            take(ParametersAnswer(success, event.reason, event.parameters, event.outcomes))
