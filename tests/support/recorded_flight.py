"""A simulated flight that is recorded as the server records: both directions, and the notes."""

from __future__ import annotations

from pathlib import Path

from drone_navigation import notes
from drone_navigation.goal import Annotation
from mavlink_vehicle.codec import Codec, with_source
from mavlink_vehicle.io.tlog import TlogWriter
from tests.support.simulated_flight import SimulatedFlight

EPOCH_S = 1_700_000_000.0
"""When the simulated recorder's clock began."""


class Recorder:
    """Writes what one flight says from now on, at the flight's time."""

    def __init__(self, flight: SimulatedFlight, path: Path) -> None:
        """Begin; :meth:`close` must follow."""
        self._flight = flight
        self._writer = TlogWriter(path)
        self._notes = Codec(1, notes.COMPONENT_ID)
        flight.codec.frame_observer = self._write
        flight.on_sent = self._write
        flight.on_output = self._note

    def close(self) -> None:
        """End the recording."""
        self._writer.close()

    def _write(self, frame: bytes) -> None:
        self._writer.write(frame, EPOCH_S + self._flight.now)

    def _note(self, output: object) -> None:
        if isinstance(output, Annotation):
            system_id = self._flight.vehicle.state.system_id or 1
            note = with_source(output.message, system_id, notes.COMPONENT_ID)
            self._write(self._notes.encode(note))
