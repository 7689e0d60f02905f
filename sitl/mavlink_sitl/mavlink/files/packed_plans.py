"""ArduPilot's @MISSION: the mission, the fence and the rally points as files.

Read in AP_Filesystem_Mission.cpp: a header, then the items as MISSION_ITEM_INT has them.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from mavlink_sitl.autopilot.plans.plans import PlanItem, PlanType

FOLDER = "@MISSION"
NAMES = {"mission.dat": PlanType.MISSION, "fence.dat": PlanType.FENCE, "rally.dat": PlanType.RALLY}
MAGIC = 0x763D
_HEADER = struct.Struct("<HHHHH")
_ITEM = struct.Struct("<4f2if2H6B")


def pack(items: Sequence[PlanItem], plan_type: PlanType) -> bytes:
    """The file."""
    head = _HEADER.pack(MAGIC, plan_type, 0, 0, len(items))
    return head + b"".join(
        _ITEM.pack(
            *item.params, item.x, item.y, item.z, seq, item.command,
            0, 0, item.frame, 0, item.autocontinue, plan_type,
        )
        for seq, item in enumerate(items)
    )  # fmt: skip
