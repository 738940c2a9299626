"""What the build hook does to the texts that it compiles."""

from __future__ import annotations

import subprocess
import sys
import types
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
TEXT = '''
@dataclass(frozen=True, slots=True)
class Plain:
    """Doc."""

    x: int
    y: str = "a"

    def both(self) -> str:
        return self.y * self.x


@dataclass(slots=True)
class Made:
    items: list[int] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Checked:
    x: int

    def __post_init__(self) -> None: ...


class NoDataclass:
    x: int


@value
class Valued:
    x: int


'''


@pytest.fixture
def hook(monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
    """The hook, without the tool that calls it."""
    name = "hatchling.builders.hooks.plugin.interface"
    interface = types.ModuleType(name)
    interface.BuildHookInterface = list  # type: ignore[attr-defined]
    for part in ("hatchling", "hatchling.builders", "hatchling.builders.hooks", "hatchling.builders.hooks.plugin"):
        monkeypatch.setitem(sys.modules, part, types.ModuleType(part))
    monkeypatch.setitem(sys.modules, name, interface)
    module = types.ModuleType("hatch_build")
    exec((ROOT / "hatch_build.py").read_text(), module.__dict__)
    return module


def test_constructors_are_written_out_and_no_line_moves(hook: types.ModuleType) -> None:
    written = hook.with_inits(TEXT).split("\n")
    before = TEXT.split("\n")
    assert len(written) == len(before)
    changed = [(old, new) for old, new in zip(before, written) if old != new]
    assert changed == [
        ("@dataclass(frozen=True, slots=True)", "@dataclass(init=False, frozen=True, slots=True)"),
        ("", "    def __init__(self, x: int, y: str = 'a') -> None: self.x = x; self.y = y  # type: ignore"),
        ("@value", "@dataclass(init=False, repr=False, eq=False)"),
        ("", "    def __init__(self, x: int) -> None: self.x = x  # type: ignore"),
        ("", "machine(Valued)"),
    ]


def test_what_is_written_out_makes_the_same_values(hook: types.ModuleType, tmp_path: Path) -> None:
    """As Python that is not frozen, which is how machine code writes into fields."""
    head = (
        "from __future__ import annotations\nfrom dataclasses import dataclass, field\nfrom potto.quick import value\n"
    )
    written = hook.with_inits(head + TEXT).replace("frozen=True, ", "")
    check = "assert Plain(2).both() == 'aa' and Plain(x=1, y='b') == Plain(1, 'b')"
    check += "; assert Valued.__match_args__ == ('x',) and Valued.__setattr__ is not object.__setattr__"
    (tmp_path / "one.py").write_text(f"{written}\n{check}\n")
    assert subprocess.run([sys.executable, "one.py"], cwd=tmp_path, check=False).returncode == 0
