"""Axe-core in a page of the browser: which rules of accessibility the page breaks.

https://github.com/dequelabs/axe-core/blob/develop/doc/rule-descriptions.md
"""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from tests.support.ros.browser import Tab

_AXE = files("axe_playwright_python").joinpath("axe.min.js").read_text("utf-8")
# All of its rules but the experimental ones, and of these the one about names that are not shown.
_RUN = (
    "axe.run(document, { resultTypes: ['violations'],"
    " rules: { 'label-content-name-mismatch': { enabled: true } } })"
)
_WIDTHS = (1400, 400)


def violations(tab: Tab) -> list[str]:
    """Return each element that breaks a rule of axe-core: the rule, the element, what is wrong."""
    if not tab.value("'axe' in window"):
        tab.call("Runtime.evaluate", expression=_AXE)
    answer = tab.call(
        "Runtime.evaluate",
        expression=_RUN,
        awaitPromise=True,
        returnByValue=True,
    )
    result: dict[str, Any] = answer["result"]["value"]
    assert result["passes"], "axe-core has looked at nothing"
    return [
        f"{rule['id']}: {node['html'][:200]}: {node['failureSummary']}"
        for rule in result["violations"]
        for node in rule["nodes"]
    ]


def violations_at_all_widths(tab: Tab) -> list[str]:
    """Return the violations on a wide and on a narrow screen, in the light and the dark theme."""
    found = []
    for width in _WIDTHS:
        tab.resize(width, 900)
        for theme, scheme in (("day", "light"), ("night", "dark")):
            # The console has its own switch; the report follows the system.
            tab.value(f"document.documentElement.dataset.theme = '{theme}'")
            wanted = [{"name": "prefers-color-scheme", "value": scheme}]
            tab.call("Emulation.setEmulatedMedia", features=wanted)
            found += [f"{width} px, {theme}: {text}" for text in violations(tab)]
    tab.resize(_WIDTHS[0], 900)
    return found
