"""The releases of each firmware that goals have been flown with.

A release that is not among them is reported and nothing else: most changes concern no goal.
"""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_vehicle.codec import mavlink


@dataclass(frozen=True)
class FlownReleases:
    """The releases of a firmware, as the beginnings of their versions.

    Attributes:
        firmware: its name.
        real: flown with the firmware itself, in its own simulator.
        simulated: flown in the simulator of this project only.
    """

    firmware: str
    real: tuple[str, ...]
    simulated: tuple[str, ...]


FLOWN = {
    mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: FlownReleases(
        "ArduPilot", real=("4.7.0-dev",), simulated=("4.6", "4.7")
    ),
    mavlink.MAV_AUTOPILOT_PX4: FlownReleases(
        "PX4", real=("1.17", "1.18.0-beta"), simulated=("1.18",)
    ),
}


def flown_with(autopilot: int, version: str) -> tuple[bool, str]:
    """Return whether goals have been flown with a release, and a sentence about it.

    Args:
        autopilot: MAV_AUTOPILOT of a known firmware.
        version: of the firmware, as "4.7.3" or "1.18.0-beta1".
    """
    flown = FLOWN[autopilot]
    name = f"{flown.firmware} {version}"
    if _is_among(version, flown.real):
        return True, f"{name}: goals have been flown with this release"
    if _is_among(version, flown.simulated):
        return True, f"{name}: goals have been flown with this release in the simulator only"
    known = f"{', '.join(flown.real)} and, in the simulator only, {', '.join(flown.simulated)}"
    return False, f"{name}: no goals have been flown with this release; they have with {known}"


def _is_among(version: str, releases: tuple[str, ...]) -> bool:
    return any(_is_of(version, release) for release in releases)


def _is_of(version: str, release: str) -> bool:
    """Whether a version begins as a release does: 1.18.0-beta1 is of 1.18, but 4.60 not of 4.6."""
    rest = version.removeprefix(release)
    cuts_a_number = release[-1].isdigit() and rest[:1].isdigit()
    return version.startswith(release) and not cuts_a_number
