"""The exploration itself: it repeats, it finds, it shrinks, and what it found stays mended."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain, product
from pathlib import Path
from typing import Any

import pytest

from navigation_bridge.vehicle import fence
from navigation_core.tasks.steering.command_silence import CommandSilence
from navigation_core.tasks.traffic.giving_way import GivingWay
from navigation_core.tasks.watching.plane_giving_way import PlaneGivingWay
from tests.explore.__main__ import drawn, policy_table
from tests.explore.check import Checker
from tests.explore.coverage import OUTSIDE, Reached, compile_marked, modules, statement_lines
from tests.explore.defects import MUTANTS, TOGETHER, planted
from tests.explore.exploration import Exploration
from tests.explore.explorer import explore_scenario, explore_seed
from tests.explore.generate import scenario_of
from tests.explore.hunt import Fate, hunt
from tests.explore.log import Log
from tests.explore.more_situations import MORE_SITUATIONS_FROM, more_situation_of
from tests.explore.mutants import defect_of, defect_of_several
from tests.explore.planting import source_of
from tests.explore.policies import ON_TRIAL, POLICIES
from tests.explore.releases import RELEASES
from tests.explore.run import fly
from tests.explore.scenario import Craft, Event, Scenario
from tests.explore.shrink import shrink
from tests.explore.situations import SITUATIONS_FROM, TRAJECTORIES_FROM, situation_of

pytestmark = pytest.mark.wide_but_first


SCENARIOS = sorted((Path(__file__).parents[1] / "scenarios").glob("*.json"))
FLIGHT = Scenario(
    1,
    (Craft(),),
    (
        Event(0.0, 0, "navigate", {"place": [8.0, 4.0, 3.0]}),
        Event(6.0, 0, "pause"),
        Event(9.0, 0, "resume"),
        Event(20.0, 0, "cancel"),
    ),
)


def test_the_same_scenario_gives_the_same_log() -> None:
    assert fly(FLIGHT).digest == fly(FLIGHT).digest


@pytest.mark.parametrize("seed", [4, 6])
def test_the_same_seed_gives_the_same_scenario_and_no_violation(seed: int) -> None:
    assert scenario_of(seed) == scenario_of(seed)
    flown = explore_seed(seed)
    assert not flown.error
    assert not flown.violations


def test_policies_have_names_sentences_and_sources() -> None:
    assert len({policy.name for policy in POLICIES}) == len(POLICIES) >= 60
    assert all(policy.text.endswith(".") and policy.source for policy in POLICIES)
    assert {policy.name for policy in POLICIES} >= ON_TRIAL


def test_the_page_has_all_policies() -> None:
    page = (Path(__file__).parents[2] / "docs/policies.md").read_text("utf-8")
    kept = "".join(line for line in page.splitlines(keepends=True) if line.startswith("|"))
    assert kept == policy_table() + "\n", "write docs/policies.md from --policies again"


def test_a_scenario_survives_its_file(tmp_path: Path) -> None:
    for seed in range(30):
        scenario = scenario_of(seed)
        scenario.save(tmp_path / "one.json")
        # NaN is not equal to itself.
        assert repr(Scenario.load(tmp_path / "one.json")) == repr(scenario)


def test_a_file_that_is_no_scenario_is_named(tmp_path: Path) -> None:
    path = tmp_path / "bad.json"
    path.write_text('{"seed": 1}')
    with pytest.raises(ValueError, match=r"bad\.json is not a scenario"):
        Scenario.load(path)


def test_one_seed_in_eight_is_of_shared_traffic() -> None:
    seeds = list(drawn(13, 80, 8))
    assert len(set(seeds)) == 80
    assert sum(scenario_of(seed).shares_traffic for seed in seeds) == 10
    assert list(drawn(13, 80, 0)) == list(range(13, 93))


def test_one_seed_in_eight_is_a_situation_and_they_take_turns() -> None:
    raised = [seed for seed in drawn(13, 192, 8, 8) if seed >= SITUATIONS_FROM]
    of_trajectories = [seed for seed in raised if seed >= TRAJECTORIES_FROM]
    assert len({situation_of(seed) for seed in raised if seed < TRAJECTORIES_FROM}) == 24
    assert len({situation_of(seed) for seed in of_trajectories}) == 4
    assert len(raised) - len(of_trajectories) == 24
    assert all(len(scenario_of(seed).crafts) == 1 for seed in raised)


def test_more_situations_take_turns_in_one_seed_of_eight() -> None:
    raised = [seed for seed in drawn(13, 136, 8, 8, 8) if seed >= MORE_SITUATIONS_FROM]
    assert len({more_situation_of(seed) for seed in raised}) == len(raised) == 17
    assert not any(seed >= MORE_SITUATIONS_FROM for seed in drawn(13, 136, 8, 8))


@pytest.mark.parametrize("seed", [4, 10, 14])
def test_one_of_more_situations_repeats_without_a_violation(seed: int) -> None:
    flown = explore_seed(MORE_SITUATIONS_FROM + seed)
    assert not flown.error
    assert not flown.violations
    assert flown.digest == explore_seed(MORE_SITUATIONS_FROM + seed).digest


@pytest.mark.night
@pytest.mark.parametrize(
    ("seed", "owner", "name", "instead", "policy"),
    [
        (25, GivingWay, "step", lambda *given: given[4], "an_intruder_too_near"),
        (26, PlaneGivingWay, "_look", lambda *_: None, "an_intruder_too_near"),
        (0, CommandSilence, "current", lambda *given: given[1], "a_plane_gone_without_commands"),
        (17, CommandSilence, "current", lambda *given: given[1], "moving_without_commands"),
        (15, fence, "areas_of", lambda *_: (), "the_fence_left"),
    ],
)
def test_what_more_situations_are_for_is_found(
    monkeypatch: pytest.MonkeyPatch,
    seed: int,
    owner: object,
    name: str,
    instead: Callable[..., Any],
    policy: str,
) -> None:
    monkeypatch.setattr(owner, name, instead)
    flown = explore_scenario(scenario_of(MORE_SITUATIONS_FROM + seed), briefly=True)
    assert [violation.policy for violation in flown.violations] == [policy]


@pytest.mark.parametrize("seed", [3, 8, TRAJECTORIES_FROM - SITUATIONS_FROM + 1])
def test_a_situation_repeats_without_a_violation(seed: int) -> None:
    flown = explore_seed(SITUATIONS_FROM + seed)
    assert not flown.error
    assert not flown.violations
    assert flown.digest == explore_seed(SITUATIONS_FROM + seed).digest


def test_defects_planted_together_are_all_there() -> None:
    for names in TOGETHER:
        defect = defect_of_several(names)
        sources = {defect.module: defect.source, **dict(defect.others)}
        mutants = [mutant for mutant in MUTANTS if mutant.name in names]
        assert len(mutants) == len(names)
        for mutant in mutants:
            assert mutant.sound not in sources[mutant.module]


def test_all_releases_and_devices_are_drawn_and_each_has_its_parameters() -> None:
    crafts = [craft for seed in range(150) for craft in scenario_of(seed).crafts]
    assert {craft.firmware for craft in crafts} == {"", *chain(*RELEASES.values())}
    assert {(craft.camera, craft.gimbal) for craft in crafts} == set(
        product((False, True), repeat=2)
    )
    renamed = [c for c in crafts if c.firmware == "ardupilot-4.7" and "RTL_ALT" in c.onboard]
    flight = Exploration(Scenario(1, (renamed[0],)), Log())
    value = flight.ships[0].sim.parameters["RTL_ALT_M"]
    assert value == pytest.approx(0.01 * renamed[0].onboard["RTL_ALT"])


def test_shrinking_keeps_what_fails_and_drops_the_rest() -> None:
    whole = scenario_of(8)
    culprit = whole.events[len(whole.events) // 2]

    def fails(scenario: Scenario) -> bool:
        return any(e.what == culprit.what and e.how == culprit.how for e in scenario.events)

    small, _ = shrink(whole, fails)
    assert [event.what for event in small.events] == [culprit.what]
    assert len(small.crafts) == 1
    assert not small.posts


@pytest.mark.by_day
@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: str(path.stem))
def test_what_was_found_stays_mended(path: Path) -> None:
    scenario = Scenario.load(path)
    checker = Checker(scenario)
    fly(scenario, checker.take)
    assert not checker.found


def test_each_planted_defect_fits_the_source() -> None:
    for mutant in MUTANTS:
        source = planted(source_of(mutant.module), mutant)
        compile(source, mutant.module, "exec")


def test_a_planted_defect_is_found() -> None:
    mutant = next(m for m in MUTANTS if m.name == "the result comes twice")
    defect = defect_of(mutant)
    line = statement_lines(source_of(defect.module))[defect.line]
    sound = Reached(1419, "", 5.0, (), {defect.module: frozenset({line})})
    (verdict,) = hunt([defect], {sound.seed: sound})
    assert verdict.fate is Fate.FOUND
    assert verdict.policy == "a_goal_ends_once"


def test_marks_tell_which_statements_were_executed() -> None:
    source = "def f(x):\n    if x:\n        return 1\n    return (\n        2)\n"
    marks = bytearray(8)
    names: dict[str, Any] = {"__reached__": marks}
    exec(compile_marked(source, Path("f.py")), names)
    assert names["f"](0) == 2
    assert [line for line, mark in enumerate(marks) if mark] == [2, 4]
    assert statement_lines(source) == (0, 0, 2, 3, 4, 4, 0)


def test_what_no_exploration_reaches_exists_and_is_tested_elsewhere() -> None:
    for tests, *names in OUTSIDE.values():
        assert (Path(__file__).parents[2] / tests).exists(), tests
        for name in names:
            assert any(f"{module}.".startswith(f"{name}.") for module in modules()), name
