"""Laws of the plain-condition rule.

For functions of numbers, writing out calls by hand changes no verdict. For functions that are passed on, what is wrong
when written out is never missed.
"""

from __future__ import annotations

import random
import re

import pytest
from marks import database, diagnostics

PLAIN_RULE = {"P0301", "P0302", "P0303", "P0304"}


def verdict(text: str) -> bool:
    """Whether a program breaks the rule; that is all that may be wrong with it."""
    codes = {d.code for _, d in diagnostics(database(text)) if d.severity == "error"}
    assert codes <= PLAIN_RULE, (codes, text)
    return bool(codes)


def expression(rng: random.Random, atoms: list[str], calls: list[str], depth: int) -> str:
    """A random expression. `@f(a; b)` calls f; the two ways of writing programs differ in that alone."""
    if depth == 0 or rng.random() < 0.15:
        return rng.choice(atoms)

    def inner() -> str:
        return expression(rng, atoms, calls, depth - 1)

    kinds = ["sum", "product", "plain", "bracket", "sin", "integral"] + ["call"] * (3 if calls else 0)
    match rng.choice(kinds):
        case "sum":
            return f"({inner()} + {inner()})"
        case "product":
            return f"({inner()}*{rng.choice(['0', '2', inner()])})"
        case "plain":
            return f"(if {rng.choice([*atoms, inner()])} > 0 then {inner()} else {inner()})"
        case "bracket":
            return f"(if [{inner()} > 1] then {inner()} else {inner()})"
        case "sin":
            return f"{rng.choice(['sin', 'exp', 'sin', 'floor'])}({inner()})"
        case "integral":
            name = f"z{rng.randrange(10**9)}"
            body = expression(rng, [*atoms, name], calls, depth - 1)
            return f"(integral [0, {rng.choice([*atoms, '1'])}] ({body} + 0*{name}) d({name}))"
        case _:
            return f"@{rng.choice(calls)}<{inner()};{inner()}>"


def written_out(text: str, bodies: dict[str, str]) -> str:
    """A program without calls: each replaced by the body with the arguments put in."""
    while "@" in text:
        at = text.rindex("@")  # the last call has no call inside its arguments
        end = _end(text, at)
        name, arguments = text[at + 1 : end].split("<", 1)
        values = dict(zip(("(p)", "(q)"), arguments.split(";")))
        body = re.sub(r"\([pq]\)", lambda found, values=values: f"({values[found.group()]})", bodies[name])
        text = text[:at] + f"({body})" + text[end + 1 :]
    return text


def _end(text: str, at: int) -> int:
    """Where the call that starts at `at` ends: comparisons have blanks around `>`, calls do not."""
    while True:
        at = text.index(">", at + 1)
        if text[at - 1] != " ":
            return at


def called(text: str) -> str:
    """The same program with calls as calls."""
    return text.replace("@", "").replace("<", "(").replace(";", ", ").replace(" > ", " GT ").replace(">", ")").replace(
        " GT ", " > "
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(60))
def test_writing_out_calls_changes_no_verdict(seed: int) -> None:
    rng = random.Random(seed)
    bodies: dict[str, str] = {}
    for name in ("f", "g", "h"):
        body = expression(rng, ["(p)", "(q)", "2"], list(bodies), 3)
        bodies[name] = f"({body} + 0*(p)*(q))"  # what is not used would be gone when written out
    main = expression(rng, ["x", "t", "1"], list(bodies), 3)
    definitions = "".join(f"def {name}(p, q) {called(body)}\n" for name, body in bodies.items())
    modular = f"{definitions}def main(t) integral [0, 1] ({called(main)} + 0*x) d(x)\n"
    flat_main = written_out(main, {name: written_out(body, bodies) for name, body in bodies.items()})
    flat = f"def main(t) integral [0, 1] ({flat_main} + 0*x) d(x)\n"
    if verdict(definitions):
        return  # wrong in itself: then writing it out proves nothing
    if len(flat) < 20_000:
        assert verdict(modular) == verdict(flat), (modular, flat)


FUNCTIONS = (r"\y . y*y", r"\y . if y > 0 then 1 else y", r"\y . floor(t)*y", r"\y . [y > t]", r"\y . 3")
USERS = (
    "def use(k, a) k(a)",
    "def use(k, a) k(k(a))",
    "def use(k, a) integral [0, 1] k(z)*a d(z)",
    "def use(k, a) if k(1) > 0 then a else 0",
    "def use(k, a) if a > 0 then k(a) else k(1)",
    "def use(k, a) integral [0, a] k(1)*z d(z)",
    "def use(k, a) (let s = \\y . k(y) + a in s(2))",
)
ARGUMENTS = ("x", "t", "x*t", "1")


@pytest.mark.parametrize("user", USERS)
@pytest.mark.parametrize("function", FUNCTIONS)
@pytest.mark.parametrize("argument", ARGUMENTS)
def test_what_is_wrong_written_out_is_not_missed(user: str, function: str, argument: str) -> None:
    body = user.split(") ", 1)[1]
    inlined = body.replace("k(", f"({function})(").replace("a", "A").replace("integrAl", "integral")
    inlined = inlined.replace("A", f"({argument})") if "integral" in inlined else inlined.replace("A", argument)
    flat = f"def main(t) integral [0, 1] (({inlined}) + 0*x) d(x)\n"
    passed = f"{user}\ndef main(t) integral [0, 1] (use({function}, {argument}) + 0*x) d(x)\n"
    if verdict(flat):
        assert verdict(passed), (flat, passed)
