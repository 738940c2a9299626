"""The project file: the same roots, lints and settings from the command line, the prompt and Python."""

from __future__ import annotations

import importlib
import json
import pkgutil
from pathlib import Path

import pytest
from command_runs import Potto

import potto as api
from potto.diagnostics import KINDS
from potto.evaluating.session import Said, Session, Valued
from potto.projects.project import LINTS, Projects, read_project
from potto.projects.settings import DEFAULTS, current

USES_SRC = "from shapes import f\ndef g(t) f(t)\n"
UNUSED = "from shapes import f\ndef g(t) t\n"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder with modules in `src`, a lint switched off and an accuracy of its own."""
    (tmp_path / "src").mkdir()
    (tmp_path / "src/shapes.po").write_text("def f(t) t^2\n")
    (tmp_path / "potto.toml").write_text(
        'roots = ["src"]\n[lints]\nP0620 = "off"\n[settings]\nmethod = "mc"\nsamples = 1000\nseed = 3\n'
    )
    return tmp_path


def test_check_finds_modules_and_heeds_lints(potto: Potto, project: Path) -> None:
    assert potto("check", "main.po", main=UNUSED).status == 0
    assert "P0620" not in potto("check", "main.po").out
    (project / "potto.toml").write_text('roots = ["src"]\n[lints]\nP0620 = "error"\n')
    ran = potto("check", "main.po")
    assert ran.status == 1 and "error[P0620]" in ran.out
    assert potto("eval", "main.po", "g(2)").status == 0, "a lint keeps no program from running"


def test_the_project_of_a_file_counts_not_that_of_the_working_folder(
    potto: Potto, project: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    (project / "deep/er").mkdir(parents=True)
    (project / "deep/er/main.po").write_text(USES_SRC)
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    ran = potto("eval", str(project / "deep/er/main.po"), "g(3)")
    assert ran.status == 0 and ran.out.strip() == "9"


def test_settings_of_the_project_and_options_over_them(potto: Potto, project: Path) -> None:
    expression = "integral [0, 1] x d(x)"
    assert json.loads(potto("eval", "--json", "main.po", expression, main=USES_SRC).out)["method"] == "mc"
    asked = potto("eval", "--json", "--method", "quadrature", "main.po", expression)
    assert json.loads(asked.out)["method"] == "quadrature"


def test_the_prompt_has_them(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(project)
    session = Session(["."])
    session.run("from shapes import f")
    outcomes = session.run("integral [0, 1] f(x) d(x)")  # what samples miss is said as well
    (shown,) = [outcome for outcome in outcomes if isinstance(outcome, Valued)]
    assert shown.estimates[0].method == "mc"


def test_the_prompts_command_has_them(potto: Potto, project: Path) -> None:
    ran = potto("repl", "-c", "from shapes import f", "-c", "f(3)", "-c", ":set samples")
    assert "9" in ran.out and "1000" in ran.out


def test_python_has_them_and_a_block_goes_first(project: Path) -> None:
    (project / "main.po").write_text(USES_SRC + "area = integral [0, 1] f(x) d(x)\n")
    assert api.load(project / "main.po").area.method == "mc"
    with api.settings(method="quadrature"):
        assert api.load(project / "main.po").area.method == "quadrature"
    assert api.Workspace(project).module("shapes").f(2).value == 4


def test_a_wrong_project_file_is_told_everywhere(potto: Potto, project: Path) -> None:
    (project / "potto.toml").write_text('[settings]\nrtol = "fine"\naccuracy = 1\n[lint]\n')
    for command in (["check", "main.po"], ["eval", "main.po", "1"], ["run", "main.po"]):
        ran = potto(*command, main="def g(t) t\n")
        assert ran.status == 1 and (ran.out + ran.err).count("error[P0231]") == 3, command
    assert "potto.toml:2:8" in potto("check", "main.po").out
    with pytest.raises(api.PottoError) as caught:
        api.load(project / "main.po")
    assert {d.code for d in caught.value.diagnostics} == {"P0231"}
    told = [o for o in Session([project]).run("1 + 1") if isinstance(o, Said)]
    assert [o.located.diagnostic.code for o in told] == ["P0231"] * 3


def places(folder: Path, text: str) -> list[str]:
    """What a project file says that is not understood, in order: the texts of the places."""
    (folder / "potto.toml").write_text(text)
    return [text[said.span.start : said.span.end] for said in read_project(str(folder)).problems]


def test_what_is_wrong_is_told_at_its_place_and_all_at_once(tmp_path: Path) -> None:
    text = 'roots = ["nowhere"]  # seed\n\n[lints]\nP0620 = "loud" # P0621\nP0621 = "off"\n\n[settings]\nseed = -1\n'
    assert places(tmp_path, text) == ['["nowhere"]', '"loud"', "-1"]
    found = read_project(str(tmp_path))
    assert found.settings == DEFAULTS and found.lints == {"P0621": "off"}
    assert places(tmp_path, 'lints = { P0620 = "off", "P062" = "off" }\nsettings.sed = 1\n[other]\nseed = 1\n') == [
        "P062", "sed", "other",
    ]  # fmt: skip
    assert places(tmp_path, "lints = 3\nsettings = 4\nroots = 5") == ["3", "4", "5"]
    assert places(tmp_path, "roots = [\n\nx = 3 = 4") == ["x = 3 = 4"]
    assert places(tmp_path, "roots = [") == [""]
    assert read_project(str(tmp_path)).problems[0].span.start == len("roots = [")


def test_a_code_that_is_no_lint_is_an_error_with_what_may_have_been_meant(tmp_path: Path) -> None:
    text = '[lints]\nP620 = "off"\nP0301 = "off"\n[setings]\n[settings]\nrtoll = 1\n'
    assert places(tmp_path, text) == ["P620", "P0301", "setings", "rtoll"]
    unknown, language, *_ = read_project(str(tmp_path)).problems
    assert "no diagnostic `P620`" in unknown.message and "`P0620`" in unknown.help
    assert "not a lint" in language.message and not language.suggestions
    edits = [said.suggestions[0].edits[0] for said in read_project(str(tmp_path)).problems if said.suggestions]
    written = text
    for edit in reversed(edits):
        written = written[: edit.span.start] + edit.text + written[edit.span.end :]
    assert written == text.replace("P620", "P0620").replace("setings", "settings").replace("rtoll", "rtol")


def test_lints_are_all_kinds_that_are_no_errors() -> None:
    for module in pkgutil.walk_packages(api.__path__, "potto."):
        path = Path(module.module_finder.path, *module.name.rsplit(".", 1)[-1:])  # type: ignore[union-attr]
        source = path.with_suffix(".py") if not module.ispkg else path / "__init__.py"
        if "declare(" in source.read_text():
            importlib.import_module(module.name)
    assert set(LINTS) == {kind.code for kind in KINDS.values() if kind.severity != "error"}


def test_the_nearest_project_file_counts(tmp_path: Path) -> None:
    (tmp_path / "a/b").mkdir(parents=True)
    (tmp_path / "potto.toml").write_text("[settings]\nseed = 1\n")
    (tmp_path / "a/potto.toml").write_text("[settings]\nseed = 2\n")
    projects = Projects()
    for path, seed in (("x.po", 1), ("a/x.po", 2), ("a/b/x.po", 2), ("a/b", 2)):
        found = projects.of(str(tmp_path / path))
        assert found is not None and found.settings.seed == seed
    (tmp_path / "a/potto.toml").unlink()
    projects.forget()
    found = projects.of(str(tmp_path / "a/b/x.po"))
    assert found is not None and found.settings.seed == 1


def test_what_is_not_set_comes_from_the_base() -> None:
    base = api_settings(seed=9, rtol=1e-3)
    assert current(base) == base
    with api.settings(seed=4):
        assert current(base) == api_settings(seed=4, rtol=1e-3)
        assert current() == api_settings(seed=4)


def api_settings(**changes: object):
    from msgspec.structs import replace

    return replace(DEFAULTS, **changes)
