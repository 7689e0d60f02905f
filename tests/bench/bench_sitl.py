"""How much faster than real time one simulated copter is, on one core.

A flight as a navigation server flies it: take-off, position setpoints with velocity at
20 Hz, the streams of REQUEST_DATA_STREAM ALL at 4 Hz with position and attitude at 10 Hz (as
in the recordings of the real simulator), everything read. The real ArduCopter simulator
reached about 105 times real time with all of a core.
"""

from __future__ import annotations

import time
from typing import Any

from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import Simulation

GOAL = 100.0
FLIGHT_S = 60.0
ROUNDS = 3
SETPOINT_S = 0.05


def measures() -> list[dict[str, Any]]:
    """The best of a few rounds, by the processor's clock and by the wall's."""
    _fly()  # first calls are slower
    rounds = [_fly() for _ in range(ROUNDS)]
    cpu_s = min(cpu for cpu, _, _ in rounds)
    wall_s = min(wall for _, wall, _ in rounds)
    rate_hz = rounds[0][2] / FLIGHT_S

    def row(name: str, seconds: float) -> dict[str, Any]:
        factor = FLIGHT_S / seconds
        return {
            "name": name,
            "value": factor,
            "unit": "x real time",
            "reference": "real time",
            "reference_value": 1.0,
            "ratio": factor,
            "goal": f">= {GOAL:g} x",
            "met": factor >= GOAL,
        }

    return [
        row(f"one simulated copter, {rate_hz:.0f} messages/s, CPU time", cpu_s),
        row(f"one simulated copter, {rate_hz:.0f} messages/s, wall clock", wall_s),
        {
            "name": "a flight of 60 s in a test",
            "value": wall_s,
            "unit": "s",
            "reference": "real time",
            "reference_value": FLIGHT_S,
            "ratio": wall_s / FLIGHT_S,
            "goal": "< 1 s",
            "met": wall_s < 1.0,
        },
    ]


def _fly() -> tuple[float, float, int]:
    """A flight; CPU and wall seconds for its 60 s, and the number of messages in them."""
    simulation = Simulation(seed=1)
    link = simulation.link
    out = mav.MAVLink(None, srcSystem=255, srcComponent=190)

    def send(message: Any) -> None:
        link.write(bytes(message.pack(out)))

    def command(*values: float) -> None:
        parameters = [*values[1:], *([0.0] * (8 - len(values)))]
        send(mav.MAVLink_command_long_message(1, 1, int(values[0]), 0, *parameters))

    simulation.run_for(3.0)
    send(mav.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
    for message_id in (30, 32, 33):
        command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e5)
    command(mav.MAV_CMD_DO_SET_MODE, 1, 4)
    command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 10)
    simulation.run_for(15.0)
    link.read()
    messages = 0
    cpu_s, wall_s = time.process_time(), time.monotonic()
    for number in range(round(FLIGHT_S / SETPOINT_S)):
        north = 2.0 * number * SETPOINT_S
        send(
            mav.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, 1, 0x9C0, north, 0, -10, 2, 0, 0, 0, 0, 0, 0, 0
            )
        )
        simulation.run_for(SETPOINT_S)
        messages += len(link.read_datagrams())
    cpu_s, wall_s = time.process_time() - cpu_s, time.monotonic() - wall_s
    north, _, down = simulation.truth.position_ned_m[0]
    if not (100.0 < north < 130.0 and -11.0 < down < -9.0):
        raise RuntimeError(f"the copter did not fly as ordered: north {north:.1f}, down {down:.1f}")
    return cpu_s, wall_s, messages
