"""Long formulas over several lines.

Owns `broken`. A line breaks beside what names stand for, before the sides of a choice, the signs of a sum or what joins
conditions, the outermost one or that between the farthest parentheses; where there is no long one, before a factor.
"""

from __future__ import annotations

from itertools import pairwise

_SIGNS = (" + ", " - ", " − ")
_SIDES = (" then ", " else ")
_JOINTS = (" and ", " or ", " ∧ ", " ∨ ")
_ORDERS = (" < ", " <= ", " ≤ ")
_LET, _IN, _WHERE = "let ", " in ", " where "
_FACTORS = ("·", "*")
_OUTSIDE = -1
_SHORT = 40  # characters between parentheses that stay together
_DEEPEST = 6


def broken(head: str, text: str, width: int) -> list[str]:
    """A formula behind a head, cut where it is a sum; lines are filled as far as they go."""
    return _broken(head + text, len(head), min(len(head), 8), width, 0)


def _broken(line: str, start: int, indent: int, width: int, deep: int) -> list[str]:
    """A line that may be cut behind `start`; what goes on is indented."""
    places = [] if len(line) <= width or deep >= _DEEPEST else _places(line[start:])
    if not places:
        return [line]
    ends = [*(start + place for place in places), len(line)]
    lines: list[str] = []
    now, begun = line[: ends[0]], start
    for a, b in pairwise(ends):
        piece = line[a:b]
        if len(now) + len(piece) <= width:
            now += piece
        else:
            lines += _broken(now, begun, indent + 2, width, deep + 1)
            now, begun = " " * indent + piece.lstrip(), indent
    return [*lines, *_broken(now, begun, indent + 2, width, deep + 1)]


def _beside_meanings(text: str) -> list[int]:
    """Where a formula goes on behind what its names stand for, or ends before that; of these alone, where each ends."""
    if not text.startswith(_LET):
        place = text.rfind(_WHERE)
        return [place] if place > 0 else []
    place = text.find(_IN)
    return [place + len(_IN) - 1] if place > 0 else [i + 1 for i, char in enumerate(text) if char == ";"]


def _places(text: str) -> list[int]:
    """Where to break: beside what names stand for, before the sides of a choice, the signs of one sum, conditions that
    are joined, or factors."""
    if meanings := _beside_meanings(text):
        return meanings
    choices: dict[int, list[int]] = {}
    sums: dict[int, list[int]] = {}
    joints: dict[int, list[int]] = {}
    orders: dict[int, list[int]] = {}
    factors: dict[int, list[int]] = {}
    ends: dict[int, int] = {}
    around = [_OUTSIDE]
    ranges = set[int]()  # in what there is a range, up to the body of its sum: `0..n - 1 (`
    for i, char in enumerate(text):
        if text.startswith("..", i):
            ranges.add(around[-1])
        elif char == "," or text.startswith(" (", i):
            ranges.discard(around[-1])
        if char == "|" and around[-1] != _OUTSIDE and text[around[-1]] == "|":
            ends[around.pop()] = i
        elif char in "([{|":
            around.append(i)
        elif char in ")]}" and len(around) > 1:
            ends[around.pop()] = i
        elif i and text.startswith(_JOINTS, i) and around[-1] != _OUTSIDE:
            joints.setdefault(around[-1], []).append(i)
        elif i and text.startswith(_ORDERS, i):
            orders.setdefault(around[-1], []).append(i)
        elif i and text.startswith(_SIDES, i):
            choices.setdefault(around[-1], []).append(i)
        elif i and text.startswith(_SIGNS, i) and around[-1] not in ranges:
            sums.setdefault(around[-1], []).append(i)
        elif i and char in _FACTORS:
            factors.setdefault(len(around), []).append(i)
    sums |= {at: places for at, places in orders.items() if len(places) > 1}  # what stands between two bounds
    sums |= joints  # conditions are told apart before their sides are
    sums |= choices  # a choice reaches further than a sum
    if _OUTSIDE in sums:
        return sums[_OUTSIDE]
    long = [(ends.get(at, len(text)) - at, places) for at, places in sums.items()]
    length, places = max(long, default=(0, []))
    return places if length > _SHORT else factors[min(factors)] if factors else places
