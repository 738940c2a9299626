"""Renaming: everywhere it must, nowhere it must not."""

from __future__ import annotations

import pytest
from ide_fixture import Fixture, fixture

import potto.ide as ide


def renamed(text: str, new: str) -> tuple[Fixture, ide.Change | ide.Refused]:
    f = fixture(text)
    return f, ide.rename(f.db, f.file, f.offset, new)


def test_a_local_name_and_its_shadows():
    f, change = renamed("def f(a)\n    b = a\n    $0b + (let b = 2 in b) + b\n", "total")
    assert f.after(change)["main.po"] == "def f(a)\n    total = a\n    total + (let b = 2 in b) + total\n"


def test_a_variable_of_integration_with_its_measure_and_annotation():
    f, change = renamed("def f(a)\n    integral (x ~ normal(0, 1)) $0x^2 d(x)\n", "θ")
    assert f.after(change)["main.po"] == "def f(a)\n    integral (θ ~ normal(0, 1)) θ^2 d(θ)\n"


def test_a_parameter_with_keywords_of_calls_and_derivatives_in_other_modules():
    f, change = renamed(
        """
        # file: r.po
        def render($0c, k) c*k
        drender = deriv(render)
        # file: main.po
        from r import render as r, drender
        y = r(k=1, c=2) + fst(drender(dc=(1, 2), dk=1))
        z = fst(deriv(r)(1, dc=3))
        #> r(c=1, k=2)
        """,
        "centre",
    )
    after = f.after(change)
    assert after["r.po"] == "def render(centre, k) centre*k\ndrender = deriv(render)\n"
    assert "r(k=1, centre=2) + fst(drender(dcentre=(1, 2), dk=1))" in after["main.po"]
    assert "deriv(r)(1, dcentre=3)" in after["main.po"] and "#> r(centre=1, k=2)" in after["main.po"]


def test_from_the_keyword_of_a_derivative():
    f, change = renamed("def g(c) c^2\ny = deriv(g)($0dc=(1, 1))\n", "dcentre")
    assert f.after(change)["main.po"] == "def g(centre) centre^2\ny = deriv(g)(dcentre=(1, 1))\n"
    f, change = renamed("def g(c) c^2\ny = deriv(g)($0dc=(1, 1))\n", "centre")
    assert isinstance(change, ide.Refused) and "`d`" in change.message


def test_a_definition_across_modules_with_members_and_re_exports():
    text = """
        # file: low.po
        def disc(x) x
        # file: mid.po
        from low import disc
        # file: alias.po
        from low import disc as round
        y = round(1)
        # file: main.po
        from mid import disc
        import low
        y = disc(1) + low.disc(2)
        def other(disc) disc
        """
    f, change = renamed(text.replace("def disc", "def $0disc"), "circle")
    after = f.after(change)
    assert after["low.po"] == "def circle(x) x\n" and after["mid.po"] == "from low import circle\n"
    assert after["alias.po"] == "from low import circle as round\ny = round(1)\n"
    tail = "def other(disc) disc\n"
    assert after["main.po"] == "from mid import circle\nimport low\ny = circle(1) + low.circle(2)\n" + tail
    f, again = renamed(text.replace("y = disc(1)", "y = $0disc(1)"), "circle")
    assert f.after(again) == after


def test_an_alias_is_renamed_alone():
    files = "# file: low.po\ndisc = 1\n# file: main.po\n"
    f, change = renamed(files + "from low import disc as round\ny = $0round\n", "circle")
    assert f.after(change) == {"main.po": "from low import disc as circle\ny = circle\n"}


def test_a_module_is_a_file():
    f, change = renamed(
        """
        # file: pkg/low.po
        disc = 1
        # file: pkg/near.po
        from low import disc
        # file: main.po
        import pkg.low
        from pkg.$0low import disc as d
        y = pkg.low.disc + d
        """,
        "deep",
    )
    after = f.after(change)
    assert after["main.po"] == "import pkg.deep\nfrom pkg.deep import disc as d\ny = pkg.deep.disc + d\n"
    assert after["near.po"] == "from deep import disc\n"
    assert change.renames == (ide.FileRename(f.key("pkg/low.po"), f.key("pkg/deep.po")),)


def test_files_that_move_take_their_imports_along():
    f = fixture(
        """
        # file: pkg/low.po
        disc = 1
        # file: pkg/near.po
        from low import disc
        # file: main.po
        from pkg.near import disc
        """
    )
    change = ide.rename_files(f.db, (ide.FileRename(f.key("pkg"), f.key("shapes")),))
    assert f.after(change) == {"main.po": "from shapes.near import disc\n"}
    change = ide.rename_files(f.db, (ide.FileRename(f.key("pkg/near.po"), f.key("near.po")),))
    assert f.after(change) == {"main.po": "from near import disc\n", "near.po": "from pkg.low import disc\n"}


@pytest.mark.parametrize(
    ("text", "new", "why"),
    [
        ("def f($0a) a\n", "if", "word of the language"),
        ("def f($0a) a\n", "1a", "is not a name"),
        ("def f($0a, b) a*b\n", "b", "something else"),
        ("b = 1\ndef f($0a) a*b\n", "b", "something else"),
        ("def f($0a) a*sin(1)\n", "sin", "something else"),
        ("$0a = 1\nb = 2\n", "b", "already defined"),
        ("$0a = 1\nb = sin(2)\n", "sin", "builtin"),
        ("$0a = 1\ndef f(b) a*b\n", "b", "something else"),
        ("y = $0sin(1)\n", "z", "is a builtin"),
        ("y = $0nothing\n", "z", "not defined"),
    ],
)
def test_refused(text, new, why):
    _, change = renamed(text, new)
    assert isinstance(change, ide.Refused) and why in change.message


def test_prepare_gives_the_word():
    f = fixture("def f(alpha) al$0pha\n")
    found = ide.prepare_rename(f.db, f.file, f.offset)
    assert isinstance(found, ide.Renaming) and f.at(found.span) == found.placeholder == "alpha"
    f = fixture("def f(alpha) alpha $0+ 1\n")
    assert ide.prepare_rename(f.db, f.file, f.offset + 1) is None


def test_renaming_in_broken_text():
    f, change = renamed("def f(a)\n    b = if a then\n    $0b * (c\n", "d2")
    assert f.after(change)["main.po"] == "def f(a)\n    d2 = if a then\n    d2 * (c\n"


def test_there_and_back_again():
    text = "# file: m.po\ndef g(a) a*2\n# file: main.po\nfrom m import g\ny = $0g(a=1) + g(2)\n"
    f, change = renamed(text, "h")
    for file in change.files:
        name = file.file
        f.library.files.set_text(name, f.after(change)[name.rpartition("/")[2]])
    back = ide.rename(f.db, f.file, f.offset, "g")
    assert isinstance(back, ide.Change) and len(back.files) == 2
    assert not f.errors()


def test_the_name_of_a_size():
    text = "def f(a: [$0n, m] Real, v: [m] Real) -> [n - 1] Real\n    [a[i + 1, m - 1]*v[0]/n for i in 0..n-2]\n"
    f, change = renamed(text, "rows")
    after = (
        "def f(a: [rows, m] Real, v: [m] Real) -> [rows - 1] Real\n    [a[i + 1, m - 1]*v[0]/rows for i in 0..rows-2]\n"
    )
    assert f.after(change)["main.po"] == after
    f, change = renamed("def f(a: [n] Real, v: [$0n] Real) a[0]*v[n - 1]\n", "v")
    assert isinstance(change, ide.Refused)


def test_a_parameter_that_hides_a_size():
    f, change = renamed("def f($0m: [n, m] Real) m[0, n - 1]\n", "mat")
    assert f.after(change)["main.po"] == "def f(mat: [n, m] Real) mat[0, n - 1]\n"


def test_a_record_in_the_type_of_a_lambda():
    f, change = renamed("record $0Cam(focal: Real)\nf = \\(q: Cam) . q.focal\n", "Lens")
    assert f.after(change)["main.po"] == "record Lens(focal: Real)\nf = \\(q: Lens) . q.focal\n"
