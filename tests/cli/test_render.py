"""How diagnostics look, to people and to machines."""

from __future__ import annotations

from textwrap import dedent

from potto.diagnostics import Diagnostic, Related
from potto.reports.excerpt import printable, width
from potto.reports.render import COLORS, Located, render, summary, to_json
from potto.source import SourceText, Span

PROGRAM = "def f(t)\n    integral [0, 1] (if x < t then 1 else 0) d(x)\n"


def show(text: str, diagnostic: Diagnostic, inline: bool = False, **others: str) -> str:
    texts = {"main.po": text, **{f"{name}.po": other for name, other in others.items()}}
    sources = {name: SourceText(name, content) for name, content in texts.items()}
    return render(Located("main.po", diagnostic), sources.get, inline_header=inline)


def at(text: str, part: str) -> Span:
    start = text.index(part)
    return Span(start, start + len(part))


def error(span: Span, label: str = "", *related: Related, message: str = "wrong", help: str = "") -> Diagnostic:
    return Diagnostic("P0301", "error", message, span, label, related, (), help)


def expect(shown: str, wanted: str) -> None:
    assert shown == dedent(wanted).strip("\n")


def test_the_example_of_the_style_page() -> None:
    diagnostic = error(
        at(PROGRAM, "x < t"),
        "varies inside the integral",
        Related(at(PROGRAM, "x)"), "`x` is bound here"),
        message="this condition depends on the variable of integration `x`",
        help="state the jump as a diffeomorphic condition, `[x < t]`, so that its boundary term is counted",
    )
    expect(
        show(PROGRAM, diagnostic),
        """
        error[P0301]: this condition depends on the variable of integration `x`
         --> main.po:2:25
          |
        2 |     integral [0, 1] (if x < t then 1 else 0) d(x)
          |                         ^^^^^                  -- `x` is bound here
          |                         varies inside the integral
          = help: state the jump as a diffeomorphic condition, `[x < t]`, so that its boundary term is counted
        """,
    )


def test_check_puts_the_place_in_front() -> None:
    expect(
        show("a = b\n", error(Span(4, 5), "not defined"), inline=True),
        """
        main.po:1:5: error[P0301]: wrong
          |
        1 | a = b
          |     ^ not defined
        """,
    )


def test_labels_on_one_line_hang_from_bars() -> None:
    text = "a + b + c\n"
    related = (Related(Span(4, 5), "second"), Related(Span(8, 9), "third"))
    expect(
        show(text, error(Span(0, 1), "first", *related)),
        """
        error[P0301]: wrong
         --> main.po:1:1
          |
        1 | a + b + c
          | ^   -   - third
          | |   second
          | first
        """,
    )


def test_lines_between_marks_are_left_out_unless_there_is_only_one() -> None:
    text = "".join(f"line{n}\n" for n in range(1, 13))
    related = (Related(at(text, "line3"), "here"), Related(at(text, "line12"), "there"))
    expect(
        show(text, error(at(text, "line1"), "first", *related)),
        """
        error[P0301]: wrong
          --> main.po:1:1
           |
         1 | line1
           | ^^^^^ first
         2 | line2
         3 | line3
           | ----- here
        ...
        12 | line12
           | ------ there
        """,
    )


def test_a_span_over_many_lines_shows_its_ends() -> None:
    text = "def f(t)\n    a = 1\n    b = 2\n    c = 3\n    d = 4\n    a\n"
    expect(
        show(text, error(Span(0, len(text) - 1), "all of this")),
        """
        error[P0301]: wrong
         --> main.po:1:1
          |
        1 | def f(t)
          | ^^^^^^^^
        2 |     a = 1
          |     ^^^^^
        ...
        6 |     a
          |     ^ all of this
        """,
    )


def test_places_in_other_files() -> None:
    related = Related(Span(4, 5), "defined here", file="other.po")
    expect(
        show("a = b\n", error(Span(4, 5), "used", related), other="\n\ndef b(x) x\n"),
        """
        error[P0301]: wrong
         --> main.po:1:5
          |
        1 | a = b
          |     ^ used
         ::: other.po:3:3
          |
        3 | def b(x) x
          |   - defined here
        """,
    )


def test_wide_characters_and_tabs_keep_the_carets_in_place() -> None:
    text = "a\t漢字 = θ + é2\n"
    lines = show(text, error(at(text, "θ"), "here")).splitlines()
    source, carets = lines[3], lines[4]
    before = source[: source.index("θ")]
    assert width(before) == carets.index("^")
    assert "\t" not in source


def test_a_long_line_is_cut_around_its_mark() -> None:
    text = "x" * 5000 + " bad " + "y" * 10_000_000
    shown = show(text, error(at(text, "bad"), "this"))
    source, carets = shown.splitlines()[3:5]
    assert len(source) < 130 and "..." in source
    assert source.index("bad") == carets.index("^^^")


def test_a_place_past_the_end_and_an_empty_file() -> None:
    assert "main.po:1:1" in show("", error(Span(7, 9), "end"))
    assert "main.po:2:1" in show("a\n", error(Span(2, 2), "end"))


def test_nothing_in_a_program_reaches_the_terminal_as_a_command() -> None:
    text = "a = \x1b[31m\u202e\x07\n"
    shown = show(text, error(Span(4, 5), "x\x1b", message="bad \x1b]0;title\x07"))
    assert "\x1b" not in shown and "\x07" not in shown and "\u202e" not in shown
    assert printable("plain θ") == "plain θ"


def test_colours_only_add_codes() -> None:
    import re

    diagnostic = error(at(PROGRAM, "x < t"), "varies", Related(at(PROGRAM, "f(t)"), "in this"), help="do it")
    sources = {"main.po": SourceText("main.po", PROGRAM)}.get
    coloured = render(Located("main.po", diagnostic), sources, palette=COLORS)
    plain = [line.rstrip() for line in re.sub(r"\x1b\[[0-9;]*m", "", coloured).splitlines()]
    assert "\x1b[1;31merror[P0301]" in coloured
    assert plain == render(Located("main.po", diagnostic), sources).splitlines()


def test_machines_get_utf16() -> None:
    text = "𝜃𝜃 = b\n"  # two characters outside of the basic plane: two UTF-16 units each
    sources = {"main.po": SourceText("main.po", text)}.get
    shown = to_json(Located("main.po", error(at(text, "b"), "x", Related(Span(0, 1), "there"))), sources)
    assert shown["range"] == {"start": {"line": 0, "character": 7}, "end": {"line": 0, "character": 8}}
    assert shown["related"][0]["range"]["end"] == {"line": 0, "character": 2}
    assert {"code", "severity", "message", "file", "range", "related", "help"} <= set(shown)


def test_a_diagnostic_without_a_place() -> None:
    located = Located(None, error(Span(0, 0), message="no such setting", help="use rtol"))
    assert render(located, lambda file: None) == "error[P0301]: no such setting\n  = help: use rtol"


def test_counting() -> None:
    warning = Diagnostic("P0601", "warning", "w", Span(0, 0))
    assert summary([Located(None, error(Span(0, 0))), Located(None, warning)]) == "1 error, 1 warning"
    assert summary([]) == ""
