"""Result of a flight that shows whether a computer is fast enough; known without the simulator."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Trial"]


@dataclass(frozen=True)
class Trial:
    """The measurements.

    Attributes:
        seconds: how long it flew.
        vehicles: how many.
        setpoint_rate_hz: the first one's rate of setpoints.
        setpoints: how many were sent by all.
        late_p50_ms: half of the setpoints left within this time after they were due.
        late_p99_ms: 99 of 100 did.
        late_worst_ms: all did.
        plans: how many searches for a path ended.
        plan_p50_ms: half of them took less.
        plan_worst_ms: the longest.
        simulator_late_s: how far simulated time was behind at most.
        processor_share: processor time per second, simulator included; above 1: several cores.
        others_cores: processor time per second of all other programs; 1.0 is a whole core.
        memory_bytes: most memory that the process had.
        ended: the code of the first goal that ended before the time was over; empty if none did.
    """

    seconds: float
    vehicles: int
    setpoint_rate_hz: float
    setpoints: int
    late_p50_ms: float
    late_p99_ms: float
    late_worst_ms: float
    plans: int
    plan_p50_ms: float
    plan_worst_ms: float
    simulator_late_s: float
    processor_share: float
    others_cores: float
    memory_bytes: int
    ended: str
