"""The command line options and their parser."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any, NoReturn

from mavlink_sitl.autopilot.parameters import Parameters, UnknownParameterError
from mavlink_sitl.autopilot.personality.versions import RELEASES
from mavlink_sitl.config import (
    DEFAULT_HEADING_DEG,
    DEFAULT_HOME,
    ConfigurationError,
    Underway,
    VehicleConfig,
)
from mavlink_sitl.dynamics.battery import BatteryModel
from mavlink_sitl.geodesy import GeoPoint, LocalFrame
from mavlink_sitl.links.addresses import AddressError, LinkAddress, parse_address
from mavlink_sitl.links.faults import LinkFaults
from mavlink_sitl.mavlink.codec import MAVLINK_1
from mavlink_sitl.world.loader import WorldError, load_world
from mavlink_sitl.world.model import Mark, Wind, World, wind_from


class PrintVersion(argparse.Action):
    """Prints the version of the installed package and exits with 0."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **{**kwargs, "nargs": 0, "default": argparse.SUPPRESS})

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        """Print it; argparse calls this when the option is given."""
        try:
            number = version("mavlink_sitl")
        except PackageNotFoundError:
            number = "(not installed)"
        print(f"{parser.prog} {number}")
        parser.exit()


APART_M = 10.0
DEFAULT_LINK = "udpout://127.0.0.1:14550"
DEFAULT_CAMERA = "udpout://127.0.0.1:14560"
DEFAULT_PX4_LINKS = (DEFAULT_LINK, "udpout://127.0.0.1:14540")
ONBOARD_PORTS = range(14540, 14550)
"""PX4 speaks to companion computers on these, with other streams than to ground stations"""
ROLES = ("gcs", "onboard")

_DESCRIPTION = """\
A simulated MAVLink autopilot: a copter, rover, boat or plane that behaves like ArduPilot or PX4.
By default it runs in real time and sends to UDP port 14550 of this machine, on which a ground
station or a bridge listens."""

_EPILOG = """\
examples:
  python -m mavlink_sitl
  python -m mavlink_sitl --link tcpin://127.0.0.1:5760 --link udpout://127.0.0.1:14550
  python -m mavlink_sitl --speedup 10 --seed 7 --tlog flight.tlog
  python -m mavlink_sitl --fault loss=0.2,delay=0.5 --battery cells=4,capacity=5000

Stop it with Ctrl-C or SIGTERM; it then exits with 0. An invalid option prints one sentence and
exits with 2."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One sentence, without the usage in front of it."""
        sys.stderr.write(f"{self.prog}: {message}\n")
        sys.exit(2)


def _number(name: str, low: float, high: float) -> Callable[[str], float]:
    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"{name} must be a number from {low:g} to {high:g}, not {text!r}"
            )
        return value

    return parse


def _numbers(text: str, form: str) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != form.count(",") + 1 or not all(math.isfinite(v) for v in values):
        raise argparse.ArgumentTypeError(f"write {form} as numbers, not {text!r}")
    return values


def _home(text: str) -> tuple[GeoPoint, float]:
    values = _numbers(text, "LAT,LON,ALT_AMSL_M,HEADING_DEG")
    return GeoPoint(values[0], values[1], values[2]), values[3]


def _underway(text: str) -> Underway:
    north, east, up = _numbers(text, "NORTH,EAST,UP")
    return Underway((north, east, -up))


def _wind(text: str) -> Wind:
    form = "SPEED_M_S,FROM_DEG,GUST_M_S" if text.count(",") > 1 else "SPEED_M_S,FROM_DEG"
    speed, from_deg, *gust = _numbers(text, form)
    if not 0.0 <= speed <= 60.0 or not 0.0 <= sum(gust) <= 30.0:
        raise argparse.ArgumentTypeError(
            f"wind must be 0 to 60 m/s and gusts 0 to 30 m/s, not {text!r}"
        )
    return wind_from(speed, from_deg, gust_m_s=sum(gust))


def _mark(text: str) -> Mark:
    north, east = _numbers(text, "NORTH,EAST")
    return Mark((north, east))


def _camera(text: str) -> LinkAddress:
    try:
        return parse_address(text)
    except AddressError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _world(path: str) -> World:
    try:
        return load_world(path)
    except WorldError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _settings(known: dict[str, str]) -> Callable[[str], dict[str, float]]:
    """KEY=VALUE,... with the keys of `known`, renamed to its values."""

    def parse(text: str) -> dict[str, float]:
        settings = {}
        for part in text.split(","):
            key, _, value = part.partition("=")
            if key not in known:
                raise argparse.ArgumentTypeError(
                    f"{key!r} is not one of {', '.join(known)} (written {key or 'KEY'}=NUMBER)"
                )
            try:
                settings[known[key]] = float(value)
            except ValueError:
                settings[known[key]] = math.nan
            if not math.isfinite(settings[known[key]]):
                raise argparse.ArgumentTypeError(f"{key} needs a number, not {value!r}")
        return settings

    return parse


def _parameter(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.upper(), float(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f"write NAME=NUMBER, not {text!r}") from None


def _link(text: str) -> tuple[str, LinkAddress]:
    """[ROLE@]ADDRESS: the role, empty where none is given, and the address."""
    role, at, address = text.rpartition("@")
    if at and role not in ROLES:
        raise argparse.ArgumentTypeError(
            f"{role!r} is no role of a link; roles are {' and '.join(ROLES)}, as in "
            f"onboard@{DEFAULT_LINK}"
        )
    try:
        return role, parse_address(address)
    except AddressError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def make_parser() -> argparse.ArgumentParser:
    """The parser of the command line."""
    parser = _Parser(
        prog="mavlink_sitl",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add(
        "--vehicle",
        default="copter",
        metavar="KIND",
        help="copter, rover, boat or plane (default: copter)",
    )
    add(
        "--autopilot",
        metavar="FIRMWARE",
        help="ardupilot or px4 (default: that of --firmware, else ardupilot)",
    )
    add(
        "--firmware",
        choices=tuple(RELEASES),
        metavar="RELEASE",
        help=f"{', '.join(RELEASES)}: the release that it behaves like (default: ardupilot-4.7-dev "
        "or px4-1.17, which were recorded)",
    )
    add(
        "--link",
        action="append",
        type=_link,
        metavar="[ROLE@]ADDRESS",
        help="link to use: udpout://HOST:PORT (send), udpin://HOST:PORT (listen), "
        "tcpin://HOST:PORT (TCP server) or tcpout://HOST:PORT (TCP client); pymavlink's "
        f"form udpout:HOST:PORT is accepted, too; may be repeated (default: {DEFAULT_LINK}; "
        "with px4 also port 14540). ROLE is gcs or onboard, which PX4 has other streams for "
        "(default: onboard for ports 14540 to 14549, else gcs)",
    )
    add(
        "--speedup",
        type=_number("the speedup", 0.01, 1000.0),
        default=1.0,
        metavar="FACTOR",
        help="simulated seconds per second of real time, 0.01 to 1000, limited by the machine "
        "(default: 1)",
    )
    add(
        "--seed",
        type=int,
        default=0,
        help="seed for sensor noise, wind gusts and link faults (default: 0)",
    )
    add(
        "--home",
        type=_home,
        metavar="LAT,LON,ALT,HEADING",
        help="home position: degrees, degrees, metres above sea level, heading in degrees from "
        f"north (default: {DEFAULT_HOME.latitude_deg},{DEFAULT_HOME.longitude_deg},"
        f"{DEFAULT_HOME.altitude_amsl_m:g},{DEFAULT_HEADING_DEG:g})",
    )
    add(
        "--system-id",
        type=int,
        default=1,
        metavar="ID",
        help="MAVLink system id, 1 to 255 (default: 1)",
    )
    add(
        "--count",
        type=int,
        default=1,
        metavar="N",
        help="number of vehicles, placed 10 m apart towards the east, with consecutive system ids "
        "from --system-id; all share the same links (default: 1)",
    )
    add(
        "--collisions",
        action="store_true",
        help="vehicles hit each other; else they pass through each other",
    )
    add(
        "--mavlink1",
        choices=MAVLINK_1[1:],
        default="",
        help="speak MAVLink 1: until MAVLink 2 is heard, to send while hearing both, or only",
    )
    add(
        "--photo-camera",
        action="store_true",
        help="a MAVLink camera, component 100, beside a PX4 (an ArduPilot has one by CAM1_TYPE)",
    )
    add(
        "--ready-after",
        type=_number("the time until ready", 0.0, 3600.0),
        default=2.0,
        metavar="SECONDS",
        help="time from power-up until the position is known; 41.6 s on the real firmware "
        "(default: 2)",
    )
    add("--tlog", metavar="PATH", help="record the traffic of both directions as a tlog")
    add(
        "--summary",
        metavar="PATH",
        help="at the end, write the true least clearance and the collisions as JSON",
    )
    add(
        "--fault",
        type=_settings(
            {
                "loss": "loss",
                "duplicate": "duplicate",
                "delay": "delay_s",
                "jitter": "jitter_s",
                "corrupt": "corrupt",
            }
        ),
        default={},
        metavar="KEY=NUMBER,...",
        help="link faults: loss, duplicate and corrupt (fractions, 0 to 1), delay and jitter "
        "(seconds)",
    )
    add(
        "--battery",
        type=_settings(
            {
                "cells": "cells",
                "capacity": "capacity_mah",
                "resistance": "internal_resistance_ohm",
                "remaining": "remaining",
            }
        ),
        default={},
        metavar="KEY=NUMBER,...",
        help="battery: cells, capacity (mAh), resistance (ohm), remaining (0 to 1) (default: "
        "cells=3,capacity=11600,resistance=0.01,remaining=1)",
    )
    add(
        "--wind",
        type=_wind,
        metavar="SPEED,FROM[,GUST]",
        help="wind that replaces the world's: speed in m/s, direction it comes from in degrees, "
        "and standard deviation of gusts in m/s (default: none)",
    )
    add(
        "--world",
        type=_world,
        default=World(),
        metavar="FILE",
        help="YAML file of obstacles, ground, wind and sensors (see docs/sitl.md; examples in "
        "worlds/; default: flat ground, no wind)",
    )
    add(
        "--mark",
        type=_mark,
        metavar="NORTH,EAST",
        help="put a mark for landings on the ground, metres from the world's origin, in place of "
        "the world's; a camera below each vehicle looks for it (default: none)",
    )
    add(
        "--camera",
        type=_camera,
        metavar="ADDRESS",
        help="link on which the cameras report the mark, as LANDING_TARGET (default: "
        f"{DEFAULT_CAMERA} with --mark, else none)",
    )
    add(
        "--param",
        action="append",
        type=_parameter,
        default=[],
        metavar="NAME=NUMBER",
        help="set a firmware parameter, for example BATT_FS_LOW_ACT=2; may be repeated",
    )
    add(
        "--underway",
        type=_underway,
        metavar="NORTH,EAST,UP",
        help="begin there, metres from home: armed, and hovering if it flies; not for planes",
    )
    add("--quiet", action="store_true", help="print errors only")
    add("--version", action=PrintVersion, help="print the version and exit")
    return parser


def vehicle_config(options: argparse.Namespace) -> VehicleConfig:
    """The vehicle that was asked for.

    Raises:
        ConfigurationError: it cannot be.
    """
    battery = dict(options.battery)
    remaining = battery.pop("remaining", 1.0)
    if "cells" in battery:
        battery["cells"] = int(battery["cells"])
    home, heading_deg = options.home or (DEFAULT_HOME, DEFAULT_HEADING_DEG)
    try:
        faults = LinkFaults(**options.fault) if options.fault else None
        config = VehicleConfig(
            vehicle=options.vehicle,
            autopilot=options.autopilot,
            firmware=options.firmware or "",
            system_id=options.system_id,
            home=home,
            heading_deg=heading_deg,
            ready_after_s=options.ready_after,
            mavlink_1=options.mavlink1,
            photo_camera=options.photo_camera,
            parameters=dict(options.param),
            battery=BatteryModel(**battery),
            battery_remaining=remaining,
            underway=options.underway,
            faults=faults,
            links=_roles(options),
        )
        Parameters(config.personality().parameter_table, config.parameters)
    except UnknownParameterError as error:
        raise ConfigurationError(str(error)) from None
    except ConfigurationError:
        raise
    except ValueError as error:
        raise ConfigurationError(str(error)) from None
    return config


def vehicle_configs(options: argparse.Namespace) -> list[VehicleConfig]:
    """All vehicles that were asked for.

    Raises:
        ConfigurationError: they cannot be.
    """
    first = vehicle_config(options)
    last = options.system_id + options.count - 1
    if options.count < 1 or last > 255:
        raise ConfigurationError(
            f"the count must be at least 1 and the last system id at most 255, not {options.count} "
            f"from {options.system_id} on"
        )
    frame = LocalFrame(first.home, first.personality().projection)
    return [
        replace(
            first,
            system_id=options.system_id + place,
            home=frame.to_geodetic(0.0, APART_M * place, 0.0) if place else first.home,
        )
        for place in range(options.count)
    ]


def _roles(options: argparse.Namespace) -> tuple[str, ...]:
    """The role of each link, as given or by its port; only PX4 distinguishes roles."""
    if options.autopilot != "px4":
        return ("gcs",) * len(options.link)
    return tuple(
        role or ("onboard" if link.port in ONBOARD_PORTS else "gcs")
        for role, link in zip(options.roles, options.link, strict=True)
    )


def parse(arguments: Sequence[str]) -> tuple[argparse.Namespace, VehicleConfig]:
    """Read the command line; a wrong one ends the program with 2 and one sentence.

    Returns:
        The options, all vehicles among them as `vehicles`, and the first vehicle.
    """
    parser = make_parser()
    options = parser.parse_args(_joined(arguments))
    if options.autopilot is None:
        release = RELEASES.get(options.firmware)
        options.autopilot = "ardupilot" if release is None else release.autopilot
    if options.wind is not None:
        options.world = replace(options.world, wind=options.wind)
    if options.mark is not None:
        options.world = replace(options.world, mark=options.mark)
        options.camera = options.camera or parse_address(DEFAULT_CAMERA)
    elif options.camera is not None and options.world.mark is None:
        parser.error("a camera needs a mark to look for: give --mark NORTH,EAST")
    defaults = DEFAULT_PX4_LINKS if options.autopilot == "px4" else (DEFAULT_LINK,)
    links = options.link or [_link(link) for link in defaults]
    options.roles = [role for role, _ in links]
    options.link = [address for _, address in links]
    try:
        options.vehicles = vehicle_configs(options)
        return options, options.vehicles[0]
    except ConfigurationError as error:
        parser.error(str(error))


def _joined(arguments: Sequence[str]) -> list[str]:
    """`--home -35,...` as one word, since argparse takes a value with a minus for an option."""
    joined: list[str] = []
    waiting = list(arguments)
    while waiting:
        word = waiting.pop(0)
        if word in ("--home", "--wind", "--underway", "--mark") and waiting:
            word = f"{word}={waiting.pop(0)}"
        joined.append(word)
    return joined
