"""Checks when a wide test runs, and what tests find."""

from __future__ import annotations

from tests.wide import of_the_night
from tests.worth import measure, table


def test_of_the_wide_tests_the_first_and_the_last_parameters_do_not_wait_for_the_night() -> None:
    wide = [("a.py", f"test_one[{n}]") for n in range(4)]
    wide += [("b.py", "test_one[0]"), ("b.py", "test_two"), ("a.py", "test_two[0]")]
    assert of_the_night(wide) == {1, 2}
    assert of_the_night(wide[:2]) == set()
    assert not of_the_night([("unit/test_make_targets.py", f"test_one[{n}]") for n in range(4)])


def test_a_planted_defect_is_reached_and_found_by_the_tests_of_its_module() -> None:
    name = "nothing must brake"
    worth = measure("unit/core/test_braking.py", [name])
    assert worth.reached == (name,)
    assert worth.found == (name,)
    assert table([worth]).row_count == 1
