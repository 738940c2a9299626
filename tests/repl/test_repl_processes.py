"""The prompt as a process: in pipes, and on a terminal with a real interrupt and a real screen."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys

import pexpect
import pytest
from screens import Screen

JUMP = "def f(t)\n    integral [0, 1] [x < t] d(x)\n"
POTTO = [sys.executable, "-m", "potto", "repl"]


def run(folder, text="", *arguments, **environment):
    return subprocess.run(
        [*POTTO, *arguments], input=text, capture_output=True, text=True, cwd=folder, check=False,
        env={**os.environ, **environment}, encoding="utf-8",
    )  # fmt: skip


# Pipes


def test_a_script_has_no_prompts_and_no_colours(tmp_path):
    done = run(tmp_path, f"# a comment\n{JUMP}\nf(0.25)\nprint(f(0.5), 2)\n:type f\n")
    lines = done.stdout.splitlines()
    assert done.returncode == 0 and done.stderr == "" and "\x1b" not in done.stdout
    assert lines[0] == "f : (t: Real) -> Real" and re.match(r"0\.250* ± ", lines[1]) and lines[1].endswith(" : Real")
    assert lines[2:] == ["0.5 2", "f : (t: Real) -> Real"]


def test_a_script_ends_at_its_first_error(tmp_path):
    done = run(tmp_path, "1 + 1\nnothing\n2 + 2\n")
    assert done.returncode == 1 and done.stdout == "2 : Real\n"
    assert "error[P0201]" in done.stderr and "<In 2>:1:1" in done.stderr


def test_a_script_can_keep_going(tmp_path):
    done = run(tmp_path, "nothing\n:nonsense\n2 + 2\n", "--keep-going")
    assert done.returncode == 1 and done.stdout == "4 : Real\n"


def test_json_lines(tmp_path):
    done = run(tmp_path, f"{JUMP}deriv(f)((0.25, 1))\n:type f\nnothing\n", "--json")
    definition, value, type, wrong = map(json.loads, done.stdout.splitlines())
    assert definition["name"] == "f" and definition["type"] == "(t: Real) -> Real"
    assert value["value"] == pytest.approx(0.25, rel=1e-12) and value["tangent"] == pytest.approx(1, rel=1e-12)
    assert (value["interior"], value["boundary"]) == (0, pytest.approx(1, rel=1e-12))
    assert type["type"] == "(t: Real) -> Real" and wrong["diagnostics"][0]["code"] == "P0201"
    assert done.returncode == 1


def test_entries_from_the_command_line_over_a_file(tmp_path):
    (tmp_path / "a.po").write_text(JUMP)
    done = run(tmp_path, "", "a.po", "-c", "f(0.5)", "-c", ":type f")
    assert done.returncode == 0 and done.stdout.splitlines()[0].startswith("0.5000000000")
    assert run(tmp_path, "", "missing.po", "-c", "1").returncode == 1
    assert run(tmp_path, "", "-c", ":quit", "-c", "1").stdout == ""


def test_ascii_where_the_locale_knows_no_more(tmp_path):
    done = subprocess.run(
        [*POTTO, "-c", "def f(t) integral [0, 1] [x < t] d(x)", "-c", "f(0.3)", "-c", ":plot f"], capture_output=True,
        cwd=tmp_path, check=False, env={**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"},
    )  # fmt: skip
    assert done.returncode == 0 and b"+/-" in done.stdout and max(done.stdout) < 128


def test_a_pipe_imports_no_terminal(tmp_path):
    done = subprocess.run([sys.executable, "-X", "importtime", "-m", "potto", "repl", "-c", "1 + 1"],
                          capture_output=True, text=True, cwd=tmp_path, check=False)  # fmt: skip
    assert done.stdout == "2 : Real\n"
    for library in ("prompt_toolkit", "pygls", "mpmath", "lark", "asyncio", "potto.ide"):
        assert f"| {library}\n" not in done.stderr.replace(" ", "").replace("|", "| "), library


def test_the_first_prompt_imports_no_numbers():
    code = "import sys, potto_repl.terminal; sys.exit('numpy' in sys.modules or 'potto.syntax' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# A terminal


def test_a_talk_on_a_screen(tmp_path):
    screen = Screen(tmp_path)
    screen.say("6*7", r"_1 = 42")
    screen.process.sendline("def f(t)")
    screen.process.sendline("    integral [0, 1] [x < t] d(x)")
    screen.say("", r"f : \(t: Real\)")
    screen.say("f(0.25)", r"_3 = 0\.25")
    assert "1 po> 6*7\n_1 = 42 : Real" in screen.text
    assert "2 po> def f(t)\n  ...     integral [0, 1] [x < t] d(x)" in screen.text
    assert screen.leave() == 0
    assert "+def f(t)\n+    integral" in (tmp_path / "history").read_text()


def test_ctrl_c_drops_a_half_typed_block(tmp_path):
    screen = Screen(tmp_path)
    screen.process.send("def f(t")
    screen.process.expect("def")
    screen.process.sendintr()
    screen.process.expect("po>")
    screen.say("1 + 2", r"_1 = 3")
    assert screen.leave() == 0


def test_what_is_wrong_is_underlined_on_the_screen(tmp_path):
    screen = Screen(tmp_path)
    screen.say("1 + 2", r"_1 = 3")
    screen.process.send("4 + nothing")
    underlined = ""
    for _ in range(20):
        screen.process.expect([pexpect.TIMEOUT, "never"], timeout=0.2)
        row = screen.terminal.buffer[screen.terminal.cursor.y]
        underlined = "".join(row[column].data for column in range(40) if row[column].underscore)
        if underlined:
            break
    assert underlined == "nothing"
    screen.process.sendintr()
    screen.process.expect("po>")
    assert screen.leave() == 0


def test_a_narrow_terminal_and_no_colours(tmp_path):
    screen = Screen(tmp_path, columns=30, NO_COLOR="1")
    screen.say("1 + 2", r"= 3 ")
    screen.settle(lambda text: text.splitlines()[-1].startswith("po>"))
    assert all(char.fg == "default" for line in screen.terminal.buffer.values() for char in line.values())
    assert screen.leave() == 0


def test_a_dumb_terminal_gets_no_escape_codes(tmp_path):
    screen = Screen(tmp_path, TERM="dumb")
    screen.say("1 + 2", r"_1 = 3")
    screen.process.sendline(":quit")
    screen.process.expect(pexpect.EOF)
    assert "\x1b" not in screen.process.before


def test_the_editor_is_the_persons(tmp_path):
    script = tmp_path / "editor.sh"
    script.write_text("#!/bin/sh\necho 'def f(t) 5*t' > \"$1\"\n")
    script.chmod(0o755)
    screen = Screen(tmp_path, EDITOR=str(script), VISUAL="")
    screen.say(":edit", r"f : ")
    screen.say("f(2)", r"= 10 ")
    assert screen.leave() == 0


def test_files_are_watched_while_the_prompt_waits(tmp_path):
    (tmp_path / "a.po").write_text("def f(t) 2*t")
    screen = Screen(tmp_path, "a.po")
    screen.say(":watch", "watching")
    (tmp_path / "a.po").write_text("def f(t) 300*t")
    screen.process.expect("1 of 1 recompiled")
    screen.process.expect("po>")
    screen.say("f(1)", r"= 300 ")
    assert screen.leave() == 0
