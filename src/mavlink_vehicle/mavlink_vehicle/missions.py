"""The mission in the autopilot: stored, read, cleared, flown; without I/O or a clock."""

from __future__ import annotations

from collections.abc import Sequence

from mavlink_vehicle.events import OperationKind, OperationResult
from mavlink_vehicle.mission_items import MissionItem
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.protocols.mission.mission_goals import MissionModeGoal, MissionStartGoal
from mavlink_vehicle.protocols.mission.mission_operation import MissionJob, MissionTiming
from mavlink_vehicle.protocols.mission.transfer import TransferTiming
from mavlink_vehicle.protocols.operation_slot import Wanted
from mavlink_vehicle.protocols.operations.command import CommandTiming
from mavlink_vehicle.protocols.operations.operation_parts import OperationTiming
from mavlink_vehicle.state.vehicle_state import evolve
from mavlink_vehicle.storage.list_operation import ListOperation
from mavlink_vehicle.vehicle_core import VehicleCore

_TRANSFER_TIMEOUT_S = 50.0
_TRANSFER_TIMEOUT_PER_ITEM_S = 0.3
_START_JUDGED_S = 1.0
"""A PX4 may reject the start of a mission for this long after its upload: it judges it first. On
a fast link an upload, its read-back and the start take 10 ms."""


class Missions:
    """Operations on the mission. Items are counted from 0, without ArduPilot's home.

    Each method but :attr:`stored` returns the id of an operation, as those of `Vehicle` do.
    """

    def __init__(self, core: VehicleCore) -> None:
        """Operate on the mission of this autopilot."""
        self._core = core

    @property
    def stored(self) -> tuple[MissionItem, ...] | None:
        """The items read by the last upload, download or clearing; None before."""
        last = self._core.operations.last_mission
        return None if last is None else last.stored

    def upload(self, items: Sequence[MissionItem], now: float) -> int:
        """Store a mission; returns the operation's id.

        It is achieved when the vehicle gives back what it was sent, but for what its firmware
        is known to change, and the mission stands at its first item.
        """
        state = self._core.state
        if state.mission is not None:
            self._core.state = evolve(state, {"mission": state.mission._replace(reached=())})
        return self._operate(OperationKind.UPLOAD_MISSION, tuple(items), now)

    def download(self, now: float) -> int:
        """Read the stored mission into `stored`; returns the operation's id."""
        return self._operate(OperationKind.DOWNLOAD_MISSION, (), now)

    def clear(self, now: float) -> int:
        """Remove the stored mission; returns the operation's id.

        An ArduPilot rejects it while it flies the mission. A PX4 obeys, and loiters.
        """
        return self._operate(OperationKind.CLEAR_MISSION, (), now)

    def start(self, now: float) -> int:
        """Fly the stored mission, or continue with it; returns the operation's id.

        The vehicle must be armed. On the ground the first item must be a take-off, if it flies.
        """
        profile, kind = self._core.profile, OperationKind.START_MISSION
        if profile is None:
            return self._core.operations.nobody(kind, now)
        rules, name = profile.missions, profile.mission_mode
        if rules is None or name is None:
            return self._core.operations.refuse(kind, _no_missions(profile), now)
        if not self._core.state.armed:
            # ArduPilot and PX4 show the mode and wait in it; arming would then set them off.
            reason = f"Mission start rejected: {profile.name} is disarmed; arm it first."
            return self._core.operations.refuse(kind, reason, now)
        mode = profile.modes[name]
        goal = (
            MissionStartGoal(name, mode, profile)
            if rules.start_command
            else MissionModeGoal(name, mode, profile)
        )
        timing = OperationTiming(self._core.config.operation_timeout_s, rejected_s=_START_JUDGED_S)
        return self._core.operations.begin(goal, Wanted(mode=mode), timing, now)

    def _operate(self, kind: OperationKind, items: tuple[MissionItem, ...], now: float) -> int:
        core, profile = self._core, self._core.profile
        if profile is None:
            return core.operations.nobody(kind, now)
        if profile.missions is None:
            return core.operations.refuse(kind, _no_missions(profile), now)
        pending = core.list_jobs.pending
        if isinstance(pending, ListOperation) and pending.writes:
            reason = "The fence or the rally points are being written; try again after that."
            return core.operations.refuse(kind, reason, now)
        instead = "a mission is transferred instead"
        core.list_jobs.stop(OperationResult.CANCELLED, instead, now)
        job = MissionJob(kind, items, profile.missions, profile.name)
        timing = MissionTiming(
            _TRANSFER_TIMEOUT_S + _TRANSFER_TIMEOUT_PER_ITEM_S * len(items),
            TransferTiming(core.config.mission_timeout_s, core.config.mission_retries),
            CommandTiming(core.config.command_timeout_s, core.config.command_retries),
        )
        core.stations.mission_sent(kind)
        core.stored_lists.make_way(now)
        return core.operations.begin_mission(job, timing, now)


def _no_missions(profile: Profile) -> str:
    return f"The mission rules of {profile.name} are unknown, so no mission is sent."
