"""Sources of what a server hears that nothing may hang on: odd clocks, and who else speaks."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Any

from mavlink_vehicle.codec import Codec, make, mavlink
from mavlink_vehicle.profiles import vehicle_rank
from mavlink_vehicle.state.identity import NOT_VEHICLES
from tests.explore.scenario import Event
from tests.support.messages.vehicle_clocks import CLOCKS

if TYPE_CHECKING:
    from tests.explore.exploration import Ship

_BEST = 3
_COMPONENTS = (2, 3, 25, 100, 154, 156, 158, 180, 191, 236, 240, 250, 255)
"""Of the vehicle's system: also cameras, gimbals, an ADS-B receiver, batteries and computers"""


def vehicle_clock(ship: Ship, name: str) -> None:
    """The vehicle's time since boot is wrong in all messages."""
    ship.vehicle_clock = CLOCKS[name]


def others_speak(ship: Ship, seed: int, count: int) -> None:
    """HEARTBEATs of any kind, and reports, of other components and systems arrive."""
    rng = random.Random(seed)
    own = ship.address["target_system"]
    for _ in range(count):
        system, component = rng.choice(
            ((own, rng.choice(_COMPONENTS)), (own, 1), (rng.choice((77, 255)), 1), (77, 190))
        )
        kind, autopilot = rng.randrange(55), rng.randrange(23)
        if component == 1 and vehicle_rank(autopilot, kind) == _BEST:
            kind = rng.choice(sorted(NOT_VEHICLES))  # as good a vehicle would be one
        report = make(
            "HEARTBEAT", type=kind, autopilot=autopilot, base_mode=rng.randrange(256),
            custom_mode=rng.randrange(30), system_status=rng.randrange(9), mavlink_version=3,
        )  # fmt: skip
        if (system, component) != (own, 1) and rng.random() < 0.6:
            report = _report(rng)
        ship.foreign.append(Codec(system, component).encode(report))


def _report(rng: random.Random) -> Any:
    """Return what would change much if the vehicle said it."""
    name, fields = rng.choice(
        (
            ("EXTENDED_SYS_STATE", {"landed_state": rng.randrange(5)}),
            ("GLOBAL_POSITION_INT", {"time_boot_ms": 5000, "lat": 473977420, "lon": 85455940}),
            ("LOCAL_POSITION_NED", {"time_boot_ms": 5000, "x": 900.0, "y": -40.0, "z": -2.0}),
            ("SYS_STATUS", {"voltage_battery": 9000, "battery_remaining": 1}),
            ("BATTERY_STATUS", {"id": rng.randrange(4), "battery_remaining": 0}),
            ("GPS_RAW_INT", {"fix_type": 0}),
            ("CURRENT_MODE", {"custom_mode": rng.randrange(30)}),
            ("HOME_POSITION", {"latitude": 473977420, "longitude": 85455940}),
            ("MISSION_CURRENT", {"seq": rng.randrange(5)}),
            ("STATUSTEXT", {"severity": 0, "text": b"EKF failsafe"}),
            ("SYSTEM_TIME", {"time_boot_ms": rng.randrange(9000)}),
            ("COMMAND_ACK", {"command": mavlink.MAV_CMD_DO_SET_MODE, "result": 4}),
        )
    )
    return make(name, **fields)


def drawn(seed: int, craft: int, last_s: float) -> list[Event]:
    """Return the events of one vehicle: a clock in a sixth of all, others in a third of them."""
    rng = random.Random(f"sources {seed} {craft}")
    events = []
    if rng.random() < 1 / 6:
        events.append(Event(0.0, craft, "vehicle_clock", {"name": rng.choice(list(CLOCKS))}))
    if rng.random() < 1 / 3:
        for _ in range(rng.choice((1, 3, 10))):
            how = {"seed": rng.randrange(1000), "count": rng.randrange(1, 30)}
            events.append(Event(round(rng.uniform(0.0, last_s), 2), craft, "others_speak", how))
    return events
