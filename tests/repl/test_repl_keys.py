"""Keys at the prompt, without a terminal: a pipe for the keyboard, nothing for the screen."""

from __future__ import annotations

import threading
import time

import pytest
from potto_repl.complete import candidates
from potto_repl.session_loading import Loader
from potto_repl.terminal import Terminal
from prompt_toolkit.application import create_app_session
from prompt_toolkit.history import InMemoryHistory
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from potto.projects.settings import DEFAULTS

UP, RIGHT, LEFT, CTRL_C, CTRL_D, CTRL_E, TAB = "\x1b[A", "\x1b[C", "\x1b[D", "\x03", "\x04", "\x05", "\t"


def paste(text):
    return f"\x1b[200~{text}\x1b[201~"


@pytest.fixture(scope="module")
def loader():
    loader = Loader(DEFAULTS)
    assert candidates(loader.session, "expm")  # what the first Tab would wait for
    return loader


def read(loader, *keys, history=(), vi=False):
    """The entry that the keys make."""
    with create_pipe_input() as keyboard, create_app_session(input=keyboard, output=DummyOutput()):
        past = InMemoryHistory(list(history))
        terminal = Terminal(loader, history=past, vi=vi)
        keyboard.send_text("".join(keys))
        return terminal.read()


def read_slowly(loader, *steps, history=(), vi=False):
    """The same, with time to think before each step: for what happens on other threads."""
    with create_pipe_input() as keyboard, create_app_session(input=keyboard, output=DummyOutput()):
        terminal = Terminal(loader, history=InMemoryHistory(list(history)), vi=vi)

        def send():
            for step in steps:
                time.sleep(0.7 if step == "0" else 0.25)  # after an Escape it takes half a second to be one
                keyboard.send_text(step)
            if not over.wait(5):
                keyboard.send_text(CTRL_C + CTRL_C)

        over = threading.Event()
        sender = threading.Thread(target=send, daemon=True)
        sender.start()
        try:
            return terminal.read()
        finally:
            over.set()
            sender.join()


def test_a_line_is_an_entry(loader):
    assert read(loader, "1 + 1\r") == "1 + 1"


def test_a_block_is_indented_and_ends_at_an_empty_line(loader):
    steps = ("def f(t)\r", "a = t^2\r", "a + 1\r", "\r")
    assert read_slowly(loader, *steps).rstrip() == "def f(t)\n    a = t^2\n    a + 1"


def test_brackets_hold_an_entry_open(loader):
    assert read_slowly(loader, "max(1,\r", "2)\r") == "max(1,\n    2)"


def test_lines_in_a_rush_keep_their_own_indentation(loader):
    text = "def f(t)\r    a = t\r    b = a\r    b\r\r"
    assert read(loader, text).rstrip() == "def f(t)\n    a = t\n    b = a\n    b"


def test_a_paste_is_one_entry_without_prompts(loader):
    block = "po> def f(t)\n...     t^2\nf : Real\npo> f(2)\n"
    assert read(loader, paste(block), "\r") == "def f(t)\n    t^2\nf(2)"
    assert read(loader, paste("def f(t)\n    t^2\n"), "\r") == "def f(t)\n    t^2"


def test_what_is_wrong_is_handed_in_to_be_told(loader):
    assert read(loader, "f(1))\r") == "f(1))"


def test_history_by_prefix(loader):
    past = ["f(1)", "g(2)", "def f(t)\n    t"]
    assert read_slowly(loader, "g", UP, "\r", history=past) == "g(2)"
    assert read_slowly(loader, "f", UP, "\r", history=past) == "f(1)"


def test_a_block_comes_back_as_one_entry(loader):
    got = read_slowly(loader, UP, " + 1\r", "\r", history=["def f(t)\n    t"])
    assert got.rstrip() == "def f(t)\n    t + 1"


def test_a_suggestion_is_taken_by_the_right_arrow_only(loader):
    past = ["renderer(0.5)"]
    assert read_slowly(loader, "rend", RIGHT, "\r", history=past) == "renderer(0.5)"
    assert read_slowly(loader, "rend", CTRL_E, "\r", history=past) == "rend"
    assert read_slowly(loader, "rend", "\r", history=past) == "rend"


def test_symbols_by_tab(loader):
    assert read(loader, "\\theta", TAB, " + 1\r") == "θ + 1"


def test_tab_completes(loader):
    assert read_slowly(loader, "expm", TAB, "(1)\r") == "expm1(1)"


def test_enter_right_behind_tab_hands_in_what_was_completed(loader):
    assert read(loader, "expm", TAB, "(1)\r") == "expm1(1)"
    assert read(loader, "expm", TAB, "\r") == "expm1"
    assert read(loader, "1 + erf", TAB, "(2)\r") == "1 + erf(2)"  # erf or erfc: what both begin with


def test_tab_indents_on_a_blank_line(loader):
    assert read_slowly(loader, "f(1,\r", TAB, "2)\r") == "f(1,\n        2)"


def test_ctrl_c_drops_and_ctrl_d_leaves(loader):
    with pytest.raises(KeyboardInterrupt):
        read(loader, "def f(t", CTRL_C)
    with pytest.raises(EOFError):
        read(loader, CTRL_D)


def test_vi_keys(loader):
    assert read_slowly(loader, "1 + 2", "\x1b", "0", "x", "i3", "\r", vi=True) == "3 + 2"


def test_the_talk_answers_and_leaves(loader, capsys):
    with create_pipe_input() as keyboard, create_app_session(input=keyboard, output=DummyOutput()):
        terminal = Terminal(loader, history=InMemoryHistory(), color=False, theme="none")
        keyboard.send_text("20 + 3\r" + "nothing here\r" + "\r" + CTRL_C + ":quit\r")
        assert terminal.run() == 0
    loader.session.leaving = False
    out = capsys.readouterr().out
    assert "= 23 : Real" in out and "`nothing` is not defined" in out and "\x1b" not in out


def test_what_is_wrong_is_underlined_while_one_types(loader):
    from potto_repl.background import Checker

    seen = threading.Event()
    checker = Checker(loader, seen.set)
    checker.look("1 + nothing")
    assert seen.wait(5)
    assert checker.wrong("1 + nothing") == ((4, 11),) and checker.wrong("1 + nothin") == ()
    before = loader.session.number
    seen.clear()
    checker.look("1 + 1")
    assert seen.wait(5) and checker.wrong("1 + 1") == () and loader.session.number == before


def test_progress_comes_late_and_goes_away():
    import io

    from potto.evaluating.progress import Progress

    screen = io.StringIO()
    with Progress(screen):
        pass
    assert screen.getvalue() == ""
    with Progress(screen) as progress:
        progress.note("step 3", 0.5)
        time.sleep(0.8)
    text = screen.getvalue()
    assert "step 3" in text and "s left" in text and text.endswith("\r\x1b[K")


def test_what_was_typed_while_everything_was_loading_is_coloured_then():
    running = threading.Event()

    class Late(Loader):
        def _load(self):
            running.wait(20)
            super()._load()

    late = Late(DEFAULTS)
    with create_pipe_input() as keyboard, create_app_session(input=keyboard, output=DummyOutput()):
        terminal = Terminal(late, history=InMemoryHistory())
        drawn = []
        terminal.prompt_session.app.invalidate = lambda: drawn.append(terminal.prompt_session.lexer)

        def finish():
            while not terminal.prompt_session.app.is_running:
                time.sleep(0.01)
            running.set()
            for _ in range(200):
                if terminal.lexers[1] in drawn:  # another lexer: the same text is coloured anew
                    break
                time.sleep(0.05)
            keyboard.send_text(CTRL_C)

        threading.Thread(target=finish, daemon=True).start()
        with pytest.raises(KeyboardInterrupt):
            terminal.read()
    assert terminal.lexers[1] in drawn
