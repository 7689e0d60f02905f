"""Differences between firmware, as data; one module per firmware and vehicle type."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from mavlink_sitl.autopilot.parameters import ParameterSpec, ParameterTable, ParameterType
from mavlink_sitl.autopilot.personality.parameters import changes_in, whole_list
from mavlink_sitl.autopilot.personality.used_params import UsedParams
from mavlink_sitl.autopilot.plans.plan_rules import ARDUPILOT_PLANS, PlanRules
from mavlink_sitl.geodesy import ARDUPILOT, Projection


@dataclass(frozen=True)
class ModeSpec:
    """One flight mode.

    Attributes:
        number: HEARTBEAT.custom_mode.
        name: the firmware's name.
        behaviour: which class of `autopilot.modes` flies it.
        requires_position: rejected in the air while the estimator has no position.
        armable: motors may be armed in it.
        position_controlled: the position controller runs in it (base_mode GUIDED_ENABLED).
        requires_velocity: the same of a velocity, which the estimator has where it has a position.
        base_flags: HEARTBEAT.base_mode in it, besides CUSTOM_MODE_ENABLED, SAFETY_ARMED and that.
    """

    number: int
    name: str
    behaviour: str
    requires_position: bool = False
    armable: bool = False
    position_controlled: bool = False
    base_flags: int = 0x50
    requires_velocity: bool = False

    @property
    def requires_estimate(self) -> bool:
        """Whether it needs the estimator's position or velocity."""
        return self.requires_position or self.requires_velocity


@dataclass(frozen=True)
class BootStep:
    """A line the firmware says while it starts, and when (seconds after power-up)."""

    at_s: float
    text: str


@dataclass(frozen=True)
class SavedStep:
    """A parameter the firmware saves while it starts, and when (seconds after power-up)."""

    at_s: float
    name: str
    value: float
    type: ParameterType = ParameterType.REAL32


@dataclass(frozen=True)
class Sensors:
    """SYS_STATUS bits once everything but the GPS has been found, as recorded.

    Attributes:
        present: without the fence, which depends on its parameters.
        enabled: without the fence, the estimator, and what the mode controls.
        healthy: the same.
        by_mode: what is controlled in a mode, by its name: rates, attitude, yaw, height, place.
        otherwise: what is controlled in all other modes.
        estimator_needs_gps: the estimator counts as healthy only when it uses the GPS.
    """

    present: int = 0
    enabled: int = 0
    healthy: int = 0
    by_mode: Mapping[str, int] = field(default_factory=dict)
    otherwise: int = 0
    estimator_needs_gps: bool = False


@dataclass(frozen=True)
class Personality:
    """A firmware for a kind of vehicle, as far as it can be written down.

    Attributes:
        mav_type: HEARTBEAT.type.
        mav_autopilot: HEARTBEAT.autopilot.
        capabilities: AUTOPILOT_VERSION.capabilities.
        flight_sw_version: AUTOPILOT_VERSION.flight_sw_version.
        flight_custom_version: AUTOPILOT_VERSION.flight_custom_version, 8 characters.
        modes: by number.
        parameters: those that do something here.
        whole: the list of all that the firmware has (`whole_list`); empty for no others.
        boot: what it says while starting, in time.
        ready_s: when the estimator uses GPS in the real firmware; `boot` and the times below
            are scaled down when a shorter time is configured.
        gps_fix_s: when the receiver has its fix.
        battery_ready_s: when the power monitor has readings.
        origin_s: when the estimator has its origin and home is set.
        first_heartbeat_s: when it is first heard.
        standby_s: when HEARTBEAT.system_status goes from BOOT to STANDBY.
        streams: REQUEST_DATA_STREAM groups: stream id to message ids.
        shortest_interval_us: SET_MESSAGE_INTERVAL below it is denied.
        available_modes: AVAILABLE_MODES in its order: custom mode, standard mode, properties,
            name; of firmwares that list more than they fly here.
        sensors: SYS_STATUS; of firmwares that report it so.
        projection: how its local frame lies over the earth.
        plan_rules: how missions, fences and rally points are taken.
        kind: copter, rover, boat or plane.
        boot_mode: HEARTBEAT.custom_mode while starting; None for that of the first mode. With
            one, the state is CALIBRATING instead of BOOT.
        boot_flags: HEARTBEAT.base_mode while starting, besides CUSTOM_MODE_ENABLED.
        armed_text: said when armed.
        disarmed_text: said when disarmed.
        aloft_texts: said once after power-up, at first out of the ground's reach.
        saved: parameters that it saves and reports while starting, by time; empty where it
            reports none.
        estimators: those that say when they lose the GPS for good and use it again; of the
            first time `boot` has the texts.
        banner: its texts on request (DO_SEND_BANNER).
        says_impacts: whether it says how hard it has hit the ground.
        changes: lists of what a release has otherwise than the recorded one (`versions`).
        used_params: by MAV_CMD; others that are set are rejected. A MAV_CMD that is not there may
            have any.
        reports_parameter_errors: PARAM_ERROR answers where the recorded releases are silent.
        removed_commands: MAV_CMDs that the recorded release obeys and this one does not know.
        added_commands: the other way round.
        signs_by_specification: a PX4 takes no other key while armed, and four kinds of messages
            without a signature.
        assembles_corrections: a PX4 gives its GPS whole RTCM messages, not each fragment.
    """

    name: str
    mav_type: int
    mav_autopilot: int
    capabilities: int
    flight_sw_version: int
    flight_custom_version: str
    modes: Mapping[int, ModeSpec]
    parameters: tuple[ParameterSpec, ...]
    boot: tuple[BootStep, ...]
    ready_s: float
    gps_fix_s: float
    battery_ready_s: float
    origin_s: float
    first_heartbeat_s: float
    standby_s: float
    streams: Mapping[int, tuple[int, ...]]
    shortest_interval_us: int
    available_modes: tuple[tuple[int, int, int, str], ...] = ()
    sensors: Sensors = Sensors()
    projection: Projection = ARDUPILOT
    plan_rules: PlanRules = ARDUPILOT_PLANS
    kind: str = "copter"
    boot_mode: int | None = None
    boot_flags: int = 0x58
    armed_text: str = "Arming motors"
    disarmed_text: str = "Disarming motors"
    aloft_texts: tuple[str, ...] = ()
    saved: tuple[SavedStep, ...] = ()
    estimators: tuple[str, ...] = ()
    whole: str = ""
    banner: tuple[str, ...] = ()
    says_impacts: bool = True
    changes: tuple[str, ...] = ()
    used_params: Mapping[int, UsedParams] = field(default_factory=dict)
    removed_commands: frozenset[int] = frozenset()
    added_commands: frozenset[int] = frozenset()
    reports_parameter_errors: bool = False
    signs_by_specification: bool = False
    assembles_corrections: bool = False

    @cached_property
    def parameter_table(self) -> ParameterTable:
        """All its parameters, those that do nothing among them."""
        table = ParameterTable(self.parameters, whole_list(self.whole) if self.whole else ())
        for name in self.changes:
            table = table.changed(changes_in(name))
        return table
