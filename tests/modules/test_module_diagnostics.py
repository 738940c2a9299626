"""What is said about imports, and about definitions side by side."""

from __future__ import annotations

import pytest
from module_files import edit, key, only, said, world

from potto.modules import module_diagnostics


def test_nothing_is_said_of_the_papers_files() -> None:
    db = world("""
        # file: main.po
        from color_shaders import dconst_shader,
            dlin_shader
        from renderer import drenderer
        for dshader in [dconst_shader,
            dlin_shader]:
            print(drenderer(dc=(-2,1), dshader))
        # file: color_shaders.po
        dconst_shader = deriv(\\(x,y) . c. 1)
        dlin_shader   = deriv(\\(x,y) . c.
            1/(sqrt(2)*(x+y+c)+2))
        # file: renderer.po
        from half_plane import cond
        def renderer(c, shader)
            integral ([0,1], [0,1])
                ((shader (x,y)) c)
                *(((cond (x, y)) c)?1:0) d(x,y)
        drenderer = deriv(renderer)
        # file: half_plane.diffeo
        # a diffeomorphism of (x, y), with the parameter c
        cond = \\(x, y) . \\c . (x + y + c, x - y + c)
    """)
    for name in ("main.po", "color_shaders.po", "renderer.po", "half_plane.diffeo"):
        assert said(db, name) == []


def test_a_module_that_is_not_found(tmp_path) -> None:
    db = world("""
        def f(x) g(x)
        from half_plan import g
    """)
    db.set_input(("folder", "/ws"), ("half_plane.diffeo", "main.po", "pkg/"))
    db.set_input(("folder", "/ws/pkg"), ("half_plan.po",))
    found = only(db)
    assert (found.code, found.severity) == ("P0202", "error")
    assert "half_plan.po" in found.notes[0] and "half_plan.diffeo" in found.notes[0] and "/ws" in found.notes[0]
    assert found.help == "did you mean `pkg.half_plan`?"
    assert said(db) == [("P0202", "half_plan")]
    db.set_input(("folder", "/ws"), ("half_plane.diffeo", "main.po"))
    assert only(db).help == "did you mean `half_plane`?"


def test_a_name_that_its_module_does_not_have() -> None:
    db = world("""
        # file: main.po
        from shaders import lin_shade, cubic
        def f(x) lin_shade(x) + cubic(x)
        # file: shaders.po
        def lin_shader(x) x
        # file: more/kinds.po
        def cubic(x) x^3
    """)
    assert said(db) == [("P0203", "lin_shade"), ("P0203", "cubic")]
    first, second = module_diagnostics(db, key("main.po"))
    assert first.help == "did you mean `lin_shader`?"
    assert "`more.kinds`" in second.help and "from more.kinds import cubic" in second.help


def test_a_name_that_is_lost_further_on_is_said_here_too() -> None:
    db = world("""
        # file: main.po
        from b import f
        def g(x) f(x)
        # file: b.po
        from c import f
        # file: c.po
        def other(x) x
    """)
    assert said(db) == [("P0203", "f")]
    assert "it is to come from `c`" in only(db).message
    db.set_input(("file", key("c.po")), None)
    assert only(db).label == "its import there fails"


def test_a_broken_module_is_given_the_benefit_of_the_doubt() -> None:
    db = world("""
        # file: main.po
        from m import f, g
        def h(x) f(x) + g(x)
        # file: m.po
        def f(x) x +* (
        ) = = what
        = = what
    """)
    assert said(db) == []


def test_a_name_that_is_imported_in_a_circle() -> None:
    db = world("""
        # file: a.po
        from b import f
        def g(x) f(x)
        # file: b.po
        from c import f
        # file: c.po
        from a import f
    """)
    for name, path in (("a.po", "`a` -> `b` -> `c` -> `a`"), ("b.po", "`b` -> `c` -> `a` -> `b`")):
        assert only(db, name).code == "P0204"
        assert path in only(db, name).message


def test_modules_that_import_each_other() -> None:
    db = world("""
        # file: a.po
        from d import s
        from b import g
        def f(x) if x > 0 then g(x - 1) + s(x) else 0
        # file: b.po
        from c import h
        def g(x) h(x)
        # file: c.po
        import a
        def h(x) a.f(x)
        # file: d.po
        def s(x) x
    """)
    assert only(db, "a.po").message == "modules import each other: `a` -> `b` -> `c` -> `a`"
    assert only(db, "c.po").message == "modules import each other: `c` -> `a` -> `b` -> `c`"
    assert said(db, "a.po") == [("P0625", "b")]
    assert said(db, "d.po") == []
    assert only(db, "b.po").severity == "warning"


def test_a_module_that_imports_itself() -> None:
    db = world("""
        from main import f
        def f(x) x
    """)
    assert said(db)[0] == ("P0205", "main")


def test_a_name_that_is_defined_twice() -> None:
    db = world("""
        def f(x) x
        def g(x) x
        def f(x) 2*x
        f = 3
    """)
    found = module_diagnostics(db, key("main.po"))
    assert [d.code for d in found] == ["P0206", "P0206"]
    text = db.get_input(("file", key("main.po")))
    first = text.index("f(x) x")
    assert {d.related[0].span.start for d in found} == {first}
    assert [d.span.start for d in found] == [text.index("f(x) 2*x"), text.index("f = 3")]


def test_a_name_that_is_imported_twice() -> None:
    db = world("""
        # file: main.po
        from a import f, g
        from a import f
        from b import g
        import a as b
        def h(x) f(x) + g(x) + b.f(x)
        # file: a.po
        def f(x) x
        def g(x) x
        # file: b.po
        def g(x) x
    """)
    assert said(db) == [("P0624", "f"), ("P0207", "g")]


def test_imports_that_are_not_used() -> None:
    db = world("""
        # file: main.po
        from a import f, g as k, h
        import a
        import pkg.m
        import pkg.n as n
        #> h(2)
        def u(f, x) f(x) + pkg.m.q(x)
        # file: a.po
        def f(x) x
        def g(x) x
        def h(x) x
        # file: pkg/m.po
        def q(x) x
        # file: pkg/n.po
        def q(x) x
    """)
    assert said(db) == [
        ("P0620", "f"),
        ("P0620", "g as k"),
        ("P0620", "import a"),
        ("P0620", "import pkg.n as n"),
    ]
    assert all(d.tags == ("unnecessary",) and d.severity == "warning" for d in module_diagnostics(db, key("main.po")))


def test_what_is_passed_on_is_used() -> None:
    db = world("""
        # file: main.po
        from b import f
        import b
        print(f(1), b.g(1))
        # file: b.po
        from a import f, g, h
        def own(x) x
        # file: only_imports.po
        from a import f, g
        # file: a.po
        def f(x) x
        def g(x) x
        def h(x) x
    """)
    assert said(db) == []
    assert said(db, "b.po") == [("P0620", "h")]
    assert said(db, "only_imports.po") == []


def test_half_written_code_does_not_make_an_import_unused() -> None:
    db = world("""
        # file: main.po
        from a import f
        def h(x)
            f(x) + ((( )] 3 3 3 f f
        # file: a.po
        def f(x) x
    """)
    assert said(db) == []


def test_definitions_that_hide_something() -> None:
    db = world("""
        # file: main.po
        from a import f, cos
        def f(x) cos(x)
        def sqrt(x) x^0.5
        def pi(x) x
        # file: a.po
        def f(x) x
        def cos(x) x
    """)
    assert said(db) == [
        ("P0622", "cos"),
        ("P0621", "f"),
        ("P0622", "sqrt"),
        ("P0622", "pi"),
    ]


def test_a_module_name_that_means_two_files() -> None:
    db = world("""
        # file: main.po
        from m import f
        print(f(1))
        # file: m.po
        def f(x) x
        # file: m.diffeo
        f = \\x . x
    """)
    assert said(db) == [("P0623", "m")]


def test_spans_are_absolute_after_an_edit_above() -> None:
    db = world("""
        # file: main.po
        def u(x) x
        from nowhere import f
        def u(x) f(x)
    """)
    assert said(db) == [("P0202", "nowhere"), ("P0206", "u")]
    edit(db, "main.po", "def u(x) x\n", "def u(x)\n    x + x + x\n\n")
    assert said(db) == [("P0202", "nowhere"), ("P0206", "u")]


def test_a_file_that_is_not_there() -> None:
    db = world("print(1)\n")
    found = module_diagnostics(db, key("gone.po"))
    assert [d.code for d in found] == ["P0208"]


@pytest.mark.parametrize("line", ["import", "from", "from m import", "from  import f", "import m as"])
def test_half_written_imports_are_left_to_the_parser(line: str) -> None:
    db = world(line + "\ndef f(x) x\n")
    db.set_input(("file", key("m.po")), "def g(x) x\n")
    assert [found for found in said(db) if found[0] != "P0620"] == []
