"""The page of the language server: its hovers are those that the server gives, its table says what is announced."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from potto_lsp.features import COMMANDS, capabilities

import potto.ide as ide
from potto.checking.library import Library

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "lsp.md").read_text(encoding="utf-8")
HOVERS = re.findall(r"In `(examples/\S+)`, on `(.+?)`:\n\n~~~markdown\n(.*?)\n~~~", PAGE, re.DOTALL)


def test_there_are_hovers() -> None:
    assert len(HOVERS) >= 10


@pytest.mark.parametrize(("file", "word", "shown"), HOVERS, ids=[f"{file}:{word}" for file, word, _ in HOVERS])
def test_a_hover(file: str, word: str, shown: str) -> None:
    library = Library([ROOT / "examples"])
    key = library.files.open(ROOT / file)
    source = library.source(key)
    assert source is not None
    found = ide.hover_at(library.db, key, source.text.index(word))
    assert found is not None and found.markdown == shown


ANNOUNCED = {
    "linked editing": "linkedEditingRangeProvider", "inline values": "inlineValueProvider",
    "document links": "documentLinkProvider", "code lenses": "codeLensProvider",
    "call hierarchy": "callHierarchyProvider", "inlay hints": "inlayHintProvider",
    "semantic tokens": "semanticTokensProvider", "implementation": "implementationProvider",
    "declaration": "declarationProvider", "rename with prepare": "renameProvider",
}  # fmt: skip


def test_what_the_page_claims_is_announced() -> None:
    announced = capabilities("utf-16")
    for row, provider in ANNOUNCED.items():
        assert f"| {row} |" in PAGE and provider in announced, row
    for command in COMMANDS:
        assert f"`{command}`" in PAGE
    for modifier in announced["semanticTokensProvider"]["legend"]["tokenModifiers"]:
        assert f"`{modifier}`" in PAGE
