"""Agents that propose flights, and the person who confirms them: ``navigation_mcp``."""

from __future__ import annotations

from drone_navigation.process_control.quiet_start import run_program

# isort: split
import argparse
import asyncio
import getpass
import os
import signal
import sys
import tempfile
import uuid
from importlib import metadata
from pathlib import Path
from typing import Any

from drone_navigation.agents.confirmations import FolderError, ask_all, confirming
from drone_navigation.agents.proposals import ProposalBook
from drone_navigation.agents.rules import AgentRules, RulesError, find_agent, read_rules
from drone_navigation.agents.tool_calls import ToolCalls
from drone_navigation.agents.vehicle_hands import VehicleHands
from drone_navigation.agents.vehicle_view import VehicleView
from drone_navigation.process_control.stop_signals import leave
from drone_navigation.programs.async_vehicle import AsyncVehicle
from drone_navigation.programs.errors import NavigationError
from flight_logs.command_version import add_version
from flight_logs.errors import MissingPackageError
from flight_logs.extras import extra

EXIT_OK, EXIT_REJECTED, EXIT_USAGE, EXIT_NO_SERVER = 0, 3, 2, 5
TOKEN = "NAVIGATION_MCP_TOKEN"


def make_parser() -> argparse.ArgumentParser:
    """Return the command line."""
    parser = argparse.ArgumentParser(
        prog="navigation_mcp",
        description="Let an agent read a vehicle and propose flights, by the Model Context "
        "Protocol. Nothing that it proposes is flown before a person confirms it, or the file "
        "of rules allows it.",
    )
    add_version(parser, "drone_navigation")
    verbs = parser.add_subparsers(dest="verb", required=True)
    serve = verbs.add_parser("serve", help="serve one agent over standard input and output")
    serve.add_argument("--rules", type=Path, help="YAML file with the agents and their rules")
    serve.add_argument("--vehicle", default="", help="namespace of the vehicle")
    serve.add_argument(
        "--tlog", type=Path, metavar="PATH", help="the server's recording, or its folder, to report"
    )
    serve.add_argument(
        "--server-timeout", type=float, default=30.0, metavar="S", help="longest wait for a server"
    )
    verbs.add_parser("proposals", help="show the proposals that wait")
    for verb, text in (("confirm", "show a proposal, ask, and fly it"), ("reject", "reject one")):
        verbs.add_parser(verb, help=text).add_argument("id", metavar="ID", help="of the proposal")
    return parser


def main(args: list[str] | None = None) -> int:
    """Run the command; return the exit code."""
    return run_program("navigation_mcp", args, _main, EXIT_OK)


def _main(argv: list[str]) -> int:
    options = make_parser().parse_args(argv[1:])
    try:
        if options.verb == "serve":
            return _serve(options)
        return _decide(options)
    except (FolderError, MissingPackageError, RulesError) as error:
        print(f"navigation_mcp: {error}", file=sys.stderr)
        return EXIT_USAGE


# --- the agent -----------------------------------------------------------------------------


def _serve(options: argparse.Namespace) -> int:
    with extra("mcp", "navigation_mcp"):
        import mcp  # noqa: F401, PLC0415
    name, rules = _identity(options.rules)
    code = EXIT_OK
    try:
        asyncio.run(_serve_agent(name, rules, options))
    except NavigationError as error:
        print(f"navigation_mcp: {error.message}", file=sys.stderr)
        code = EXIT_NO_SERVER
    except asyncio.CancelledError:
        pass
    # A thread may still wait for standard input.
    leave(code)
    return code


def _identity(path: Path | None) -> tuple[str, AgentRules]:
    """Return the name of the agent that this process serves, and its rules.

    Raises:
        RulesError: the file cannot be used, or no agent in it has the token.
    """
    if path is None:
        return "agent", AgentRules("")
    import yaml  # noqa: PLC0415 - of no use to a person's commands

    try:
        rules = read_rules(yaml.safe_load(path.read_text("utf-8")))
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise RulesError(f"{path}: {error}") from None
    name = find_agent(rules, os.environ.get(TOKEN, ""))
    if name is None:
        raise RulesError(f"No agent in {path} has the token in {TOKEN}.")
    return name, rules[name]


async def _serve_agent(name: str, rules: AgentRules, options: argparse.Namespace) -> None:
    from drone_navigation.agents.stdio_server import serve  # noqa: PLC0415 - imports mcp

    task = asyncio.current_task()
    assert task is not None
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, task.cancel)
    async with AsyncVehicle(options.vehicle, options.server_timeout, leased=True) as vehicle:
        view = VehicleView(vehicle.link, options.vehicle)
        book = ProposalBook(name, rules, uuid.uuid4().hex[:6])
        with tempfile.TemporaryDirectory(prefix="navigation_mcp-") as folder:
            hands = VehicleHands(vehicle, name, view, book.finish, Path(folder), options.tlog)
            calls = ToolCalls(book, hands)
            async with confirming(calls):
                await serve(calls, metadata.version("drone_navigation"))


# --- the person ------------------------------------------------------------------------------


def _decide(options: argparse.Namespace) -> int:
    found = [each for answer in ask_all({"verb": "list"}) for each in answer.get("proposals", ())]
    if options.verb == "proposals":
        for each in found:
            print(_shown(each), end="\n\n")
        if not found:
            print("No proposal waits.")
        return EXIT_OK
    wanted = [each for each in found if each["id"] == options.id]
    if not wanted:
        print(f"No proposal {options.id} waits.", file=sys.stderr)
        return EXIT_REJECTED
    if options.verb == "confirm" and not _agrees(wanted[0]):
        print("Not confirmed; it still waits.")
        return EXIT_REJECTED
    request = {"verb": options.verb, "id": options.id, "by": getpass.getuser()}
    answers = ask_all(request)
    codes = ("UNKNOWN_PROPOSAL", None)
    why = [each["message"] for each in answers if each.get("code") not in codes]
    taken = any("proposals" in each for each in answers)
    print("Done." if taken else " ".join(why) or f"No proposal {options.id} waits.")
    return EXIT_OK if taken else EXIT_REJECTED


def _agrees(proposal: dict[str, Any]) -> bool:
    """Show a proposal and ask, on a terminal only."""
    print(_shown(proposal))
    if not sys.stdin.isatty():
        print("A proposal is confirmed on a terminal only.", file=sys.stderr)
        return False
    for answer in ask_all({"verb": "picture", "id": proposal["id"]}):
        if "picture" in answer:
            print(f"  picture: {answer['picture']}")
    return input("Type yes to fly it: ").strip() == "yes"


def _shown(proposal: dict[str, Any]) -> str:
    arms = "  ARMS the vehicle and takes off\n" if proposal["arms_and_takes_off"] else ""
    note = f"\n  {proposal['message']}" if proposal["message"] else ""
    return (
        f"{proposal['id']}, by agent {proposal['agent']}: {proposal['act']}\n{arms}"
        f"  {proposal['envelope']}\n  {proposal['rehearsed']}{note}"
    )


if __name__ == "__main__":
    sys.exit(main())
