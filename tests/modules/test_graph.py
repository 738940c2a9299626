"""Who needs whom."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
from module_files import FOLDER, key, world

from potto.modules import (
    DefinitionTarget,
    dependencies,
    import_cycle,
    import_group,
    imported_files,
    is_recursive,
    strongly_connected,
)
from potto.query import Database

MAIN = key("main.po")


def group(db: Database, name: str, file: str = MAIN) -> list[str]:
    return [f"{target.file.removeprefix(FOLDER + '/')}:{target.name}" for target in strongly_connected(db, file, name)]


def test_dependencies_are_direct_in_order_and_each_once() -> None:
    db = world("""
        # file: main.po
        from b import g
        import c as k
        def u(x) x
        def f(x)
            y = k.q(x) + u(x)
            g(y) + u(y) + sin(y) + nothing(x) + f(x)
        # file: b.po
        from c import q as g
        # file: c.po
        def q(x) x
    """)
    q = DefinitionTarget(key("c.po"), "q")
    assert dependencies(db, MAIN, "f") == (q, DefinitionTarget(MAIN, "u"), DefinitionTarget(MAIN, "f"))
    assert dependencies(db, MAIN, "u") == ()
    assert dependencies(db, MAIN, "gone") == ()


def test_groups_in_one_file() -> None:
    db = world("""
        def fact(n) if n > 0 then n*fact(n - 1) else 1
        def even(n) if n > 0 then odd(n - 1) else 1
        def odd(n) if n > 0 then even(n - 1) else 0
        def uses(n) even(n) + fact(n)
    """)
    assert group(db, "even") == group(db, "odd") == ["main.po:even", "main.po:odd"]
    assert group(db, "fact") == ["main.po:fact"]
    assert group(db, "uses") == ["main.po:uses"]
    recursive = [name for name in ("fact", "even", "odd", "uses") if is_recursive(db, MAIN, name)]
    assert recursive == ["fact", "even", "odd"]


def test_words_alone_make_no_group() -> None:
    db = world("""
        # even and odd are but words here
        def even(odd) if odd > 0 then odd - 1 else 1
        # as even is
        def odd(n) sin(n) + even(n)
    """)
    assert group(db, "even") == ["main.po:even"]
    assert group(db, "odd") == ["main.po:odd"]


def test_groups_under_other_names() -> None:
    db = world("""
        # file: main.po
        from b import odd as other
        def even(n) if n > 0 then other(n - 1) else 1
        # file: b.po
        from main import even as one
        def odd(n) if n > 0 then one(n - 1) else 0
    """)
    assert group(db, "even") == group(db, "odd", key("b.po")) == ["b.po:odd", "main.po:even"]


def test_groups_across_files() -> None:
    db = world("""
        # file: main.po
        from b import odd
        def even(n) if n > 0 then odd(n - 1) else 1
        def alone(n) odd(n)
        # file: b.po
        import main as m
        def odd(n) if n > 0 then m.even(n - 1) else 0
    """)
    expected = ["b.po:odd", "main.po:even"]
    assert group(db, "even") == expected
    assert group(db, "odd", key("b.po")) == expected
    assert group(db, "alone") == ["main.po:alone"]


def test_imports_and_their_cycles() -> None:
    db = world("""
        # file: a.po
        import d
        from b import f
        # file: b.po
        from c import f
        from pkg import m
        # file: c.po
        import a
        import c
        def f(x) x
        # file: d.po
        import a
        # file: pkg/m.po
        def q(x) x
    """)
    a, b, c, d = (key(f"{name}.po") for name in "abcd")
    assert imported_files(db, a) == (d, b)
    assert imported_files(db, b) == (c, key("pkg/m.po"))
    assert import_group(db, a) == import_group(db, c) == (a, b, c, d)
    assert import_group(db, key("pkg/m.po")) == (key("pkg/m.po"),)
    assert import_cycle(db, a) == (a, d, a), "the shortest"
    assert import_cycle(db, c) == (c, a, b, c)
    assert import_cycle(db, key("pkg/m.po")) == ()


def test_a_module_by_its_name_is_imported_also_where_another_file_has_imported_it() -> None:
    db = world("""
        # file: a.po
        from b import k, g, m, here
        # file: b.po
        import pkg.far as k
        def g(x) x
        import pkg.near as here
        def here(x) x
        # file: b/g.po
        def no(x) x
        # file: b/m.po
        def yes(x) x
        # file: pkg/far.po
        def f(x) x
        # file: pkg/near.po
        def f(x) x
    """)
    # `g` and `here` are definitions of b, which win over the module in the folder b and over the import in b
    assert imported_files(db, key("a.po")) == tuple(map(key, ("b.po", "pkg/far.po", "b/m.po")))


def test_imports_are_followed_without_asking_what_the_files_define() -> None:
    long = "".join(f"def f{n}(x) x + {n}\n" for n in range(1000))
    db = world(f"# file: a.po\nfrom b import f1\n# file: b.po\nfrom c import f2\n{long}# file: c.po\n{long}")
    with db.recording() as events:
        assert import_group(db, key("a.po")) == (key("a.po"),)
    asked = [event.query for event in events]
    assert not {"layout", "outline", "names", "scope"} & set(asked)
    assert asked.count("piece") == 2, "where the imports are"


def test_a_long_chain_of_definitions_and_of_modules() -> None:
    text = "".join(f"def f{n}(x) f{n + 1}(x)\n" for n in range(2000)) + "def f2000(x) f1999(x)\n"
    db = world(text)
    assert group(db, "f0") == ["main.po:f0"]
    assert group(db, "f1999") == ["main.po:f1999", "main.po:f2000"]
    files = "".join(f"# file: m{n}.po\nimport m{(n + 1) % 500}\ndef f(x) x\n" for n in range(500))
    db = world(files)
    assert len(import_cycle(db, key("m7.po"))) == 501


@given(st.lists(st.lists(st.integers(0, 7), max_size=3), min_size=8, max_size=8))
@settings(max_examples=60, deadline=None)
def test_groups_are_those_of_mutual_reachability(graph: list[list[int]]) -> None:
    calls = (" + ".join(f"f{other}(x)" for other in others) or "x" for others in graph)
    db = world("".join(f"def f{number}(x) {body}\n" for number, body in enumerate(calls)))
    reach = [set(others) for others in graph]
    for _ in graph:
        reach = [found.union(*(reach[other] for other in found)) for found in reach]
    for number in range(len(graph)):
        mutual = [m for m in range(len(graph)) if m == number or (m in reach[number] and number in reach[m])]
        assert group(db, f"f{number}") == [f"main.po:f{m}" for m in mutual]
        assert is_recursive(db, MAIN, f"f{number}") == (number in reach[number])
