"""Hints that propose imports: from files of the same project, and from no other that lies below it."""

from __future__ import annotations

from pathlib import Path

import pytest

from potto.checking.library import Library


@pytest.mark.parametrize("mark", ["potto.toml", ".git", "pyproject.toml"])
def test_no_import_is_proposed_from_another_project(tmp_path: Path, mark: str) -> None:
    for folder in ("inner", "pkg"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "shapes.po").write_text(f"def {folder}_disc(x) x^2\n", encoding="utf-8")
    (tmp_path / "inner" / mark).write_text("", encoding="utf-8")
    main = tmp_path / "main.po"
    main.write_text("def f(x) inner_disc(x)\ndef g(x) pkg_disc(x)\n", encoding="utf-8")
    library = Library([tmp_path])
    helps = {d.diagnostic.message: d.diagnostic.help for d in library.diagnostics(library.key(main))}
    assert "pkg.shapes" in helps["`pkg_disc` is not defined"]
    assert "inner.shapes" not in helps["`inner_disc` is not defined"]


@pytest.mark.parametrize("mark", ["", "potto.toml"])
def test_without_a_project_none_is_proposed_from_far_below(tmp_path: Path, mark: str) -> None:
    """A prompt that is opened in `/tmp` is beside everything that anybody left there."""
    (tmp_path / "pkg" / "old").mkdir(parents=True)
    (tmp_path / "pkg" / "old" / "left.po").write_text("def disc(x) x^2\n", encoding="utf-8")
    if mark:
        (tmp_path / mark).write_text("", encoding="utf-8")
    main = tmp_path / "main.po"
    main.write_text("def f(x) disc(x)\n", encoding="utf-8")
    library = Library([tmp_path])
    (said,) = library.diagnostics(library.key(main))
    assert ("pkg.old.left" in said.diagnostic.help) == bool(mark)
