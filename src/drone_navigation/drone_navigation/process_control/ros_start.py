"""Starts ROS in a process; what prevents it, as a missing enclave does, is one sentence."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from rclpy.impl.implementation_singleton import rclpy_implementation

from drone_navigation.process_control.quiet_start import RosStartError

__all__ = ["starting_ros"]

# The middleware logs no reason, or before, in words of its own.
_OF_SECURITY = (
    " ROS_SECURITY_ENABLE is 'true': a keystore is for the ROS_DOMAIN_ID it was made with, and the "
    "middleware has to be built with security."
)


@contextmanager
def starting_ros() -> Iterator[None]:
    """Surround what begins with ROS: its initialization, and the process's node.

    Raises:
        RosStartError: ROS or its middleware raised an error there.
    """
    try:
        yield
    except rclpy_implementation.RCLError as error:
        reason = str(error).strip().splitlines()[0].rstrip(".,")
        hint = _OF_SECURITY if os.environ.get("ROS_SECURITY_ENABLE") == "true" else ""
        raise RosStartError(f"ROS cannot start: {reason}.{hint}") from error
