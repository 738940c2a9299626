"""`potto deriv`, hovers, the derivative's document, LaTeX and the prompt show one formula: `explain_derivative` has it.

`potto deriv` carries calls of definitions out, which the others leave as the definition has them: where there are such
calls it has another one, which the tests of what holds evaluate.
"""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest
from generated_definitions import definition, program
from how_many import examples
from potto_repl.respond import respond
from potto_repl.session import Conversation

import potto
from potto.calculus.explanation.explain import explain_derivative
from potto.calculus.explanation.layout import DerivativeText
from potto.checking.facts import LONG, DerivativeFacts, derivative_facts
from potto.checking.library import Library
from potto.checking.typeset import derivative_latex, function_derivative
from potto.core.terms import Global, postorder
from potto.elaborate import core
from potto.ide.hover.derivatives import LONG as LONG_IN_HOVERS
from potto.ide.hover.derivatives import derivative_markdown, derivative_parts
from potto.modules import names
from potto.source import Span
from potto.syntax import nodes
from potto.syntax.typesetting import latex
from potto.types import interface
from potto.types.types import Function

EXAMPLES = Path(__file__).parents[2] / "examples"


def packed(text: str) -> str:
    """Without spaces, which lines are broken at."""
    return re.sub(r"\s", "", text)


def check(conversation: Conversation, file: str, name: str) -> None:
    library = conversation.world
    found = explain_derivative(library.db, file, name)
    if found.by:  # it is that of another one, while the prompt differentiates it once more
        return
    facts = derivative_facts(library.db, file, name)
    assert facts is not None
    if not any(isinstance(node, Global) for node in postorder(core(library.db, file, name).term)):
        _by_command(found, facts)
    _by_hover(found)
    document = derivative_markdown(library.db, file, name)
    assert document is not None and packed(found.tangent) in packed(document)
    asked = function_derivative(library.db, file, nodes.Name(Span(0, 0), name), name)
    assert asked == found
    if found.tangent and len(found.tangent) <= LONG and (whole := latex(found.tangent, found.tangents)) is not None:
        assert whole in str(derivative_latex(asked, name))
    reply = respond(conversation, f":deriv {name}")
    assert not reply.failed, reply.text
    (data,) = [part.data for part in reply.parts if part.data is not None and "tangent" in part.data]
    assert data["tangent"] == found.tangent and packed(found.tangent) in packed(str(data["text"]))


def _by_command(found: DerivativeText, facts: DerivativeFacts) -> None:
    assert facts.derivative == found.tangent
    assert facts.divisors == found.divisors and facts.where == found.conditions
    assert [(p.interior, p.boundary, p.bounds, p.continuous, p.each) for p in facts.integrals] == [
        (i.over(i.interior) if i.interior else "", tuple(map(i.over, i.deltas)), i.bounds, i.continuous, i.each)
        for i in found.integrals
    ]


def _by_hover(found: DerivativeText) -> None:
    shown = packed("\n".join(derivative_parts(found)))
    parts = [i.over(part) for i in found.integrals for part in (i.interior, *i.deltas) if part]
    parts += [part for i in found.integrals for part in i.bounds]
    parts += [found.tangent] if found.tangent and not found.integrals else []
    typeset = [found.unicode(part) for part in parts]
    assert all(packed(text) in shown for text in typeset if len(text) <= LONG_IN_HOVERS)
    assert all(f"{divisor} != 0" in " ".join(found.notes) for divisor in found.divisors)
    assert all(packed(note) in shown for note in found.notes if "!=" in note)


SURFACES = [
    ("[x < t]", "x = t"),
    ("[x > t]", "x = t"),
    ("[2*t - 1 > x^2]", "x^2 + 1 = 2*t"),
    ("[a*x^2 + t*x + 1 < 0]", "a*x^2 + t*x = -1"),
    ("[t - a*x > 0]*[a*x < t]", "t = a*x"),  # one surface
    ("[-x > 0]", "x = 0"),
]


@pytest.mark.parametrize(("integrand", "equation"), SURFACES)
def test_surfaces_are_written_alike(integrand: str, equation: str) -> None:
    """Without a sign in front, and by the name that stands alone."""
    text = f"def f(t, a) integral [-1, 1] {integrand} d(x)\n"
    library, conversation = Library(), Conversation()
    file = library.put("<text>", text)
    facts = derivative_facts(library.db, file, "f")
    assert facts is not None and facts.surfaces == (equation,) and f"surfaces  {equation}" in facts.text
    function = potto.compile(text).f
    assert function.surfaces == (equation,)
    (integral,) = explain_derivative(library.db, file, "f").integrals
    assert [surface.equation for surface in integral.surfaces] == [equation]
    respond(conversation, text)
    (part,) = respond(conversation, ":surfaces f").parts
    assert part.data is not None and part.data["surfaces"] == [equation]
    with potto.counting():
        stats = function(0.3, -2.0).stats
    assert [surface["surface"] for surface in stats["surfaces"]] == [equation]


def test_what_a_call_brings_in_is_told_as_its_own() -> None:
    """The surfaces of the function that is called, and bounds without what its arguments make twice."""
    library = Library()
    text = "def g(x, h, t) integral [x - h/2, x + h/2] [u < t] d(u)\ndef f(i, t) g((i + 1/2)/t, 1/t, t)\n"
    facts = derivative_facts(library.db, library.put("<text>", text), "f")
    assert facts is not None and facts.surfaces == ("u = t",)
    assert facts.integrals[0].value == "integral [i/t, (i + 1)/t] [u < t] d(u)"


def test_an_integral_reads_the_same_in_what_is_around_it() -> None:
    library = Library()
    file = library.put("<text>", "def f(t) 2*(integral (x ~ normal(0, 1)) [x < t] d(x))\n")
    facts = derivative_facts(library.db, file, "f")
    assert facts is not None and facts.body is not None
    assert facts.body.value == f"2*({facts.integrals[0].value})"


def test_of_two_names_that_of_the_variable_comes_first() -> None:
    library = Library()
    file = library.put("<text>", "def f(set) integral [0, 1] [reading > set] d(reading)\n")
    facts = derivative_facts(library.db, file, "f")
    assert facts is not None and facts.surfaces == ("reading = set",)
    (integral,) = explain_derivative(library.db, file, "f").integrals
    assert [surface.equation for surface in integral.surfaces] == ["reading = set"]


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=() if path.parent.name in ("paper", "worked") else pytest.mark.slow)
     for path in sorted(EXAMPLES.glob("*/*.po"))[:: examples(2, 1)] if path.stem != "hidden"],  # too long to be shown
    ids=lambda path: f"{path.parent.name}/{path.stem}",
)  # fmt: skip
def test_examples(path: Path) -> None:
    conversation = Conversation([str(path.parent)])
    db, file = conversation.db, conversation.world.key(str(path))
    assert not respond(conversation, f":load {path}").failed
    for name in names(db, file):
        if isinstance(interface(db, file, name).type, Function):
            check(conversation, file, name)


@pytest.mark.parametrize("seed", range(examples(50, 500)))
def test_generated(seed: int, tmp_path: Path) -> None:
    rng = random.Random(seed)
    text = definition(rng) if seed % 2 else program(rng)[0]
    path = tmp_path / "generated.po"
    path.write_text(text, encoding="utf-8")
    conversation = Conversation([str(tmp_path)])
    assert not respond(conversation, f":load {path}").failed
    check(conversation, conversation.world.key(str(path)), "f")
