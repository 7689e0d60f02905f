"""HTML elements for reports, with all text from logs escaped. Pure."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence


class Markup(str):
    """Text that is already HTML."""

    __slots__ = ()


def safe(text: object) -> Markup:
    """Return text as HTML that shows it, whatever it is; unprintable characters become spaces."""
    if isinstance(text, Markup):
        return text
    return Markup(html.escape("".join(c if c.isprintable() else " " for c in str(text))))


def element(name: str, *parts: object, **attributes: object) -> Markup:
    """Return an element; underscores in attributes' names are hyphens, `class_` is `class`."""
    given = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{safe(value)}"' for key, value in attributes.items()
    )
    return Markup(f"<{name}{given}>{joined(parts)}</{name}>")


def joined(parts: Iterable[object]) -> Markup:
    """Return pieces one after the other."""
    return Markup("".join(safe(part) for part in parts))


def table(
    heads: Sequence[str], rows: Iterable[Sequence[object]], class_: str = "", caption: str = ""
) -> Markup:
    """Return a table with a head.

    Each cell knows its head, as on a narrow page the rows stand as cards (`report_page.css`).
    """
    head = element("tr", *(element("th", text, scope="col") for text in heads))
    body = joined(
        element(
            "tr",
            *(element("td", cell, data_head=head) for head, cell in zip(heads, row, strict=True)),
        )
        for row in rows
    )
    parts = [element("caption", caption)] if caption else []
    whole = element("table", *parts, element("thead", head), element("tbody", body), class_=class_)
    return element("div", whole, class_="scroll")


def at(time_s: float, section: str) -> Markup:
    """Return a time that leads to its place in a section's plots."""
    return element(
        "a", f"{time_s:.1f} s", href=f"#{section}-time", class_="at", data_section=section,
        data_time=f"{time_s:.3f}",
    )  # fmt: skip


def number(value: float | None, unit: str = "", digits: int = 1) -> str:
    """Return a number with its unit, a dash if it isn't known."""
    if value is None or value != value:
        return "–"
    return f"{value:.{digits}f} {unit}".rstrip()


def duration(seconds: float) -> str:
    """Return a duration in the usual notation."""
    minutes, rest = divmod(seconds, 60.0)
    if not minutes:
        return f"{seconds:.1f} s"
    hours, minutes = divmod(int(minutes), 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {rest:04.1f} s"
