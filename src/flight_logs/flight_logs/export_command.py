"""The command `tlog_export`: exports the messages of a log as Parquet or CSV."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from flight_logs.command_version import add_version
from flight_logs.errors import ExportError, LogError, MissingPackageError
from flight_logs.exit_codes import EXIT_BAD_INPUT, EXIT_FAILED, EXIT_OK
from flight_logs.extras import extra
from flight_logs.formats import Format
from flight_logs.progress import bytes_bar
from flight_logs.tlog import for_each_log

if TYPE_CHECKING:
    from flight_logs.export import Exported


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line."""
    parser = argparse.ArgumentParser(
        prog="tlog_export",
        description="Export the messages of a telemetry log (tlog), one file per message type.",
    )
    add_version(parser, "flight_logs")
    parser.add_argument("log", type=Path, nargs="+", metavar="LOG", help="the tlog, or several")
    parser.add_argument(
        "--to",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder to write to; each of several logs gets a folder of its own name in it",
    )
    parser.add_argument(
        "--format",
        choices=[kind.value for kind in Format],
        default=Format.PARQUET.value,
        help="file format (default: %(default)s)",
    )
    parser.add_argument(
        "--messages",
        type=_names,
        metavar="A,B",
        help="export only these messages, for example ATTITUDE,GPS_RAW_INT",
    )
    parser.add_argument(
        "--enum-names",
        action="store_true",
        help="write enum names instead of numbers, for example MAV_STATE_ACTIVE instead of 4",
    )
    return parser


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip().upper() for name in text.split(",") if name.strip())


def main(arguments: Sequence[str] | None = None) -> int:
    """Export; 0 when it is done, 1 when a file can't be written, 2 for bad input."""
    options = make_parser().parse_args(arguments)
    logs: list[Path] = options.log
    if len({log.stem for log in logs}) < len(logs):
        print("Two of the logs have the same name; export them one by one.", file=sys.stderr)
        return EXIT_BAD_INPUT
    try:
        return max(for_each_log(partial(_export, options), logs))
    except KeyboardInterrupt:
        print(f"Interrupted; {options.to} is not complete.", file=sys.stderr)
        return EXIT_FAILED


def _export(options: argparse.Namespace, log: Path) -> int:
    several = len(options.log) > 1
    folder = options.to / log.stem if several else options.to
    try:
        with extra("pyarrow", "An export"):
            from flight_logs.export import export_tlog  # noqa: PLC0415 its package is an extra
        with nullcontext() if several else bytes_bar(f"Reading {log.name}") as progress:
            exported = export_tlog(
                log,
                folder,
                Format(options.format),
                messages=options.messages,
                enum_names=options.enum_names,
                progress=progress,
            )
    except LogError as error:
        print(error, file=sys.stderr)
        return (
            EXIT_FAILED if isinstance(error, (ExportError, MissingPackageError)) else EXIT_BAD_INPUT
        )
    print(_summary(exported, folder))
    return EXIT_OK


def _summary(exported: Exported, folder: Path) -> str:
    counts = exported.counts
    skipped = {
        "with bad checksums": counts.bad_checksums,
        "of messages unknown to the dialect": sum(counts.unknown_messages.values()),
    }
    parts = [f"{count} {what}" for what, count in skipped.items() if count]
    if counts.bytes_outside:
        parts.append(f"{counts.bytes_outside} bytes outside packets")
    rows = sum(exported.rows.values())
    done = f"Wrote {rows} messages of {len(exported.rows)} types to {folder}."
    if not exported.rows:
        done = "The log has none of these messages; nothing was written."
    return done + (f" Skipped: {', '.join(parts)}." if parts else "")


if __name__ == "__main__":
    sys.exit(main())
