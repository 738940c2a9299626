"""What is drawn over the text: colours, hints, lenses, values; and its layout."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from ide_fixture import Fixture, edited, fixture

import potto.ide as ide
from potto.ide.actions.edits import applied, minimal
from potto.source import Span
from potto.syntax import format_source

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def coloured(f: Fixture, span: Span | None = None) -> list[tuple[str, str]]:
    found = ide.semantic_tokens(f.db, f.file, span)
    return [(f.at(t.span), ".".join((t.type, *sorted(set(t.modifiers) - {"readonly"})))) for t in found]


COLOURS = """
    # file: half.diffeo
    cond = \\(x, y) . \\c . (x + y + c, x - y + c)
    # file: main.po
    from half import cond
    import half as h
    # Says something.
    def f(a, g)
        b = if a > 0 then 1 else 2.5
        integral (x ~ normal(0, 1)) g(x)*[cond(x, b)(a) ? 1 : 0 > sin(pi)] d(x)
    df = deriv(f)
    print(df(da=(1, 1), g))
    #> f(a=1, sin)
    """


def test_tokens_say_what_words_mean():
    f = fixture(COLOURS)
    found = coloured(f)
    for word, kind in [
        ("from", "keyword"), ("half", "namespace"), ("cond", "function.diffeo"), ("h", "namespace.declaration"),
        ("# Says something.", "comment"), ("f", "function.declaration.definition"),
        ("a", "parameter.declaration.plain"), ("g", "function.declaration"), ("b", "variable.declaration"),
        ("2.5", "number"), ("x", "variable.declaration.integration"), ("x", "variable.integration"),
        ("normal", "type.defaultLibrary"), ("sin", "function.defaultLibrary"), ("pi", "variable.defaultLibrary"),
        ("df", "function.declaration.definition"), ("deriv", "function.defaultLibrary"), ("print", "keyword"),
        ("da", "property"), (">", "operator"), ("a", "parameter.plain"), ("d", "keyword"), ("integral", "keyword"),
    ]:  # fmt: skip
        assert (word, kind) in found, (word, kind, [k for w, k in found if w == word])
    assert found[-6:-2] == [("#> ", "comment.documentation"), ("f", "function"), ("a", "property"), ("=", "operator")]


def test_types_are_coloured_and_names_that_are_called_like_one_are_not():
    assert ("Real", "type.defaultLibrary") in coloured(fixture("def f(a: Real*) -> Real a^2\n"))
    found = coloured(fixture("def f(Dist) Dist^2\n"))
    assert ("Dist", "parameter.declaration") in found and ("Dist", "type.defaultLibrary") not in found


def test_tokens_of_a_range_are_those_of_the_file_there():
    f = fixture(COLOURS)
    span = Span(f.find("b = if"), f.find("df = "))
    whole = [t for t in ide.semantic_tokens(f.db, f.file) if t.span.start < span.end and span.start < t.span.end]
    assert list(ide.semantic_tokens(f.db, f.file, span)) == whole


def hints(text: str) -> tuple[Fixture, list[tuple[str, str]]]:
    f = fixture(text)
    found = ide.inlay_hints(f.db, f.file, Span(0, len(f.text())))
    return f, [(f.text()[: h.offset].splitlines()[-1].split()[-1] if h.offset else "", h.label) for h in found]


def test_hints_show_types_and_what_completes_a_condition():
    body = "(let u = x*s in g(u)*[x^2 + y^2 < r^2])"
    f, found = hints(f"def f(r, g)\n    s = r*2\n    integral ([0, 1], [0, 1]) {body} d(x, y)\n")
    labels = [label for _, label in found]
    assert labels[:3] == [": Real", ": Real* -> Real", "-> Real"]
    assert ": Real[x]" in labels and " diffeo(…, x)" in labels
    every = [ide.resolve_inlay_hint(f.db, h) for h in ide.inlay_hints(f.db, f.file, Span(0, len(f.text())))]
    assert all(h.tooltip for h in every)
    assert any("- determinant: `2*y`" in h.tooltip for h in every)


def test_a_hint_can_be_written_down():
    f = fixture("def f(r)\n    integral ([0, 1], [0, 1]) (if diffeo(x + y - r) then 1 else 0) d(x, y)\n")
    text = edited(f.text(), [e for h in ide.inlay_hints(f.db, f.file, Span(0, len(f.text()))) for e in h.edits])
    assert text.startswith("def f(r: Real) -> Real\n    integral ([0, 1], [0, 1]) (if diffeo(x + y - r, x) then")
    f.library.files.set_text(f.file, text)
    assert f.errors() == [] and ide.inlay_hints(f.db, f.file, Span(0, len(text))) == ()


def test_hints_of_a_range_only():
    f = fixture("a = 1\nb = 2\n")
    assert len(ide.inlay_hints(f.db, f.file, Span(6, 11))) == 1


def test_lenses():
    f = fixture("def f(t) integral [0, 1] [x < t] d(x)\ny = f(1)\nprint(y)\nprint(y)\n#> f(0.5)\n")
    found = [ide.resolve_code_lens(f.db, lens) for lens in ide.code_lenses(f.db, f.file)]
    assert [(lens.command, lens.title) for lens in found] == [
        ("value", "evaluate f(0.5)"), ("more", "more"), ("value", "evaluate"), ("more", "more"), ("run", "run"),
    ]  # fmt: skip
    assert found[0].arguments[1] == "f(0.5)"
    assert [(offer.command, offer.title) for offer in ide.offered(f.db, f.file, "f")] == [
        ("evaluate", "evaluate f(0.5)"), ("differentiate", "differentiate f(0.5)"),
        ("showDerivative", "show derivative (1 surface)"), ("showReferences", "2 references"),
    ]  # fmt: skip
    assert [(offer.command, offer.title) for offer in ide.offered(f.db, f.file, "y")] == [
        ("evaluate", "evaluate"), ("showReferences", "2 references"),
    ]  # fmt: skip
    assert "boundary" in fixture("def f(t) integral [0, 1] [x < t] d(x)\n").hover("f(")
    assert "boundary" in (ide.derivative_markdown(f.db, f.file, "f") or "")


def test_a_record_is_not_evaluated():
    f = fixture("record Point(x: Real, y: Real)\n#> Point(1, 2).x\n")
    assert [lens.command for lens in ide.code_lenses(f.db, f.file)] == ["more"]
    assert [offer.command for offer in ide.offered(f.db, f.file, "Point")] == ["showReferences"]


def test_inline_values_are_expressions():
    f = fixture("def f(x) x\ny = f(1)\nprint(f(2), y)\n#> f(0.5)\n")
    found = ide.inline_values(f.db, f.file, Span(0, len(f.text())))
    assert [v.text for v in found] == ["y", "f(2)", "y", "f(0.5)"]
    assert all(f.at(v.span) == v.text for v in found)


@pytest.mark.parametrize("path", sorted(EXAMPLES.rglob("*.po")), ids=lambda p: p.name)
def test_formatting_by_edits_is_formatting(path):
    text = path.read_text(encoding="utf-8").replace(" + ", "+  ").replace(", ", " ,")
    f = fixture("y = 1\n")
    f.library.files.set_text(f.file, text)
    edits = ide.format_document(f.db, f.file)
    assert edited(text, edits) == format_source(text)
    assert all(len(e.span) + len(e.text) < 60 for e in edits) or len(edits) < 3


def test_formatting_keeps_line_ends_and_what_is_right():
    f = fixture("y = 1\n")
    for text, after in [
        ("y  =1\r\nz=2\r\n", "y = 1\r\nz = 2\r\n"),
        ("\n\n\ny=1\n\n\n\n\n\nz=2", "y = 1\n\n\nz = 2\n"),
        ("y = 1\n", "y = 1\n"),
        ("y = (1\n", "y = (1\n"),
        ("", ""),
    ]:
        assert after == format_source(text)
        f.library.files.set_text(f.file, text)
        assert edited(text, ide.format_document(f.db, f.file)) == after


def test_formatting_a_range_leaves_the_rest():
    f = fixture("a  = 1\nb  = $<2\nc  = 3$>\nd2  = 4\n")
    assert edited(f.text(), ide.format_range(f.db, f.file, f.span)) == "a  = 1\nb = 2\nc = 3\nd2  = 4\n"


@pytest.mark.parametrize(
    ("text", "typed", "after"),
    [
        ("def f(x)\n$0", "\n", "def f(x)\n    "),
        ("def f(x) x\n$0", "\n", "def f(x) x\n"),
        ("def f(x)\n    g(x,\n    $0", "\n", "def f(x)\n    g(x,\n        "),
        ("for v in [1]:\n$0", "\n", "for v in [1]:\n    "),
        ("def f(x)\n    g(\n        x\n        )$0", ")", "def f(x)\n    g(\n        x\n    )"),
        ("y = (1 + 2)$0", ")", "y = (1 + 2)"),
        ("# def f(x)\n$0", "\n", "# def f(x)\n"),
        ("def f(x)\n    s=1+x\n    $0", "\n", "def f(x)\n    s=1+x\n    "),  # nothing to read yet
        ("def f(x)\n    s=1+x\n    $0\n    s*x", "\n", "def f(x)\n    s = 1 + x\n    \n    s*x"),
        ("y=f( 1,2 )\n$0", "\n", "y = f(1, 2)\n"),
    ],
)
def test_formatting_while_typing(text, typed, after):
    f = fixture(text)
    f.library.files.set_text(f.file, f.text()[:-1])  # without the end of the last line
    assert edited(f.text()[:-1], ide.format_on_type(f.db, f.file, f.offset, typed)) == after


def test_symbols_of_an_empty_file():
    f = fixture("\n")
    assert ide.document_symbols(f.db, f.file) == () and ide.semantic_tokens(f.db, f.file) == ()
    assert ide.hover_at(f.db, f.file, 0) is None and ide.code_lenses(f.db, f.file) == ()
    assert "def" in [i.label for i in ide.completions(f.db, f.file, 0).items]


def test_a_file_that_is_not_there():
    f = fixture("y = 1\n")
    nowhere = f.key("nothing.po")
    assert ide.hover_at(f.db, nowhere, 3) is None and ide.document_symbols(f.db, nowhere) == ()
    assert ide.format_document(f.db, nowhere) == () and ide.code_actions(f.db, nowhere, Span(0, 0)) == ()


@pytest.mark.parametrize("seed", range(40))
def test_edits_of_blanks_make_the_new_text_and_touch_nothing_else(seed: int) -> None:
    rng = random.Random(seed)
    words = [rng.choice(["a", "b+", "é", "(", "[x", "\\y"]) for _ in range(rng.randrange(30))]
    old, new = ("".join(word + rng.choice(["", " ", "  ", "\n", "\n    ", "\t"]) for word in words) for _ in range(2))
    edits = minimal(old, new, 7)
    assert applied("-" * 7 + old, edits) == "-" * 7 + new
    assert all(not (("-" * 7 + old)[e.span.start : e.span.end] + e.text).strip() for e in edits)


def test_edits_of_a_long_line_are_one_for_each_place() -> None:
    """A search for what both have in common would take the square of its length."""
    old = "+".join(f"a{i}" for i in range(20_000))
    new = old.replace("+", " + ")
    edits = minimal(old, new)
    assert len(edits) == 2 * 19_999 and applied(old, edits) == new
    lines = [f"a{i}" if i % 2 else f"a{i} " for i in range(20_000)]
    assert len(minimal("\n".join(lines), "\n".join(line.strip() for line in lines))) == 10_000


def test_a_scene_is_given_what_fits_from_the_whole_workspace_and_the_reach_of_its_numbers():
    f = fixture("""
# file: far/away.po
def third(x, y)(c) x*y*c
# file: beside.po
def second(x, y)(c) x + y + c
def other(x) x
# file: main.po
def first(x, y)(c) x - y
def drawn(c, shader) integral ([0, 1], [0, 1]) shader(x, y)(c) d(x, y)
#> drawn(-1, first)
#> drawn(c=3, shader=first)
#> drawn(0.5, first)
""")
    (scene,) = (scene for scene in ide.scenes(f.db, f.file) if scene.name == "drawn")
    number, shader = scene.parameters
    assert (number.value, number.reach) == ((-1,), (-1, 3))
    assert shader.reach is None and shader.fits[:2] == ("first", "beside.second")
    assert set(shader.fits) >= {"far.away.third"} and "beside.other" not in shader.fits
