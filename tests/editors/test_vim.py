"""Potto in Vim: files are recognized, and every kind of word has its group."""

from __future__ import annotations

from pathlib import Path

import pytest
from editors_folder import EDITORS, Run

EXAMPLES = EDITORS.parent / "examples"
PROGRAM = """from m import f
def cover(t) integral ([0, 1], [0, 1]) [x + y < t] d(x, y)  # cover
g = \\(x) . if pi > 2.5 then sin(x) else deriv(cover)
diffeo polar(x, y; c) = (x, y)
    inverse (u, v) . (u, v)
    where x > 0
h = integral (x ~ normal(0, 1)) x d(x)
#> cover(0.5)
#= 0.125
top = max x in [1, 2] (x) + min(1, 2) + fold s = 0 for i in 1..3 (s + i)
"""
GROUPS = {
    (1, "from"): "pottoInclude", (2, "def"): "pottoDefine", (2, "cover"): "pottoFunction",
    (2, "integral"): "pottoIntegral", (2, "d(x"): "pottoIntegral", (2, "# cover"): "pottoComment",
    (3, "g"): "pottoFunction", (3, "\\("): "pottoLambda",
    (3, "if"): "pottoConditional", (3, "pi"): "pottoConstant", (3, "2.5"): "pottoNumber", (3, "sin"): "pottoBuiltin",
    (3, "deriv"): "pottoCalculus", (4, "diffeo"): "pottoDefine", (5, "inverse"): "pottoDefine",
    (6, "where"): "pottoDefine",
    (7, "normal"): "pottoMeasure", (8, "#>"): "pottoLive", (8, "0.5"): "pottoNumber", (9, "#="): "pottoExpected",
    (10, "max x"): "pottoRepeat", (10, "min("): "pottoBuiltin", (10, "fold"): "pottoRepeat",
}  # fmt: skip


def vim(run: Run, folder: Path, file: str, *asked: str) -> list[str]:
    """What expressions give in Vim, with our files in its runtime path."""
    script = folder / "ask.vim"
    lines = [f"set nocompatible runtimepath^={EDITORS / 'vim'}", "filetype plugin on", "syntax on", f"edit {file}"]
    lines += ["let found = []", *(f"call add(found, {expression})" for expression in asked)]
    script.write_text("\n".join([*lines, "call writefile(found, 'found')", "qall!"]) + "\n", encoding="utf-8")
    run("vim", "-u", "NONE", "-i", "NONE", "-n", "-es", "-S", str(script), "-c", "cquit")
    return (folder / "found").read_text(encoding="utf-8").splitlines()


def test_words_have_their_groups(run: Run, folder: Path) -> None:
    (folder / "words.po").write_text(PROGRAM, encoding="utf-8")
    lines = PROGRAM.splitlines()
    asked = [f"synIDattr(synID({line}, {lines[line - 1].index(word) + 1}, 1), 'name')" for line, word in GROUPS]
    assert dict(zip(GROUPS, vim(run, folder, "words.po", *asked))) == GROUPS


@pytest.mark.parametrize(
    ("name", "text", "type"),
    [("a.po", "f = 1\n", "potto"), ("a.diffeo", "c = \\x . x\n", "potto"), ("a.po", 'msgid ""\nmsgstr ""\n', "po")],
)
def test_translations_stay_translations(run: Run, folder: Path, name: str, text: str, type: str) -> None:
    (folder / name).write_text(text, encoding="utf-8")
    assert vim(run, folder, name, "&filetype") == [type]
