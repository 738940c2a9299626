"""Every feature all along every example, also when the text is broken: an answer or none, never an exception, and
nothing outside of it. `make fuzz` asks at every offset, `make test` here and there."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
from how_many import LOOKING, examples

import potto.ide as ide
from potto.checking.library import Library
from potto.source import Span
from potto.syntax import live_expressions

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FILES = sorted(str(path.relative_to(EXAMPLES)) for suffix in ("po", "diffeo") for path in EXAMPLES.rglob(f"*.{suffix}"))


@cache
def unchanged() -> Library:
    """One for all that ask about the examples as they are: what is worked out for one is there for the others."""
    return Library([EXAMPLES])


@cache
def edited() -> Library:
    """One whose texts are broken and put right again one after the other, as by an editor."""
    return Library([EXAMPLES])


def opened(name: str) -> tuple[Library, str, str]:
    library = unchanged()
    file = library.files.open(EXAMPLES / name)
    found = library.source(file)
    assert found is not None
    return library, file, found.text


@contextmanager
def broken(name: str, rng: random.Random) -> Iterator[tuple[Library, str, str]]:
    library, path = edited(), EXAMPLES / name
    file, original = library.files.open(path), path.read_text(encoding="utf-8")
    text = mutated(original, rng)
    library.files.set_text(file, text)
    yield library, file, text
    library.files.set_text(file, original)


def ask_everything(library: Library, file: str, text: str, offsets) -> None:
    db, whole = library.db, Span(0, len(text))

    def inside(span: Span) -> None:
        assert 0 <= span.start <= span.end <= len(text), span

    for offset in offsets:
        hover = ide.hover_at(db, file, offset)
        if hover is not None:
            inside(hover.span)
            assert hover.span.start <= offset <= hover.span.end
            assert hover.markdown.count("```") % 2 == 0
        for feature in (ide.definition, ide.declaration, ide.type_definition, ide.implementation):
            feature(db, file, offset)
        completions = ide.completions(db, file, offset)
        assert completions.span.start <= offset == completions.span.end
        for item in completions.items[:: max(1, len(completions.items) // 3)]:
            ide.resolve_completion(db, item)
        ide.signature_help(db, file, offset)
        for highlight in ide.highlights(db, file, offset):
            inside(highlight.span)
        ranges = ide.selection_ranges(db, file, offset)
        for inner, outer in pairwise(ranges):
            assert outer.start <= inner.start <= inner.end <= outer.end
        ide.linked_editing(db, file, offset)
        ide.prepare_rename(db, file, offset)
        ide.prepare_call_hierarchy(db, file, offset)
        ide.format_on_type(db, file, offset, "\n")
        ide.format_on_type(db, file, offset, ")")
        ide.code_actions(db, file, Span(offset, offset))
        ide.definition_at(db, file, offset)
        to = Span(offset, min(offset + 40, len(text)))
        for token in ide.semantic_tokens(db, file, to):
            assert token.span.start < to.end and to.start < token.span.end
        for hint in ide.inlay_hints(db, file, to):
            assert to.start <= hint.offset <= to.end
        for edit in ide.format_range(db, file, to):
            inside(edit.span)
        ide.inline_values(db, file, to)
    ask_about_file(library, file, text, whole)


def ask_about_file(library: Library, file: str, text: str, whole: Span) -> None:
    db = library.db
    ide.document_symbols(db, file)
    tokens = ide.semantic_tokens(db, file)
    for before, after in pairwise(tokens):
        assert before.span.end <= after.span.start
    for token in tokens:
        assert token.type in ide.TOKEN_TYPES and set(token.modifiers) <= set(ide.TOKEN_MODIFIERS)
        assert "\n" not in text[token.span.start : token.span.end] and len(token.span)
    for hint in ide.inlay_hints(db, file, whole):
        ide.resolve_inlay_hint(db, hint)
    for lens in ide.code_lenses(db, file):
        assert ide.resolve_code_lens(db, lens).title
    for fold in ide.folding_ranges(db, file):
        assert "\n" in text[fold.span.start : fold.span.end]
    ide.document_links(db, file)
    ide.format_document(db, file)
    ide.inline_values(db, file, whole)
    ide.live_diagnostics(db, file)
    assert ide.live_in(db, file) == live_expressions(text)
    for symbol in ide.document_symbols(db, file):
        ide.incoming_calls(db, file, symbol.name)
        ide.outgoing_calls(db, file, symbol.name)
        ide.points(db, file, symbol.name)


@pytest.mark.parametrize("name", FILES)
def test_every_feature_here_and_there(name: str) -> None:
    library, file, text = opened(name)
    ask_everything(library, file, text, range(0, len(text) + 1, examples(281, 12)))


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_every_feature_all_along(name: str) -> None:
    """Those that look through the workspace, and every action and proposal resolved; the others as well where there is
    time to ask them everywhere."""
    library, file, text = opened(name)
    offsets = range(0, len(text) + 1, examples(331, 1))
    if LOOKING:
        ask_everything(library, file, text, offsets)
    db = library.db
    for offset in offsets:
        ide.references(db, file, offset)
        ide.rename(db, file, offset, "another_name")
        for action in ide.code_actions(db, file, Span(offset, offset)):
            ide.resolve_code_action(db, action)
        for item in ide.completions(db, file, offset).items:
            ide.resolve_completion(db, item)


@pytest.mark.parametrize("name", FILES)
def test_heavy_features_at_every_word(name: str) -> None:
    library, file, _ = opened(name)
    db = library.db
    for symbol in ide.document_symbols(db, file):
        for each in (symbol, *symbol.children):
            offset = each.selection.start
            assert ide.references(db, file, offset) or symbol.kind == "statement"
            ide.rename(db, file, offset, "another_name")
            for action in ide.code_actions(db, file, each.selection):
                ide.resolve_code_action(db, action)
            for action in ide.code_actions(db, file, each.span):
                ide.resolve_code_action(db, action)


def mutated(text: str, rng: random.Random) -> str:
    for _ in range(rng.randrange(1, 4)):
        at = rng.randrange(len(text) + 1)
        match rng.randrange(4):
            case 0:
                text = text[:at] + text[at + rng.randrange(1, 12) :]
            case 1:
                text = text[:at] + rng.choice("()[],.;:=?\\~ \nθ'\"#+-*") + text[at:]
            case 2:
                words = [" if ", " integral ", "\ndef ", "diffeo", " d(", "\r\n", "let x = "]
                text = text[:at] + rng.choice(words) + text[at:]
            case _:
                text = text[: max(at, 1)]
    return text


@pytest.mark.parametrize("seed", range(0, len(FILES), examples(2, 1)))
def test_every_feature_on_broken_text(seed: int) -> None:
    rng = random.Random(seed)
    with broken(FILES[seed], rng) as (library, file, text):
        places = rng.sample(range(len(text) + 1), min(examples(12, 40), len(text) + 1))
        ask_everything(library, file, text, sorted(places))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 100 + examples(12, 60)))
def test_every_feature_on_many_broken_texts(seed: int) -> None:
    rng = random.Random(seed)
    with broken(rng.choice(FILES), rng) as (library, file, text):
        ask_everything(library, file, text, sorted(rng.sample(range(len(text) + 1), min(150, len(text) + 1))))
