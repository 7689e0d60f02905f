"""A program's own arguments, without those of ROS."""

from __future__ import annotations

import sys
from pathlib import Path

from rclpy.utilities import remove_ros_args

__all__ = ["own_arguments"]

_USAGE = 2


def own_arguments(argv: list[str]) -> list[str]:
    """Return the arguments of a program that are not those of ROS, without its name.

    A mistake in the others ends the program with a sentence and the exit code 2.

    Args:
        argv: the name of the program and all arguments.
    """
    try:
        return list(remove_ros_args(argv)[1:])
    # rclpy's two exceptions for this, UnknownROSArgsError and RCLInvalidROSArgsError, have no
    # public name.
    except RuntimeError as error:
        reason = str(error).strip().partition(", at ")[0].rstrip(".")
        print(
            f"{Path(argv[0]).stem}: invalid ROS arguments: {reason}. What follows --ros-args is "
            "for ROS, up to a --; give the program's own arguments before it.",
            file=sys.stderr,
        )
        sys.exit(_USAGE)
