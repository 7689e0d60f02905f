"""ONBOARD_COMPUTER_STATUS has what is known, and the message's own value for what is not."""

from __future__ import annotations

from typing import Any

import pytest

from mavlink_vehicle.codec import Codec
from mavlink_vehicle.protocols.streams.computer_status import ComputerStatus
from mavlink_vehicle.vehicle import Vehicle
from tests.unit.vehicle.test_services import connected

GIB = 1 << 30
KNOWN = ComputerStatus(
    uptime_s=3723.5,
    core_loads=(0.0, 0.254, 1.0, 0.5),
    ram_used_bytes=3 * GIB,
    ram_total_bytes=8 * GIB,
    storage_used_bytes=20 * GIB,
    storage_total_bytes=64 * GIB,
    temperature_c=61.6,
)


def sent(vehicle: Vehicle, status: ComputerStatus) -> list[Any]:
    """Return what leaves, as it arrives."""
    vehicle.computer_status.offer(status)
    codec = Codec(1, 191)
    frames = [codec.encode(message) for message in vehicle.messages_to_send()]
    messages = [message for frame in frames for message in Codec(1, 1).decode(frame)]
    return [each for each in messages if each.get_type() == "ONBOARD_COMPUTER_STATUS"]


def test_what_is_known_is_in_the_message() -> None:
    (message,) = sent(connected(), KNOWN)
    assert (message.uptime, message.time_usec, message.type) == (3_723_500, 3_723_500_000, 0)
    assert list(message.cpu_cores) == [0, 25, 100, 50, 255, 255, 255, 255]
    assert (message.ram_usage, message.ram_total) == (3072, 8192)
    assert message.storage_usage[0] == 20_480
    assert message.storage_total[0] == 65_536
    assert message.temperature_board == 62
    assert (message.get_srcSystem(), message.get_srcComponent()) == (1, 191)


def test_what_is_not_known_has_the_values_that_mean_it() -> None:
    (message,) = sent(connected(), ComputerStatus())
    assert set(message.cpu_cores) | set(message.cpu_combined) == {0xFF}
    assert set(message.gpu_cores) | set(message.gpu_combined) == {0xFF}
    assert {message.temperature_board, *message.temperature_core} == {0x7F}
    assert set(message.fan_speed) == {0x7FFF}
    unknown = {message.ram_usage, message.ram_total, *message.storage_usage}
    unknown |= {*message.storage_type, *message.storage_total}
    unknown |= {*message.link_tx_rate, *message.link_rx_rate}
    unknown |= {*message.link_tx_max, *message.link_rx_max}
    assert unknown == {0xFFFFFFFF}


@pytest.mark.parametrize(
    ("temperature_c", "expected"), [(-300.0, -128), (-12.4, -12), (126.9, 126), (140.0, 126)]
)
def test_a_temperature_never_reads_as_unknown(temperature_c: float, expected: int) -> None:
    (message,) = sent(connected(), ComputerStatus(temperature_c=temperature_c))
    assert message.temperature_board == expected


def test_a_computer_of_many_cores_reports_the_first_eight() -> None:
    (message,) = sent(connected(), ComputerStatus(core_loads=(0.1,) * 20))
    assert list(message.cpu_cores) == [10] * 8


def test_a_long_uptime_begins_again() -> None:
    (message,) = sent(connected(), ComputerStatus(uptime_s=5_000_000.0))
    assert message.uptime == 5_000_000_000 % (1 << 32)
    assert message.time_usec == 5_000_000_000_000


def test_nothing_is_kept_for_a_vehicle_that_is_not_heard() -> None:
    vehicle = Vehicle()
    vehicle.start(0.0)
    assert sent(vehicle, KNOWN) == []
    vehicle = connected()
    for now in range(1, 10):
        vehicle.handle_timer(float(now))
    assert not vehicle.heartbeats.alive
    assert sent(vehicle, KNOWN) == []
