"""Errors of this package; each carries a sentence that says what to do."""

from __future__ import annotations


class LogError(Exception):
    """Base of all errors of `flight_logs`: a log that can't be read, or a request without sense."""


class EmptyLogError(LogError):
    """The file has no bytes."""


class NotATlogError(LogError):
    """The file holds no MAVLink packets."""


class RawStreamError(LogError):
    """The file holds MAVLink packets one after the other, without the time before each."""


class SwappedStampsError(LogError):
    """The times are little-endian; a tlog's are big-endian."""


class ExportError(LogError):
    """The messages cannot be written."""


class MissingPackageError(LogError):
    """A package that only this needs is not installed."""
