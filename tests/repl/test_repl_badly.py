"""A prompt that is treated badly: broken files, full discs, nonsense, crashes. It says what is wrong and goes on."""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys

import pytest
from potto_repl.editing import untabbed
from potto_repl.registry import COMMANDS, PromptCommand
from potto_repl.replay import replayed
from potto_repl.without_terminal import entries
from screens import Screen

POTTO = [sys.executable, "-m", "potto"]
NEVER = ("Traceback", "bug in Potto", "internal error")


def fine(reply):
    assert not any(word in reply.text for word in NEVER), reply.text
    return reply.text


def alive(talk):
    assert talk.data("20 + 3")["value"] == 23


# Files


@pytest.mark.parametrize(("name", "content", "says"), [
    ("binary.po", bytes(range(255, -1, -1)) * 10, "not UTF-8"),
    ("utf16.po", "def f(t) t".encode("utf-16"), "UTF-16"),
    ("latin.po", "é = 3".encode("latin-1"), "not UTF-8"),
    ("nul.po", b"a = 1\0\n", "NUL"),
    ("deep.po", b"a = " + b"(" * 5000 + b"1" + b")" * 5000, "nested too deeply"),
    ("open.po", b"def f(t\n", "never closed"),
    ("self.po", b"from self import f\n", "self"),
])  # fmt: skip
def test_files_that_are_no_programs(talk, name, content, says):
    (talk.folder / name).write_bytes(content)
    reply = talk(f":load {name}")
    assert says in fine(reply) and reply.failed
    alive(talk)


def test_what_is_no_file(talk):
    (talk.folder / "folder.po").mkdir()
    os.mkfifo(talk.folder / "pipe.po")
    for name, says in (("missing.po", "no file"), ("folder.po", "folder"), ("pipe.po", "not an ordinary file"),
                       ("/dev/zero", "not an ordinary file"), ("~nobody/x", "no file"), ("''", "missing")):  # fmt: skip
        reply = talk(f":load {name}")
        assert reply.failed and says in fine(reply), name
    alive(talk)


def test_a_huge_file(talk):
    talk.write("huge.po", "".join(f"def n{i}(x) x + {i}\n" for i in range(5000)))
    assert "5000 names: n0, n1" in fine(talk(":load huge.po"))
    assert talk.data("n4999(1)")["value"] == 5000


def test_lines_that_end_and_begin_in_any_way(talk):
    (talk.folder / "a.po").write_bytes("\ufeffdef f(t)\r\n\tt^2\r\ndef g(t)\r\n    θ = t\r\n    θ + 1\r\n".encode())
    fine(talk(":load a.po"))
    assert talk.data("f(3)")["value"] == 9 and talk.data("g(3)")["value"] == 4
    assert untabbed("def f(t)\n\ta = t\n        a\tb") == "def f(t)\n    a = t\n        a b"


def test_a_file_that_is_loaded_is_not_overwritten(talk):
    talk.write("mine.po", "def f(t) t\n")
    talk.all(":load mine.po", "f(2)")
    assert talk(":save mine.po").failed
    assert (talk.folder / "mine.po").read_text() == "def f(t) t\n"
    assert not talk(":save other.po").failed


def test_a_full_disc_loses_nothing(talk):
    talk.all("def f(t) t", "f(2)", ":plot f", ":save kept.po", ":save kept.svg", ":record log.txt", "f(3)")
    before = {name: (talk.folder / name).read_bytes() for name in ("kept.po", "kept.svg")}
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, limits[1]))
    try:
        reply = talk("f(4)")
        assert "= 4" in reply.text and "`log.txt` cannot be written any more" in fine(reply)
        for name in before:
            assert "cannot be written" in fine(talk(f":save {name}"))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert {name: (talk.folder / name).read_bytes() for name in before} == before
    assert sorted(os.listdir(talk.folder)) == ["kept.po", "kept.svg", "log.txt"]
    assert "nothing was being recorded" in talk(":record off").text
    alive(talk)


def test_what_is_said_where_nothing_can_be_written(tmp_path):
    with open("/dev/full", "w") as full:
        done = subprocess.run([*POTTO, "repl", "-c", "1"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1 and "no space left" in done.stderr and "bug" not in done.stderr
    closed = subprocess.run(["sh", "-c", '"$@" >&- 2>&- <&-', "sh", *POTTO, "repl", "-c", "1+1"], check=False)
    assert closed.returncode == 0
    script = "".join(f"{n}\n" for n in range(3000))
    done = subprocess.run(f"'{sys.executable}' -m potto repl | head -1", input=script, shell=True, text=True,
                          capture_output=True, check=False)  # fmt: skip
    assert done.stdout == "0 : Real\n" and done.stderr == ""


def test_a_folder_that_is_gone(tmp_path):
    command = f"mkdir gone; cd gone; rmdir ../gone; '{sys.executable}' -m potto repl -c 1"
    done = subprocess.run(command, shell=True, cwd=tmp_path, text=True, capture_output=True, check=False)
    assert done.returncode == 1 and "is gone" in done.stderr and "Traceback" not in done.stderr


def test_a_folder_that_goes_while_one_works_in_it(talk, tmp_path_factory, monkeypatch):
    gone = tmp_path_factory.mktemp("gone")
    monkeypatch.chdir(gone)
    gone.rmdir()
    for text in (":load x.po", ":save x.po", ":record x.log", ":browse x", "from m import h"):
        assert talk(text).failed and fine(talk(text))
    alive(talk)


def test_files_that_change_while_they_are_watched(talk):
    path = talk.folder / "w.po"
    path.write_text("def f(t) 2*t")
    talk.all(":load w.po", ":watch")
    changes = [
        (path.unlink, "cannot be read|no file|is gone|not there"),
        (lambda: path.write_text("def f(t) 2*"), "P01"),
        (lambda: path.write_bytes(b"\xff\xfe\x00"), "not UTF-8"),
        (lambda: (path.unlink(), path.mkdir()), "folder"),
    ]
    for change, says in changes:
        change()
        text = fine(talk("f(1)"))
        assert re.search(says, text) and "earlier definitions are kept" in text and "= 2 " in text
        assert fine(talk("f(2)")).startswith("_") and "= 4 " in talk("f(2)").text  # said once, not each time
    path.rmdir()
    path.write_text("def f(t) 50*t")
    assert "1 of 1 recompiled" in (text := fine(talk("f(1)"))) and "= 50 " in text


# What is typed


@pytest.mark.parametrize("text", [
    ")", "((", "[", "}", "def", "def f", "def f(", "for", "for = 3", "if = 2", "integral", "integral = 3", "\\", "\\x",
    "..", "1 2", "f(\0)", "\x1b[31m", "“x”", "x² = 3", "١ + 1", "1\u00a0+ 1", "a = ", "=", "== 3", "_", "_99", "Out[",
    "Out[x]", "Out[99999999999999999999]", ":", "::", ": type", ":type", ":\u00e9", "?", "??", "x?", "x??",
    "?x", "😀", "\ud800", "1" * 5000, "+".join("1" * 3000), "(" * 3000, "x" * 20000, "-" * 2000 + "1",
    "def f(" + ",".join(f"a{i}" for i in range(3000)) + ") 1", "1e999", "1e-999",
    "0x10", "deriv", "deriv()", "deriv(deriv)", "print", "print()", "let", "import os",
    "from os import path", "import .", "from . import x",
])  # fmt: skip
def test_nonsense_is_answered(talk, text):
    reply = talk(text)
    fine(reply)
    alive(talk)


def test_two_thousand_lines_at_once(talk):
    block = "".join(f"def n{i}(x)\n    a = sin(x) + {i}\n    a*x\n\n" for i in range(500))
    assert len(fine(talk(block)).splitlines()) == 500
    assert talk.data("n7(1)")["value"] == pytest.approx(7.841470984807897, rel=1e-15)
    assert len(list(entries(block.split("\n")))) == 500
    broken = block.replace("a*x\n\ndef n250", "a*y\n\ndef n250")
    text = fine(talk(broken))
    assert "`y` is not defined" in text and "<In 3>:999:7" in text


def test_entries_of_a_pipe_go_on_behind_operators_and_within_brackets():
    lines = ["1 +", "2", "f(", "1,", "2)", "3 *", ":type 4", "f(", "def f(x) x", "a = 1 -", "b = 2"]
    assert list(entries(lines)) == ["1 +\n2", "f(\n1,\n2)", "3 *", ":type 4", "f(", "def f(x) x", "a = 1 -", "b = 2"]


def test_names_of_builtins_may_be_used(talk):
    text = fine(talk("def sqrt(x) 2*x"))
    assert text.count("builtin") == 1 and "shadows the builtin `sqrt`" in text  # said once
    assert talk.data("sqrt(4)")["value"] == 8
    talk(":undo")
    assert talk.data("sqrt(4)")["value"] == 2
    for text in ("pi = 3", "def deriv(x) x", "def print(x) x", "quit = 3", "help = 4", "_ = 5", "_2 = 6"):
        reply = talk(text)
        assert not reply.failed and "<Last" not in reply.text and "<Out" not in reply.text, reply.text
    assert talk.data("pi")["value"] == 3 and talk.data("quit + help")["value"] == 7
    assert not talk.session.leaving


def test_advice_is_given_where_it_helps(talk):
    assert "make a function" in talk("x + 1").text
    assert "make a function" not in talk("“x”").text
    talk.write("m.po", "def h(t) t")
    text = talk("h(3)").text
    assert "add `from m import h`" in text and "def h(x)" not in text


def test_a_crash_in_any_command_is_a_short_report(talk, monkeypatch):
    def broken(session, text):
        raise RuntimeError("ours")

    for name, entry in list(COMMANDS.items()):
        monkeypatch.setitem(
            COMMANDS, name, PromptCommand(name, entry.short, entry.argument, "nothing", entry.help, broken)
        )
        reply = talk(f":{name}")
        assert reply.failed and len(reply.text.splitlines()) == 5 and "RuntimeError" in reply.text
        assert "Traceback" not in reply.text and "the session goes on" in reply.text
        os.unlink(re.search(r"report: +(\S+)", reply.text)[1])
    alive(talk)


def test_a_crash_in_the_middle_of_a_command_shows_what_came_before(talk, monkeypatch):
    import potto_repl.slopes

    def broken(*_):
        raise RecursionError("ours")

    talk("def f(t) t^2")
    monkeypatch.setattr(potto_repl.slopes, "parts_of", broken)
    reply = talk(":grad f(3)")
    assert reply.failed and "RecursionError" in reply.text
    alive(talk)


def test_a_crash_whose_report_cannot_be_written(talk, monkeypatch):
    import tempfile

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(COMMANDS, "type", PromptCommand("type", "t", "", "nothing", "", lambda s, t: 1 / 0))
    monkeypatch.setattr(tempfile, "mkstemp", full)
    assert "could not be written" in talk(":type 1").text
    alive(talk)


# Terminals


def test_a_history_that_cannot_be_kept(tmp_path):
    for history in ("/proc/nowhere/history", str(tmp_path), "/dev/full"):
        screen = Screen(tmp_path, POTTO_HISTORY=history)
        screen.say("1 + 2", "= 3 ")
        screen.process.send("\x1b[A")  # of this session there is one all the same
        screen.settle(lambda text: text.endswith("2 po> 1 + 2"))
        screen.process.sendintr()
        screen.process.expect("po>")
        assert screen.leave() == 0


def test_a_home_that_is_not_there(tmp_path):
    home = tmp_path / "nobody"
    screen = Screen(tmp_path, HOME=str(home), POTTO_HISTORY="", XDG_STATE_HOME="")
    screen.say("1 + 2", "= 3 ")
    assert screen.leave() == 0
    assert not (home / ".local").exists()


def test_a_history_on_a_disc_that_gets_full(tmp_path, monkeypatch):
    from potto_repl.terminal import KeptHistory, open_history

    monkeypatch.setenv("POTTO_HISTORY", str(tmp_path / "deep" / "history"))
    history = open_history()
    assert isinstance(history, KeptHistory)
    history.append_string("1 + 1")
    (tmp_path / "deep" / "history").unlink()
    (tmp_path / "deep").rmdir()
    history.append_string("2 + 2")
    assert history.get_strings() == ["1 + 1", "2 + 2"]
    assert list(history.load_history_strings()) == []


def test_a_screen_of_twenty_columns_that_changes_its_size(tmp_path):
    screen = Screen(tmp_path, columns=20)
    screen.say("def f(t) integral [0, 1] [x < t]*t^2 d(x)", "f : ")
    screen.say("f(0.3)", "0.027")
    screen.process.send("f(0.2) + f(0.1) + f(0.3)")
    for columns in (60, 9, 20):
        screen.process.setwinsize(40, columns)
        screen.terminal.resize(40, columns)
        screen.process.expect("po>")
    screen.say("", "0.036")
    screen.say("nothing", "not defined")
    screen.say(":help", "watch")
    assert screen.leave() == 0


@pytest.mark.parametrize("environment", [{"NO_COLOR": "1"}, {"TERM": "dumb"}, {"TERM": "vt100"}, {"TERM": "nonsense"}])
def test_poor_terminals(tmp_path, environment):
    screen = Screen(tmp_path, **environment)
    screen.say("1 + 2", "= 3 ")
    screen.say("nothing", "not defined")
    assert all(char.fg == "default" for row in screen.terminal.buffer.values() for char in row.values()) or (
        "TERM" in environment
    )
    assert screen.leave() == 0


# Everything that happens in a session, replayed


def test_a_record_of_everything_is_replayed(talk):
    talk.write("m.po", "def h(x) integral [0, x] u d(u)\n")
    talk.all(":record log.txt", ":load m.po", "h(2)", "_*3", "Out[1] + 1", "def g(t)\n    a = h(t)\n    a + 1",
             "(g(1), [1, 2])", "\\x . h(x)", "_(2)", ":deriv h", ":check h(1)", ":surfaces h", ":eval g(3)", ":type g",
             "g?", "sqrt?", ":browse", ":set rtol 1e-8", ":method mc", "h(2)", ":method auto", ":plot h",
             ":image x*h(y) 8", ":error h(1)", ":time h(1)", ":fit (h(t) - 1)^2 t=2", ":undo",
             "for v in [1, 2]:\n    print(v, h(v))", "def g(t) 7", ":reset", "1 + 1")  # fmt: skip
    talk("nothing")
    talk(":nonsense")
    talk(":record off")
    found = list(replayed((talk.folder / "log.txt").read_text()))
    assert len(found) == 32
    assert [(entry.text, difference.now) for entry, difference in found if difference is not None] == []


def test_a_folder_stands_for_its_main_program(talk):
    (talk.folder / "whole").mkdir()
    (talk.folder / "whole" / "main.po").write_text("def cube(t) t^3\n")
    fine(talk(":load whole"))
    assert "8" in fine(talk("cube(2)"))
    (talk.folder / "parts").mkdir()
    (talk.folder / "parts" / "one.po").write_text("x = 1\n")
    reply = talk(":load parts")
    assert "`parts` is a folder without a `main.po`" in reply.text and "one.po" in reply.text
