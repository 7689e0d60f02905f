"""The releases that a firmware can be simulated as: each as its differences from the recorded one.

`ardupilot-4.7-dev` (May 2025) and `px4-1.17` are as recorded. Of another release only that is
known which stands here; in all else it is simulated as the recorded one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from mavlink_sitl.autopilot.personality import Personality
from mavlink_sitl.autopilot.personality.parameters import exists
from mavlink_sitl.autopilot.personality.used_params import UsedParams, used_params


@dataclass(frozen=True)
class Release:
    """One release of a firmware.

    Attributes:
        autopilot: "ardupilot" or "px4".
        number: as its banner has it; empty for the recorded one, which everything is taken from.
        flight_sw_version: AUTOPILOT_VERSION.flight_sw_version.
        git_hash: AUTOPILOT_VERSION.flight_custom_version, 8 digits; zeros where it is not known.
        removed_commands: MAV_CMDs that the recorded one obeys and this one does not know.
        added_commands: the other way round.
        reports_parameter_errors: PARAM_ERROR tells why a parameter is not read or set.
        signs_by_specification: see `Personality`, as is `assembles_corrections`.
    """

    autopilot: str
    number: str = ""
    flight_sw_version: int = 0
    git_hash: str = "00000000"
    removed_commands: frozenset[int] = frozenset()
    added_commands: frozenset[int] = frozenset()
    reports_parameter_errors: bool = False
    signs_by_specification: bool = False
    assembles_corrections: bool = False


GET_HOME_POSITION, REQUEST_PROTOCOL_VERSION, REQUEST_AUTOPILOT_CAPABILITIES = 410, 519, 520
REQUEST_STORAGE_INFORMATION, REQUEST_FLIGHT_INFORMATION = 525, 528

TAKEOFF, SET_GLOBAL_ORIGIN = 22, 611

RELEASES = {
    "ardupilot-4.7-dev": Release("ardupilot"),
    "ardupilot-4.6": Release("ardupilot", "4.6.2", 0x040602FF, "1ebd4d99"),
    "ardupilot-4.7": Release("ardupilot", "4.7.3", 0x040703FF, reports_parameter_errors=True),
    "px4-1.17": Release("px4"),
    "px4-1.18": Release(
        "px4",
        "1.18.0",
        0x011200FF,
        reports_parameter_errors=True,
        signs_by_specification=True,
        assembles_corrections=True,
        added_commands=frozenset({SET_GLOBAL_ORIGIN}),
        removed_commands=frozenset(
            {
                GET_HOME_POSITION,
                REQUEST_PROTOCOL_VERSION,
                REQUEST_AUTOPILOT_CAPABILITIES,
                REQUEST_STORAGE_INFORMATION,
                REQUEST_FLIGHT_INFORMATION,
            }
        ),
    ),
}
"""By their names; of each firmware the recorded one comes first"""


def releases_of(autopilot: str) -> list[str]:
    """The names of a firmware's releases; the recorded one, which is the default, comes first."""
    return [name for name, release in RELEASES.items() if release.autopilot == autopilot]


def as_release(recorded: Personality, vehicle: str, name: str) -> Personality:
    """Return a recorded personality as another release has it.

    Args:
        recorded: it.
        vehicle: "copter", "rover", "boat" or "plane": what a kind of vehicle has of its own.
        name: of `RELEASES`.
    """
    release = RELEASES[name]
    if not release.number:
        return recorded
    files = (name, f"{name}-{vehicle}")
    used = dict(used_params(name))
    if vehicle == "plane" and TAKEOFF in used:
        pitch = frozenset({1})  # the least pitch of its climb
        takeoff = used[TAKEOFF]
        used[TAKEOFF] = UsedParams(takeoff.of_item | pitch, takeoff.of_command | pitch)
    rules = recorded.plan_rules
    return replace(
        recorded,
        flight_sw_version=release.flight_sw_version,
        flight_custom_version=release.git_hash,
        changes=tuple(file for file in files if exists(file)),
        removed_commands=release.removed_commands,
        added_commands=release.added_commands,
        reports_parameter_errors=release.reports_parameter_errors,
        signs_by_specification=release.signs_by_specification,
        assembles_corrections=release.assembles_corrections,
        used_params=used,
        plan_rules=replace(rules, used_params={c: each.of_item for c, each in used.items()}),
        banner=tuple(
            text.replace("4.7.0-dev", release.number).replace(
                recorded.flight_custom_version, release.git_hash
            )
            for text in recorded.banner
        ),
    )
