"""Rules for agents, from a YAML file: who they are, how often they call, what they may do alone."""

from __future__ import annotations

import hashlib
import hmac
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from drone_navigation.agents.envelopes import ActEnvelope
from navigation_bridge.configuration.checked_values import (
    InvalidValueError,
    Kind,
    RecordMember,
    member,
    number,
    record,
    text,
    whole,
)

__all__ = ["ALONE", "AgentRules", "RulesError", "find_agent", "read_rules"]

ALONE = ("goto", "route", "orbit")
"""Acts that may be allowed without a person: in the air, from there to there"""

_NAME = re.compile(r"[a-z][a-z0-9_]{0,30}")
_HASH = re.compile(r"[0-9a-f]{64}")


class RulesError(ValueError):
    """A file of rules cannot be used; the text is a sentence."""


def _hash() -> Kind[str]:
    whole_text = text(64)

    def read(value: object) -> str:
        given = whole_text.read(value)
        if not _HASH.fullmatch(given):
            raise InvalidValueError("must be 64 hexadecimal digits, those of sha256sum.")
        return given

    return Kind(read, whole_text.schema)


def _allowed() -> Kind[Mapping[str, ActEnvelope]]:
    envelope: RecordMember[object] = RecordMember(record(ActEnvelope))
    goto, route, orbit = (envelope for _ in ALONE)
    return record(lambda **given: given, goto=goto, route=route, orbit=orbit)


@dataclass(frozen=True)
class AgentRules:
    """Rules of one agent.

    Attributes:
        token_sha256: of the token that it is started with.
        calls_per_minute: of all tools but `hold`.
        waiting_max: proposals that may wait for a person at a time.
        envelope: what no proposal may leave; None: the server's own limits.
        allow: acts that need no person, each within an envelope, in a vehicle that flies.
    """

    token_sha256: str = member(_hash(), default="", required=True)
    calls_per_minute: float = member(number(1, 6000), default=60.0)
    waiting_max: int = member(whole(1, 100), default=3)
    envelope: ActEnvelope | None = member(record(ActEnvelope), default=None)
    allow: Mapping[str, ActEnvelope] = field(default_factory=dict)


_RULES = record(AgentRules, allow=RecordMember(_allowed()))


def read_rules(document: object) -> Mapping[str, AgentRules]:
    """Return the rules by name of the agent.

    Args:
        document: as read from YAML: `agents`, by name.

    Raises:
        RulesError: it is something else.
    """
    if not isinstance(document, dict) or set(document) != {"agents"}:
        raise RulesError("The file must have one member, 'agents'.")
    agents = document["agents"]
    if not isinstance(agents, dict) or not agents:
        raise RulesError("'agents' must be an object, by name of the agent.")
    rules = {}
    for name, given in agents.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise RulesError(f"{name!r} is no name of an agent: up to 31 of a-z, 0-9 and _.")
        try:
            rules[name] = _RULES.read(given)
        except InvalidValueError as error:
            raise RulesError(str(error.inside(f"agents.{name}"))) from None
    return rules


def find_agent(rules: Mapping[str, AgentRules], token: str) -> str | None:
    """Return the name of the agent with a token; None if there is none."""
    given = hashlib.sha256(token.encode()).hexdigest()
    found = [name for name, each in rules.items() if hmac.compare_digest(each.token_sha256, given)]
    return found[0] if found and token else None
