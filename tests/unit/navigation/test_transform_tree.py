"""Transforms that are joined, kept for a while, and those that cannot be poses."""

from __future__ import annotations

import math

import pytest

from drone_navigation.server.frames.transform_tree import Placed, TransformTree

LEFT = (math.cos(math.pi / 4.0), 0.0, 0.0, math.sin(math.pi / 4.0))
STILL = math.inf


def tree(*links: tuple[str, str, Placed]) -> TransformTree:
    made = TransformTree()
    for child, parent, placed in links:
        made.take(child, parent, placed)
    return made


def test_a_chain_is_joined_upwards_and_down_again() -> None:
    joined = tree(
        ("map", "earth", Placed((100.0, 0.0, 0.0), LEFT, STILL)),
        ("other/map", "earth", Placed((100.0, 10.0, 0.0), LEFT, STILL)),
        ("other/base_link", "other/map", Placed((1.0, 2.0, 3.0), LEFT, 5.0)),
    )
    placed = joined.pose("other/base_link", "map")
    assert placed is not None
    # The axes of both maps are turned to the left: earth's y is their x.
    assert placed.position == pytest.approx((11.0, 2.0, 3.0))
    assert placed.turn == pytest.approx(LEFT)
    assert placed.stamp_s == 5.0


def test_frames_that_are_not_joined_have_no_pose() -> None:
    joined = tree(("tag", "camera", Placed(stamp_s=1.0)), ("base_link", "map", Placed(stamp_s=1.0)))
    assert joined.pose("tag", "map") is None
    assert joined.pose("nothing", "map") is None
    assert joined.pose("map", "map") == Placed()


def test_a_pose_of_the_past_lies_between_those_around_it() -> None:
    joined = tree(
        *(("tag", "map", Placed((float(second), 0.0, 0.0), stamp_s=second)) for second in range(4))
    )
    positions = []
    for at_s in (-1.0, 1.5, 9.0):
        placed = joined.pose("tag", "map", at_s)
        assert placed is not None
        positions.append(placed.position[0])
    assert positions == [0.0, 1.5, 3.0]


@pytest.mark.parametrize(
    "placed",
    [
        Placed((math.nan, 0.0, 0.0), stamp_s=2.0),
        Placed((9.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), 2.0),
        Placed((9.0, 0.0, 0.0), (5.0, 0.0, 0.0, 0.0), 2.0),
        Placed((9.0, 0.0, 0.0), stamp_s=math.nan),
        Placed((9.0, 0.0, 0.0), stamp_s=1.0),
        Placed((9.0, 0.0, 0.0), stamp_s=0.5),
    ],
)
def test_what_is_no_pose_and_what_is_late_is_ignored(placed: Placed) -> None:
    joined = tree(("tag", "map", Placed(stamp_s=1.0)), ("tag", "map", placed))
    assert joined.pose("tag", "map") == Placed(stamp_s=1.0)


def test_a_clock_that_was_set_back_begins_again() -> None:
    joined = tree(
        ("tag", "map", Placed(stamp_s=100.0)), ("tag", "map", Placed((1.0, 0.0, 0.0), stamp_s=1.0))
    )
    placed = joined.pose("tag", "map")
    assert placed is not None
    assert placed.stamp_s == 1.0


def test_a_circle_of_frames_ends() -> None:
    joined = tree(("a", "b", Placed(stamp_s=1.0)), ("b", "a", Placed(stamp_s=1.0)))
    assert joined.pose("a", "map") is None
