"""After any edits a database says what a fresh one says: the same diagnostics, the same terms, the same interfaces."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import pytest
from how_many import examples
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from potto.checking.library import Library
from potto.elaborate import core
from potto.modules import names
from potto.types import interface

FILES = ("a.po", "b.po", "c.diffeo", "main.po")
TEXTS: dict[str, tuple[str, ...]] = {
    "a.po": (
        "def step(u) [u > 0]\ndef twice(h, x) h(h(x))\n",
        "# a comment\n\ndef step(u) [u > 0]\ndef twice(h, x) h(h(x))\n",
        "def step(u) [u >= 0.5]*u\ndef twice(h, x) h(h(x))\n",
        "def twice(h, x) h(h(x))\n",
        "def step(u, v) [u > v]\ndef twice(h, x) h(x)\n",
        "def step(u) if u > 0 then 1 else 0\ndef twice(h, x) h(h(x))\n",
        "from b import area\nstep = area\ndef twice(h, x) h(h(x))\n",
        "def step(u) [u > \n",
        "",
    ),
    "b.po": (
        "from a import step\ndef area(t) integral [0, 1] step(x - t) d(x)\n",
        "from a import step as s\n\n\ndef area(t) integral [0, 1] s(x - t)*x d(x)\n",
        "import a\ndef area(t) integral [0, 1] a.step(t*x - 0.5) d(x)\n",
        "from a import step\ndef area(t) integral ([0, 1], [0, x]) step(x - y*t) d(x, y)\n",
        "def area(t) t*unknown\n",
        "from nowhere import step\ndef area(t) step(t)\n",
    ),
    "c.diffeo": (
        "cond = \\(x, y) . \\c . (x + y + c, x - y)\n",
        "cond = \\(x, y) . \\c . (x + y + c, 2*x + 2*y)\n",
        "cond = \\(x, y) . \\c . (x*x + y + c, x)\n",
    ),
    "main.po": (
        "from b import area\nfrom c import cond\ndef f(t) area(t)^2\nprint(f(0.5))\n",
        "from b import area\nfrom c import cond\n"
        "def f(t) integral ([0, 1], [0, 1]) ((cond (x, y) t) ? area(t) : x) d(x, y)\nprint(deriv(f)((0.5, 1)))\n",
        "from a import twice\nfrom b import area\ndef f(t) twice(area, t)\ndf = deriv(f)\n",
        "from b import area\ndef f(t, unused) area(t)\nf = 3\n",
        "print(area(1))\n",
    ),
}

Edit = tuple[str, int]
edits = st.sampled_from(FILES).flatmap(lambda f: st.tuples(st.just(f), st.integers(0, len(TEXTS[f]) - 1)))
scripts = st.lists(edits, min_size=1, max_size=8)


def put(library: Library, root: str, edit: Edit) -> None:
    library.put(library.key(f"{root}/{edit[0]}"), TEXTS[edit[0]][edit[1]])


def seen(library: Library, root: str) -> dict[Hashable, Any]:
    """Everything that the front end says about the files."""
    found: dict[Hashable, Any] = {}
    for file in FILES:
        key = library.key(f"{root}/{file}")
        found[file] = library.diagnostics(key)
        for name in names(library.db, key):
            elaborated = core(library.db, key, name)
            found[file, name] = (elaborated.term, interface(library.db, key, name))
    return found


def check(root: str, script: list[Edit], asking: list[bool]) -> None:
    """`asking`: after which edits questions are asked, so that answers of several revisions mix."""
    state = dict.fromkeys(FILES, 0)
    library = Library([root])
    for file in FILES:
        put(library, root, (file, 0))
    seen(library, root)
    for number, edit in enumerate(script):
        put(library, root, edit)
        state[edit[0]] = edit[1]
        if asking[number % len(asking)] or number == len(script) - 1:
            fresh = Library([root])
            for file, version in state.items():
                put(fresh, root, (file, version))
            assert seen(library, root) == seen(fresh, root), (script, number)


quick = settings(max_examples=25, deadline=None, database=None, derandomize=True,
                 suppress_health_check=list(HealthCheck))  # fmt: skip
thorough = settings(quick, max_examples=examples(100, 400))
pytestmark = pytest.mark.filterwarnings("ignore:The recursion limit")


@quick
@given(scripts, st.lists(st.booleans(), min_size=1, max_size=4))
def test_edits(tmp_path_factory: pytest.TempPathFactory, script: list[Edit], asking: list[bool]) -> None:
    check(str(tmp_path_factory.mktemp("edits")), script, asking)


@pytest.mark.slow
@thorough
@given(scripts, st.lists(st.booleans(), min_size=1, max_size=4))
def test_many_edits(tmp_path_factory: pytest.TempPathFactory, script: list[Edit], asking: list[bool]) -> None:
    check(str(tmp_path_factory.mktemp("edits")), script, asking)
