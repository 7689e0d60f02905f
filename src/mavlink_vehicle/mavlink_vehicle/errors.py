"""Errors of this package; each carries a sentence that says what to do.

They mean a mistake in the program or its configuration, or a link that cannot be opened.
An action or a rejection of an autopilot is never an exception; it is an event (see `events`).
"""

from __future__ import annotations


class VehicleError(Exception):
    """Base of all errors of `mavlink_vehicle`."""


class MessageError(VehicleError):
    """A message that cannot be built: unknown name or field, or a value that does not fit."""


class SetpointError(VehicleError):
    """A setpoint that must not be sent: not finite, not legal for the vehicle, or not now."""


class LinkError(VehicleError):
    """A link that is badly written or cannot be opened or used, or whose key cannot be read."""


class SettingError(VehicleError):
    """A setting that makes no sense."""


class ProtocolError(VehicleError):
    """A transition that a protocol's table does not hold: a mistake in this package."""


class DriverError(VehicleError):
    """The driver thread is not running, does not answer, or gave up."""
