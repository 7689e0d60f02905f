"""Generator of ``completion.bash``, the bash completion of the project's commands.

Run by the set-up; ``setup.bash`` reads the file in an interactive shell.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import shtab

from drone_navigation import navigation_target, tlog2mcap
from drone_navigation.client import options as client_options
from drone_navigation.console import options as console_options
from drone_navigation.server import options as server_options
from flight_logs import export_command
from flight_reports import navigation_report


def make_client_parser() -> argparse.ArgumentParser:
    """Return the client's command line with its commands as sub-parsers, as one to complete."""
    parser = client_options.make_parser()
    commands = parser.add_subparsers()
    for name, what in client_options.COMMANDS.items():
        own = client_options.make_command_parser(name)
        commands.add_parser(name, help=what, parents=[own], add_help=False)
    return parser


def completion() -> str:
    """Return the bash script for all commands that entering the environment brings."""
    parsers = (
        make_client_parser(),
        server_options.make_parser(),
        console_options.make_parser(),
        navigation_target.make_parser(),
        navigation_report.make_parser(),
        tlog2mcap.make_parser(),
        export_command.make_parser(),
    )
    return "\n".join(shtab.complete(_with_files(parser), "bash") for parser in parsers)


def _with_files(parser: argparse.ArgumentParser) -> argparse.ArgumentParser:
    for action in parser._actions:
        if action.type is Path or action.metavar == "FILE":
            action.complete = shtab.FILE  # type: ignore[attr-defined]
    return parser


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(completion(), encoding="ascii")
