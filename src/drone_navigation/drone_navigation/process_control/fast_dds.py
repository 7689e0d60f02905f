"""Has Fast DDS take memory for messages when there are some, unless the user has settings of it.

Each reader and writer would keep room for a hundred messages: half of what a vehicle's node takes.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

__all__ = ["small_histories"]

_PROFILES = Path(__file__).with_name("fast_dds.xml")
_BEFORE_3, _FROM_3 = "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"
_FROM_FILE = "RMW_FASTRTPS_USE_QOS_FROM_XML"
# The name of Fast DDS from 3 on, as in Kilted.
_LIBRARY = "lib/libfastdds.so*"
# Fast DDS takes a file of this name without being asked.
_FOUND = ("DEFAULT_FASTRTPS_PROFILES.xml", "DEFAULT_FASTDDS_PROFILES.xml")


def small_histories(environment: Mapping[str, str], folder: Path) -> dict[str, str]:
    """Return the variables to be set before rclpy begins; no other middleware reads them.

    Args:
        environment: of the process.
        folder: that the process is in.

    Returns:
        Nothing if the user has set one of them, or has settings of Fast DDS in the folder.
    """
    if any(name in environment for name in (_BEFORE_3, _FROM_3, _FROM_FILE)):
        return {}
    if any((folder / name).exists() for name in _FOUND):
        return {}
    prefixes = environment.get("AMENT_PREFIX_PATH", "").split(":")
    is_new = any(any(Path(prefix).glob(_LIBRARY)) for prefix in prefixes if prefix)
    return {_FROM_3 if is_new else _BEFORE_3: str(_PROFILES), _FROM_FILE: "1"}
