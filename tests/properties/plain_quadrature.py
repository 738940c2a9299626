"""Integrals by brute force: an evaluator for tests that shares nothing with Potto's.

A program is a Python function of an environment of equally long arrays. It tells what decides its course (the numbers
whose signs choose) by appending them to `record`. An integral looks at its body on a grid, finds by halving every
place where the course changes, and integrates the pieces by the tanh-sinh rule, whose nodes crowd at both ends so
that square roots there cost nothing. Good to about 1e-13 of the largest piece; `estimate` says how good it was.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Array = Any
Environment = dict[str, Any]
# The numbers that decide, or, of an inner integral, a hash of the course that it took.
Record = list[tuple[str, Array]]
Program = Callable[[Environment, "Record | None", int], Array]

GRID = 129
MOST_POINTS = 10_000_000
GOLDEN = (5**0.5 - 1) / 2


class TooHard(Exception):
    """The brute force is not enough for this program."""


def _rule(step: float = 0.0625, most: float = 3.2) -> tuple[Array, Array, Array]:
    """Of the tanh-sinh rule on [0, 1]: the side of each node, its distance from the nearer end, its weight."""
    count = int(most / step)
    t = np.arange(-count, count + 1) * step
    e = np.exp(-np.pi * np.sinh(np.abs(t)))
    return t, e / (1 + e), np.pi * np.cosh(t) * e / (1 + e) ** 2 * step


SIDE, NEAR, WEIGHTS = _rule()
COARSE = np.where((np.arange(SIDE.size) - SIDE.size // 2) % 2 == 0, 2 * WEIGHTS, 0)


class Books:
    """How many points were looked at, and how far the rule with half of the nodes was off. grid: of how many points."""

    def __init__(self, grid: int = GRID) -> None:
        self.points = 0
        self.off = 0.0
        self.grid = grid

    def count(self, points: int) -> None:
        self.points += points
        if self.points > MOST_POINTS:
            raise TooHard("too many points")


books = Books()


def estimate(program: Program, grid: int = GRID, **parameters: float) -> tuple[float, float]:
    """The value of a program, and how much worse half of the nodes would have done. Raises TooHard."""
    books.__init__(grid)  # type: ignore[misc]
    with np.errstate(all="ignore"):
        value = program({name: np.array([x]) for name, x in parameters.items()}, None, 1)
    return float(np.broadcast_to(value, (1,))[0]), books.off


def integral(name: str, lo: Program, hi: Program, body: Program) -> Program:
    """The integral of a body over one variable, as a program."""

    def run(env: Environment, record: Record | None, n: int) -> Array:
        low, high = (np.broadcast_to(bound(env, record, n), (n,)).astype(float) for bound in (lo, hi))
        a, b = np.minimum(low, high), np.maximum(low, high)
        left, right = _pieces(name, a, b, body, env, n)
        if record is not None:
            record.append(("sign", high - low))
            record.append(("course", _course(name, left, right, body, env, n)))
        return np.where(high < low, -1.0, 1.0) * _sum(name, left, right, body, env, n)

    return run


def _mixed(hash_: Array, entry: Array) -> Array:
    mixed = (hash_ ^ (entry.astype(np.uint64) + np.uint64(0x9E3779B97F4A7C15))) * np.uint64(0xBF58476D1CE4E5B9)
    return mixed ^ (mixed >> np.uint64(29))


def _label(record: Record, n: int) -> Array:
    """One number for each point that differs where the courses do."""
    label = np.full(n, np.uint64(7))
    for kind, entry in record:
        label = _mixed(label, np.broadcast_to(entry, (n,)) > 0 if kind == "sign" else np.broadcast_to(entry, (n,)))
    return label


def _rows(env: Environment, index: Array) -> Environment:
    return {name: value[index] for name, value in env.items()}


def _sum(name: str, left: Array, right: Array, body: Program, env: Environment, n: int) -> Array:
    row, piece = np.nonzero(right > left)
    low, high = left[row, piece], right[row, piece]
    total, nodes = np.zeros(n), SIDE.size
    for i in range(0, row.size, max(1, 400_000 // nodes)):
        part = slice(i, i + max(1, 400_000 // nodes))
        a, b, owner = low[part], high[part], row[part]
        width = b - a
        x = np.where(SIDE < 0, a[:, None] + width[:, None] * NEAR, b[:, None] - width[:, None] * NEAR)
        books.count(x.size)
        at = {**_rows(env, np.repeat(owner, nodes)), name: x.ravel()}
        f = np.broadcast_to(body(at, None, x.size), (x.size,)).reshape(-1, nodes)
        np.add.at(total, owner, (f @ WEIGHTS) * width)
        books.off = max(books.off, float(np.max(np.abs(f @ COARSE - f @ WEIGHTS) * width, initial=0.0)))
    return total


def _pieces(name: str, a: Array, b: Array, body: Program, env: Environment, n: int) -> tuple[Array, Array]:
    """Where the pieces between the cuts begin and end, (rows, pieces); empty ones fill up the rows."""
    row, cut = _Cuts(name, a, b, body, env, n).found()
    order = np.lexsort((cut, row))
    row, cut = row[order], cut[order]
    counts = np.bincount(row, minlength=n)
    ends = np.repeat(b[:, None], int(counts.max(initial=0)) + 2, axis=1)
    ends[:, 0] = a
    ends[row, 1 + np.arange(cut.size) - (np.cumsum(counts) - counts)[row]] = cut
    return ends[:, :-1], ends[:, 1:]


def _course(name: str, left: Array, right: Array, body: Program, env: Environment, n: int) -> Array:
    """A hash of the courses taken on the pieces that have a length, one after the other."""
    count = left.shape[1]
    record: Record = []
    body({**_rows(env, np.repeat(np.arange(n), count)), name: ((left + right) / 2).ravel()}, record, n * count)
    labels = _label(record, n * count).reshape(n, count)
    real = right - left > 1e-10 * (1 + np.abs(right[:, -1:] - left[:, :1]))
    course, last = np.full(n, np.uint64(3)), np.zeros(n, np.uint64)
    for k in range(count):
        new = real[:, k] & (labels[:, k] != last)
        course, last = np.where(new, _mixed(course, labels[:, k]), course), np.where(new, labels[:, k], last)
    return course


class _Cuts:
    """The search for the places along one variable where the course changes."""

    def __init__(self, name: str, a: Array, b: Array, body: Program, env: Environment, n: int) -> None:
        self.name, self.body, self.env, self.n = name, body, env, n
        self.x = a[:, None] + (b - a)[:, None] * (np.linspace(0, 1, books.grid) * 0.999998 + 1e-6)

    def look(self, row: Array, x: Array) -> tuple[Array, Record]:
        books.count(x.size)
        record: Record = []
        self.body({**_rows(self.env, row), self.name: x}, record, x.size)
        return _label(record, x.size), record

    def found(self) -> tuple[Array, Array]:
        labels, record = self.look(np.repeat(np.arange(self.n), books.grid), self.x.ravel())
        labels = labels.reshape(self.n, books.grid)
        row, at = np.nonzero(labels[:, :-1] != labels[:, 1:])
        brackets = [(row, self.x[row, at], self.x[row, at + 1], labels[row, at], labels[row, at + 1])]
        for number, (kind, entry) in enumerate(record):
            if kind == "sign":
                brackets += self.dips(number, np.broadcast_to(entry, (labels.size,)).reshape(labels.shape), labels)
        return self.halved(*(np.concatenate(parts) for parts in zip(*brackets, strict=True)))

    def dips(self, number: int, value: Array, labels: Array) -> list[tuple[Array, ...]]:
        """Between neighbours of one sign a number that decides may touch 0 or go through it twice."""
        size, above = np.abs(value), value > 0
        bent = np.abs(size[:, :-2] + size[:, 2:] - 2 * size[:, 1:-1])
        dip = (size[:, 1:-1] < size[:, :-2]) & (size[:, 1:-1] <= size[:, 2:]) & (size[:, 1:-1] <= 4 * bent)
        row, at = np.nonzero(dip & (above[:, 1:-1] == above[:, :-2]) & (above[:, 1:-1] == above[:, 2:]))
        if not row.size:
            return []
        low, high, sign = self.x[row, at], self.x[row, at + 2], np.where(above[row, at], 1.0, -1.0)
        for _ in range(40):
            inner = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
            first, second = (sign * np.broadcast_to(self.look(row, x)[1][number][1], x.shape) for x in inner)
            low, high = np.where(first < second, low, inner[0]), np.where(first < second, inner[1], high)
        bottom = (low + high) / 2
        label, _ = self.look(row, bottom)
        through = label != labels[row, at]
        row, at, bottom, label = row[through], at[through], bottom[through], label[through]
        return [
            (row, self.x[row, at], bottom, labels[row, at], label),
            (row, bottom, self.x[row, at + 2], label, labels[row, at + 2]),
        ]

    def halved(self, row: Array, a: Array, b: Array, at_a: Array, at_b: Array) -> tuple[Array, Array]:
        """Every change between a and b, as far as halving sees it."""
        rows, cuts = [], []
        for _ in range(75):
            middle = (a + b) / 2
            small = (middle <= a) | (middle >= b) | (b - a < 1e-18)
            done, open_ = small & (at_a != at_b), ~small & (at_a != at_b)
            rows.append(row[done])
            cuts.append(b[done])
            row, a, b, at_a, at_b, middle = (x[open_] for x in (row, a, b, at_a, at_b, middle))
            if not row.size:
                break
            if row.size > 20_000:
                raise TooHard("too many cuts")
            label, _ = self.look(row, middle)
            like_a, new = label == at_a, (label != at_a) & (label != at_b)
            row, a, b, at_a, at_b = (
                np.concatenate(pair)
                for pair in (
                    (row, row[new]),
                    (np.where(like_a, middle, a), middle[new]),
                    (np.where(like_a, b, middle), b[new]),
                    (at_a, label[new]),
                    (np.where(like_a, at_b, label), at_b[new]),
                )
            )
        rows.append(row)
        cuts.append((a + b) / 2)
        return np.concatenate(rows).astype(int), np.concatenate(cuts)
