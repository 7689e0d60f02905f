"""Ticks a tree while its node spins, and leaves nothing flying behind it."""

from __future__ import annotations

import time
from collections.abc import Callable

import rclpy
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.trees import BehaviourTree
from rclpy.node import Node

__all__ = ["run_tree"]

_TICK_S = 0.1
_CANCEL_S = 2.0
"""The answer to a cancel is waited for this long"""


def run_tree(
    root: Behaviour, node: Node, is_over: Callable[[], bool] = lambda: False
) -> tuple[Status, str]:
    """Tick a tree ten times a second until it ends.

    A tree that is interrupted cancels the goal that it flies, and the vehicle holds.

    Args:
        root: of the tree.
        node: that its leaves speak through; nobody else may spin it.
        is_over: is asked with each tick whether to stop.

    Returns:
        How it ended, INVALID if it was interrupted; and the sentence of the leaf that decided.
    """
    tree = BehaviourTree(root)
    tree.setup(node=node)
    try:
        while not is_over():
            tree.tick()
            if root.status is not Status.RUNNING:
                tip = root.tip() or root
                return root.status, tip.feedback_message
            _spin(node, _TICK_S)
    finally:
        if root.status is Status.RUNNING:
            tree.interrupt()
            _spin(node, _CANCEL_S)
    return Status.INVALID, "The tree was interrupted."


def _spin(node: Node, seconds: float) -> None:
    end_s = time.monotonic() + seconds
    while (left_s := end_s - time.monotonic()) > 0.0:
        rclpy.spin_once(node, timeout_sec=left_s)
