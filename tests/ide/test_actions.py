"""Code actions: what they offer, and that the program is right afterwards."""

from __future__ import annotations

import pytest
from ide_fixture import fixture

import potto.ide as ide
from potto.checking.check import diagnostics


def fixed(text: str, title: str, left: tuple[str, ...] = ()) -> str:
    """The file after an action. Of all files that it changes nothing may be said afterwards but what is `left`."""
    f = fixture(text)
    action = f.actions()[title]
    assert action.change is not None, action
    after = f.act(title)
    for name, given in f.after(action.change).items():
        f.library.files.set_text(f.key(name), given)
    said = [found.diagnostic.code for file in f.texts for found in diagnostics(f.db, file)]
    assert sorted(said) == sorted(left), (said, after)
    return after


def test_plain_condition_becomes_a_bracket():
    text = "def f(t)\n    integral [0, 1] (if x $0< t then 1 else 0) d(x)\n"
    assert "(if [x < t] then 1 else 0)" in fixed(text, "Count the jump: `[x < t]`")
    action = next(iter(fixture(text).actions().values()))
    assert action.preferred and action.codes == ("P0301",) and action.kind == "quickfix"


def test_plain_condition_becomes_a_completed_diffeomorphism():
    text = "def f(t)\n    integral ([0, 1], [0, 1]) ((x + y $0>= t) ? 1 : 0) d(x, y)\n"
    assert "((diffeo(x + y - t, x)) ? 1 : 0)" in fixed(text, "Make it the diffeomorphism `diffeo(x + y - t, x)`")
    text = "def f(t)\n    integral [0, 1] (if x^3 $0< t then 1 else 0) d(x)\n"
    assert "if diffeo(t - x^3) then" in fixed(text, "Make it the diffeomorphism `diffeo(t - x^3)`")


def test_the_whole_condition_is_bracketed_also_in_another_definition():
    text = "def f(t)\n    integral [0, 1] (if x < t and $0x > 0.2 then 1 else 0) d(x)\n"
    assert "if [x < t and x > 0.2] then" in fixed(text, "Count the jump: `[x < t and x > 0.2]`")
    text = "def f(t)\n    integral [0, 1] (let p = x < t in if $0p then 1 else 0) d(x)\n"
    assert "if [p] then" in fixed(text, "Count the jump: `[p]`")
    text = "def step(y) if y > 0 then 1 else 0\n\ndef f(t)\n    integral [0, 1] step($0x - t) d(x)\n"
    assert fixed(text, "Count the jump in `step`: `[y > 0]`").startswith("def step(y) if [y > 0] then 1 else 0\n")


def test_no_bracket_is_offered_where_it_would_be_the_next_mistake():
    for text in ("if x $0== t then 1 else 0", "if x $0!= t then 1 else 0", "if not (x $0== t) then 1 else 0"):
        f = fixture(f"def f(t)\n    integral [0, 1] ({text}) d(x)\n")
        assert f.errors() and not [title for title in f.actions() if title.startswith(("Count", "Make"))], text


def test_did_you_mean():
    assert fixed("def f(alpha) $0alpa + 1\n", "Change to `alpha`") == "def f(alpha) alpha + 1\n"
    files = "# file: shapes.po\ndisc = 1\n# file: main.po\n"
    assert fixed(files + "from $0shpes import disc\ny = disc\n", "Change to `shapes`").startswith("from shapes import")
    assert fixed(files + "from shapes import $0dsc\n", "Change to `disc`") == "from shapes import disc\n"
    assert fixed(files + "import shapes\ny = shapes.$0dsc\n", "Change to `disc`").endswith("y = shapes.disc\n")


def test_import_a_name_or_a_module():
    files = "# file: shapes.po\ndef disc(x) x\n# file: main.po\n"
    assert fixed(files + "y = $0disc(1)\n", "Import `disc` from `shapes`") == "from shapes import disc\n\ny = disc(1)\n"
    after = fixed(files + "y = $0shapes.disc(1)\n", "Import the module `shapes`")
    assert after == "import shapes\n\ny = shapes.disc(1)\n"


def test_define_a_missing_name():
    assert fixed("def f(a) $0gain*a\n", "Define `gain`") == "gain = 0\n\ndef f(a) gain*a\n"
    after = fixed("def f(a) $0gain(a, 2)(k=1)*a\n", "Define `gain`")
    assert after == "def gain(a, x)(k)\n    0\n\ndef f(a) gain(a, 2)(k=1)*a\n"
    assert fixed("def f(a) $0gain*a\n", "Make `gain` a parameter of `f`") == "def f(a, gain) gain*a\n"


def test_write_down_the_inverse():
    text = "diffeo $0turn(x, y; c) = (x + y + c, x - y)\n"
    after = fixed(text, "Write down the inverse")
    assert after.startswith(text.replace("$0", "").rstrip() + "\n    inverse (u, v) . (")


def test_an_inverse_to_fill_in():
    text = "diffeo odd(x, y) = ($0x + sin(x + y^3) + y^5, x*y)\n"
    f = fixture(text)
    if "P0402" in f.errors():
        assert "inverse (u, v) . (x, y)" in f.act("Add an `inverse` to fill in")


def test_remove_what_is_not_used():
    files = "# file: m.po\na = 1\nb = 2\n# file: main.po\n"
    assert fixed(files + "from m import $0a, b\ny = b\n", "Remove the import of `a`") == "from m import b\ny = b\n"
    assert fixed(files + "from m import a, $0b\ny = a\n", "Remove the import of `b`") == "from m import a\ny = a\n"
    assert fixed(files + "from m import $0a\ny = 1\n", "Remove the import of `a`") == "y = 1\n"
    assert fixed("def f(a)\n    $0b = 1\n    a\n", "Remove `b`") == "def f(a)\n    a\n"
    assert fixed("def f(a) let $0b = 1 in a\n", "Remove `b`") == "def f(a) a\n"
    assert fixed("def f(a) let c = 2; $0b = 1 in a*c\n", "Remove `b`") == "def f(a) let c = 2 in a*c\n"
    after = fixed("def f(a)\n    integral [0, 1] a d($0x)\n", "Rename it to `_x`")
    assert after == "def f(a)\n    integral [0, 1] a d(_x)\n"


@pytest.mark.parametrize(
    ("text", "after"),
    [
        ("def f(a) if $0a > 0 then a else -a\n", "def f(a) a > 0 ? a : -a\n"),
        ("def f(a) 1 + (a $0> 0 ? a : -a)\n", "def f(a) 1 + (if a > 0 then a else -a)\n"),
        ("def f(a) 2*(if $0a > 0 then (if a > 1 then 1 else 2) else 3)\n", None),
    ],
)
def test_swap_conditionals(text, after):
    f = fixture(text)
    title = next(t for t in f.actions() if t.startswith("Write it with"))
    result = fixed(text, title)
    assert after is None or result == after
    f.library.files.set_text(f.file, result)
    assert not f.errors()


def test_extract_a_local_name():
    text = "def f(a)\n    b = 2\n    a + $<a*b$> + 1\n"
    assert fixed(text, "Extract to a local name") == "def f(a)\n    b = 2\n    value = a*b\n    a + value + 1\n"
    text = "def f(a) a + $<a*2$>\n"
    assert fixed(text, "Extract to a local name") == "def f(a)\n    value = a*2\n    a + value\n"
    text = "def f(a)\n    integral [0, a] sin($<x*a$>)*x d(x)\n"
    after = fixed(text, "Extract to a local name")
    assert after == "def f(a)\n    integral [0, a] let value = x*a in sin(value)*x d(x)\n"
    text = "y = 1 + $<2*3$>\n"
    assert fixed(text, "Extract to a local name") == "y = let value = 2*3 in 1 + value\n"


def test_extract_a_definition():
    text = "def f(a)\n    integral [0, a] sin($<x*a$>)*x d(x)\n"
    after = fixed(text, "Extract to a definition")
    assert after == "def extracted(a, x)\n    x*a\n\ndef f(a)\n    integral [0, a] sin(extracted(a, x))*x d(x)\n"
    action = fixture(text).actions()["Extract to a definition"]
    assert after[action.rename_at :].startswith("extracted(a, x)")
    after = fixed("value = 1\ny = $<2*pi$>\n", "Extract to a definition")
    assert after == "value = 1\nextracted = 2*pi\n\ny = extracted\n"


def test_a_bracket_that_decides_stays_in_its_place():
    text = "def f(t)\n    integral [0, 1] (if $<[x < t]$> then x else 1) d(x)\n"
    assert "Extract to a definition" not in fixture(text).actions()
    assert "let value = [x < t] in (if value then x else 1)" in fixed(text, "Extract to a local name")
    text = "def f(t)\n    integral [0, 1] (if [x < t] then $<[x > 0.5]$>*x*t else 1) d(x)\n"
    assert "def extracted(x)\n    [x > 0.5]\n" in fixed(text, "Extract to a definition")


def test_what_an_index_or_a_condition_holds_is_not_carried_out_of_it():
    text = "def f(x, n) sum k in 0..n ($<x^k$>/2)\n"
    assert "(let value = x^k in value / 2)" in fixed(text, "Extract to a local name").replace("value/2", "value / 2")
    text = "def fact(n) if n > 0 then n*$<fact(n - 1)$> else 1\n"
    assert "then let value = fact(n - 1) in n*value else 1" in fixed(text, "Extract to a local name")


def test_inline_a_local_name():
    assert fixed("def f(a)\n    $0b = a + 1\n    b*2 + b\n", "Inline `b`") == "def f(a)\n    (a + 1)*2 + (a + 1)\n"
    assert fixed("def f(a) let b = a in $0b*2\n", "Inline `b`") == "def f(a) a*2\n"


def test_inline_is_refused_where_it_would_capture():
    f = fixture("def f(a)\n    $0b = a + 1\n    integral [0, 1] (let a = 2 in a*b*x) d(x)\n")
    assert f.actions()["Inline `b`"].disabled


def test_complete_the_arguments_of_a_dual_call():
    text = "def g(c, shader) shader(c) + sign(c)\ndg = deriv(g)\ndef shader(x) x^2\nprint(dg($0))\n"
    assert fixed(text, "Complete the arguments of `dg`").endswith("print(dg(dc=(0, 1), dshader=deriv(shader)))\n")
    text = "def g(a, b) a*b\nprint(deriv(g)(db=2, $0))\n"
    assert fixed(text, "Complete the arguments of `dg`").endswith("print(deriv(g)(db=2, da=(0, 1)))\n")
    text = "def g(a, b) a*b\nprint(deriv(g)(da=(0.5, $01)))\n"
    assert fixed(text, "Complete the arguments of `dg`").endswith("print(deriv(g)(da=(0.5, 1), db=(0, 1)))\n")
    assert not fixture("def g(a, b) a*b\nprint(deriv(g)(da=(0.5, $01), db=2))\n").actions()
    text = "def g(a, b) a*b\nprint($0g(2))\n"
    assert fixed(text, "Complete the arguments of `g`").endswith("print(g(2, b=0))\n")


def test_imports_in_order():
    files = "# file: a.po\nx = 1\ny = 2\nunused = 3\n# file: b.po\nz = 1\n# file: main.po\n"
    text = files + "from b import z\nfrom a import $0y\nfrom a import unused, x\nw = x + y + z\n"
    after = fixed(text, "Sort the imports", ("P0620",))
    assert after == "from a import unused, x, y\nfrom b import z\nw = x + y + z\n"
    assert fixed(text, "Remove all unused imports") == "from a import x, y\nfrom b import z\nw = x + y + z\n"


@pytest.mark.parametrize(
    ("text", "title", "after"),
    [
        ("$0f(x) = x^2", "Write `def f(x)`", "def f(x) x^2"),
        ("def f(x) $0= x^2", "Take out `=`", "def f(x) x^2"),
        ("def f(x) x$0**2", "Write `^`", "def f(x) x^2"),
        ("def f(x) x$0²", "Write `^2`", "def f(x) x^2"),
        ("def f(x) $02x", "Write `2*x`", "def f(x) 2*x"),
        ("def f(x) $0.5*x", "Write `0.5`", "def f(x) 0.5*x"),
        ("def f(x) if $0!(x > 0) then 1 else 2", "Write `not`", "def f(x) if not(x > 0) then 1 else 2"),
        ("def f(x) if x $0= 1 then 2 else 3", "Write `==`", "def f(x) if x == 1 then 2 else 3"),
        ("def f(x) if x > 0$0: 1 else 2", "Write `then`", "def f(x) if x > 0 then 1 else 2"),
        ("def f(x) $0(x + 1", "Write `)`", "def f(x) (x + 1)"),
        ("def f(x) x*(2 + 3)$0)", "Take out `)`", "def f(x) x*(2 + 3)"),
        ("def f(x) $0return x", "Take out `return`", "def f(x) x"),
        ("$0var x = 3", "Take out `var`", "x = 3"),
        ("def f(x) $0x < 1", "Write `[x < 1]`", "def f(x) [x < 1]"),
    ],
)
def test_what_the_help_says_to_write(text, title, after):
    assert fixed(text + "\n", title) == after + "\n"
    action = fixture(text + "\n").actions()[title]
    assert action.kind == "quickfix" and action.preferred


@pytest.mark.parametrize(
    "text",
    [
        "def f(x) x $0% 2",
        "def f(x) $0|x|",
        "def f(x) integral $0[0 1] x d(x)",
        "def f(x) $0integral [0, x] t^2",
        "$0import",
    ],
)
def test_what_only_the_author_knows_is_not_written(text):
    assert not [title for title in fixture(text + "\n").actions() if title.startswith(("Write", "Take"))]


def test_kinds_are_filtered():
    f = fixture("def f(a)\n    $<a + 1$>\n")
    found = ide.code_actions(f.db, f.file, f.span, ("refactor.extract",))
    assert found and all(a.kind == "refactor.extract" and a.change is None for a in found)
    assert ide.code_actions(f.db, f.file, f.span, ("source",)) == ()


def test_an_action_of_an_old_text_is_disabled():
    f = fixture("def f(a) $0gain*a\n")
    action = next(a for a in ide.code_actions(f.db, f.file, f.span) if a.title == "Define `gain`")
    f.library.files.set_text(f.file, "def f(a) a\n")
    assert ide.resolve_code_action(f.db, action).disabled


def test_give_a_number_its_tangent():
    head = "def f(t) t^2\ndef g(a, b) a*b\n"
    for before, after in (
        ("deriv(f)($00.3)", "deriv(f)((0.3, 1))"),
        ("deriv(f)(dt=$00.3)", "deriv(f)(dt=(0.3, 1))"),
        ("deriv(f) $00.3", "deriv(f) ((0.3, 1))"),
        ("deriv(g)($00.3 + 1, 2)", "deriv(g)((0.3 + 1, 1), 2)"),
        ("deriv(g)(($00.3, 2))", "deriv(g)(((0.3, 1), 2))"),
        ("deriv(deriv(f))($00.3)", "deriv(deriv(f))(((0.3, 1), (1, 0)))"),
    ):
        f = fixture(f"{head}a = {before}\n")
        title = next(title for title in f.actions() if title.startswith("Write `("))
        assert fixed(f"{head}a = {before}\n", title) == f"{head}a = {after}\n"


@pytest.mark.parametrize(
    ("live", "title", "after"),
    [
        ("f$0((0.5 + 1)", "Write `)`", "f((0.5 + 1))"),
        ("f(0.5)$0)", "Take out `)`", "f(0.5)"),
    ],
)
def test_what_stands_in_a_live_expression_is_mended_too(live: str, title: str, after: str) -> None:
    f = fixture(f"def f(t) t^2\n\n#> {live}\n#= 0.25\n")
    assert title in f.actions(), list(f.actions())
    assert f"#> {after}\n#= 0.25\n" in f.act(title)
