"""The warning about a battery that is not known when a goal arrives."""

from __future__ import annotations

import pytest

from mavlink_vehicle.codec import Codec, Message
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide_but_first


BATTERY = ("BATTERY_STATUS", "SYS_STATUS")


class Receiver(Codec):
    """Decodes what the vehicle sends, but loses or changes its battery."""

    def __init__(self, loses: bool) -> None:
        super().__init__(1, 191)
        self._loses = loses

    def decode(self, data: bytes) -> list[Message]:
        messages = super().decode(data)
        if self._loses:
            return [each for each in messages if each.get_type() not in BATTERY]
        for message in messages:
            if message.get_type() in BATTERY:
                message.battery_remaining = -1
        return messages


def warned(flight: SimulatedFlight) -> str:
    """Return the warnings with which a goal is accepted."""
    flight.send(0.0, 0.0, 3.0)
    flight.run_for(0.1)
    return "\n".join(line.text for line in flight.log_lines())


def test_a_battery_that_is_reported_is_known_from_the_first_moment() -> None:
    assert "battery" not in warned(SimulatedFlight().ready())


def test_a_battery_that_was_never_reported() -> None:
    flight = SimulatedFlight()
    flight.codec = Receiver(loses=True)
    assert "has never reported its remaining battery" in warned(flight.ready())


@pytest.mark.parametrize(
    ("loses", "after_s", "sentence"),
    [
        (False, 5.0, "reports its remaining battery as unknown now"),
        (True, 15.0, "does not report its battery any more"),
    ],
)
def test_a_battery_that_was_once_reported(loses: bool, after_s: float, sentence: str) -> None:
    flight = SimulatedFlight().ready()
    flight.run_for(3.0)
    flight.codec = Receiver(loses)
    flight.run_for(after_s)
    said = warned(flight)
    assert sentence in said
    assert "s ago it reported 100 %" in said
