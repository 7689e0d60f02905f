"""A server that stops reports the vehicle that it leaves behind."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from mavlink_vehicle.events import LandedState
from mavlink_vehicle.profiles import VehicleKind
from mavlink_vehicle.state.reducer import VehicleState
from navigation_bridge.vehicle.left_behind import what_is_left


@pytest.mark.parametrize(
    ("heard", "connected", "armed", "landed", "sentence", "attention"),
    [
        (
            True,
            True,
            True,
            LandedState.IN_AIR,
            "Server stopped. Vehicle left in the air, armed, in mode GUIDED.",
            True,
        ),
        (
            True,
            True,
            False,
            LandedState.ON_GROUND,
            "Server stopped. Vehicle left on the ground, disarmed, in mode GUIDED.",
            False,
        ),
        (
            True,
            True,
            True,
            LandedState.UNDEFINED,
            (
                "Server stopped. Vehicle left airborne or on the ground (unknown), "
                "armed, in mode GUIDED."
            ),
            True,
        ),
        (
            True,
            False,
            False,
            LandedState.IN_AIR,
            (
                "Server stopped. The vehicle is silent; last known state: in the air, "
                "disarmed, in mode GUIDED."
            ),
            True,
        ),
        (
            False,
            False,
            False,
            LandedState.UNDEFINED,
            "Server stopped. No vehicle was found.",
            False,
        ),
    ],
)
def test_the_final_state_of_the_vehicle_is_reported(
    heard: bool, connected: bool, armed: bool, landed: LandedState, sentence: str, attention: bool
) -> None:
    vehicle = SimpleNamespace(
        heartbeats=SimpleNamespace(alive=connected),
        mode_name="GUIDED",
        profile=SimpleNamespace(kind=VehicleKind.COPTER) if heard else None,
        state=VehicleState(armed=armed, landed_state=landed),
    )
    left = what_is_left(vehicle)  # type: ignore[arg-type]
    assert left == (sentence, attention)


@pytest.mark.parametrize("landed", [LandedState.UNDEFINED, LandedState.ON_GROUND])
def test_of_a_vehicle_that_drives_no_height_is_told(landed: LandedState) -> None:
    rover = SimpleNamespace(
        heartbeats=SimpleNamespace(alive=True),
        mode_name="GUIDED",
        profile=SimpleNamespace(kind=VehicleKind.ROVER),
        state=VehicleState(armed=True, landed_state=landed),
    )
    left = what_is_left(rover)  # type: ignore[arg-type]
    assert left == ("Server stopped. Vehicle left armed, in mode GUIDED.", True)
    recorded = what_is_left(rover, is_recorded=True)  # type: ignore[arg-type]
    assert recorded == ("Server stopped. A recording was played; no vehicle is left.", False)
