"""Between a person's terminal and the process that serves an agent: a socket of this user.

One line of JSON is asked, one is answered. The folder is open to its user only.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import socket
import stat
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from drone_navigation.agents.proposals import ToolRejection
from drone_navigation.agents.tool_calls import ToolCalls

__all__ = ["FolderError", "ask_all", "confirming"]

_LONGEST_BYTES = 65536
_ANSWER_S = 60.0
"""A picture takes a while on a slow computer"""


class FolderError(Exception):
    """The folder of the sockets is not this user's alone; the text is a sentence."""


def _folder() -> Path:
    """Return the folder of the sockets, made if necessary."""
    base = os.environ.get("XDG_RUNTIME_DIR") or "/tmp"
    folder = Path(base) / f"navigation_mcp-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) != 0o700:
        raise FolderError(f"{folder} is not this user's alone; remove it.")
    return folder


@asynccontextmanager
async def confirming(calls: ToolCalls) -> AsyncIterator[None]:
    """Take confirmations meanwhile.

    Raises:
        FolderError: they could come from others.
    """
    path = _folder() / f"{os.getpid()}.sock"
    path.unlink(missing_ok=True)

    async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError, ValueError, asyncio.TimeoutError):
            line = await asyncio.wait_for(reader.readline(), _ANSWER_S)
            now = asyncio.get_running_loop().time()
            answered = await _answer(calls, json.loads(line), now)
            writer.write(json.dumps(answered).encode() + b"\n")
            await writer.drain()
        writer.close()

    server = await asyncio.start_unix_server(answer, path, limit=_LONGEST_BYTES)
    try:
        yield
    finally:
        server.close()
        path.unlink(missing_ok=True)


async def _answer(calls: ToolCalls, asked: Any, now: float) -> Mapping[str, object]:
    verb, proposal_id, by = asked.get("verb"), str(asked.get("id")), str(asked.get("by"))
    try:
        if verb == "picture":
            return {"picture": str(await calls.picture(proposal_id, now))}
        if verb == "confirm":
            calls.confirm(proposal_id, by, now)
        elif verb == "reject":
            calls.reject(proposal_id, by, now)
        return {"proposals": calls.waiting(now)}
    except ToolRejection as error:
        return {"code": error.code, "message": error.message}


def ask_all(request: Mapping[str, object]) -> list[dict[str, Any]]:
    """Ask all processes that serve agents of this user; return their answers.

    Raises:
        FolderError: they are not this user's alone.
    """
    answers = []
    for path in sorted(_folder().glob("*.sock")):
        with socket.socket(socket.AF_UNIX) as client:
            client.settimeout(_ANSWER_S)
            try:
                client.connect(str(path))
            except ConnectionRefusedError:
                path.unlink(missing_ok=True)  # its process was killed
                continue
            client.sendall(json.dumps(request).encode() + b"\n")
            with client.makefile() as answer, contextlib.suppress(ValueError):
                answers.append(json.loads(answer.readline()))
    return answers
