"""Measurements that go straight from their frames into the state change what messages would."""

from __future__ import annotations

from collections import Counter
from random import Random
from typing import Any

from mavlink_vehicle.codec import Codec, Message, Sender, make, mavlink, message_of
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.goals.requests import NavigateRequest
from navigation_bridge.supervision.preflight import check_position

UNKNOWN_HEADING, LATITUDE, LONGITUDE = 65535, 473977420, 85455940
SOURCE = 1 | 1 << 8
TIMESYNC = mavlink.MAVLink_timesync_message
GOAL = NavigateRequest("map", (5.0, 5.0, 5.0), (0.0, 0.0, 0.0, 1.0), False, 0.0)
taken: Counter[str] = Counter()
asked: list[int] = []
"""Times of the questions that were sent by TIMESYNC."""


def heartbeat(draw: Random, firmware: int) -> Message:
    return make(
        "HEARTBEAT",
        type=2,
        autopilot=firmware,
        base_mode=draw.choice([81, 209]),
        custom_mode=draw.choice([0, 4]),
        system_status=draw.choice([3, 4, 4, 5]),
    )


def measurement(draw: Random, name: str, time_boot_ms: int) -> Message:
    if name == "GLOBAL_POSITION_INT":
        return make(
            name,
            time_boot_ms=time_boot_ms,
            lat=draw.choice([0, 0x7FFFFFFF, *[LATITUDE + draw.randint(-60, 60)] * 5]),
            lon=draw.choice([0, LONGITUDE, LONGITUDE, LONGITUDE]),
            alt=488000,
            vx=draw.randint(-60, 60),
            hdg=draw.choice([0, 9000, 18000, 35999, 60000, UNKNOWN_HEADING]),
        )
    if name == "LOCAL_POSITION_NED":
        x = draw.choice([0.0, 1.5, float("nan"), float("inf")])
        return make(name, time_boot_ms=time_boot_ms, x=x, z=float(draw.randint(-60, 60)))
    if name == "ATTITUDE":
        yaw = draw.choice([0.0, -3.2, 3.1, 7.0, float("nan")])
        return make(name, time_boot_ms=time_boot_ms, yaw=yaw, rollspeed=0.5)
    if name == "SYSTEM_TIME":
        return make(name, time_boot_ms=time_boot_ms)
    if name == "TIMESYNC":
        ts1 = draw.choice([*asked[-2:], 7_000_000_000])
        return make(name, tc1=draw.choice([0, time_boot_ms * 1_000_000]), ts1=ts1)
    return report(draw, name)


def report(draw: Random, name: str) -> Message:
    health = draw.choice([0, 1, 0x1FFFFFFF, 0x1FEFFFFF])
    fields: dict[str, dict[str, Any]] = {
        "EXTENDED_SYS_STATE": {"landed_state": draw.choice([1, 2, 2, 2, 5])},
        "SYS_STATUS": {
            "onboard_control_sensors_present": 0x1FFFFFFF,
            "onboard_control_sensors_enabled": draw.choice([0, 0x1FFFFFFF]),
            "onboard_control_sensors_health": health,
            "battery_remaining": draw.randint(-1, 100),
        },
        "BATTERY_STATUS": {
            "id": draw.choice([0, 0, 0, 1]),
            "voltages": [12600] + [65535] * 9,
            "current_battery": draw.choice([-100, -1, 2500]),
            "charge_state": draw.randint(0, 5),
        },
        "GPS_RAW_INT": {
            "time_usec": draw.choice([0, 20_000_000]),
            "fix_type": draw.randint(0, 6),
            "lat": LATITUDE + draw.randint(-2000, 2000),
            "lon": LONGITUDE,
            "eph": draw.choice([80, 65535]),
            "satellites_visible": draw.choice([9, 255]),
            "h_acc": draw.choice([0, 700]),
        },
        "EKF_STATUS_REPORT": {"flags": draw.choice([0x33F, 0x32F, 0x8400])},
        "ESTIMATOR_STATUS": {
            "flags": draw.choice([0x33F, 0x32F]),
            "pos_horiz_ratio": draw.choice([0.1, 1.5]),
            "pos_horiz_accuracy": draw.choice([0.5, float("nan")]),
        },
    }
    return make(name, **fields[name])


NAMES = (
    "GLOBAL_POSITION_INT", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "ATTITUDE", "SYSTEM_TIME",
    "EXTENDED_SYS_STATE", "SYS_STATUS", "BATTERY_STATUS", "GPS_RAW_INT", "EKF_STATUS_REPORT",
    "ESTIMATOR_STATUS", "TIMESYNC",
)  # fmt: skip


def bridge() -> Bridge:
    config = make_config({"arming": "auto"})
    made = Bridge(Vehicle(config.vehicle), config.bridge)
    made.start(100.0)
    return made


def outcome(of: Bridge, sender: Codec, now: float) -> list[Any]:
    """Return all that can be seen of a bridge from outside."""
    outputs = []
    while (output := of.next_output()) is not None:
        outputs.append(str(getattr(output, "message", output)))
    vehicle, messages = of.vehicle, of.messages_to_send()
    asked.extend(each.ts1 for each in messages if isinstance(each, TIMESYNC))
    return [
        repr(vehicle.state),
        outputs,
        [sender.encode(message) for message in messages],
        vehicle.timesync.answers,
        of.next_deadline(),
        repr(of.pose),
        vehicle.heartbeats.alive,
        vehicle.own_gap.is_open,
        repr(check_position(of._positions, now)),
        repr(vars(of._observer.battery.consumption)),
    ]


def compare(seed: int) -> None:
    draw, autopilot, reader = Random(seed), Codec(1, 1), Codec(255, 190)
    asked.clear()
    firmware = draw.choice([3, 12])
    by_messages, directly = bridge(), bridge()
    senders = Codec(1, 191), Codec(1, 191)
    sender, now, time_boot_ms = Sender(), 100.0, 10_000
    reader.senders[SOURCE] = sender
    for number in range(draw.randint(5, 60)):
        wait_s = draw.choice([0.0, *[0.02] * 9, 0.1, 0.9, 2.5])
        now += wait_s
        time_boot_ms += round(1000 * wait_s) + draw.choice([*[0] * 20, -30, -5000])
        time_boot_ms = max(time_boot_ms, 0)
        act = draw.choice([*[""] * 12, "timer", "timer", "goal", "mode"])
        if number % 10 == 0:
            sender.grant(directly.intakes(1, 1))
            message = heartbeat(draw, firmware)
        else:
            message = measurement(draw, draw.choice(NAMES), time_boot_ms)
        frame = autopilot.encode(message)
        by_messages.receive(message_of(frame), now)
        (found,) = reader.receive(frame)
        if not isinstance(found, tuple):
            directly.receive(found, now)
        elif found[1](found[2], now):
            taken[message.get_type()] += 1
        else:
            directly.receive(message_of(found[3]), now)
        for of in (by_messages, directly):
            if act == "timer":
                of.handle_timer(now)
            elif act == "goal" and of.goals.check(GOAL, now) is None:
                of.goals.start("1" * 32, GOAL, now)
            elif act == "mode":
                of.vehicle.change_mode("GUIDED", now)
        assert outcome(directly, senders[1], now) == outcome(by_messages, senders[0], now)


def test_measurements_taken_directly_do_what_their_messages_do() -> None:
    for seed in range(20):
        compare(seed)
    names = {mavlink.mavlink_map[number].msgname for number in bridge().vehicle._direct.intakes}
    assert set(taken) == names
