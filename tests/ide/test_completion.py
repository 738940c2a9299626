"""Completion: what can stand where the cursor is."""

from __future__ import annotations

import time

from ide_fixture import fixture

import potto.ide as ide


def test_local_names_definitions_imports_builtins_and_keywords():
    f = fixture(
        """
        # file: shapes.po
        def disc(x, y) 1
        # file: main.po
        from shapes import disc
        half = 0.5
        def f(a, b)
            c = a*b
            integral [0, 1] (c + $0) d(x)
        """
    )
    labels = f.labels()
    for wanted in ("a", "b", "c", "x", "f", "half", "disc", "sin", "pi", "deriv", "if", "integral", "let"):
        assert wanted in labels, wanted
    assert "def" not in labels and "normal" not in labels
    order = sorted(ide.completions(f.db, f.file, f.offset).items, key=lambda item: item.sort)
    labels = [item.label for item in order]
    places = [labels.index(name) for name in ("c", "half", "disc", "sin", "if")]
    assert places == sorted(places)


def test_types_and_documentation_wait_for_resolve():
    f = fixture("# Doubles.\ndef twice(a) 2*a\n\ny = tw$0\n")
    found = next(i for i in ide.completions(f.db, f.file, f.offset).items if i.label == "twice")
    assert not found.detail and not found.documentation
    item, text = f.complete("twice")
    assert item.detail == "(a: Real*) -> Real" and "Doubles." in item.documentation and item.kind == "function"
    assert text == "# Doubles.\ndef twice(a) 2*a\n\ny = twice\n"


def test_local_names_resolve_to_their_types():
    f = fixture("def f(a)\n    integral [0, 1] (xx$0) d(xx)\n")
    item, _ = f.complete("xx")
    assert item.detail == "Real[xx]" and "variable of integration" in item.documentation


def test_an_inner_name_hides_an_outer_one_and_later_lines_are_not_seen():
    f = fixture("a = 1\ndef f(a)\n    b = $0a\n    c = 1\n    b + c\n")
    items = ide.completions(f.db, f.file, f.offset).items
    assert [i.kind for i in items if i.label == "a"] == ["parameter"]
    assert "c" not in f.labels() and "b" not in f.labels()


def test_members_of_a_module_and_what_it_passes_on():
    f = fixture(
        """
        # file: low.po
        base = 1
        # file: shapes.po
        from low import base as ground
        def disc(x, y) x*y
        # file: main.po
        import shapes as s
        y = s.$0
        """
    )
    assert f.labels() == ["disc", "ground"]
    item, text = f.complete("disc")
    assert text.endswith("y = s.disc\n") and item.detail.startswith("(x: Real*")


def test_modules_and_names_in_imports():
    files = "# file: pkg/inner.po\nz = 1\n# file: shapes.po\ndisc = 1\nsquare = 2\n# file: main.po\n"
    assert {"shapes", "pkg.inner"} <= set(fixture(files + "from $0\n").labels())
    assert "main" not in fixture(files + "import $0\n").labels()
    assert fixture(files + "from shapes import disc, $0\n").labels() == ["square"]
    assert fixture(files + "from shapes import disc,\n    $0\n").labels() == ["square"]
    assert fixture(files + "from pkg import $0\n").labels() == ["inner"]
    assert fixture(files + "from shapes $0\n").labels() == ["import"]


def test_auto_import_writes_the_import():
    files = "# file: shapes.po\n# A disc.\ndef disc(x, y) 1\n# file: other.po\nz = 1\n# file: main.po\n"
    f = fixture(files + "# My program.\n\ny = dis$0\n")
    item, text = f.complete("disc")
    assert item.description == "import from shapes" and "A disc." in item.documentation
    assert text == "# My program.\n\nfrom shapes import disc\n\ny = disc\n" or "from shapes import disc\n" in text
    _, text = fixture(files + "from other import z\nfrom shapes import square\ny = dis$0\n").complete("disc")
    assert text == "from other import z\nfrom shapes import square, disc\ny = disc\n"
    _, text = fixture(files + "from other import z\ny = dis$0\n").complete("disc")
    assert text == "from other import z\nfrom shapes import disc\ny = disc\n"


def test_members_of_a_module_that_is_not_imported_bring_the_import_of_it():
    files = "# file: pkg/inner.po\nz = 1\n# file: shapes.po\n# A disc.\ndef disc(x, y) 1\n# file: main.po\n"
    item, text = fixture(files + "y = shapes.$0\n").complete("disc")
    assert text == "import shapes\n\ny = shapes.disc\n"
    assert item.description == "import shapes" and "A disc." in item.documentation
    _, text = fixture(files + "from shapes import disc\ny = pkg.inner.$0\n").complete("z")
    assert text == "from shapes import disc\nimport pkg.inner\ny = pkg.inner.z\n"
    assert fixture(files + "def f(shapes) shapes.$0\n").labels() == []
    assert fixture(files + "shapes = 1\ny = shapes.$0\n").labels() == []


def test_what_is_defined_here_is_not_imported():
    f = fixture("# file: shapes.po\ndisc = 1\n# file: main.po\ndisc = 2\ny = dis$0\n")
    assert f.labels().count("disc") == 1


def test_keyword_arguments_of_functions_and_derivatives():
    files = "# file: r.po\ndef render(c, shader) shader(c)\ndrender = deriv(render)\n"
    files += "# file: main.po\nfrom r import drender, render\n"
    assert {"c=", "shader="} <= set(fixture(files + "print(render($0))\n").labels())
    labels = fixture(files + "print(drender(dc=(1, 2), $0))\n").labels()
    assert "dshader=" in labels and "dc=" not in labels
    assert "dc=" in fixture(files + "print(deriv(render)($0\n").labels()
    assert "c=" not in fixture(files + "print(render(c=$0))\n").labels()


def test_measures_made_of_measures_after_a_tilde():
    f = fixture("y = integral (x ~ trunc$0")
    _, text = f.complete("truncated")
    assert "x ~ truncated(${1:measure}, ${2:lo}, ${3:hi})" in text


def test_measures_after_a_tilde():
    f = fixture("def f(m)\n    integral (x ~ nor$0) x d(x)\n")
    item, text = f.complete("normal")
    assert "x ~ normal(${1:m}, ${2:s})" in text and "standard deviation" in item.documentation


def test_letters_by_name():
    f = fixture("def f(\\the$0)\n")
    item, text = f.complete("θ")
    assert text == "def f(θ)\n" and item.filter == "\\theta"
    assert "α" in fixture("y = 1 + \\$0\n").labels()


def test_snippets_of_keywords_by_place():
    f = fixture("y = 1\n$0\n")
    item, text = f.complete("def")
    assert item.snippet and "def ${1:name}" in text
    assert "then" in fixture("def f(a) if a > 0 $0\n").labels()
    assert "then" not in fixture("def f(a) $0\n").labels()
    assert "where" in fixture("diffeo g(x; c) = (x^2 - c)\n    $0\n").labels()


def test_nothing_where_a_name_is_made_or_in_a_comment_or_a_number():
    for text in ("def $0\n", "def f(a, $0\n", "# if $0\n", "y = 12$0\n", "for $0\n", "from m import a as $0\n"):
        assert fixture(text).labels() == [], text


def test_types_in_annotations():
    assert set(fixture("def f(a: $0) a\n").labels()) == {"Real", "Real*", "Diffeo[2]"}
    assert "Real" in fixture("def f(a) -> $0\n").labels()


def test_live_expressions_are_code():
    labels = fixture("def f(x) x\n\n#> $0\n").labels()
    assert "f" in labels and "sin" in labels


def test_broken_text_and_unicode_names():
    f = fixture("def f(α, β)\n    integral [0, 1] (α + (β * $0\n")
    assert {"α", "β"} <= set(f.labels())


def test_a_list_is_fast_in_a_large_workspace():
    modules = ["".join(f"def fun_{n}_{k}(x) x + {k}\n" for k in range(20)) for n in range(100)]
    files = "".join(f"# file: m{n}.po\n{text}" for n, text in enumerate(modules))
    f = fixture(files + "# file: main.po\ndef g(a) a + fun$0\n")
    assert len(f.labels()) >= 100
    times = []
    for n in range(20):
        f.library.files.set_text(f.file, f.text().replace("a + fun", f"a + {n} + fun"))
        start = time.process_time()
        ide.completions(f.db, f.file, f.offset + 4 + (n > 9))
        times.append(time.process_time() - start)
    assert sorted(times)[len(times) // 2] < 0.02  # the goal is 0.005 on an idle machine


def test_of_a_long_file_the_likeliest_names_are_listed() -> None:
    """Those that only contain the letters come last, and there are more to be asked for."""
    long = "".join(f"def some_{n}(x) x\n" for n in range(600)) + "def me(x) x\ndef g(a) "
    f = fixture(long + "a + me$0\n")
    found = ide.completions(f.db, f.file, f.offset)
    own = [item.label for item in found.items if item.data[:1] == ("definition",)]
    assert own[0] == "me" and len(own) == 500 and found.incomplete
    f = fixture(long + "a + some_59$0\n")
    assert not ide.completions(f.db, f.file, f.offset).incomplete


def first(text: str, count: int = 1) -> list[str]:
    """The first proposals in their order."""
    f = fixture(text)
    items = sorted(ide.completions(f.db, f.file, f.offset).items, key=lambda item: item.sort)
    return [item.label for item in items[:count]]


def test_what_an_open_conditional_or_integral_still_needs_comes_first():
    assert first("def f(a)\n    if a > 0 $0\n") == ["then"]
    assert first("def f(a)\n    if a > 0 then 1 $0\n") == ["else"]
    assert first("def f(a)\n    integral [0, 1] a*x $0\n") == ["d"]
    assert first("def f(a)\n    let b = a $0\n") == ["in"]
    assert "then" not in fixture("def f(a)\n    a + $0\n").labels()
    assert "else" not in fixture("diffeo t(x; c) = (x + c, $0)\n").labels()


def test_a_line_at_the_top_begins_with_a_statement():
    assert first("$0\n", 2) == ["def", "diffeo"]


def test_a_body_on_the_line_of_the_head_is_an_expression():
    for text in ("def f(a) sin($0)\n", "def f(a) sum i in 1..3 ($0)\n", "def f(a) a > 0 ? 1 : $0\n",
                 "diffeo t(a; c) = ($0, 1)\n", "def f(a: (Real, Real) -> Real)(b) $0\n"):  # fmt: skip
        assert {"a", "sin"} <= set(fixture(text).labels()), text


def test_in_a_head_there_are_new_names_and_types():
    for text in ("def f($0", "def f(a, $0", "def f(a)($0", "def f(a: Real, $0", "diffeo t(x; $0", "y = \\(a, $0"):
        assert fixture(text + "\n").labels() == [], text
    for text in ("def f(a: $0", "def f(a, b: (Real, $0", "def f(a) -> $0"):
        assert fixture(text + "\n").labels() == ["Real", "Real*", "Diffeo[2]"], text


def test_a_constant_is_not_proposed_for_itself():
    assert "y" not in fixture("y = $0\n").labels()
    assert "f" in fixture("def f(n) if n > 0 then $0 else 1\n").labels()


def test_the_name_of_a_dual_brings_its_two_parts():
    f = fixture("def f(a, n) a^n\ny = deriv(f)($0)\n")
    item, after = f.complete("da=")
    assert item.snippet and after.endswith("y = deriv(f)(da=(${1:0}, ${2:1}))\n")


def test_behind_a_text_that_is_in_no_file():
    """What a prompt asks: the names of its file, and what the text itself binds."""
    f = fixture("half = 0.5\ndef disc(x, y) x*y\n")

    def labels(before: str) -> list[str]:
        return [item.label for item in ide.completions_after(f.db, f.file, before).items]

    assert {"half", "disc", "sin", "def"} <= set(labels(""))
    assert {"t", "half", "disc"} <= set(labels("def f(t)\n    "))
    assert labels("disc(")[:2] == ["x=", "y="]
    assert labels("let u = 1 in u + ").count("u") == 1
    assert labels("\\thet") == ["θ", "Θ"] and "normal" in labels("integral (x ~ no")
    found = ide.completions_after(f.db, f.file, "1 + ha")
    assert (found.span.start, found.span.end) == (4, 6)
    item = next(item for item in found.items if item.label == "half")
    assert "half : Real" in ide.resolve_completion(f.db, item).documentation


def test_parts_of_records_tuples_and_vectors():
    f = fixture("record Camera(eye: (Real, Real, Real), focal: Real)\ndef f(c: Camera) c.$0\n")
    assert f.labels() == ["eye", "focal"]
    f = fixture("record Camera(eye: (Real, Real, Real), focal: Real)\ndef f(c: Camera) c.eye.$0\n")
    assert f.labels() == ["x", "y", "z", "0", "1", "2"]
    f = fixture("origin = (1, [2, 3])\ny = origin.$0\n")
    assert f.labels() == ["0", "1"]
    f = fixture("def f(a) a.$0\n")
    assert f.labels() == []
