"""Actions of other ground stations on the autopilot while we fly it; without I/O or a clock."""

from __future__ import annotations

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import (
    OperationFinished,
    OperationKind,
    OperationResult,
    StationAct,
)
from mavlink_vehicle.mission_items import MissionItem
from mavlink_vehicle.protocols.mission.stored_mission import StoredMission
from mavlink_vehicle.protocols.stations.overheard import (
    ANSWERS,
    HEARD,
    StationWatch,
    is_fence_taken,
)
from mavlink_vehicle.state.telemetry import MissionProgress
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.vehicle_config import VehicleConfig
from mavlink_vehicle.vehicle_missions import VehicleMissions

_ACTIVE = mavlink.MISSION_STATE_ACTIVE
_PAUSED = mavlink.MISSION_STATE_PAUSED


class VehicleStations(VehicleMissions):
    """One autopilot, and who else talks to it."""

    def __init__(self, config: VehicleConfig | None = None) -> None:
        """Prepare; nothing happens before `start`."""
        super().__init__(config)
        self._stations = StationWatch()
        self._ours = StoredMission()

    @property
    def mission_change(self) -> str:
        """The change of the mission that we uploaded last; empty while it is ours.

        Part of a sentence, for example "MISSION_CURRENT shows 4 items instead of 5".
        """
        return self._ours.change

    @property
    def stations_heard(self) -> tuple[tuple[int, int], ...]:
        """System and component of who was heard to talk to the vehicle, the last one last."""
        return self._stations.stations

    def overhear(self, message: Message, now: float) -> None:
        """Process what a ground station sends to the vehicle, and nothing else.

        It is never taken for the vehicle's word. What it does to the vehicle comes as
        `StationActed`.
        """
        if message.__class__ in HEARD and self.profile is not None:
            self._stations.hear(message, self.address, self.profile, now)
            self._take_acts()

    # Inside

    def _overhear(self, message: Message, now: float) -> None:
        super()._overhear(message, now)
        self.overhear(message, now)

    def _hear_answer(self, message: Message, now: float) -> None:
        self._stations.answered(message, self.address, now)

    def _hand_out(self, message: Message, now: float) -> None:
        super()._hand_out(message, now)
        if message.__class__ in ANSWERS:
            self._stations.answered(message, self.address, now)
            self._take_acts()
            if is_fence_taken(message):
                self._fence.refresh(now)

    def _compare(self, before: VehicleState, heartbeat: bool, now: float) -> None:
        super()._compare(before, heartbeat, now)
        if self.state.boot_count != before.boot_count:
            self._ours.forget()
        done = self._done_to_mission(before)
        if done is not None:
            self._stations.mission_changed(done, self._ours.change, now)
        self._compare_pause(before, now)
        self._take_acts()

    def _compare_pause(self, before: VehicleState, now: float) -> None:
        """See an ArduCopter pause in the mode in which it flies the mission (observed)."""
        profile, mission, earlier = self.profile, self.state.mission, before.mission
        if profile is None or not profile.pauses_in_mode or mission is None or earlier is None:
            return
        if profile.mission_mode is None or self.mode_name != profile.mission_mode:
            return
        states = (earlier.state, mission.state)
        if states == (_ACTIVE, _PAUSED):
            how = "MISSION_CURRENT shows that it is paused"
            self._stations.pause_changed(StationAct.PAUSED, how, now)
        elif states == (_PAUSED, _ACTIVE):
            how = "MISSION_CURRENT shows that it was resumed"
            self._stations.pause_changed(StationAct.CONTINUED, how, now)

    def _done_to_mission(self, before: VehicleState) -> StationAct | None:
        mission, texts = self.state.mission, self.state.texts
        if mission is not None and _is_current(mission, before.mission):
            return self._ours.observe(mission, self._place)
        if texts is not before.texts and texts.count > before.texts.count:
            new = self.state.status_texts[before.texts.count - texts.count :]
            return self._ours.observe_texts((text.text for text in new), self._place)
        return None

    def _mission_operation(
        self, kind: OperationKind, items: tuple[MissionItem, ...], now: float
    ) -> int:
        if kind is not OperationKind.DOWNLOAD_MISSION:
            self._ours.forget()
        return super()._mission_operation(kind, items, now)

    def _operation_ended(self, event: OperationFinished) -> None:
        super()._operation_ended(event)
        uploaded = event.kind is OperationKind.UPLOAD_MISSION
        rules = None if self.profile is None else self.profile.missions
        if uploaded and event.result is OperationResult.ACHIEVED and rules is not None:
            self._ours.stored(len(self.stored_mission or ()), rules, self._place)

    def _take_acts(self) -> None:
        while (event := self._stations.next_event()) is not None:
            self._events.append(event)


def _is_current(mission: MissionProgress, before: MissionProgress | None) -> bool:
    """Return whether MISSION_CURRENT has come, not MISSION_ITEM_REACHED or nothing."""
    if before is None or mission is before:
        return before is None
    return mission.reached is before.reached
