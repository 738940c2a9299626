"""Formulas as they are displayed: the signs of mathematics for what Potto writes, and nothing else."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest

from potto.syntax.typesetting import broken, mathml, unicode

SHOWN = [
    ("integral [0, 1] r*dr/sqrt(r^2 - x^2)*[x < r] d(x)", "∫₀¹ r·∂r/√(r² − x²)·[x < r] dx"),
    ("dt*[0 < t < 1]", "∂t·[0 < t < 1]"),
    ("[a <= b and b != c]", "[a ≤ b ∧ b ≠ c]"),
    ("-2*theta^n*delta(x - t)", "−2·θ^n·δ(x − t)"),
    ("-dt*delta'(x - t)", "−∂t·δ′(x − t)"),
    ("integral [-inf, inf] a + b d(time)", "∫[−∞, ∞] (a + b) d time"),
    ("integral ([0, 1], [0, x]) y d(x, y)", "∫[x = 0, 1]∫[y = 0, x] y dx dy"),
    ("sum i in 0..n (a[i]^2)", "∑[i = 0, n] a[i]²"),
    ("2^(a + b)", "2^(a + b)"),
    ("dt^2*ddr", "(∂t)²·ddr"),
    ("abs(x)/(2*y)", "|x|/(2·y)"),
    ("a/b*c", "a/b·c"),
    ("if [x < t] then 1 else x", "if x < t then 1 else x"),
]  # fmt: skip


@pytest.mark.parametrize(("formula", "shown"), SHOWN)
def test_what_is_displayed(formula: str, shown: str) -> None:
    assert unicode(formula, frozenset({"dr", "dt"})) == shown


@pytest.mark.parametrize("formula", [formula for formula, _ in SHOWN])
def test_pages_get_xml_with_every_name_and_number(formula: str) -> None:
    tree = ElementTree.fromstring(mathml(formula))
    words = re.findall(r"[A-Za-z]+|\d+", formula)
    told = "".join(tree.itertext())
    signs = {"integral", "sum", "in", "and", "sqrt", "abs", "if", "then", "else", "d", "theta", "delta", "inf"}
    assert all(word in told for word in words if word not in signs)


def test_what_is_no_formula_is_shown_as_it_is() -> None:
    assert unicode("integral [0, ") == "integral [0, "
    assert "<mtext>a &lt;</mtext>" in mathml("a <")


def test_lines_break_before_the_signs_of_the_outermost_sum() -> None:
    text = " + ".join(f"integral [0, 1] term{n}*(u + v) d(x)" for n in range(4))
    lines = broken("D f = ", text, 60)
    assert lines[0].startswith("D f = integral") and all(line.lstrip().startswith("+ integral") for line in lines[1:])
    assert "".join(lines).replace(" ", "") == f"D f = {text}".replace(" ", "")
    assert all(len(line) <= 60 for line in lines)


def test_a_product_without_a_long_sum_breaks_before_a_factor() -> None:
    first, second = broken("", "a" * 30 + "·(x − y)²·" + "b" * 30, 50)
    assert first.endswith("(x − y)²") and second.strip() == "·" + "b" * 30


def test_a_choice_breaks_before_its_sides_and_a_size_stays_whole() -> None:
    first, second, third = broken("", "(if x < t + 1 then " + "a" * 40 + " + b else " + "c" * 40 + ")·d", 60)
    assert first.endswith("t + 1") and second.lstrip().startswith("then a") and third.lstrip().startswith("else c")
    first, second = broken("", "(" + "a" * 38 + " + |x − t|·" + "b" * 12 + ")", 50)
    assert second.lstrip().startswith("+ |x − t|")


def test_meanings_break_between_them() -> None:
    formula = "let D = b^2 - 4*a*c; x1 = -(b + sqrt(D))/(2*a); x2 = (sqrt(D) - b)/(2*a) in x1*da + x2*db"
    assert [line.strip() for line in broken("D f = ", formula, 60)] == [
        "D f = let D = b^2 - 4*a*c; x1 = -(b + sqrt(D))/(2*a);",
        "x2 = (sqrt(D) - b)/(2*a) in",
        "x1*da + x2*db",
    ]


def test_a_range_stays_whole() -> None:
    lines = broken("", "sum i in 0..n - 1 (sum j in 0..len(w) - 1 (" + "a" * 30 + "*w[i] + " + "b" * 30 + "*w[j]))", 80)
    assert [line.strip()[0] for line in lines] == ["s", "+"]


def test_conditions_break_where_they_are_joined() -> None:
    """And not within one of them, although it is a sum."""
    formula = "(r*dr + (x - t)*dt)/sqrt(r^2 - t^2)*[t^2 + x^2 <= r^2 + 2*t*x and r^2 + 2*t*x < t^2 + x^2 + 4]"
    lines = broken("D f = ", formula, 60)
    assert all(len(line) <= 60 for line in lines)
    assert lines[-1].strip() == "and r^2 + 2*t*x < t^2 + x^2 + 4]"
    between = formula.replace("and r^2 + 2*t*x ", "")
    assert broken("D f = ", between, 60)[-1].strip() == "<= r^2 + 2*t*x < t^2 + x^2 + 4]"
