"""The validated configuration of a simulated vehicle."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache

from mavlink_sitl.autopilot.personality import Personality
from mavlink_sitl.autopilot.personality.ardupilot import ARDUBOAT, ARDUCOPTER, ARDUPLANE, ARDUROVER
from mavlink_sitl.autopilot.personality.px4 import PX4BOAT, PX4COPTER, PX4PLANE, PX4ROVER
from mavlink_sitl.autopilot.personality.versions import as_release, releases_of
from mavlink_sitl.dynamics.battery import BatteryModel
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.links.faults import LinkFaults
from mavlink_sitl.mavlink.codec import MAVLINK_1

PERSONALITIES: dict[tuple[str, str], Personality] = {
    ("copter", "ardupilot"): ARDUCOPTER,
    ("copter", "px4"): PX4COPTER,
    ("rover", "ardupilot"): ARDUROVER,
    ("boat", "ardupilot"): ARDUBOAT,
    ("plane", "ardupilot"): ARDUPLANE,
    ("rover", "px4"): PX4ROVER,
    ("boat", "px4"): PX4BOAT,
    ("plane", "px4"): PX4PLANE,
}

DEFAULT_HOME = GeoPoint(-35.363261, 149.165230, 584.0)
DEFAULT_HEADING_DEG = 353.0


class ConfigurationError(ValueError):
    """Something about a vehicle cannot be; the message says what and what would be right."""


@dataclass(frozen=True)
class Underway:
    """Where a vehicle is put as soon as it is ready, and how it moves there.

    Attributes:
        place_ned_m: from its home.
        velocity_ned_m_s: what it has there; what drives has only the part along its nose.
        moves: armed, and in the air if it flies: in GUIDED (PX4: Hold). Else it stands there.
    """

    place_ned_m: tuple[float, float, float]
    velocity_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    moves: bool = True


@dataclass(frozen=True)
class VehicleConfig:
    """One simulated vehicle.

    Attributes:
        vehicle: "copter", "rover", "boat" or "plane".
        autopilot: "ardupilot" or "px4".
        firmware: its release, as "px4-1.18"; empty for the recorded one (`versions.RELEASES`).
        system_id: MAVLink system id, 1..255; None for the vehicle's place in the list, from 1
            (and again from 1 after 255).
        home: where it starts.
        heading_deg: where its nose points at start, clockwise from North.
        ready_after_s: from power-up until the estimator uses GPS. The real firmware's
            simulator takes 41.6 s; the whole start shrinks with this.
        parameters: values other than the defaults.
        battery: the pack.
        battery_remaining: charge at start, 0..1.
        underway: where it is put once it is ready, in place of a start from home; not for planes.
        faults: of its link.
        links: what its links are for: "gcs" (a ground station's) or "onboard" (a companion
            computer's). PX4 has streams of its own on each; ArduPilot says the same on all.
        external_position: it has no GPS; the estimator is set to a position from outside.
        photo_camera: a MAVLink camera, component 100, is beside the autopilot; of PX4 only, an
            ArduPilot has one by its parameters.
        mavlink_1: what it speaks besides MAVLink 2: one of `codec.MAVLINK_1`.
    """

    vehicle: str = "copter"
    autopilot: str = "ardupilot"
    firmware: str = ""
    system_id: int | None = None
    home: GeoPoint = DEFAULT_HOME
    heading_deg: float = DEFAULT_HEADING_DEG
    ready_after_s: float = 2.0
    parameters: Mapping[str, float] = field(default_factory=dict)
    battery: BatteryModel = field(default_factory=BatteryModel)
    battery_remaining: float = 1.0
    underway: Underway | None = None
    faults: LinkFaults | None = None
    links: tuple[str, ...] = ("gcs",)
    external_position: bool = False
    photo_camera: bool = False
    mavlink_1: str = ""

    def __post_init__(self) -> None:
        """Check everything that can be checked without the other vehicles."""
        self.personality()
        _require(
            self.system_id is None or 1 <= self.system_id <= 255,
            f"the system id must be between 1 and 255, not {self.system_id}",
        )
        _require(
            len(self.links) > 0 and set(self.links) <= {"gcs", "onboard"},
            f"links must be gcs or onboard, at least one, not {', '.join(self.links) or 'none'}",
        )
        _require(
            self.mavlink_1 in MAVLINK_1,
            f"mavlink_1 must be one of {', '.join(MAVLINK_1[1:])}, not {self.mavlink_1}",
        )
        _require(
            not self.photo_camera or self.autopilot == "px4",
            "a MAVLink camera is beside a PX4 only; give an ArduPilot one by CAM1_TYPE 1",
        )
        latitude, longitude, altitude = self.home
        _require(abs(latitude) <= 90.0, f"the latitude of home must be -90 to 90, not {latitude}")
        _require(
            abs(longitude) <= 180.0, f"the longitude of home must be -180 to 180, not {longitude}"
        )
        _require(
            -1000.0 <= altitude <= 20000.0,
            f"the altitude of home must be -1000 to 20000 m above sea level, not {altitude}",
        )
        _require(
            math.isfinite(self.heading_deg),
            f"the heading must be a number of degrees, not {self.heading_deg}",
        )
        _require(
            math.isfinite(self.ready_after_s) and self.ready_after_s >= 0.0,
            f"the time until ready must be 0 s or more, not {self.ready_after_s}",
        )
        _require(
            0.0 <= self.battery_remaining <= 1.0,
            f"the battery's charge must be 0 to 1, not {self.battery_remaining}",
        )
        if self.underway is not None:
            _require(self.vehicle != "plane", "a plane cannot be put under way; let it take off")
            numbers = (*self.underway.place_ned_m, *self.underway.velocity_ned_m_s)
            _require(
                all(map(math.isfinite, numbers)),
                f"place and velocity under way must be numbers, not {self.underway}",
            )
        _require(self.battery.cells >= 1, "the battery must have a cell")
        _require(
            0.0 <= self.battery.internal_resistance_ohm < 10.0,
            "the battery's internal resistance must be 0 to 10 ohm, "
            f"not {self.battery.internal_resistance_ohm}",
        )
        _require(
            math.isfinite(self.battery.capacity_mah) and self.battery.capacity_mah > 0.0,
            f"the battery's capacity must be above 0 mAh, not {self.battery.capacity_mah}",
        )

    def personality(self) -> Personality:
        """The firmware that goes with vehicle and autopilot.

        Raises:
            ConfigurationError: there is none.
        """
        try:
            recorded = PERSONALITIES[(self.vehicle, self.autopilot)]
        except KeyError:
            known = ", ".join(f"{v} with {a}" for v, a in PERSONALITIES)
            raise ConfigurationError(
                f"{self.vehicle} with {self.autopilot} is not supported; supported are: {known}"
            ) from None
        known_releases = releases_of(self.autopilot)
        _require(
            self.firmware in ("", *known_releases),
            f"the firmware of {self.autopilot} must be one of {', '.join(known_releases)}, "
            f"not {self.firmware}",
        )
        if self.firmware in ("", known_releases[0]):
            return recorded
        return _as_release(self.vehicle, self.autopilot, self.firmware)


@cache
def _as_release(vehicle: str, autopilot: str, firmware: str) -> Personality:
    return as_release(PERSONALITIES[(vehicle, autopilot)], vehicle, firmware)


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ConfigurationError(message)
