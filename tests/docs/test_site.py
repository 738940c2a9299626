"""The site: built with every link and anchor checked; what stands at the head of the repository."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    if importlib.util.find_spec("material") is None:
        pytest.skip("mkdocs-material is not installed: `make docs` runs this")
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--site-dir", str(tmp_path)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    pages = {path.stem for path in (ROOT / "docs").glob("*.md")} | {
        path.stem for path in (ROOT / "docs/errors").iterdir()
    }
    assert pages <= {path.stem for path in tmp_path.rglob("*.html")}
    assert "<h2" in (tmp_path / "python.html").read_text("utf-8")


def test_every_page_is_in_the_navigation() -> None:
    listed = set(re.findall(r": ([\w-]+\.md)$", (ROOT / "mkdocs.yml").read_text("utf-8"), re.MULTILINE))
    assert listed == {path.name for path in (ROOT / "docs").glob("*.md")}


@pytest.mark.parametrize("name", ["LICENSE", "CITATION.cff", "CONTRIBUTING.md", "CHANGELOG.md", "README.md"])
def test_what_a_stranger_looks_for_is_there(name: str) -> None:
    assert (ROOT / name).read_text(encoding="utf-8").strip()


def test_the_citation_has_the_version_of_the_package() -> None:
    import potto

    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"version: {potto.__version__}\n" in text and "license: MIT\n" in text


def test_every_extra_that_pages_and_messages_name_exists() -> None:
    import tomllib

    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    texts = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    texts += [path for folder in ("potto", "repl", "lsp") for path in (ROOT / folder).rglob("*.py")]
    named = {name for path in texts for name in re.findall(r"pip install '\.\[(\w+)\]'", path.read_text("utf-8"))}
    called = {name for path in texts for name in re.findall(r"""install_command\(['"](\w+)""", path.read_text("utf-8"))}
    assert "jit" in named & called and named | called <= set(extras)
    assert not [path for path in texts if re.search(r"pip install '?potto", path.read_text("utf-8"))], "not released"
    tried = set(re.findall(r"\$\{(?:EXTRAS|RESOLVED)-([\w ]+)\}", (ROOT / ".ci/wheels").read_text("utf-8")))
    assert set(extras) - {"dev"} <= {word for words in tried for word in words.split()}


def test_messages_name_the_libraries_that_pyproject_asks_for() -> None:
    import tomllib

    from potto.extras import install_command

    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    for extra, wanted in extras.items():
        told = re.findall("'([^']*)'", install_command(extra))
        assert sorted(one.lower().replace("_", "-") for one in wanted) == sorted(told), extra
    assert install_command("nothing") == "pip install '.[nothing]'"
