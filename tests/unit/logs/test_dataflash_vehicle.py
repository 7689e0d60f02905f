"""The kind of vehicle of a DataFlash log whose firmware has a name of its own."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from flight_logs.autopilot.dataflash_vehicle import VehicleFacts
from mavlink_vehicle.codec import mavlink


@dataclass
class Record:
    """A PARM record."""

    Name: str
    Value: float

    def get_type(self) -> str:
        return "PARM"


@pytest.mark.parametrize(
    ("names", "kind"),
    [
        (("WPNAV_SPEED",), mavlink.MAV_TYPE_QUADROTOR),
        (("WP_SPD", "WP_RADIUS_M"), mavlink.MAV_TYPE_QUADROTOR),
        (("AIRSPEED_MIN",), mavlink.MAV_TYPE_FIXED_WING),
        (("CRUISE_SPEED", "WP_SPEED"), mavlink.MAV_TYPE_GROUND_ROVER),
        (("WP_RADIUS",), mavlink.MAV_TYPE_GENERIC),
    ],
)
def test_the_parameters_show_the_vehicle_of_each_release(names: tuple[str, ...], kind: int) -> None:
    facts = VehicleFacts()
    for name in names:
        facts.take(Record(name, 5.0))
    assert facts.vehicle_type == kind
