"""The autopilots' own logs: DataFlash of ArduPilot, ULog of PX4, retold as MAVLink telemetry."""
