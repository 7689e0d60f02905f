"""The state and the texts that the vehicle has shown since an operation began."""

from __future__ import annotations

import math

from mavlink_vehicle.protocols.operations.operation_parts import Goal
from mavlink_vehicle.state.reducer import VehicleState


class Evidence:
    """The vehicle's state during an operation.

    Attributes:
        state: the vehicle's latest state.
        connected: whether its HEARTBEAT is fresh.
    """

    def __init__(self) -> None:
        """Begin without a state; `begin` brings it."""
        self.state = VehicleState()
        self.connected = True
        self._texts_before = 0
        self._heartbeat_from_s = -math.inf

    def begin(self, state: VehicleState, connected: bool, heartbeat_from_s: float) -> None:
        """Take the state at the beginning; what an earlier HEARTBEAT shows proves nothing."""
        self.observe(state, connected)
        self._texts_before = state.texts.count
        self._heartbeat_from_s = heartbeat_from_s

    def observe(self, state: VehicleState, connected: bool) -> None:
        """Take another state."""
        self.state, self.connected = state, connected

    def settle(self) -> None:
        """The request before this one has taken effect; from here HEARTBEATs count."""
        self._heartbeat_from_s = -math.inf

    def shows(self, goal: Goal) -> bool:
        """Return whether the state shows that the goal is reached, and is fresh enough."""
        heard_s = self.state.last_heartbeat_s
        return (
            self.connected
            and heard_s is not None
            and heard_s >= self._heartbeat_from_s
            and goal.reached(self.state)
        )

    @property
    def texts(self) -> tuple[str, ...]:
        """The STATUSTEXTs since the beginning."""
        return texts_since(self.state, self._texts_before)

    def quoted(self, sentence: str) -> str:
        """Return a sentence with the STATUSTEXTs since the beginning behind it."""
        return full_stop(sentence + quote_texts(self.state, self._texts_before))


def texts_since(state: VehicleState, count_before: int) -> tuple[str, ...]:
    """Return the STATUSTEXTs since there were that many."""
    fresh = min(state.texts.count - count_before, len(state.status_texts))
    return tuple(text.text for text in state.status_texts[-fresh:]) if fresh else ()


def quote_texts(state: VehicleState, count_before: int) -> str:
    """Return the STATUSTEXTs since then, each once, to be put behind a sentence."""
    unique = dict.fromkeys(texts_since(state, count_before))
    return "; autopilot: " + ", ".join(f'"{text}"' for text in unique) if unique else ""


def full_stop(sentence: str) -> str:
    """Return a sentence with its end."""
    return sentence if sentence.endswith((".", "!", "?")) else f"{sentence}."
