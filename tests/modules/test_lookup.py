"""Modules to files, and names through imports and re-exports to the file that defines them."""

from __future__ import annotations

from module_files import key, world

from potto.modules import (
    DefinitionTarget,
    ModuleTarget,
    find_module,
    load_file,
    names,
    resolve,
    resolve_member,
    resolve_module,
)

MAIN = key("main.po")


def test_a_module_is_a_file_beside_the_importing_one() -> None:
    db = world("""
        # file: main.po
        from half_plane import cond
        # file: half_plane.diffeo
        cond = \\(x, y) . \\c . (x + y + c, x - y + c)
    """)
    assert find_module(db, MAIN, "half_plane") == key("half_plane.diffeo")
    assert resolve(db, MAIN, "cond") == DefinitionTarget(key("half_plane.diffeo"), "cond")


def test_a_dotted_module_is_a_file_in_a_folder() -> None:
    db = world("""
        # file: main.po
        from pkg.deep.m import f
        # file: pkg/deep/m.po
        def f(x) x
    """)
    assert resolve(db, MAIN, "f") == DefinitionTarget(key("pkg/deep/m.po"), "f")


def test_the_importing_files_folder_comes_before_the_roots() -> None:
    db = world("""
        # file: sub/main.po
        import m
        import n
        # file: sub/m.po
        def f(x) x
        # file: m.po
        def f(x) 2*x
        # file: n.po
        def f(x) 3*x
    """)
    assert find_module(db, key("sub/main.po"), "m") == key("sub/m.po")
    assert find_module(db, key("sub/main.po"), "n") == key("n.po")
    assert find_module(db, "<In 3>", "m") == key("m.po"), "a prompt has no folder: only the roots"


def test_of_two_files_the_po_wins_and_a_file_is_not_its_own_module_if_there_is_another() -> None:
    db = world("""
        # file: main.po
        import m
        # file: m.po
        from m import cond
        # file: m.diffeo
        cond = \\x . x
    """)
    assert find_module(db, MAIN, "m") == key("m.po")
    assert resolve(db, MAIN, "cond") is None
    assert resolve(db, key("m.po"), "cond") == DefinitionTarget(key("m.diffeo"), "cond")


def test_names_follow_re_exports_and_aliases_to_the_definition() -> None:
    db = world("""
        # file: main.po
        from b import g as h, f
        import b as k
        import pkg.c
        # file: b.po
        from a import f, f as g
        import a
        # file: a.po
        def f(x) x
        # file: pkg/c.po
        def q(x) x
    """)
    f = DefinitionTarget(key("a.po"), "f")
    assert resolve(db, MAIN, "h") == f
    assert resolve(db, MAIN, "f") == f
    assert resolve(db, MAIN, "k") == ModuleTarget(key("b.po"), "b")
    assert resolve(db, MAIN, "pkg.c") == ModuleTarget(key("pkg/c.po"), "pkg.c")
    assert resolve(db, MAIN, "pkg") is None
    assert resolve(db, MAIN, "b") is None, "imported under another name only"
    assert resolve_member(db, MAIN, "k", "g") == f
    assert resolve_member(db, MAIN, "pkg.c", "q") == DefinitionTarget(key("pkg/c.po"), "q")
    assert resolve_member(db, MAIN, "k.a", "f") == f, "a module that another one imports"
    assert resolve_module(db, MAIN, "k.a") == key("a.po")
    assert resolve_member(db, MAIN, "k.nothing", "f") is None


def test_from_a_folder_a_module() -> None:
    db = world("""
        # file: main.po
        from pkg import m, n as other
        # file: pkg/m.po
        def f(x) x
        # file: pkg/n.po
        def f(x) 2*x
    """)
    assert resolve(db, MAIN, "m") == ModuleTarget(key("pkg/m.po"), "pkg.m")
    assert resolve_member(db, MAIN, "other", "f") == DefinitionTarget(key("pkg/n.po"), "f")


def test_names_that_run_in_a_circle_mean_nothing() -> None:
    db = world("""
        # file: main.po
        from b import f
        # file: b.po
        from main import f
    """)
    assert resolve(db, MAIN, "f") is None


def test_a_file_that_appears_is_found() -> None:
    db = world("from m import f\n")
    assert resolve(db, MAIN, "f") is None
    db.set_input(("file", key("m.diffeo")), "f = \\x . x\n")
    assert resolve(db, MAIN, "f") == DefinitionTarget(key("m.diffeo"), "f")
    db.set_input(("file", key("m.po")), "def g(x) x\n")
    assert resolve(db, MAIN, "f") is None
    db.set_input(("file", key("m.po")), None)
    assert resolve(db, MAIN, "f") == DefinitionTarget(key("m.diffeo"), "f")


def test_an_unsaved_text_wins(tmp_path) -> None:
    path = tmp_path / "m.po"
    path.write_text("def f(x) x\n")
    db = world("from m import f\n")
    m = load_file(db, path)
    assert names(db, m) == ("f",)
    db.set_input(("overlay", m), "def g(x) x\n")
    assert names(db, m) == ("g",)
    db.set_input(("overlay", m), None)
    assert names(db, m) == ("f",)


def test_a_definition_wins_over_an_import_and_a_later_import_over_an_earlier_one() -> None:
    db = world("""
        # file: main.po
        from a import f, g
        from b import g
        def f(x) x
        # file: a.po
        def f(x) x
        def g(x) x
        # file: b.po
        def g(x) x
    """)
    assert resolve(db, MAIN, "f") == DefinitionTarget(MAIN, "f")
    assert resolve(db, MAIN, "g") == DefinitionTarget(key("b.po"), "g")


def test_a_long_chain_of_re_exports() -> None:
    files = "".join(f"# file: m{i}.po\nfrom m{i + 1} import f\n" for i in range(3000))
    db = world(files + "# file: m3000.po\ndef f(x) x\n")
    assert resolve(db, key("m0.po"), "f") == DefinitionTarget(key("m3000.po"), "f")


def test_an_entry_of_a_prompt_sees_those_before_it_the_latest_first() -> None:
    db = world("""
        # file: <In 1>
        def f(x) x
        def g(x) f(x)
        # file: <In 2>
        from m import h
        def f(x) 2*x
        # file: <In 3>
        f(1) + g(1) + h(1)
        # file: m.po
        def h(x) x
    """)
    db.set_input(("prelude", "<In 2>"), ("<In 1>",))
    db.set_input(("prelude", "<In 3>"), ("<In 2>",))
    assert resolve(db, "<In 3>", "f") == DefinitionTarget("<In 2>", "f")
    assert resolve(db, "<In 3>", "g") == DefinitionTarget("<In 1>", "g")
    assert resolve(db, "<In 3>", "h") == DefinitionTarget(key("m.po"), "h")
    assert resolve(db, "<In 1>", "h") is None
