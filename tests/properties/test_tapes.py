"""Sweeps of tapes against matrices: what is done to nodes is done to the rows of a Jacobian as well.

A tape is linear, so numpy does to an array of unit tangents, (parameters, ...), what the tape writes down; all numbers
are sums and products of a few, and differ by roundings only.
"""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest
from how_many import examples

from potto.kernels.sweeps import pushed, swept
from potto.kernels.tape import Node, Untaped, leaves, linear, scaled

SIZE = 4


def grown(pick: random.Random, steps: int) -> tuple[list[Node], list[Any], list[Any]]:
    """Seeds, nodes made of them by random steps, and the tangents of these, (seeds, *shape)."""
    seeds = [Node((), shape) for shape in ((), (), (SIZE,))]
    tangents: list[Any] = [np.zeros((2 + SIZE, *seed.shape)) for seed in seeds]
    tangents[0][0], tangents[1][1] = 1.0, 1.0
    tangents[2][2:] = np.eye(SIZE)
    nodes: list[Any] = list(seeds)

    def wide(i: int) -> tuple[Any, Any]:
        return np.broadcast_to(nodes[i], (SIZE,)), np.broadcast_to(
            tangents[i] if tangents[i].ndim == 2 else tangents[i][:, None], (2 + SIZE, SIZE)
        )

    for _ in range(steps):
        i, j = pick.randrange(len(nodes)), pick.randrange(len(nodes))
        (a, t), (b, u) = wide(i), wide(j)
        mask = np.array([pick.random() < 0.5 for _ in range(SIZE)])
        c, d = np.array([pick.gauss(0, 1) for _ in range(SIZE)]), pick.gauss(0, 1)
        match pick.randrange(6):
            case 0:
                made, moved = linear((c, a, None), (d, b, None)), c * t + d * u
            case 1:
                made, moved = np.where(mask, a, b), np.where(mask, t, u)
            case 2:
                made, moved = a[::-1], t[:, ::-1]
            case 3:
                made, moved = np.add.reduce(a, axis=-1), t.sum(axis=-1)
            case 4:
                made, moved = a[..., None][..., 0] + b, t + u
            case _:
                made, moved = np.stack([a, b], axis=-1)[..., 0], t
        nodes.append(made)
        tangents.append(moved)
    return seeds, nodes, tangents


@pytest.mark.parametrize("seed", range(examples(40, 2000)))
def test_what_is_swept_back_is_what_moves(seed: int) -> None:
    pick = random.Random(seed)
    seeds, nodes, tangents = grown(pick, 12)
    node, t = nodes[-1], tangents[-1]
    weight = np.array([pick.gauss(0, 1) for _ in range(SIZE)]) if node.shape else pick.gauss(0, 1)
    found = swept([(node, weight)])
    wanted = (t * weight).reshape(2 + SIZE, -1).sum(axis=1)
    size = max(1.0, float(np.max(np.abs(t))))
    for own, place in zip(seeds, (0, 1, slice(2, None)), strict=True):
        slope, off = found.get(own, (0.0, 0.0))
        assert np.all(np.abs(slope - wanted[place]) <= off + 1e-15 * size)
        assert np.all(off <= 1e-12 * size * SIZE**12)


def test_what_is_pushed_forward_is_what_is_swept_back() -> None:
    """Along members that are not moved about, with slopes that are off."""
    x, y = Node((), ()), Node((), ())
    a = linear((2.0, x, 1e-3), (3.0, y, None))
    b = linear((0.5, a, None), (-1.0, x, 1e-2))
    assert leaves([b]) == {x, y}
    ((by_x, off_x), (by_y, off_y)) = pushed([b], [x, y])[0]
    found = swept([(b, 1.0)])
    assert (by_x, by_y) == (0.0, 1.5) == (found[x][0], found[y][0])
    assert off_x == pytest.approx(0.5 * 1e-3 + 1e-2, rel=1e-10) == found[x][1]
    assert off_y == pytest.approx(found[y][1], rel=1e-10) and off_y < 1e-14


def test_where_an_answer_does_not_depend_on_a_number_no_slope_is_too_steep() -> None:
    """By a factor of 0 that does not move, or a member that is not taken; a slope that is 0 just here tells nothing."""
    x = Node((), ())
    steep = linear((float("inf"), x, None))
    assert swept([(scaled((0.0, steep, None)), 1.0)])[x][0] == 0.0
    assert swept([(linear((1.0, steep, None)), 1.0)])[x][0] == float("inf")
    by_zero, off = swept([(linear((0.0, steep, None)), 1.0)])[x]
    assert np.isnan(by_zero) and off == float("inf")
    rows = Node((), (2,))
    some = np.where(np.array([True, False]), linear((np.array([1.0, np.inf]), rows, None)), 0.0)
    assert swept([(np.add.reduce(some), 1.0)])[rows][0].tolist() == [1.0, 0.0]


@pytest.mark.parametrize("what", [
    lambda x: x * 2.0, lambda x: 2.0 * x, lambda x: np.ones(3) * x, lambda x: float(x), lambda x: np.exp(x),
    lambda x: np.asarray(x), lambda x: np.linalg.norm(x), lambda x: abs(x), lambda x: bool(x), lambda x: x + 1.0,
])  # fmt: skip
def test_nothing_else_is_done_to_a_node_in_silence(what: Any) -> None:
    with pytest.raises(Untaped):
        what(Node((), (3,)))
