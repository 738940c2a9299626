"""The grain is the definition: what an edit runs, read off the log; and incremental = from scratch."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
from module_files import edit, key, world

from potto.modules import (
    chunk_start,
    chunk_text,
    definition,
    dependencies,
    imports,
    is_recursive,
    module_diagnostics,
    names,
    resolve,
    source,
    statements,
    strongly_connected,
    syntax_diagnostics,
)
from potto.modules.texts import import_starts
from potto.query import Database, QueryEvent

MAIN, LIB = key("main.po"), key("lib.po")
PROGRAM = """
    # file: main.po
    from lib import lin, quad as q
    import lib as k

    def f(x)
        lin(x) + q(x)

    # about g
    def g(x)
        f(x) + k.lin(x)

    def h(x) g(x) + 1

    print(h(1))
    # file: lib.po
    def lin(x) x
    def quad(x) lin(x)^2
"""


def ask_everything(db: Database) -> list[object]:
    found: list[object] = []
    for file in (MAIN, LIB):
        found += (names(db, file), imports(db, file), statements(db, file), source(db, file))
        found += (module_diagnostics(db, file), syntax_diagnostics(db, file))
        for name in ("f", "g", "h", "lin", "quad", "q", "k", "new"):
            found += (definition(db, file, name), resolve(db, file, name), dependencies(db, file, name))
            found += (strongly_connected(db, file, name), is_recursive(db, file, name))
            found += (chunk_start(db, file, name), chunk_text(db, file, name))
    return found


def executed(events: list[QueryEvent], *queries: str) -> set[tuple[object, ...]]:
    return {(e.query, *e.args) for e in events if e.kind == "executed" and (not queries or e.query in queries)}


def test_a_body_edit_runs_no_question_about_other_definitions() -> None:
    db = world(PROGRAM)
    ask_everything(db)
    edit(db, "main.po", "lin(x) + q(x)", "lin(x)\n        + 2*q(x)")
    with db.recording() as events:
        ask_everything(db)
    assert executed(events, "definition", "references") == {("definition", MAIN, "f"), ("references", MAIN, "f")}
    nothing = ("names", "resolve", "resolve_member", "trail", "locate", "find_module", "dependencies", "imports")
    assert executed(events, *nothing, "strongly_connected", "is_recursive", "imported_files", "import_group") == set()
    assert not [e for e in events if LIB in e.args and e.kind == "executed"], "nothing in the other module"


def test_an_edit_above_moves_nothing() -> None:
    db = world(PROGRAM)
    ask_everything(db)
    before, start = definition(db, MAIN, "g"), chunk_start(db, MAIN, "g")
    edit(db, "main.po", "def f(x)", "def new(a) a\n\n\ndef f(x)")
    with db.recording() as events:
        ask_everything(db)
    assert definition(db, MAIN, "g") is before
    assert chunk_start(db, MAIN, "g") == start + len("def new(a) a\n\n\n")
    assert executed(events, "definition") == {("definition", MAIN, "new")}
    assert executed(events, "resolve") == {("resolve", MAIN, "new")}


def test_an_edit_of_an_import_asks_again_only_what_it_binds() -> None:
    db = world(PROGRAM)
    ask_everything(db)
    edit(db, "main.po", "import lin, quad as q", "import lin, lin as q")
    with db.recording() as events:
        ask_everything(db)
    assert executed(events, "resolve") == {("resolve", MAIN, "q")}
    assert executed(events, "dependencies") == {("dependencies", MAIN, "f")}
    assert executed(events, "definition") == set()


def test_an_edit_in_a_library_asks_nothing_of_its_importer() -> None:
    db = world(PROGRAM)
    ask_everything(db)
    edit(db, "lib.po", "lin(x)^2", "lin(x)^2 + 1")
    with db.recording() as events:
        ask_everything(db)
    assert not [e for e in events if MAIN in e.args and e.kind == "executed"]


def test_an_undo_parses_nothing() -> None:
    db = world(PROGRAM)
    ask_everything(db)
    edit(db, "main.po", "f(x) + k.lin(x)", "f(x) + k.lin(x) + 1")
    ask_everything(db)
    edit(db, "main.po", "f(x) + k.lin(x) + 1", "f(x) + k.lin(x)")
    with db.recording() as events:
        ask_everything(db)
    assert executed(events, "parsed") == set()


def test_the_last_definition_of_a_name_wins() -> None:
    db = world("def f(x) x\ndef f(x, y) x\n")
    found = definition(db, MAIN, "f")
    assert found is not None and len(found.groups[0]) == 2
    assert names(db, MAIN) == ("f",)
    assert chunk_start(db, MAIN, "f") == len("def f(x) x\n")


def test_a_broken_definition_keeps_its_name() -> None:
    db = world("def f(\ndef g(x) f(x)\n")
    assert names(db, MAIN) == ("f", "g")
    assert syntax_diagnostics(db, MAIN)[0].span.end <= len("def f(\n")


def test_what_is_not_there_is_none() -> None:
    db = Database()
    assert source(db, "/nowhere.po") is None
    assert names(db, "/nowhere.po") == ()
    assert definition(db, "/nowhere.po", "f") is None
    assert statements(db, "/nowhere.po") == ()


PIECES = st.sampled_from(
    [
        "def f(x) lin(x) + g(x)\n",
        "def g(x)\n    f(x) + k.lin(x)\n",
        "def h(x) h(x - 1) +\n",
        "def f(a, b) a\n",
        "lin = 3\n",
        "from lib import lin, quad as q\n",
        "from lib import\n",
        "import lib as k\n",
        "from main import f, lin\n",
        "# a comment\n#> q(1)\n",
        "\n\n",
        "    continued + q(x)\n",
        "print(f(1), lin)\n",
        "def quad(x) lin(x) (\n",
        ") = =\n",
    ]
)
EDITS = st.lists(
    st.tuples(st.sampled_from(["main.po", "lib.po"]), st.integers(0, 9), st.integers(0, 2), PIECES, st.booleans()),
    max_size=12,
)


@given(st.lists(PIECES, max_size=6), st.lists(PIECES, max_size=6), EDITS)
@settings(max_examples=60, deadline=None)
def test_incremental_is_from_scratch(
    main: list[str], lib: list[str], edits: list[tuple[str, int, int, str, bool]]
) -> None:
    texts = {"main.po": main, "lib.po": lib}
    db = Database()

    def put(db: Database) -> None:
        db.set_input(("roots",), ("/ws",))
        db.set_input(("workspace",), (MAIN, LIB))
        for name, pieces in texts.items():
            db.set_input(("file", key(name)), "".join(pieces))

    put(db)
    for name, place, gone, piece, ask in edits:
        texts[name][place : place + gone] = [piece]
        put(db)
        if ask:
            ask_everything(db)
    fresh = Database()
    put(fresh)
    assert ask_everything(db) == ask_everything(fresh)


WORDS = [*"xy1=(),+:.*[]", "m.k", "as", "def", "record", "for", "in", "if", "then", "let", "sum", "d(x)", "\n"]


@settings(max_examples=300)
@given(st.lists(st.sampled_from(WORDS), max_size=8))
def test_no_text_is_taken_for_an_import_that_has_no_word_for_it(words: list[str]) -> None:
    text = " ".join(words)
    db = world("# file: main.po\n" + text)
    assert import_starts(db, MAIN) == () == imports(db, MAIN)
