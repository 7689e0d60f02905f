"""Packages that one command each needs, and that running the server does without."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from flight_logs.errors import MissingPackageError


@contextmanager
def extra(package: str, what: str) -> Iterator[None]:
    """Let imports fail with a sentence that a user understands.

    Args:
        package: name of the package on the package index.
        what: that is done with it, as the sentence begins.

    Raises:
        MissingPackageError: it is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise MissingPackageError(missing(package, what)) from error


def missing(package: str, what: str) -> str:
    """Return the sentence that names a missing package and how to get it."""
    return (
        f"{what} needs the package {package}, which is not installed: run 'make setup-extras', or "
        f"'pip install {package}' where this was installed by pip."
    )
