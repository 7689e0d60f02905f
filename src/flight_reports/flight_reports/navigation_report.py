"""The command `navigation_report`: writes a report of a recorded flight as one HTML page."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from flight_logs.command_version import add_version
from flight_logs.errors import LogError
from flight_logs.exit_codes import EXIT_BAD_INPUT, EXIT_FAILED, EXIT_OK
from flight_logs.progress import bytes_bar
from flight_logs.whole_file import whole_file
from flight_reports.analysis.flight import Flight, read_flights
from flight_reports.contents.log_reader import read_log
from flight_reports.page.comparison import comparison_page
from flight_reports.page.page import report_page


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line."""
    parser = argparse.ArgumentParser(
        prog="navigation_report",
        description="Write a report of a recorded flight as one HTML page that works offline: "
        "map, plots over time, goals, setpoint tracking, and warnings.",
        epilog="Accepts tlogs of navigation_server --tlog, MAVProxy, QGroundControl and Mission "
        "Planner, and the autopilots' own logs: .bin (ArduPilot) and .ulg (PX4). The page lists "
        "what the log does not contain.",
    )
    add_version(parser, "flight_reports")
    parser.add_argument("log", type=Path, nargs="?", metavar="LOG", help="tlog, .bin or .ulg")
    parser.add_argument(
        "--compare", type=Path, nargs=2, metavar=("A", "B"), help="overlay two flights"
    )
    parser.add_argument(
        "-o",
        "--out",
        type=Path,
        metavar="FILE",
        help="output page (default: beside LOG, with .html)",
    )
    parser.add_argument(
        "--system", type=int, metavar="N", help="only the vehicle with this MAVLink system id"
    )
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the page; 0 when it is done, 1 when it can't be written, 2 for bad input."""
    parser = make_parser()
    options = parser.parse_args(arguments)
    if (options.log is None) == (options.compare is None):
        parser.error("give one LOG, or --compare A B")
    logs: list[Path] = [options.log] if options.compare is None else options.compare
    out: Path = options.out or logs[0].with_suffix(".html" if len(logs) == 1 else ".compare.html")
    try:
        if any(out.resolve() == log.resolve() for log in logs):
            raise LogError(f"{out} is the log itself; give another file with --out.")
        flights = [_read(log, options.system) for log in logs]
        text = report_page(flights[0]) if len(logs) == 1 else _comparison(*flights)
        out.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(out) as draft:
            draft.write_text(text, "utf-8")
    except LogError as error:
        print(f"navigation_report: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except OSError as error:
        print(f"navigation_report: cannot write {out}: {error.strerror or error}.", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt:
        print(f"Interrupted; {out} was not written.", file=sys.stderr)
        return EXIT_FAILED
    print(f"Wrote {out}")
    return EXIT_OK


def _read(log: Path, system: int | None) -> list[Flight]:
    """Return the flights of a log, or of one vehicle in it.

    Raises:
        LogError: it can't be read, or has no such vehicle.
    """
    with bytes_bar(f"Reading {log.name}") as progress:
        contents = read_log(log, progress)
    vehicles = contents.vehicles()
    if not vehicles:
        raise LogError(
            f"{log} contains no vehicle: neither a HEARTBEAT of an autopilot nor a position."
        )
    if system is not None and system not in {source[0] for source in vehicles}:
        known = ", ".join(str(source[0]) for source in sorted(vehicles))
        raise LogError(f"{log} contains no system {system}; it contains {known}.")
    with bytes_bar(f"Analysing {log.name}") as progress:
        return read_flights(contents, system, progress)


def _comparison(first: list[Flight], second: list[Flight]) -> str:
    """Return the page of two flights.

    Raises:
        LogError: a log has several vehicles, and none was chosen.
    """
    for flights in (first, second):
        if len(flights) > 1:
            systems = ", ".join(str(flight.source[0]) for flight in flights)
            raise LogError(
                f"{flights[0].path} contains several vehicles ({systems}); give --system."
            )
    return comparison_page(first[0], second[0])


if __name__ == "__main__":
    sys.exit(main())
