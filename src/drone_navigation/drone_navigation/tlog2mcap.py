"""The command `tlog2mcap`: converts a recorded flight to an MCAP file of ROS messages."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drone_navigation.bag.mcap_bag import open_bag
from drone_navigation.bag.message_definitions import DefinitionError
from drone_navigation.bag.topics import BagClock, BagError
from drone_navigation.bag.vehicle import RecordedFleet, RecordedVehicle
from flight_logs.command_version import add_version
from flight_logs.errors import LogError
from flight_logs.exit_codes import EXIT_BAD_INPUT, EXIT_FAILED, EXIT_OK
from flight_logs.frames.packets import iterate_packets
from flight_logs.progress import bytes_bar
from flight_logs.tlog import iterate_tlog
from flight_logs.vehicles import vehicle_ranks
from mavlink_vehicle.codec import Codec
from navigation_bridge.recording.replay import RecordedTime, ReplayError, play

_SUFFIX = ".mcap"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True)
class Converted:
    """The result of a conversion.

    Attributes:
        counts: messages by topic.
        time: what the recorder's clock did.
    """

    counts: dict[str, int]
    time: RecordedTime


def convert(
    log: Path,
    out: Path,
    vehicles: Sequence[tuple[int, str]] = (),
    progress: Callable[[int, int], None] | None = None,
) -> Converted:
    """Write the topics that a server had while it recorded ``log``, or would have had.

    Args:
        log: a tlog.
        out: the MCAP file; it is whole or not there, and replaces one of that name.
        vehicles: MAVLink system id and namespace of each; none for all in the log.
        progress: called with the bytes done and the size of the log.

    Raises:
        LogError: the log can't be read, or isn't a tlog.
        BagError: it has no such vehicle, or its times are none.
        DefinitionError: a package of messages is not installed.
        ReplayError: a defect of ours.
        OSError: the file can't be written.
    """
    if out.exists() and out.samefile(log):
        raise BagError(f"{out} is the log itself; give another name with --out.")
    found = _vehicles_in(log)
    systems = sorted(found)
    chosen = _choose(log, systems, vehicles)
    clock, codec = BagClock(), Codec(source_system=255, source_component=190)
    with open_bag(out) as bag:
        fleet = RecordedFleet(
            [
                RecordedVehicle((system, found[system]), name, codec, bag, clock)
                for system, name in chosen
            ],
            others=systems,
        )
        for played in play(iterate_packets(log, progress), fleet, codec, clock.time):
            if played.is_note and played.message is not None:
                fleet.take_note(played.message, played.now)
    return Converted(dict(bag.counts), clock.time)


def _vehicles_in(log: Path) -> dict[int, int]:
    """Return the vehicles in a log: MAVLink component by system id."""
    parts = [part.records("HEARTBEAT") for part in iterate_tlog(log, messages=["HEARTBEAT"])]
    return dict(vehicle_ranks(np.concatenate(parts)).keys()) if parts else {}


def _choose(
    log: Path, systems: list[int], vehicles: Sequence[tuple[int, str]]
) -> list[tuple[int, str]]:
    """Return system and namespace of the vehicles to write."""
    if not systems:
        raise BagError(f"{log} contains no vehicle (no HEARTBEAT of an autopilot).")
    for system, _ in vehicles:
        if system not in systems:
            listed = ", ".join(map(str, systems))
            raise BagError(f"{log} contains no system {system}; it contains {listed}.")
    return list(vehicles) or named(systems)


def named(systems: Sequence[int]) -> list[tuple[int, str]]:
    """Return vehicles with their namespaces: none for a single one."""
    if len(systems) == 1:
        return [(systems[0], "")]
    return [(system, f"system_{system}") for system in systems]


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line."""
    parser = argparse.ArgumentParser(
        prog="tlog2mcap",
        description="Convert a recorded flight (a tlog) to an MCAP file of ROS messages "
        "for ROS 2 tools and Foxglove.",
    )
    add_version(parser, "drone_navigation")
    parser.add_argument("log", type=Path, metavar="LOG", help="the tlog")
    parser.add_argument(
        "-o", "--out", type=Path, metavar="FILE", help="the MCAP file (default: beside the log)"
    )
    parser.add_argument(
        "--system",
        type=int,
        action="append",
        default=[],
        metavar="N",
        help="MAVLink system id of a vehicle (default: all in the log); may be repeated",
    )
    parser.add_argument(
        "--vehicle-name",
        action="append",
        default=[],
        metavar="NAME",
        help="namespace of the --system at the same position (default: none for one vehicle, "
        "system_N for several)",
    )
    return parser


def _vehicles(
    parser: argparse.ArgumentParser, systems: list[int], names: list[str]
) -> list[tuple[int, str]]:
    bad = [name for name in names if not _NAME.fullmatch(name)]
    if bad:
        parser.error(f"--vehicle-name {bad[0]}: use letters, digits and _, and begin with a letter")
    if names and len(names) != len(systems):
        parser.error("give the same number of --system and --vehicle-name")
    if len(set(systems)) < len(systems) or len(set(names)) < len(names):
        parser.error("each --system and --vehicle-name must be unique")
    return list(zip(systems, names, strict=True)) if names else named(systems)


def main(arguments: Sequence[str] | None = None) -> int:
    """Convert; 0 when it is done, 1 when the file can't be written, 2 for bad input."""
    parser = make_parser()
    options = parser.parse_args(arguments)
    log: Path = options.log
    vehicles = _vehicles(parser, options.system, options.vehicle_name)
    out: Path = options.out or log.with_suffix(_SUFFIX)
    try:
        with bytes_bar(f"Converting {log.name}") as progress:
            converted = convert(log, out, vehicles, progress)
    except (LogError, BagError) as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    except (DefinitionError, ReplayError) as error:
        print(error, file=sys.stderr)
        return EXIT_FAILED
    except OSError as error:
        print(f"Cannot write {out}: {error.strerror or error}.", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt:
        print(f"Interrupted; {out} was not written.", file=sys.stderr)
        return EXIT_FAILED
    print(_summary(converted, out))
    return EXIT_OK


def _summary(converted: Converted, out: Path) -> str:
    counts, time = converted.counts, converted.time
    topics = sum(count > 0 for count in counts.values())
    sentences = [f"Wrote {sum(counts.values())} messages of {topics} topics to {out}."]
    if not any("/_action/" in topic for topic in counts):
        sentences.append("The log contains no goals of navigation_server.")
    if not any(count for topic, count in counts.items() if topic.endswith("/pose")):
        sentences.append(
            "It has no pose: the log lacks local positions, an attitude, or positions that the "
            "estimator confirms."
        )
    if time.stepped_back:
        sentences.append(
            f"The recorder's clock stepped back {time.stepped_back} times; its times are kept."
        )
    return " ".join(sentences)


if __name__ == "__main__":
    sys.exit(main())
