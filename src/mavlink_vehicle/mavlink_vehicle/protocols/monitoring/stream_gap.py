"""Notices gaps of the setpoints that the vehicle is flown by, ours or another computer's."""

from __future__ import annotations

import math

from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.state.restarts import evolve
from mavlink_vehicle.state.vehicle_state import VehicleState

# PX4 takes the stream for lost after COM_OF_LOSS_T (1 s); the link's jitter comes on top.
STREAM_GAP_S = 0.8
# A setpoint stream that ended longer ago belonged to another flight.
_STREAM_OVER_S = 10.0


class StreamGap:
    """Marks the state of a vehicle that may have left its mode because no setpoint came.

    Attributes:
        heard_s: when the vehicle was heard last; `heard` need not be called for a message that
            does not show the mode and comes within `STREAM_GAP_S` of it.
    """

    def __init__(self) -> None:
        """Begin before any message."""
        self.heard_s = self._setpoint_s = -math.inf

    def heard(
        self, state: VehicleState, profile: Profile | None, shows_mode: bool, now: float
    ) -> VehicleState:
        """Return the state with a gap, if any, before a message is processed.

        Args:
            state: the state until now.
            profile: the vehicle's.
            shows_mode: whether the message shows the mode.
            now: time in seconds.
        """
        silent = now - self.heard_s > STREAM_GAP_S
        self.heard_s = now
        return self._marked(state, profile, silent, now) if silent or shows_mode else state

    def sent(self, state: VehicleState, profile: Profile | None, now: float) -> VehicleState:
        """Return the state with a gap, if any, that a setpoint ends; it goes out now."""
        if now - self._setpoint_s > STREAM_GAP_S:
            state = self._marked(state, profile, False, now)
        self._setpoint_s = now
        return state

    def _marked(
        self, state: VehicleState, profile: Profile | None, silent: bool, now: float
    ) -> VehicleState:
        """Return the state with a gap, if any.

        There is one when none went out for a time, and perhaps when nothing was heard for it.
        """
        last_s = now - self._setpoint_s
        if profile is None or profile.setpoints.prestream_s == 0.0 or last_s > _STREAM_OVER_S:
            return state
        if not (silent or last_s > STREAM_GAP_S):
            return state
        if state.custom_mode != profile.control_number:
            return state
        return evolve(state, {"signs": state.signs._replace(stream_s=now)})
