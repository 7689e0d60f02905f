"""The log of an exploration: what everybody did, and where the vehicles truly were."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from navigation_core.geometry import Vector3
from navigation_core.outcomes import OutcomeCode

NOBODY = -1
"""The vehicle that is waited for by who waits for none"""


@dataclass(frozen=True)
class Truth:
    """The true state of a vehicle.

    Attributes:
        position_enu_m: from its home.
        velocity_enu_m_s: over ground.
        on_ground: whether it stands.
        armed: by its firmware.
        mode: the firmware's name of the mode.
        collided: whether it has hit an obstacle.
        clearance_m: distance from its centre to the nearest obstacle; infinite without one.
        mission: latitude and longitude (1e7 degrees) of the items stored in it, without home.
        yaw_enu_rad: heading, counterclockwise from east.
    """

    position_enu_m: Vector3
    velocity_enu_m_s: Vector3
    on_ground: bool
    armed: bool
    mode: str
    collided: bool
    clearance_m: float
    mission: tuple[tuple[int, int], ...] = ()
    yaw_enu_rad: float = 0.0


@dataclass(frozen=True)
class Asked:
    """A client's goal: accepted (with an id) or rejected, by a server that knew a position."""

    goal_id: str
    request: Any
    rejection: Any
    located: bool


@dataclass(frozen=True)
class PayloadAsked:
    """A client's request to the gimbal ("point") or the camera ("photo")."""

    number: int
    what: str


@dataclass(frozen=True)
class PayloadEnded:
    """The answer to it."""

    number: int
    what: str
    code: OutcomeCode
    message: str


@dataclass(frozen=True)
class Met:
    """Where another aircraft truly is that a vehicle meets.

    Attributes:
        number: which of several.
        reported_s: since when it is reported to the vehicle.
        position_enu_m: from the vehicle's home.
        velocity_enu_m_s: over ground.
    """

    number: int
    reported_s: float
    position_enu_m: Vector3
    velocity_enu_m_s: Vector3


@dataclass(frozen=True)
class Entry:
    """One line.

    Attributes:
        time_s: simulated time.
        craft: which vehicle.
        kind: "truth", "asked", "sent" (a message of the server), "output" (of the bridge),
            "happening" (an event of the scenario), "server" ("started", "killed", "failed"),
            "waits" (the vehicle that it waits for by its server's picture of the traffic, from 0;
            -1 for none), "target" and "mark" (where it truly is that is followed, or that is seen
            and landed on), "intruder" (another aircraft), "size" (the largest container of the
            server: its name and length), "recorded" (the ends of goals as a recording has them:
            code and message by id).
        value: what.
    """

    time_s: float
    craft: int
    kind: str
    value: Any


@dataclass
class Log:
    """All entries, in order, and their hash.

    Attributes:
        watch: is given each.
    """

    entries: list[Entry] = field(default_factory=list)
    watch: Callable[[Entry], None] = lambda _: None
    _hash: Any = field(default_factory=hashlib.sha256)

    def add(self, time_s: float, craft: int, kind: str, value: Any, text: str = "") -> Entry:
        """Append an entry; ``text`` stands for its value in the hash."""
        entry = Entry(time_s, craft, kind, value)
        self.entries.append(entry)
        self._hash.update(f"{time_s:.3f} {craft} {kind} {text or value!r}\n".encode())
        self.watch(entry)
        return entry

    @property
    def digest(self) -> str:
        """The hash of all entries: equal for equal flights."""
        return str(self._hash.hexdigest())[:16]
