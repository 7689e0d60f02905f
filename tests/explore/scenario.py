"""Scenarios: what happens in an exploration, as data that is stored, read and shrunk."""

from __future__ import annotations

import json
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Craft:
    """One vehicle with its server.

    Attributes:
        kind: "copter", "rover", "boat" or "plane".
        autopilot: "ardupilot" or "px4".
        home: latitude and longitude (degrees), altitude above mean sea level (m).
        battery: charge at start, 0 to 1.
        onboard: autopilot parameters other than the defaults, as the recorded release names them.
        server: server parameters other than the defaults.
        search_s: how long each search for a path takes.
        chatty: whether the autopilot sends its usual streams, too, and not only what is asked for.
        signed: whether vehicle, server and ground station sign.
        sticks: whether a PX4's pilot has a transmitter, with the sticks centred at first.
        firmware: the release; empty for the recorded one.
        camera: whether it has a camera.
        gimbal: whether it has a gimbal.
        sees_traffic: whether its server keeps apart from what an ADS-B receiver reports.
        sensor: its range sensor, if that is one of ROS instead of its autopilot's: "scan", "cloud".
    """

    kind: str = "copter"
    autopilot: str = "ardupilot"
    home: tuple[float, float, float] = (-35.363261, 149.165230, 584.0)
    battery: float = 1.0
    onboard: dict[str, float] = field(default_factory=dict)
    server: dict[str, Any] = field(default_factory=dict)
    search_s: float = 0.0
    signed: bool = False
    chatty: bool = False
    sticks: bool = False
    firmware: str = ""
    camera: bool = False
    gimbal: bool = False
    sees_traffic: bool = False
    sensor: str = ""


@dataclass(frozen=True)
class Event:
    """Something that somebody does, or that goes wrong.

    Attributes:
        time_s: since all servers were ready for goals.
        craft: which vehicle, from 0.
        what: name of an action of `happenings`.
        how: its arguments.
    """

    time_s: float
    craft: int
    what: str
    how: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Post:
    """A cylinder that stands around: place (ENU, m from the first home), radius, height."""

    at_enu_m: tuple[float, float]
    radius_m: float
    height_m: float


@dataclass(frozen=True)
class Scenario:
    """A whole exploration.

    Attributes:
        seed: of noise, gusts and link faults.
        crafts: the vehicles, one server each.
        events: in the order of their times.
        posts: obstacles, sensed by the range sensors of all vehicles.
        wind_ned_m_s: steady wind.
        gust_m_s: standard deviation of the gusts.
        shares_traffic: whether the servers keep their vehicles apart, and these can collide.
    """

    seed: int
    crafts: tuple[Craft, ...] = (Craft(),)
    events: tuple[Event, ...] = ()
    posts: tuple[Post, ...] = ()
    wind_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gust_m_s: float = 0.0
    shares_traffic: bool = False

    def save(self, path: Path) -> None:
        """Write it as JSON without what has its default, one event a line."""
        lines = [f'"seed": {self.seed}']
        for name in ("crafts", "posts", "events"):
            items = [json.dumps(_told(item)) for item in getattr(self, name)]
            if items:
                lines.append(f'"{name}": [\n  ' + ",\n  ".join(items) + "\n ]")
        if repr(self.wind_ned_m_s) != repr(Scenario.wind_ned_m_s) or self.gust_m_s:
            lines.append(f'"wind_ned_m_s": {json.dumps(self.wind_ned_m_s)}')
            lines.append(f'"gust_m_s": {self.gust_m_s}')
        if self.shares_traffic:
            lines.append('"shares_traffic": true')
        path.write_text("{\n " + ",\n ".join(lines) + "\n}\n")

    @staticmethod
    def load(path: Path) -> Scenario:
        """Read what `save` wrote.

        Raises:
            ValueError: the file is not a scenario; the message names it.
        """
        try:
            data = json.loads(path.read_text())
            return Scenario(
                data["seed"],
                tuple(
                    Craft(**{**c, "home": tuple(c.get("home", Craft.home))}) for c in data["crafts"]
                ),
                tuple(Event(**event) for event in data.get("events", ())),
                tuple(
                    Post(**{**p, "at_enu_m": tuple(p["at_enu_m"])}) for p in data.get("posts", ())
                ),
                tuple(data.get("wind_ned_m_s", (0.0, 0.0, 0.0))),
                data.get("gust_m_s", 0.0),
                data.get("shares_traffic", False),
            )
        except (KeyError, TypeError, json.JSONDecodeError) as error:
            raise ValueError(f"{path} is not a scenario: {error!r}.") from error


def _told(item: Craft | Post | Event) -> dict[str, Any]:
    """Return the fields of an item that have not their defaults."""
    told = {}
    for each in fields(item):
        default = each.default if each.default_factory is MISSING else each.default_factory()
        if repr(getattr(item, each.name)) != repr(default):
            told[each.name] = getattr(item, each.name)
    return told
