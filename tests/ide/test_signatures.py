"""Signature help: which parameter of which group."""

from __future__ import annotations

import pytest
from ide_fixture import fixture

import potto.ide as ide

FILES = """
# file: r.po
# Renders.
def render(c, shader) shader(c) + sign(c)
drender = deriv(render)
diffeo cond(x, y; c) = (x + y + c, x - y + c)
def curried(a)(b, k) a*b*k
# file: main.po
from r import cond, curried, drender, render
"""


def help_at(text: str) -> tuple[str, str | None, ide.SignatureHelp] | None:
    f = fixture(FILES + text)
    found = ide.signature_help(f.db, f.file, f.offset)
    if found is None:
        return None
    signature = found.signatures[found.active]
    active = signature.active
    shown = None if active is None else signature.parameters[active].span
    return signature.label, None if shown is None else signature.label[shown.start : shown.end], found


@pytest.mark.parametrize(
    ("text", "active"),
    [
        ("print(render($0", "c: Real"),
        ("def half(angle) render(1, $0)", "shader: Real -> Real"),
        ("def half(angle) curried(1)(2, $0", "k: Real*"),
        ("def half(angle)(b) 2*render($0", "c: Real"),
        ("print(render(1, $0", "shader: Real -> Real"),
        ("print(render(shader=f, $0", "c: Real"),
        ("print(render(shader=$0", "shader: Real -> Real"),
        ("print(drender(dc=(1, $0", "dc: (Real, Real)"),
        ("print(drender(dc=(1, 2), $0)", "dshader: "),
        ("print(deriv(render)($0", "dc: (Real, Real)"),
        ("y = cond($0", "x: Real*"),
        ("y = cond(1, 2)($0", "c: Real*"),
        ("y = cond (1, 2) ($0", "c: Real*"),
        ("y = cond (1, 2) $0", "c: Real*"),
        ("y = cond $0", "x: Real*"),
        ("y = sin(cond (1, 2) $0)", "c: Real*"),
        ("print(drender $0)", "dc: (Real, Real)"),
        ("y = (cond (1, 2)) ($0", "c: Real*"),
        ("y = curried(1)(2, $0", "k: Real*"),
        ("y = curried(1)(sin(2), ($0", "k: Real*"),
        ("y = atan2(1, $0", "x: Real*"),
        ("y = clamp(1, $0", "lo: Real*"),
        ("y = sign($0", "x: Real"),
        ("y = max(1, 2, 3, $0", "…"),
        ("y = integral (x ~ normal(0, $0", "s"),
        ("y = deriv($0", "f"),
    ],
)
def test_active_parameter(text, active):
    found = help_at(text)
    assert found is not None
    assert found[1] is not None and found[1].startswith(active)


def test_groups_documentation_and_labels():
    found = help_at("y = cond(1, 2)($0)\n")
    assert found is not None
    assert found[0] == "cond(x: Real*, y: Real*)(c: Real*) -> Diffeo[2]"
    assert len(found[2].signatures) == 2 and found[2].active == 1
    assert help_at("print(render($0))\n")[2].signatures[0].documentation == "Renders."


def test_a_parameter_that_is_a_function():
    found = help_at("def f(g) g(1, 2) + g($0, 1)\n")
    assert found is not None and found[0].startswith("g(Real") and found[1].startswith("Real")


@pytest.mark.parametrize(
    "text", ["y = (1 + $0)", "def f(a, $0)", "y = render(1, 2) + $0", "y = \\(a, $0) . a", "y = nothing($0"]
)
def test_no_signature(text):
    assert help_at(text + "\n") is None
