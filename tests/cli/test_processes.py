"""The command line as a process: how it starts, ends, and speaks to pipes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import potto
from potto.__main__ import main

ROOT = Path(__file__).resolve().parents[2]
COMMAND = [sys.executable, "-m", "potto"]


def test_the_version_is_the_packages() -> None:
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    ran = subprocess.run([*COMMAND, "--version"], capture_output=True, text=True, check=True)
    assert ran.stdout == f"potto {declared}\n" and potto.__version__ == declared


def test_the_version_imports_nothing_heavy() -> None:
    code = "import sys, potto.__main__ as m; m.main(['--version']); print(sorted(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    for name in ("numpy", "lark", "argparse", "potto.syntax", "asyncio"):
        assert f"'{name}'" not in loaded


def test_checking_and_formatting_need_no_numpy_and_no_lark(tmp_path: Path) -> None:
    file = tmp_path / "main.po"
    file.write_text("def f(t)\n    integral [0, 1] [x < t] d(x)\n")
    subprocess.run([*COMMAND, "check", str(file)], check=True, capture_output=True)  # fills the cache of tables
    code = (
        "import sys, potto.__main__ as m\n"
        f"assert m.main(['check', {str(file)!r}]) == 0 and m.main(['fmt', {str(file)!r}]) == 0\n"
        f"assert m.main(['deriv', {str(file)!r}, 'f']) == 0\n"
        "sys.exit('numpy' in sys.modules or 'lark' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_a_reader_that_leaves_is_no_error(tmp_path: Path) -> None:
    file = tmp_path / "main.po"
    file.write_text("".join(f"print({n})\n" for n in range(3000)))
    writer = subprocess.Popen([*COMMAND, "run", str(file)], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert writer.stdout is not None and writer.stderr is not None
    writer.stdout.readline()
    writer.stdout.close()
    said = writer.stderr.read().decode()
    writer.wait(60)
    assert said == ""


def test_a_terminal_that_knows_only_ascii(tmp_path: Path) -> None:
    file = tmp_path / "main.po"
    file.write_text("def f(θ) θ + ψ\n")
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    ran = subprocess.run([*COMMAND, "check", str(file)], capture_output=True, env=environment, check=False)
    assert ran.returncode == 1 and b"P0201" in ran.stdout and b"Traceback" not in ran.stderr


def test_standard_input_as_a_pipe() -> None:
    command = [*COMMAND, "eval", "-", "f(3)"]
    ran = subprocess.run(command, input="def f(x) x^2\n", capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (0, "9\n")


# Interrupts. What is started in the background of a script is told by the shell to ignore them, and keeps to it.

IGNORING = ["sh", "-c", "trap '' INT; exec \"$@\"", "sh"]
FACES = [
    pytest.param(["run", "-"], "print(6*7)\n", "42\n", id="run"),
    pytest.param(["eval", "-", "f(6)"], "def f(x) 7*x\n", "42\n", id="eval"),
    pytest.param(["check", "-"], "def f(x) 7*x\n", "", id="check"),
    pytest.param(["fmt", "-"], "a  =  42\n", "a = 42\n", id="fmt"),
    pytest.param(["repl"], "6*7\n", "42 : Real\n", id="repl"),
]


def begun(before: list[str], words: list[str]) -> subprocess.Popen[str]:
    """A process that waits for its standard input; how interrupts reach it is settled."""
    process = subprocess.Popen([*before, sys.executable, "-c", READING, *words], stdin=subprocess.PIPE,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return process


READING = "import sys, potto.__main__ as m\nprint('ready', flush=True)\nsys.exit(m.main(sys.argv[1:]))"


@pytest.mark.parametrize(("words", "text", "answer"), FACES)
def test_who_ignores_interrupts_goes_on(words: list[str], text: str, answer: str) -> None:
    process = begun(IGNORING, words)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(text, timeout=120)
    assert process.returncode == 0 and out.startswith(answer) and "interrupted" not in err


@pytest.mark.parametrize("words", [face.values[0] for face in FACES])
def test_who_does_not_is_ended(words: list[str]) -> None:
    process = begun([], words)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=120)
    assert process.returncode in (130, -signal.SIGINT) and out == ""  # the second before the command has taken over


BUSY = """
import sys, time, concurrent.futures as futures, potto.__main__ as m, potto.cli.command_line as line
pool = futures.ThreadPoolExecutor(1)

def dispatch(arguments):
    pool.submit(time.sleep, 100)
    print("what was done")
    raise KeyboardInterrupt

line.dispatch = dispatch
sys.exit(m.main())
"""


def test_an_interrupt_does_not_wait_for_what_is_made_meanwhile() -> None:
    """As Python does for its threads, and LLVM takes seconds."""
    found = subprocess.run([sys.executable, "-c", BUSY], capture_output=True, text=True, timeout=60)
    assert (found.returncode, found.stdout, found.stderr) == (130, "what was done\n", "\ninterrupted\n")


def test_an_interrupt_while_a_class_is_made_is_one(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    """Python 3.11 tells it as a RuntimeError."""

    class Named:
        def __set_name__(self, owner: type, name: str) -> None:
            raise KeyboardInterrupt

    monkeypatch.setattr("potto.cli.command_line.dispatch", lambda arguments: type("Made", (), {"part": Named()}))
    assert main(["eval", "1"]) == 130 and "interrupted" in capsys.readouterr().err
