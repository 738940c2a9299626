"""What features find, marked under the code: carets under a place, and behind them what is found there."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable

from ide_fixture import Fixture, fixture

import potto.ide as ide
from potto.source import Span

Mark = tuple[int, int, str]
_MARK = re.compile(r"^\s*#\s*(\^+)\s*(.*)$")


def marked(text: str) -> tuple[Fixture, list[Mark]]:
    """The program without its marks, and the marks: start, end, and what is said behind the carets."""
    f = fixture(text)
    kept: list[str] = []
    marks: list[Mark] = []
    for line in f.text().splitlines(keepends=True):
        found = _MARK.match(line)
        if found is None:
            kept.append(line)
            continue
        start = sum(map(len, kept[:-1]))
        cut = found.group(2).strip()
        marks.append((start + found.start(1), start + found.end(1), cut))
    before = f.text()[: f.offset]
    removed = sum(len(line) for line in before.splitlines(keepends=True) if _MARK.match(line))
    f.offset -= removed
    f.span = Span(f.offset, f.offset)
    f.texts[f.file] = "".join(kept)
    f.library.files.set_text(f.file, f.texts[f.file])
    return f, marks


def same(found: Iterable[Mark], marks: list[Mark]) -> None:
    assert sorted(found) == sorted(marks)


def highlighted(f: Fixture) -> list[Mark]:
    return [(h.span.start, h.span.end, h.kind) for h in ide.highlights(f.db, f.file, f.offset)]


def test_highlights_of_a_local_name() -> None:
    f, marks = marked(
        """
        def f(c)
            integral [0, c] (let w = x*c in $0w*x + w) d(x)
            #                    ^ write
            #                               ^ read
            #                                     ^ read
        """
    )
    same(highlighted(f), marks)


def test_highlights_of_a_definition() -> None:
    f, marks = marked(
        """
        def f(t) t
        #   ^ write
        y = $0f(1) + f(t=2)
        #   ^ read
        #          ^ read
        """
    )
    same(highlighted(f), marks)


def test_colours_of_variables_of_integration_and_of_parameters_that_must_be_plain() -> None:
    f, marks = marked(
        """
        def f(n, t)
        #     ^ plain
            integral [0, n] (if n > 0 then x*t else 0) d(x)
            #            ^ plain
            #                   ^ plain
            #                              ^ integration
            #                                            ^ integration
        """
    )
    found = [
        (token.span.start, token.span.end, modifier)
        for token in ide.semantic_tokens(f.db, f.file)
        for modifier in token.modifiers
        if modifier in ("plain", "integration")
    ]
    same(found, marks)


def test_what_is_wrong_with_live_expressions() -> None:
    f, marks = marked(
        """
        def f(t) t
        #> f(1, 2)
        #       ^ P0308
        #> nowhere(1)
        #  ^^^^^^^ P0201
        #> f(1)
        #= one
        #  ^^^ P0201
        """
    )
    found = [(said.span.start, said.span.end, said.code) for said in ide.live_diagnostics(f.db, f.file)]
    same(found, marks)


def test_links_of_imports() -> None:
    f, marks = marked(
        """
        # file: shapes/discs.po
        def disc(x) x
        # file: main.po
        from shapes.discs import disc
        #    ^^^^^^^^^^^^ discs.po
        import shapes.discs as d
        #      ^^^^^^^^^^^^ discs.po
        y = d.disc(1) + disc(2)
        """
    )
    found = [(k.span.start, k.span.end, k.target.rpartition("/")[2]) for k in ide.document_links(f.db, f.file)]
    same(found, marks)


def test_places_that_are_edited_together() -> None:
    f, marks = marked(
        """
        def f(t)
            integral [0, 1] $0x*x*t d(x)
            #               ^
            #                 ^
            #                       ^
        """
    )
    same(((span.start, span.end, "") for span in ide.linked_editing(f.db, f.file, f.offset)), marks)


def test_what_can_be_folded() -> None:
    f, _ = marked("# one\n# two\ndef f(t)\n    g(t,\n      1)\nfrom a import b,\n    c\n")
    found = [(fold.kind, f.at(fold.span).splitlines()[0]) for fold in ide.folding_ranges(f.db, f.file)]
    assert found == [("comment", "# one"), ("region", "def f(t)"), ("region", "g(t,"), ("imports", "from a import b,")]


def test_selections_grow_from_a_word_to_the_file() -> None:
    f, _ = marked("def f(a)\n    1 + sin($0a*2)\n")
    grown = [f.at(span).strip() for span in ide.selection_ranges(f.db, f.file, f.offset)]
    assert grown[:3] == ["a", "a*2", "(a*2)"] or grown[:2] == ["a", "a*2"]
    assert grown[-1] == f.text().strip() and all(inner in outer for inner, outer in itertools.pairwise(grown))


def test_the_type_of_a_condition_is_its_diffeomorphism() -> None:
    f, _ = marked(
        """
        # file: half.diffeo
        cond = \\(x, y) . \\c . (x + y + c, x - y + c)
        # file: main.po
        from half import cond
        def f(c)
            integral ([0, 1], [0, 1]) (let inside = cond(x, y)(c) in if $0inside then 1 else 0) d(x, y)
        """
    )
    found = ide.type_definition(f.db, f.file, f.offset)
    assert found is not None and [f.at(t.span, t.file) for t in found.targets] == ["cond"]


# Points


def points(text: str, name: str) -> list[tuple[str, bool]]:
    f = fixture(text)
    return [(point.text, point.chosen) for point in ide.points(f.db, f.file, name)]


def test_points_are_where_live_expressions_and_statements_look() -> None:
    text = "def f(a, b)(c) a*b*c\n#> f(1, 2)(3) + 1\n#> deriv(f)(db=(5, 1), 4)(6)\nprint(f(b=8, 7)(9))\n"
    assert points(text, "f") == [("f(1, 2)(3)", False), ("f(4, 5)(6)", False), ("f(7, 8)(9)", False)]


def test_points_of_functions_of_functions_keep_the_functions() -> None:
    text = "def f(a, s) s(a)\ng = \\x . x^2\n#> deriv(f)(da=(3, 1), deriv(g))\n"
    assert points(text, "f") == [("f(3, g)", False)]
    f = fixture(text)
    (point,) = ide.points(f.db, f.file, "f")
    assert point.slopes == (("a", "deriv(f)((3, 1), deriv(g))"),)


def test_a_point_is_chosen_where_nobody_looks() -> None:
    assert points("def f(a, b) a*b\n", "f") == [("f(0.5, 0.5)", True)]
    assert points("def f(s) s(1)\n", "f") == []
    assert points("y = 2\n", "y") == [("y", False)]


def test_no_point_names_what_only_its_surroundings_know() -> None:
    text = "def f(a) a\n#> sum i in 1..3 (f(i))\nfor v in [1]:\n    print(f(v))\n#> deriv(f)(w)\n"
    assert points(text, "f") == [("f(0.5)", True)]


def test_only_whole_calls_of_definitions_are_points() -> None:
    f = fixture("def f(a)(b) a*b\ny = 1\n")
    for text in ("f(1)", "sin(1)", "y", "f(1)(2)(3)", "f(1, 2)(3)", "f(", "nowhere(1)"):
        assert ide.point_of(f.db, f.file, text) is None, text
    assert ide.point_of(f.db, f.file, "(f(1)(b=2))") == ide.CallPoint(
        "f(1)(2)", (("a", "deriv(f)((1, 1))(2)"), ("b", "deriv(f)(1)((2, 1))"))
    )
