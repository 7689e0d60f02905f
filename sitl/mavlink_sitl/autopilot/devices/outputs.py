"""Servos and relays that commands and mission items move, once or again and again.

As AP_ServoRelayEvents: one servo or relay at a time repeats; setting the same one ends that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_sitl.exchange import Result, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.firmware import Firmware

OUTPUTS = 16
OWN = {"copter": (1, 2, 3, 4), "rover": (1, 3), "boat": (1, 3), "plane": (1, 2, 3, 4)}
"""Outputs of the vehicle's own motors and servos, by its kind"""
RELAYS = {"copter": 1, "rover": 2, "boat": 2, "plane": 1}
"""Relays with a pin, by default (RELAY1_FUNCTION and so on)"""
TRIM_US = 1500


@dataclass
class _Repeat:
    """A servo or relay that is switched back and forth.

    Attributes:
        is_relay: else a servo.
        number: of the relay, or of the output.
        left: how often it still flips; negative forever.
        half_s: from flip to flip.
        value_us: of the servo at every other time.
        due_s: the next flip.
    """

    is_relay: bool
    number: int
    left: int
    half_s: float
    value_us: int
    due_s: float


class Outputs:
    """The outputs of one vehicle, from one power-up to the next.

    Attributes:
        servos_us: what was put on outputs, by their number.
        relays_on: the numbers of the relays that are on, from 0.
    """

    def __init__(self, vehicle: Firmware) -> None:
        self._vehicle = vehicle
        self.servos_us: dict[int, int] = {}
        self.relays_on: set[int] = set()
        self._repeat: _Repeat | None = None

    @property
    def relays(self) -> int:
        """How many there are."""
        return RELAYS.get(self._vehicle.personality.kind, 0)

    def set_servo(self, output: int, pulse_us: float) -> Result:
        """DO_SET_SERVO: an output that nothing else uses."""
        if not self._free(output) or not 0.0 <= pulse_us <= 65535.0:
            return Result.FAILED
        self._end_repeat(False, output)
        self.servos_us[output] = round(pulse_us)
        return Result.ACCEPTED

    def repeat_servo(self, output: int, pulse_us: float, times: int, cycle_s: float) -> Result:
        """DO_REPEAT_SERVO: there, and half a cycle later to its middle."""
        if not self._free(output) or not 0.0 <= pulse_us <= 65535.0:
            return Result.FAILED
        self._begin(_Repeat(False, output, 2 * times, cycle_s / 2.0, round(pulse_us), 0.0))
        return Result.ACCEPTED

    def set_relay(self, number: int, state: int) -> Result:
        """DO_SET_RELAY: 0 off, 1 on, else the other way."""
        if not 0 <= number < self.relays:
            return Result.FAILED
        self._end_repeat(True, number)
        if state not in (0, 1):
            self._toggle(number)
        elif state:
            self.relays_on.add(number)
        else:
            self.relays_on.discard(number)
        return Result.ACCEPTED

    def repeat_relay(self, number: int, times: int, cycle_s: float) -> Result:
        """DO_REPEAT_RELAY: the other way, and half a cycle later back."""
        if not 0 <= number < self.relays:
            return Result.FAILED
        self._begin(_Repeat(True, number, 2 * times, cycle_s / 2.0, 0, 0.0))
        return Result.ACCEPTED

    def update(self) -> None:
        """Flip what is due."""
        repeat, now_s = self._repeat, self._vehicle.now_s
        if repeat is None or repeat.left == 0 or now_s < repeat.due_s:
            return
        repeat.due_s = now_s + repeat.half_s
        if repeat.is_relay:
            self._toggle(repeat.number)
        else:
            middle = repeat.left & 1
            self.servos_us[repeat.number] = TRIM_US if middle else repeat.value_us
        repeat.left = repeat.left - 1 if repeat.left > 0 else repeat.left ^ 1

    def _free(self, output: int) -> bool:
        if output in OWN.get(self._vehicle.personality.kind, ()):
            text = f"ServoRelayEvent: Channel {output} is already in use"
            self._vehicle.say(Severity.INFO, text)
            return False
        return 1 <= output <= OUTPUTS

    def _toggle(self, number: int) -> None:
        self.relays_on ^= {number}

    def _begin(self, repeat: _Repeat) -> None:
        self._repeat = repeat
        self.update()

    def _end_repeat(self, is_relay: bool, number: int) -> None:
        repeat = self._repeat
        if repeat is not None and (repeat.is_relay, repeat.number) == (is_relay, number):
            self._repeat = None
