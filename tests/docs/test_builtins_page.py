"""The page of builtins says what the tables say, and its examples give what it says."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest
from mpmath import mp

import potto
from potto.core.reference import evaluate
from potto.elaborate import elaborate_expression
from potto.measures import COMPOSITIONS, MEASURES
from potto.primitives import PRIMITIVES
from potto.query import Database
from potto.syntax import parse_expression

DOCS = Path(__file__).resolve().parents[2] / "docs"
ENTRIES = [*PRIMITIVES.values(), *MEASURES.values(), *COMPOSITIONS.values()]


def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("write_builtins", DOCS / "write_builtins.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_what_the_tables_say() -> None:
    """If this fails: python docs/write_builtins.py."""
    assert (DOCS / "builtins.md").read_text(encoding="utf-8") == generator().page()


def test_the_grammars_have_the_builtins_of_the_tables() -> None:
    """If this fails: python docs/write_builtins.py."""
    for path, text in generator().grammars().items():
        assert path.read_text(encoding="utf-8") == text


def test_the_page_has_every_builtin() -> None:
    page = (DOCS / "builtins.md").read_text(encoding="utf-8")
    for entry in PRIMITIVES.values():
        assert (f"\n| `{entry.name}(" in page) == entry.surface


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda e: e.name)
def test_examples(entry: object) -> None:
    """What people get, against the reference evaluator: within its own error bar, and within 1e-12."""
    example = entry.example  # type: ignore[attr-defined]
    result = potto.compile(f"def example(unused)\n    {example}\n").example(1.0)
    parsed = parse_expression(example)
    assert parsed.expr is not None
    term = elaborate_expression(Database(), "<text>", parsed.expr).term
    with mp.workdps(30):
        difference = abs(mp.mpf(float(result)) - evaluate(term, {}, digits=15))
        scale = max(1, abs(float(result)))
        assert difference <= 1e-12 * scale
        assert difference <= getattr(result, "error", 0.0) + 4e-16 * scale
