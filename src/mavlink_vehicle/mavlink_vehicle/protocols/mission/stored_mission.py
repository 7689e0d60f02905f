"""Detects whether the stored mission is still the one that was uploaded last.

MISSION_CURRENT has the number of items and, on a PX4, the number of the mission. A report sent
before the upload was over says nothing about it, even when it arrives later or twice: so only
packets with a later place in the order of sending count. An ArduPilot also says in words
that a mission was changed in flight, which may have as many items as before.
"""

from __future__ import annotations

from collections.abc import Iterable

from mavlink_vehicle.events import StationAct
from mavlink_vehicle.mission_items import MissionRules
from mavlink_vehicle.state.telemetry import MissionProgress

_SETTLE_S = 2.0
"""Another mission in MISSION_CURRENT for this long is real, even if ours was never reported"""


class StoredMission:
    """Compares the reports of the vehicle with the mission that was stored for us."""

    def __init__(self) -> None:
        """Begin without a mission of ours."""
        self.change = ""
        """How it has become another one, to go into a sentence; empty while it is ours."""
        self._count: int | None = None
        self._rules = MissionRules()
        self._place = -1
        self._other_s: float | None = None
        self._ours: MissionProgress | None = None

    def stored(self, count: int, rules: MissionRules, place: int) -> None:
        """Our mission of this many items (without home) is stored.

        Args:
            count: number of items.
            rules: what the firmware does with missions.
            place: of the packet that confirmed it, in the vehicle's order of sending.
        """
        self.forget()
        self._count, self._rules, self._place = count, rules, place

    def forget(self) -> None:
        """There is no mission of ours any more, or not yet."""
        self.change = ""
        self._count = self._ours = self._other_s = None

    def observe(self, mission: MissionProgress, place: int) -> StationAct | None:
        """Compare a MISSION_CURRENT that has just come; place is that of its packet.

        Returns what was done to our mission, once, when it is first seen.
        """
        if self._count is None or self.change or place <= self._place:
            return None
        if mission.total == self._count and self._ours is None:
            self._ours, self._place = mission, place
        if self._ours is None and not self._is_settled(mission):
            return None
        ours = self._ours or mission._replace(total=self._count)
        self.change = _difference(ours, mission)
        if not self.change:
            return None
        removed = mission.total == 0
        return StationAct.CLEARED_MISSION if removed else StationAct.REPLACED_MISSION

    def _is_settled(self, mission: MissionProgress) -> bool:
        """Whether ours must have been replaced before it was reported once."""
        if mission.total is None:
            return False
        if self._other_s is None:
            self._other_s = mission.time_s
        return mission.time_s - self._other_s >= _SETTLE_S

    def observe_texts(self, texts: Iterable[str], place: int) -> StationAct | None:
        """Look at texts that have just come, as `observe` looks at MISSION_CURRENT."""
        opening = self._rules.change_text
        if self._ours is None or self.change or not opening or place <= self._place:
            return None
        text = next((text for text in texts if text.startswith(opening)), None)
        if text is None:
            return None
        self.change = f"the autopilot reports {text!r}"
        return StationAct.REPLACED_MISSION


def _difference(ours: MissionProgress, mission: MissionProgress) -> str:
    if mission.total == 0:
        return "MISSION_CURRENT shows that it was removed"
    if mission.total != ours.total:
        return f"MISSION_CURRENT shows {mission.total} items instead of {ours.total}"
    if mission.mission_id != ours.mission_id:
        return "MISSION_CURRENT shows that it was replaced by another one"
    return ""
