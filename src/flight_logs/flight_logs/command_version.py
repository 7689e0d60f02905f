"""The option `--version` of the project's commands."""

from __future__ import annotations

import argparse
from collections.abc import Sequence


class _PrintVersion(argparse.Action):
    """Looks the version up when it is asked for: that would cost each start 20 ms."""

    def __init__(self, option_strings: Sequence[str], dest: str, package: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help="print the version and exit")
        self._package = package

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print it; argparse calls this when the option is given."""
        from importlib.metadata import PackageNotFoundError, version  # noqa: PLC0415 - slow

        try:
            number = version(self._package)
        except PackageNotFoundError:
            number = "(not installed)"
        print(f"{parser.prog} {number}")
        parser.exit()


def add_version(parser: argparse.ArgumentParser, package: str) -> None:
    """Add `--version`, which prints the version of an installed package and exits with 0."""
    parser.add_argument("--version", action=_PrintVersion, dest=argparse.SUPPRESS, package=package)
