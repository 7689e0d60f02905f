"""``ros2 interface``, ``ros2 pkg`` and ``ros2 run``: what is installed; they need no node."""

from __future__ import annotations

import argparse
import os
import re
from pathlib import Path

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
    get_packages_with_prefixes,
)
from ament_index_python.resources import get_resource, get_resources

from drone_navigation.ros2.session import CommandError

__all__ = ["list_interfaces", "list_packages", "run", "show_interface"]

_KINDS = {"msg": "Messages", "srv": "Services", "action": "Actions"}
# The type of a field, if it is a message of a package or of the same one.
_NESTED = re.compile(r"(?:([a-z][a-z0-9_]*)/(?:msg/)?)?([A-Z]\w*)(?:\[[^\]]*\])?\s+\w")


def list_interfaces(_: argparse.Namespace) -> int:
    """Print the names of all interfaces."""
    files = {
        f"{package}/{file.rpartition('.')[0]}"
        for package in get_resources("rosidl_interfaces")
        for file in get_resource("rosidl_interfaces", package)[0].splitlines()
    }
    for kind, title in _KINDS.items():
        print(f"{title}:")
        for name in sorted(name for name in files if f"/{kind}/" in name):
            print(f"    {name}")
    return 0


def show_interface(options: argparse.Namespace) -> int:
    """Print the definition of an interface, with those of the messages in it."""
    parts = options.type.split("/")
    if len(parts) != 3 or parts[1] not in _KINDS:
        raise CommandError(f"Invalid name '{options.type}': it has three parts, as pkg/msg/Name")
    _show(parts, "" if options.no_comments else "#", options.all_comments)
    return 0


def _show(parts: list[str], comments: str, all_comments: bool, indent: str = "") -> None:
    package, kind, name = parts
    for line in _definition(package, kind, name).read_text("utf-8").splitlines():
        bare = line.partition("#")[0].rstrip()
        text = line.rstrip() if comments else bare
        if text or comments:
            print(f"{indent}{text}" if text else "")
        nested = _NESTED.match(bare)
        if nested is not None:
            below = [nested[1] or package, "msg", nested[2]]
            _show(below, "#" if all_comments else "", all_comments, f"{indent}\t")


def _definition(package: str, kind: str, name: str) -> Path:
    try:
        file = Path(get_package_share_directory(package), kind, f"{name}.{kind}")
    except (PackageNotFoundError, ValueError):
        raise CommandError(f"Unknown package '{package}'") from None
    if not file.is_file():
        raise CommandError(f"Could not find the interface '{package}/{kind}/{name}'")
    return file


def list_packages(_: argparse.Namespace) -> int:
    """Print the names of all packages."""
    print("\n".join(sorted(get_packages_with_prefixes())))
    return 0


def run(options: argparse.Namespace) -> int:
    """Become an executable of a package."""
    try:
        folder = Path(get_package_prefix(options.package), "lib", options.package)
    except (PackageNotFoundError, ValueError):
        raise CommandError(f"Package '{options.package}' not found") from None
    path = folder / options.executable
    if "/" in options.executable or not (path.is_file() and os.access(path, os.X_OK)):
        raise CommandError(f"No executable found: '{options.executable}' of {options.package}")
    os.execv(path, [str(path), *options.arguments])
