"""The least autopilot that commands and HEARTBEATs can be tried on, for property tests.

Not a simulator: it has a mode, an armed flag and a height that follows commands, and a policy
of what it rejects. It keeps a diary of what really happened, which is what outcomes are held
against.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from mavlink_vehicle.codec import Codec, Message, make, mavlink

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
FAILED = mavlink.MAV_RESULT_FAILED
IN_PROGRESS = mavlink.MAV_RESULT_IN_PROGRESS
SET_MODE = mavlink.MAV_CMD_DO_SET_MODE
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
TAKEOFF = mavlink.MAV_CMD_NAV_TAKEOFF
CLIMB_M_S = 2.0
TICK_S = 0.05

_GROUND_AMSL_M = 488.0


@dataclass
class ModelAutopilot:
    """Speaks MAVLink as 1/1; `answers` maps a command to the results it acknowledges with."""

    answers: dict[int, tuple[int, ...]] = field(default_factory=dict)
    mode: int = 0
    armed: bool = False
    height_m: float = 0.0
    target_m: float | None = None
    diary: list[str] = field(default_factory=list)
    outbox: list[bytes] = field(default_factory=list)
    received: list[Message] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._codec = Codec(1, 1)
        self._next_beat_s = 0.0
        self._next_position_s = 0.0
        self._time_s = 0.0

    @property
    def next_deadline(self) -> float:
        return min(self._next_beat_s, self._next_position_s)

    def receive(self, data: bytes) -> None:
        for message in self._codec.decode(data):
            self.received.append(message)
            if message.get_type() == "COMMAND_LONG":
                self._command(message)

    def step(self, now: float) -> None:
        elapsed_s, self._time_s = now - self._time_s, now
        if self.target_m is not None and self.armed:
            before_m = self.height_m
            self.height_m = min(self.target_m, self.height_m + CLIMB_M_S * elapsed_s)
            if before_m < self.target_m <= self.height_m:
                self.diary.append("at height")
        if now >= self._next_beat_s:
            self._next_beat_s = now + 1.0
            self._beat()
        if now >= self._next_position_s:
            self._next_position_s = now + 0.25
            self._position(now)

    def _send(self, name: str, **fields: object) -> None:
        self.outbox.append(self._codec.encode(make(name, **fields)))

    def _beat(self) -> None:
        base_mode = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (128 if self.armed else 0)
        self._send(
            "HEARTBEAT", type=2, autopilot=3, base_mode=base_mode, custom_mode=self.mode,
            system_status=4,
        )  # fmt: skip

    def _position(self, now: float) -> None:
        climbing = self.target_m is not None and self.height_m < self.target_m
        flying = self.height_m > 0.0
        self._send("EXTENDED_SYS_STATE", landed_state=3 if climbing else 2 if flying else 1)
        self._send(
            "GLOBAL_POSITION_INT", time_boot_ms=round(1e3 * now) + 10_000, lat=473977420,
            lon=85455940, alt=round(1e3 * (_GROUND_AMSL_M + self.height_m)),
            relative_alt=round(1e3 * self.height_m),
            vz=-100 * round(CLIMB_M_S) if climbing else 0, hdg=0,
        )  # fmt: skip

    def _command(self, message: Message) -> None:
        command = int(message.command)
        results = self.answers.get(command, (ACCEPTED,))
        if results and results[-1] == ACCEPTED:
            results = (*results[:-1], self._obey(message))
        for result in results:
            self._send(
                "COMMAND_ACK", command=command, result=result, target_system=1,
                target_component=191,
            )  # fmt: skip

    def _obey(self, message: Message) -> int:
        if message.command == SET_MODE:
            self.mode = int(message.param2)
            self.diary.append(f"mode {self.mode}")
            self._beat()
        elif message.command == ARM:
            self.armed = message.param1 == 1.0
            self.diary.append("armed" if self.armed else "disarmed")
        elif message.command == TAKEOFF:
            if self.height_m > 0.0:  # a repetition: it flies already
                return int(FAILED)
            self.target_m = float(message.param7)
        return int(ACCEPTED)
