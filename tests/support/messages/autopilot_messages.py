"""Messages as they come from an autopilot: encoded, sent and decoded again."""

from __future__ import annotations

from mavlink_vehicle.codec import Codec, Message, make, mavlink


class AutopilotMessages:
    """Builds what system 1, component 1 (or another) sends, with rising sequence numbers."""

    def __init__(self, system_id: int = 1, component_id: int = 1) -> None:
        self._encoder = Codec(system_id, component_id)
        self._decoder = Codec(1, 191)

    def __call__(self, name: str, **fields: object) -> Message:
        (message,) = self._decoder.decode(self._encoder.encode(make(name, **fields)))
        return message

    def heartbeat(
        self,
        mode: int = 0,
        armed: bool = False,
        status: int = 3,
        autopilot: int = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
        vehicle_type: int = mavlink.MAV_TYPE_QUADROTOR,
    ) -> Message:
        return self(
            "HEARTBEAT",
            type=vehicle_type,
            autopilot=autopilot,
            base_mode=1 | (128 if armed else 0),
            custom_mode=mode,
            system_status=status,
        )

    def ack(self, command: int, result: int, target: tuple[int, int] = (1, 191)) -> Message:
        return self(
            "COMMAND_ACK",
            command=command,
            result=result,
            target_system=target[0],
            target_component=target[1],
        )

    def position(self, time_s: float, height_m: float = 0.0, climb_m_s: float = 0.0) -> Message:
        return self(
            "GLOBAL_POSITION_INT",
            time_boot_ms=round(1e3 * time_s),
            lat=473977420,
            lon=85455940,
            alt=488000 + round(1e3 * height_m),
            relative_alt=round(1e3 * height_m),
            vz=-round(100 * climb_m_s),
            hdg=9000,
        )
