"""The autopilot's storage besides its mission: fence, rally points, parameters; sans I/O."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from mavlink_vehicle.events import OperationResult
from mavlink_vehicle.mission_items import MissionItem, MissionType
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.protocols.mission.transfer import TransferTiming
from mavlink_vehicle.storage.changes import ParameterChanges
from mavlink_vehicle.storage.list_operation import ListOperation
from mavlink_vehicle.storage.listing import ParameterListing
from mavlink_vehicle.vehicle_core import VehicleCore

_NOBODY = "No vehicle has been detected yet; check the link and the vehicle's power."
_MAVLINK_1 = (
    "The vehicle speaks MAVLink 1 only, which has no fence and no rally points (mission_type). "
    "Set its port to MAVLink 2: SERIALn_PROTOCOL 2 (ArduPilot), MAV_PROTO_VER 2 (PX4)."
)
_SILENT = "The autopilot is silent; check the link."


class Storage:
    """Reads and writes it, one list and one job on parameters at a time.

    Each method but `stop_parameters` returns why it does not begin, a sentence, or None. Each that
    has begun ends in one `StoredListFinished` or `ParametersFinished`.
    """

    def __init__(self, core: VehicleCore) -> None:
        """Work on the storage of this autopilot."""
        self._core = core

    @property
    def writes_list(self) -> bool:
        """Whether a fence or rally points are being written."""
        job = self._core.list_jobs.pending
        return isinstance(job, ListOperation) and job.writes

    @property
    def parameter_progress(self) -> tuple[bool, int, int]:
        """Whether parameters are being changed, how many are done, and of how many."""
        job = self._core.parameter_jobs.pending
        if isinstance(job, ParameterListing):
            return False, job.received, job.total
        return job.progress if isinstance(job, ParameterChanges) else (False, 0, 0)

    def read_list(self, kind: MissionType, now: float) -> str | None:
        """Read the fence or the rally points."""
        return self._begin_list(kind, None, now)

    def write_list(self, kind: MissionType, items: Sequence[MissionItem], now: float) -> str | None:
        """Store a fence or rally points; an altitude is rounded to what the firmware can store."""
        profile = self._core.profile
        step_m = profile.missions.rally_step_m if profile and profile.missions else 0.0
        if kind is MissionType.RALLY and step_m:
            items = [replace(item, z=step_m * round(item.z / step_m)) for item in items]
        return self._begin_list(kind, tuple(items), now)

    def list_parameters(self, now: float) -> str | None:
        """Read all parameters."""
        profile, obstacle = self._parameters_free()
        if profile is None:
            return obstacle
        listing = ParameterListing(self._core.address, profile.parameters_bytewise)
        self._core.parameter_jobs.begin(listing, now)
        self._core.collect(now)
        return None

    def change_parameters(
        self,
        wanted: Mapping[str, float | None],
        objection: Callable[[], str | None],
        now: float,
        list_first: bool = False,
    ) -> str | None:
        """Read or change parameters; the arguments are those of `ParameterChanges`."""
        profile, obstacle = self._parameters_free()
        if profile is None:
            return obstacle
        changes = ParameterChanges(
            wanted, self._core.address, profile.parameters_bytewise, objection, list_first
        )
        self._core.parameter_jobs.begin(changes, now)
        self._core.collect(now)
        return None

    def stop_parameters(self, reason: str, now: float) -> None:
        """End the job on parameters, if any; changes made until then stay."""
        self._core.parameter_jobs.stop(OperationResult.CANCELLED, reason, now)
        self._core.collect(now)

    def _begin_list(
        self, kind: MissionType, items: tuple[MissionItem, ...] | None, now: float
    ) -> str | None:
        core = self._core
        if core.profile is None:
            return _NOBODY
        if core.profile.missions is None:
            return f"The mission rules of {core.profile.name} are unknown, so nothing is sent."
        if not core.heartbeats.alive:
            return _SILENT
        if core.state.speaks_mavlink_1 and kind is not MissionType.MISSION:
            return _MAVLINK_1
        if core.transfers_mission:
            return "Another list is being transferred; try again after that."
        timing = TransferTiming(core.config.mission_timeout_s, core.config.mission_retries)
        core.stored_lists.make_way(now)
        core.parameters.refresh(now)  # the fence's are written by it
        job = ListOperation(kind, items, core.address, timing, lambda: core.state)
        core.list_jobs.begin(job, now)
        core.collect(now)
        return None

    def _parameters_free(self) -> tuple[Profile | None, str]:
        core = self._core
        if core.profile is None:
            return None, _NOBODY
        if not core.heartbeats.alive:
            return None, _SILENT
        if core.parameter_jobs.pending is not None:
            return None, "Parameters are being read or changed; try again after that."
        return core.profile, ""
