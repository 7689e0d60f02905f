"""The tools of an agent by the Model Context Protocol, over standard input and output."""

from __future__ import annotations

import asyncio
import base64
import json
from collections.abc import Mapping
from typing import Any

from mcp import types
from mcp.server import Server
from mcp.server.stdio import stdio_server

from drone_navigation.agents.tool_calls import ToolCalls, tools

__all__ = ["serve"]

_INSTRUCTIONS = (
    "Flies a vehicle. Lengths are metres in the map: east, north, up. A tool that moves only makes "
    "a proposal; look at it with 'proposal' until a person has confirmed it. 'hold' stops at once."
)


async def serve(calls: ToolCalls, version: str) -> None:
    """Serve one agent until its end of the pipe is closed."""

    async def list_tools(_context: Any, _asked: Any) -> types.ListToolsResult:
        return types.ListToolsResult(
            tools=[
                types.Tool(name=each.name, description=each.description, input_schema=each.schema)
                for each in tools()
            ]
        )

    async def call_tool(_context: Any, asked: types.CallToolRequestParams) -> types.CallToolResult:
        now = asyncio.get_running_loop().time()
        reply = await calls.call(asked.name, asked.arguments, now)
        value = _finite(reply.value)
        content: list[types.ContentBlock] = [types.TextContent(type="text", text=json.dumps(value))]
        if reply.picture is not None:
            data = base64.b64encode(await asyncio.to_thread(reply.picture.read_bytes)).decode()
            content.append(types.ImageContent(type="image", data=data, mime_type="image/png"))
        return types.CallToolResult(
            content=content,
            structured_content=value,
            is_error=reply.rejected,
        )

    server: Server[Any] = Server(
        "navigation_mcp",
        version=version,
        instructions=_INSTRUCTIONS,
        on_list_tools=list_tools,
        on_call_tool=call_tool,
    )
    async with stdio_server() as (read, write):
        await server.run(read, write, server.create_initialization_options())


def _finite(value: object) -> Any:
    """Return a value as JSON has it: without NaN, tuples as lists."""
    if isinstance(value, Mapping):
        return {str(name): _finite(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    if isinstance(value, float) and value - value != 0.0:
        return None
    return value
