"""Outputs of the bridge about the autopilot's own logs. No ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from mavlink_vehicle.events import StoredLog
from navigation_core.outcomes import OutcomeCode


@dataclass(frozen=True)
class LogsFound:
    """The list that a request asked for; `LogRequestDone` follows.

    Attributes:
        number: of the request.
        logs: by their numbers.
        newest: the log of the last flight; None without a log.
        system_id: MAVLink system of the vehicle.
        suffix: of files of this firmware's format.
    """

    number: int
    logs: tuple[StoredLog, ...]
    newest: StoredLog | None
    system_id: int
    suffix: str


@dataclass(frozen=True)
class LogBytes:
    """The next bytes of the log that a request downloads."""

    number: int
    offset_bytes: int
    data: bytes


@dataclass(frozen=True)
class LogRequestDone:
    """The end of a request; each has one."""

    number: int
    code: OutcomeCode
    message: str


LogOutput: TypeAlias = LogsFound | LogBytes | LogRequestDone
