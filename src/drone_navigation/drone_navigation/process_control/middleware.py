"""Checks the middleware that the environment names before rclpy is imported, which ends by it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

__all__ = ["middleware_problem"]

_INDEX = "share/ament_index/resource_index/rmw_typesupport"


def middleware_problem(environment: Mapping[str, str]) -> str | None:
    """Return why ROS cannot start with the middleware and the security that variables ask for.

    Args:
        environment: of the process.

    Returns:
        A sentence, or None.
    """
    name = environment.get("RMW_IMPLEMENTATION", "")
    prefixes = [prefix for prefix in environment.get("AMENT_PREFIX_PATH", "").split(":") if prefix]
    found = {path.name for prefix in prefixes for path in Path(prefix, _INDEX).glob("rmw_*")}
    found.discard("rmw_implementation")
    if name and found and name not in found:
        return (
            f"RMW_IMPLEMENTATION is '{name}', but this ROS has {', '.join(sorted(found))}: unset "
            "it, or install that middleware beside a sourced ROS."
        )
    enforced = environment.get("ROS_SECURITY_STRATEGY") == "Enforce"
    if environment.get("ROS_SECURITY_ENABLE") == "true" and enforced:
        keystore = environment.get("ROS_SECURITY_KEYSTORE", "")
        if not Path(keystore, "enclaves").is_dir() or not keystore:
            return (
                "ROS_SECURITY_STRATEGY is 'Enforce', but ROS_SECURITY_KEYSTORE "
                + (f"'{keystore}' has no folder enclaves" if keystore else "is not set")
                + ": make a keystore with 'ros2 security create_keystore'."
            )
    return None
