"""Mission operations of one autopilot; without I/O or a clock."""

from __future__ import annotations

from collections.abc import Sequence

from mavlink_vehicle.events import OperationKind
from mavlink_vehicle.mission_items import MissionItem
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.protocols.mission.mission_goals import (
    CurrentItemGoal,
    MissionModeGoal,
    MissionStartGoal,
)
from mavlink_vehicle.protocols.mission.mission_operation import (
    MissionJob,
    MissionOperation,
    MissionTiming,
)
from mavlink_vehicle.protocols.mission.mission_parts import TransferTiming
from mavlink_vehicle.protocols.operations.operation_parts import OperationTiming
from mavlink_vehicle.protocols.operations.operation_slot import Wanted
from mavlink_vehicle.state.restarts import evolve
from mavlink_vehicle.vehicle_operations import VehicleOperations

_TIME_S = 50.0
_TIME_PER_ITEM_S = 0.3
_JUDGED_S = 1.0
"""So long a PX4 may reject the start of a mission that it has just taken: it judges it first. On
a fast link an upload, its read-back and the start take 10 ms."""


class VehicleMissions(VehicleOperations):
    """One autopilot and its mission. Items are counted from 0, without ArduPilot's home."""

    _last_mission: MissionOperation | None = None

    @property
    def stored_mission(self) -> tuple[MissionItem, ...] | None:
        """The items read by the last upload, download or clearing; None before."""
        return None if self._last_mission is None else self._last_mission.stored

    def upload_mission(self, items: Sequence[MissionItem], now: float) -> int:
        """Store a mission; returns the operation's id.

        It is achieved when the vehicle gives back what it was sent, but for what its firmware
        is known to change, and the mission stands at its first item.
        """
        if self.state.mission is not None:
            self.state = evolve(self.state, {"mission": self.state.mission._replace(reached=())})
        return self._mission_operation(OperationKind.UPLOAD_MISSION, tuple(items), now)

    def download_mission(self, now: float) -> int:
        """Read the stored mission into `stored_mission`; returns the operation's id."""
        return self._mission_operation(OperationKind.DOWNLOAD_MISSION, (), now)

    def clear_mission(self, now: float) -> int:
        """Remove the stored mission; returns the operation's id.

        An ArduPilot rejects it while it flies the mission. A PX4 obeys, and loiters.
        """
        return self._mission_operation(OperationKind.CLEAR_MISSION, (), now)

    def start_mission(self, now: float) -> int:
        """Fly the stored mission, or go on with it; returns the operation's id.

        The vehicle must be armed. On the ground the first item must be a take-off, if it flies.
        """
        profile, kind = self.profile, OperationKind.START_MISSION
        if profile is None:
            return self._nobody(kind, now)
        rules, name = profile.missions, profile.mission_mode
        if rules is None or name is None:
            return self._refuse(kind, _no_missions(profile), now)
        if not self.state.armed:
            # ArduPilot and PX4 show the mode and wait in it; arming would then set them off.
            reason = f"Mission start rejected: {profile.name} is disarmed; arm it first."
            return self._refuse(kind, reason, now)
        mode = profile.modes[name]
        goal = (
            MissionStartGoal(name, mode, profile)
            if rules.start_command
            else MissionModeGoal(name, mode, profile)
        )
        timing = OperationTiming(self.config.operation_timeout_s, rejected_s=_JUDGED_S)
        return self._begin(profile, goal, Wanted(mode=mode), timing, now)

    def set_current_item(self, index: int, now: float) -> int:
        """Continue with the item of this number; returns the operation's id."""
        profile, kind = self.profile, OperationKind.SET_CURRENT_ITEM
        if profile is None:
            return self._nobody(kind, now)
        if profile.missions is None:
            return self._refuse(kind, _no_missions(profile), now)
        rules = profile.missions
        goal = CurrentItemGoal(index + rules.offset, rules.current_by_message)
        timing = OperationTiming(self.config.operation_timeout_s)
        return self._begin(profile, goal, Wanted(), timing, now)

    def _mission_operation(
        self, kind: OperationKind, items: tuple[MissionItem, ...], now: float
    ) -> int:
        profile = self.profile
        if profile is None:
            return self._nobody(kind, now)
        if profile.missions is None:
            return self._refuse(kind, _no_missions(profile), now)
        job = MissionJob(kind, items, profile.missions, profile.name)
        timing = MissionTiming(
            _TIME_S + _TIME_PER_ITEM_S * len(items),
            TransferTiming(self.config.mission_timeout_s, self.config.mission_retries),
            self._command_timing,
        )

        def make(operation_id: int) -> MissionOperation:
            self._last_mission = MissionOperation(operation_id, job, self.address, timing)
            return self._last_mission

        self._notice(now)
        operation_id = self._slot.begin_mission(make, self.state, now, connected=self.connected)
        self._take_ends()
        return operation_id


def _no_missions(profile: Profile) -> str:
    return f"The mission rules of {profile.name} are unknown, so no mission is sent."
