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
