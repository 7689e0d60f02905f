"""Plans of steps as texts: a sentence for each that has no sense; and their stored progress."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from flight_rehearsal.request import STEP_KINDS
from mavbridge_trees.plan import PlanTextError, read_plan
from mavbridge_trees.plan_leaves import leaf_of, rehearsed
from mavbridge_trees.progress import StoredProgress
from navigation_bridge.configuration.checked_values import FLAG

WHOLE = """
name: all
on_failure: return
on_resume: next
return_below: 0.3
steps:
- takeoff: {height: 5}
- goto: {position: [1, 2, 3], speed: 2, avoid: true}
- orbit: {centre: [1, 2], radius: -4, laps: 2, height: 5}
- survey: {area: [[0, 0], [9, 0], [9, 9]], height: 5, spacing: 3}
- photo: {}
- wait: {seconds: 2}
- return: {}
- land: {}
"""


def test_a_whole_plan_is_read() -> None:
    plan = read_plan(WHOLE)
    assert [step.kind for step in plan.steps] == [
        "takeoff", "goto", "orbit", "survey", "photo", "wait", "return", "land",
    ]  # fmt: skip
    assert (plan.on_failure, plan.on_resume, plan.return_below) == ("return", "next", 0.3)
    for step in plan.steps:
        assert leaf_of(step, ()).name
        assert rehearsed(step, ())["kind"] in STEP_KINDS
    assert FLAG.read(rehearsed(plan.steps[1], ())["avoid"]) is True


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "The plan: None is not of type 'object'"),
        ("a: [", "The plan is no YAML"),
        ("&a [*a]", "The plan: "),
        ("steps: []", "The plan's steps: "),
        ("steps: [{fly: {}}]", "The plan's steps 1: "),
        ("steps: [{photo: {}}, {takeoff: {height: -1}}]", "The plan's steps 2 takeoff height: -1"),
        ("steps: [{goto: {position: [1, 2]}}]", "The plan's steps 1 goto position: "),
        ("steps: [{goto: {position: [1, 2, .nan]}}]", "NaN or infinite"),
        ("steps: [{wait: {seconds: .inf}}]", "The plan's steps 1 wait seconds: inf"),
        ("steps: [{land: {}, photo: {}}]", "The plan's steps 1: "),
        ("steps: [{land: {}}]\nreturn_below: 2", "The plan's return_below: 2"),
        ("x" * 1_000_001, "longer than"),
        ("[" * 5000, "The plan"),
    ],
)
def test_a_plan_without_sense_is_rejected_with_its_place(text: str, words: str) -> None:
    with pytest.raises(PlanTextError) as caught:
        read_plan(text)
    assert words in str(caught.value)


_NAMES = st.sampled_from(["steps", "goto", "position", "land", "x"])
_ANY = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_NAMES, inner, max_size=3),
    max_leaves=12,
)  # fmt: skip


@given(_ANY)
def test_any_document_is_a_plan_or_a_sentence(document: object) -> None:
    try:
        steps = read_plan(yaml.safe_dump(document)).steps
    except PlanTextError:
        return
    assert steps


def test_progress_is_of_one_plan_and_survives(tmp_path: Path) -> None:
    plan, other = read_plan(WHOLE), read_plan(WHOLE.replace("name: all", "name: other"))
    path = tmp_path / "new" / "vehicle.json"
    assert StoredProgress(path).steps_done(plan) is None
    StoredProgress(path).store(plan, 3)
    assert StoredProgress(path).steps_done(plan) == 3
    assert StoredProgress(path).steps_done(other) is None
    for damage in ("", "{", "[]", '{"plan": "x"}', path.read_text().replace("3", "99")):
        path.write_text(damage)
        assert StoredProgress(path).steps_done(plan) is None
    StoredProgress(path).forget()
    StoredProgress(path).forget()
    assert not path.exists()
