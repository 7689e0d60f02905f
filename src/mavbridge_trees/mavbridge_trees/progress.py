"""The progress of a plan, in a file that survives a restart."""

from __future__ import annotations

import json
import os
from pathlib import Path

from mavbridge_trees.plan import Plan

__all__ = ["StoredProgress"]


class StoredProgress:
    """The file of one vehicle, which has the plan that it flew last."""

    def __init__(self, path: Path) -> None:
        """Use a file, which need not exist."""
        self._path = path

    def steps_done(self, plan: Plan) -> int | None:
        """Return how many steps of a plan are done; None if it was not flown last."""
        try:
            stored = json.loads(self._path.read_text("utf-8"))
            done = stored["steps_done"]
        except (OSError, ValueError, KeyError, TypeError):
            return None
        is_count = isinstance(done, int) and 0 <= done < len(plan.steps)
        return done if is_count and stored.get("plan") == plan.digest else None

    def store(self, plan: Plan, steps_done: int) -> None:
        """Write it down, at once and whole.

        Raises:
            OSError: it cannot be written.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        draft = self._path.with_suffix(".new")
        with draft.open("w", encoding="utf-8") as file:
            json.dump({"plan": plan.digest, "name": plan.name, "steps_done": steps_done}, file)
            file.flush()
            os.fsync(file.fileno())
        draft.replace(self._path)

    def forget(self) -> None:
        """Forget the plan, which is done."""
        self._path.unlink(missing_ok=True)
