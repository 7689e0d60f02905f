"""Text files that somebody wrote or saved: routes, parameters, obstacles."""

from __future__ import annotations

from pathlib import Path

_SIZE_MAX_BYTES = 10_000_000


def read_text(path: Path, error_type: type[ValueError], encoding: str = "utf-8") -> str:
    """Read a text file.

    Args:
        path: the file.
        error_type: raised if it cannot be read.
        encoding: "utf-8-sig" passes over the mark that some programs begin a file with.
    """
    try:
        if path.stat().st_size > _SIZE_MAX_BYTES:
            raise error_type(f"{path}: larger than {_SIZE_MAX_BYTES // 1_000_000} MB.")
        return path.read_text(encoding=encoding)
    except OSError as error:
        raise error_type(f"{path}: {error.strerror or error}.") from None
    except UnicodeDecodeError:
        raise error_type(f"{path}: not a text file.") from None
