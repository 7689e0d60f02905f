"""Exports logs as Parquet or CSV, one file per message."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from flight_logs.columns import fields_table, flattened, to_table
from flight_logs.dialect import message_names
from flight_logs.errors import ExportError
from flight_logs.formats import Format
from flight_logs.tlog import Counts, Progress, iterate_tlog

_CHUNK_BYTES = 32 << 20  # a piece becomes a row group, and those should not be small
FIELDS_FILE = "fields.csv"
"""Beside the CSV files, which have no room for unit and enum of each column"""


@dataclass(frozen=True)
class Exported:
    """The written files and rows.

    Attributes:
        rows: how many rows the file of each message has.
        counts: what was met in the log.
    """

    rows: dict[str, int]
    counts: Counts


def export_tlog(
    path: Path | str,
    folder: Path | str,
    file_format: Format,
    *,
    messages: Collection[str] | None = None,
    enum_names: bool = False,
    progress: Progress | None = None,
) -> Exported:
    """Write the messages of a log into `folder`, over files of the same names.

    Args:
        path: the log.
        folder: where to; made when it is missing.
        file_format: of the files.
        messages: names of the messages, None for all.
        enum_names: write names of enum entries in place of numbers.
        progress: called now and then with bytes read and size of the log.

    Raises:
        LogError: the log can't be read (see `tlog.read_tlog`).
        ExportError: a file can't be written.
    """
    writers = _Writers(Path(folder), file_format)
    rows: dict[str, int] = {}
    counts = Counts()
    with writers:
        for part in iterate_tlog(path, _CHUNK_BYTES, messages=messages, progress=progress):
            counts += part.counts
            for name, records in part.items():
                writers.write(name, to_table(records, message_names()[name], enum_names))
                rows[name] = rows.get(name, 0) + len(records)
    return Exported(rows, counts)


class _Writers:
    """A writer for each message; a file is made when there is something to put into it."""

    def __init__(self, folder: Path, file_format: Format) -> None:
        self._folder = folder
        self._format = file_format
        self._open: dict[str, pa.parquet.ParquetWriter | pa.csv.CSVWriter] = {}
        self._stack = ExitStack()

    def __enter__(self) -> None:
        """Begin; nothing is written yet."""
        self._stack.__enter__()

    def __exit__(self, *error: object) -> None:
        """Complete the files."""
        with self._refused():
            self._stack.close()
            if self._format is Format.CSV and self._open:
                pa.csv.write_csv(fields_table(sorted(self._open)), self._folder / FIELDS_FILE)

    def write(self, name: str, table: pa.Table) -> None:
        with self._refused():
            if self._format is Format.CSV:
                table = flattened(table)
            if name not in self._open:
                self._folder.mkdir(parents=True, exist_ok=True)
                path = self._folder / f"{name}.{self._format.value}"
                kind = {
                    Format.PARQUET: pa.parquet.ParquetWriter,
                    Format.CSV: pa.csv.CSVWriter,
                }[self._format]
                self._open[name] = self._stack.enter_context(kind(path, table.schema))
            self._open[name].write_table(table)

    @contextmanager
    def _refused(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise ExportError(
                f"Cannot write to {self._folder}: {error.strerror or error}."
            ) from error
