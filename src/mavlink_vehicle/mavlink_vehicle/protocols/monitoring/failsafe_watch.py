"""Reports the begin and the end of a failsafe, with its kind.

The HEARTBEAT that shows a failsafe and the text that says which one come in either order. So a
failsafe without a known kind is reported half a second later, with what is known by then.
"""

from __future__ import annotations

from mavlink_vehicle.events import FailsafeBegan, FailsafeEnded, FailsafeKind
from mavlink_vehicle.protocols.service import VehicleService
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.state.warning_signs import Failsafe

_TEXTS_S = 0.5


class FailsafeWatch(VehicleService):
    """Follows `VehicleState.failsafe`.

    Attributes:
        deadline_s: when the texts have had their time; None without a failsafe to report.
    """

    def __init__(self) -> None:
        """Begin without one."""
        super().__init__()
        self._now: Failsafe | None = None
        self._reported: FailsafeKind | None = None

    def state_changed(self, before: VehicleState, state: VehicleState, now: float) -> None:
        """Process what the state says now."""
        if state.failsafe is not before.failsafe:
            self.observe(state.failsafe, now)

    def observe(self, failsafe: Failsafe | None, now: float) -> None:
        """Process what the state says now."""
        self._now = failsafe
        if failsafe is None:
            self.deadline_s = None
            if self._reported is not None:
                self.events.append(FailsafeEnded(self._reported))
                self._reported = None
        elif failsafe.kind is not FailsafeKind.OTHER:
            self._report(failsafe)
        elif self._reported is None and self.deadline_s is None:
            self.deadline_s = now + _TEXTS_S

    def _on_deadline(self, now: float) -> None:
        """Report what is known by now."""
        if self._now is not None:
            self._report(self._now)

    def _report(self, failsafe: Failsafe) -> None:
        self.deadline_s = None
        if self._reported is not failsafe.kind:
            self._reported = failsafe.kind
            self.events.append(FailsafeBegan(failsafe.kind, failsafe.text))
