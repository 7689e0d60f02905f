"""Names of goals in a picture hide neither what is drawn nor one another."""

from __future__ import annotations

import numpy as np

from flight_reports.pictures.labels import along, free_places, names_of

FRAME_PX = (0.0, 0.0, 400.0, 300.0)
SIZE_PX = np.array([60.0, 12.0])


def boxes(places: list[tuple[float, float]], busy: np.ndarray) -> list[np.ndarray]:
    sizes = np.tile(SIZE_PX, (len(places), 1))
    corners = free_places(np.array(places), sizes, busy, FRAME_PX)
    return [np.array([*corner, *(corner + SIZE_PX)]) for corner in corners]


def overlap(one: np.ndarray, other: np.ndarray) -> bool:
    return bool((one[:2] < other[2:]).all() and (other[:2] < one[2:]).all())


def test_a_label_leaves_a_passing_line_free() -> None:
    across = np.stack([np.linspace(0.0, 400.0, 800), np.full(800, 150.0)], axis=-1)
    (box,) = boxes([(200.0, 150.0)], across)
    assert not ((across > box[:2]) & (across < box[2:])).all(axis=1).any()


def test_labels_of_adjacent_goals_do_not_overlap() -> None:
    places = [(200.0, 150.0), (230.0, 150.0), (200.0, 165.0), (215.0, 140.0)]
    found = boxes(places, np.empty((0, 2)))
    assert not any(overlap(a, b) for i, a in enumerate(found) for b in found[:i])


def test_a_label_stays_in_the_picture() -> None:
    for place in ((395.0, 295.0), (5.0, 5.0), (395.0, 5.0)):
        (box,) = boxes([place], np.empty((0, 2)))
        assert (box[:2] >= 0.0).all()
        assert (box[2:] <= (400.0, 300.0)).all()


def test_a_position_of_two_goals_has_one_label() -> None:
    named = names_of([(0.0, 0.0, 4.0), (20.0, 0.0, 4.0), (0.1, 0.0, 4.0)])
    assert [name for _, name in named] == ["1, 3: (0, 0, 4)", "2: (20, 0, 4)"]


def test_a_path_is_sampled_along_its_whole_length() -> None:
    points = along(np.array([(0.0, 0.0, 0.0), (0.0, 30.0, 0.0)]))
    assert len(points) >= 300
    assert np.diff(points[:, 1]).max() < 0.2
