"""The files of a vehicle as a ground station sees them: its logs, what was put there, and others.

Paths begin with a slash, or with an at sign where they name what an ArduPilot makes itself.
"""

from __future__ import annotations

import errno
import posixpath
from abc import ABC, abstractmethod
from collections.abc import Mapping
from datetime import datetime, timezone
from typing import TYPE_CHECKING

from mavlink_sitl.mavlink.files import component_metadata, packed_parameters
from mavlink_sitl.mavlink.files.storage import Contents, Storage, StorageError, Stored

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.common.commander import Commander
    from mavlink_sitl.mavlink.logs.logbook import Logbook


class FileSystem(ABC):
    """The files and folders of a vehicle, as MAVLink FTP shows them; common to both firmwares.

    Attributes:
        storage: what may be changed.
    """

    own_folders: tuple[str, ...] = ()
    """Those that are always there, without those above them"""

    def __init__(self, card: Logbook, vehicle: Commander) -> None:
        self.storage: Storage = card.storage
        self._card = card
        self._vehicle = vehicle

    def clean(self, path: str) -> str:
        """The path as it is known here."""
        return posixpath.normpath(f"/{path}").replace("//", "/")

    @abstractmethod
    def own_files(self) -> Mapping[str, bytes | bytearray]:
        """The read-only files of the firmware, by path."""

    def folders(self) -> set[str]:
        """All folders."""
        found = {"/", *self.storage.folders}
        for folder in (*self.own_folders, *map(posixpath.dirname, self.own_files())):
            above = folder
            while above not in found:
                found.add(above)
                above = posixpath.dirname(above)
        return found

    def files(self) -> dict[str, bytes | bytearray]:
        """All files by path."""
        return {**self.storage.files, **self.own_files()}

    def entries(self, path: str) -> list[str]:
        """The entries of a folder in the format of ListDirectory.

        Raises:
            StorageError: there is no such folder.
        """
        folder = self.clean(path)
        folders = self.folders()
        if folder not in folders:
            raise StorageError(errno.ENOENT)
        found = ["D.", "D.."]
        found += [f"D{posixpath.basename(one)}" for one in sorted(folders) if _is_in(one, folder)]
        for name, data in sorted(self.files().items()):
            if _is_in(name, folder):
                found.append(f"F{posixpath.basename(name)}\t{len(data)}")
        return found

    def open(self, path: str) -> Contents:
        """A file to be read.

        Raises:
            StorageError: there is none.
        """
        path = self.clean(path)
        data = self.files().get(path)
        if data is None:
            raise StorageError(errno.EISDIR if path in self.folders() else errno.ENOENT)
        return Stored(data)

    def writable(self, path: str, new: bool = False) -> str:
        """The path of what may be changed.

        Args:
            path: as it was received.
            new: the folder has to be there.

        Raises:
            StorageError: it may not be changed.
        """
        path = self.clean(path)
        if path in self.own_files() or path in self.folders() - self.storage.folders:
            raise StorageError(errno.EACCES)
        if new and posixpath.dirname(path) not in self.folders():
            raise StorageError(errno.ENOENT)
        return path


class ArduPilotFileSystem(FileSystem):
    """An ArduPilot's: also @PARAM, to be read."""

    own_folders = ("/APM/LOGS",)

    def clean(self, path: str) -> str:
        """See `FileSystem`."""
        return path if path.startswith("@") else super().clean(path)

    def own_files(self) -> Mapping[str, bytes | bytearray]:
        """The logs."""
        logs = enumerate(self._card.logs, 1)
        return {f"/APM/LOGS/{number:08}.BIN": log.data for number, log in logs}

    def open(self, path: str) -> Contents:
        """See `FileSystem`."""
        name, _, asked = path.partition("?")
        if name == packed_parameters.PATH:
            parameters = self._vehicle.parameters
            return packed_parameters.PackedParameters(parameters, packed_parameters.query(asked))
        return super().open(path)

    def writable(self, path: str, new: bool = False) -> str:
        """See `FileSystem`."""
        if path.startswith("@"):
            raise StorageError(errno.EACCES)
        return super().writable(path, new)


class Px4FileSystem(FileSystem):
    """A PX4's: changes are allowed on its card only."""

    own_folders = ("/fs/microsd/log", component_metadata.FOLDER)
    card = "/fs/microsd/"

    def own_files(self) -> Mapping[str, bytes | bytearray]:
        """The logs and the metadata."""
        found: dict[str, bytes | bytearray] = {}
        for number, log in enumerate(self._card.logs):
            name = f"sess{number:03}/log100.ulg"
            if log.begun_unix_s:
                begun = datetime.fromtimestamp(log.begun_unix_s, timezone.utc)
                name = begun.strftime("%Y-%m-%d/%H_%M_%S.ulg")
            found[f"/fs/microsd/log/{name}"] = log.data
        return {**found, **component_metadata.files(self._vehicle.parameters.table)}

    def writable(self, path: str, new: bool = False) -> str:
        """See `FileSystem`."""
        path = self.clean(path)
        if not path.startswith(self.card):
            raise StorageError(errno.EROFS)
        return super().writable(path, new)


def _is_in(path: str, folder: str) -> bool:
    return path != "/" and posixpath.dirname(path) == folder
