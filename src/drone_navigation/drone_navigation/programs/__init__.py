"""Flying from Python, without the words of ROS: `Vehicle` for asyncio, `BlockingVehicle` without.

`goal_messages.py` holds what is pure; `server_link.py` is ROS, in a thread of its own;
`flown_goal.py`, `steering.py` and `async_vehicle.py` are the side of the event loop.
"""

from __future__ import annotations

from drone_navigation.programs.async_vehicle import AsyncVehicle as Vehicle
from drone_navigation.programs.blocking_vehicle import BlockingVehicle
from drone_navigation.programs.errors import NavigationError
from drone_navigation.programs.reported_state import ReportedState

__all__ = ["BlockingVehicle", "NavigationError", "ReportedState", "Vehicle"]
