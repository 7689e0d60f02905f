"""Observes what other ground stations do to the autopilot and to the mission in it."""

from __future__ import annotations

from collections.abc import Callable

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import (
    OperationFinished,
    OperationKind,
    OperationResult,
    StationAct,
)
from mavlink_vehicle.mission_items import MissionItem
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.protocols.mission.stored_mission import StoredMission
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.service import VehicleService
from mavlink_vehicle.protocols.stations.overheard import ANSWERS, HEARD, StationWatch
from mavlink_vehicle.state.telemetry import MissionProgress
from mavlink_vehicle.state.vehicle_state import VehicleState

_ACTIVE = mavlink.MISSION_STATE_ACTIVE
_PAUSED = mavlink.MISSION_STATE_PAUSED


class StationObserver(VehicleService):
    """Watches others that talk to the autopilot, and whether the mission in it is still ours."""

    handles = ANSWERS

    def __init__(
        self,
        address: Callable[[], Address],
        profile: Callable[[], Profile | None],
        place: Callable[[], int],
    ) -> None:
        """Begin without having heard anybody.

        Args:
            address: returns the addresses of the conversation.
            profile: returns the vehicle's.
            place: returns the place of the last message in the order of sending.
        """
        super().__init__()
        self._address = address
        self._profile = profile
        self._place = place
        self._watch = StationWatch()
        self.events = self._watch.events
        self._ours = StoredMission()

    @property
    def mission_change(self) -> str:
        """The change of the mission that we uploaded last; empty while it is ours.

        Part of a sentence, for example "MISSION_CURRENT shows 4 items instead of 5".
        """
        return self._ours.change

    @property
    def stations(self) -> tuple[tuple[int, int], ...]:
        """System and component of who was heard to talk to the vehicle, the last one last."""
        return self._watch.stations

    def overhear(self, message: Message, now: float) -> None:
        """Process what was sent to the vehicle; it is never taken for the vehicle's word."""
        profile = self._profile()
        if isinstance(message, HEARD) and profile is not None:
            self._watch.hear(message, self._address(), profile, now)

    def receive(self, message: Message, now: float) -> None:
        """Process what the vehicle answered, perhaps to somebody else."""
        self._watch.answered(message, self._address(), now)

    def state_changed(self, before: VehicleState, state: VehicleState, now: float) -> None:
        """Look at what shows another mission, or a pause."""
        profile = self._profile()
        if profile is None:
            return
        if state.boot_count != before.boot_count:
            self._ours.forget()
        done = self._done_to_mission(before, state, self._place())
        if done is not None:
            self._watch.mission_changed(done, self._ours.change, now)
        self._compare_pause(before, state, profile, now)

    def mission_sent(self, kind: OperationKind) -> None:
        """Record that an operation on the mission begins: unless it only reads, none is ours."""
        if kind is not OperationKind.DOWNLOAD_MISSION:
            self._ours.forget()

    def operation_ended(self, event: OperationFinished, stored: tuple[MissionItem, ...]) -> None:
        """Record the end of an operation: what was uploaded is ours.

        Args:
            event: the end.
            stored: the items that the vehicle gave back.
        """
        uploaded, profile = event.kind is OperationKind.UPLOAD_MISSION, self._profile()
        rules = None if profile is None else profile.missions
        if uploaded and event.result is OperationResult.ACHIEVED and rules is not None:
            self._ours.stored(len(stored), rules, self._place())

    def _compare_pause(
        self, before: VehicleState, state: VehicleState, profile: Profile, now: float
    ) -> None:
        """See an ArduCopter pause in the mode in which it flies the mission (observed)."""
        mission, earlier = state.mission, before.mission
        if not profile.pauses_in_mode or mission is None or earlier is None:
            return
        name = profile.mission_mode
        if name is None or profile.mode_name(state.custom_mode) != name:
            return
        states = (earlier.state, mission.state)
        if states == (_ACTIVE, _PAUSED):
            how = "MISSION_CURRENT shows that it is paused"
            self._watch.pause_changed(StationAct.PAUSED, how, now)
        elif states == (_PAUSED, _ACTIVE):
            how = "MISSION_CURRENT shows that it was resumed"
            self._watch.pause_changed(StationAct.CONTINUED, how, now)

    def _done_to_mission(
        self, before: VehicleState, state: VehicleState, place: int
    ) -> StationAct | None:
        mission, texts = state.mission, state.texts
        if mission is not None and _is_current(mission, before.mission):
            return self._ours.observe(mission, place)
        if texts is not before.texts and texts.count > before.texts.count:
            new = state.status_texts[before.texts.count - texts.count :]
            return self._ours.observe_texts((text.text for text in new), place)
        return None


def _is_current(mission: MissionProgress, before: MissionProgress | None) -> bool:
    """Return whether MISSION_CURRENT has come, not MISSION_ITEM_REACHED or nothing."""
    if before is None or mission is before:
        return before is None
    return mission.reached is before.reached
