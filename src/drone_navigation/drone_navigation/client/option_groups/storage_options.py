"""The command lines of ``navigation_client fence``, ``rally`` and ``parameters``."""

from __future__ import annotations

import argparse
from pathlib import Path

STORAGE_COMMANDS = {
    "fence": "show, set or remove the fence that the autopilot stores",
    "rally": "show, set or remove its rally points",
    "parameters": "list, get, set, save or load the autopilot's parameters",
}
STORAGE_CODES = """\
exit codes:
  0  done
  1  some parameters are unknown to the autopilot, or were not changed
  2  invalid command line or file; nothing was sent
  3  rejected or failed, with the reason
  4  canceled
  5  no server, or it did not answer"""

# The operands of each verb of `parameters`.
_OPERANDS = {
    "list": (),
    "get": ("NAME",),
    "set": ("NAME", "VALUE"),
    "save": ("FILE",),
    "load": ("FILE",),
}
_VERBS = """\
list, get NAME, set NAME VALUE, save FILE or load FILE. A name that ends in .params is a file of
QGroundControl, one that ends in .parm of MAVProxy"""


def add_storage(parser: argparse.ArgumentParser, command: str) -> None:
    """Add what a command has besides the options of all."""
    if command == "parameters":
        parser.add_argument("verb", choices=tuple(_OPERANDS), help=_VERBS)
        parser.add_argument("operands", nargs="*", metavar="FILE", help="arguments of the verb")
        parser.add_argument(
            "--while-armed",
            action="store_true",
            help="with set and load: also while the vehicle is armed or a goal is active; "
            "parameters can move a flying vehicle",
        )
        parser.add_argument(
            "--force", action="store_true", help="with save: replace a file that exists"
        )
        return
    what = parser.add_mutually_exclusive_group()
    formats = {"fence": ".fen, .poly", "rally": ".ral"}[command]
    what.add_argument(
        "--plan",
        "--file",
        type=Path,
        metavar="FILE",
        help=f"set those of a file: .plan of QGroundControl, QGC WPL, {formats} of Mission Planner "
        "and MAVProxy",
    )
    what.add_argument("--clear", action="store_true", help="remove what is stored")


def check_storage(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """End the program with a message where the words do not fit the verb."""
    if options.command != "parameters":
        return
    operands = _OPERANDS[options.verb]
    if len(options.operands) != len(operands):
        parser.error(f"give: {' '.join(('parameters', options.verb, *operands))}")
    options.name = options.value = options.file = None
    for name, given in zip(operands, options.operands, strict=True):
        setattr(options, name.lower(), given)
    if options.file is not None:
        options.file = Path(options.file)
    if options.value is not None:
        try:
            options.value = float(options.value)
        except ValueError:
            parser.error(f"'{options.value}' is not a number.")
