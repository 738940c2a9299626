"""Ctrl-C in whatever takes long: back at the prompt at once, with everything kept; the line that is shown meanwhile."""

from __future__ import annotations

import math
import signal
import threading
import time

import pytest
from potto_repl.respond import respond
from screens import Screen

from potto.evaluating.progress import Progress
from potto.runtime.evaluation.gauge import Gauge

AT_ONCE = 0.2  # seconds; what an interrupt may take
TRIES = 4  # on a machine that is busy with something else as well
SLOW = "def slow(t) integral ([0,1],[0,1],[0,1]) sin(900*x*y*z*t)*[sin(20*x)+y*y>z*t] d(x,y,z)"
ROUGH = "def rough(u, v) integral ([0,1],[0,1]) sin(300*u*v*x)*[sin(20*u)*y+v*v>0.3] d(x,y)"
LONG = [
    "slow(0.5)",
    "print(slow(0.5))",
    "sum i in 1..9000000 (sum j in 1..50 (sin(i*j)))",
    ":eval slow(0.5)",
    ":fit slow t=0.5",
    ":plot slow",
    ":image rough 128",
    ":error slow(0.5)",
    ":check slow(0.5)",
    ":grad slow(0.5)",
    ":time slow(0.5)",
    ":load large.po",
]


def large(count):
    """A module that takes long to check."""
    head = "def name0(x) x\n"
    return head + "".join(
        f"def name{n}(x)\n    a = sin(x) + {n}\n    a * integral [0, 1] [u < x]*name0(u)*cos({n}*u) d(u)\n"
        for n in range(1, count)
    )


@pytest.fixture(scope="module")
def screen(tmp_path_factory):
    folder = tmp_path_factory.mktemp("interrupts")
    (folder / "large.po").write_text(large(3000))
    screen = Screen(folder, columns=120)
    screen.say(SLOW, "slow : ")
    screen.say(ROUGH, "rough : ")
    screen.say(":set max_evals 100000000000", "max_evals")
    screen.say("21*2", "_3 = 42 ")
    yield screen
    assert screen.leave() == 0


@pytest.mark.parametrize("line", LONG)
def test_an_interrupt_ends_it_and_nothing_else(screen, line):
    took = []
    for _ in range(TRIES):
        screen.process.sendline(line)
        screen.process.expect(r"Ctrl-C stops")
        took.append(screen.interrupt())
        if took[-1] < AT_ONCE:
            break
    assert min(took) < AT_ONCE
    screen.say(":type slow", r"slow : \(t: Real\) -> Real")
    screen.say(":eval _3 + 1", r"43 : Real")


def test_samples_are_interrupted_and_settings_kept(screen):
    screen.say(":method mc", "method mc")
    screen.say(":set samples 1000000000", "samples")
    screen.process.sendline("slow(0.5)")
    screen.process.expect(r"[0-9.]+ (s|min|h) left .Ctrl-C stops")
    assert screen.interrupt() < AT_ONCE * 5
    screen.say(":set samples", "samples 1000000000")
    screen.say(":method auto", "method auto")


def test_a_file_whose_loading_was_interrupted_is_loaded_the_next_time(tmp_path, talk):
    from potto_repl.keyboard import kept_interrupts

    path = talk.write("large.po", large(60))
    talk("kept = 5")
    interrupted = 0
    loading = False

    def interrupt(*_):
        if loading:  # and not what the test itself does behind it
            raise KeyboardInterrupt

    for delay in (0.002, 0.01, 0.02, 0.04, 0.08):
        old = signal.signal(signal.SIGALRM, interrupt)
        signal.setitimer(signal.ITIMER_REAL, delay)
        try:
            loading = True
            with kept_interrupts():
                respond(talk.session, f":load {path}")
            loading = False
        except KeyboardInterrupt:
            interrupted += 1
            assert len(talk.session.undoing) == 1 + len(talk.session.loaded) and talk.data("kept")["value"] == 5
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, old)
    assert interrupted
    assert not talk(f":load {path}").failed
    assert talk.data("name1(1)")["value"] == pytest.approx(
        (math.sin(1) + 1) * (math.sin(1) + math.cos(1) - 1), rel=1e-12
    )
    assert f":load {path}" in talk(":undo").text and "entry 1" in talk(":undo").text


def test_an_interrupt_where_nothing_can_be_raised_comes_again():
    from potto_repl.keyboard import kept_interrupts

    class Tidy:
        def __del__(self):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), kept_interrupts():
        Tidy()
        time.sleep(5)


# The line that is shown meanwhile


class Written:
    """A terminal's side of a stream."""

    def __init__(self):
        self.text = ""

    def write(self, text):
        self.text += text

    def flush(self):
        pass


def line(gauge=None, columns=100, note=None, after=2.0):
    progress = Progress(Written(), lambda: columns)
    with progress:
        progress.gauge = gauge
        if note is not None:
            progress.note(*note[0], **note[1])
        return progress.line(progress._start + after)


def gauge(share, *, limit=True, evaluations=0, start=0.0, samplings=0):
    found = Gauge(evaluations=evaluations, share=share, limit=limit, samplings=samplings)
    found.start = time.perf_counter() + start
    found.at = found.start + 2.0
    return found


def test_how_long_it_will_take_is_told_from_what_is_done():
    assert line() == "evaluating, 2.0 s (Ctrl-C stops)"
    told = line(gauge(0.25, evaluations=1_200_000))
    assert told.startswith("evaluating, 1,200,000 evaluations, 2.0 s, at most 6.0 s left")
    assert line(gauge(0.5, limit=False, samplings=1)) == "evaluating, 2.0 s, 2.0 s left (Ctrl-C stops)"
    assert "left" not in line(gauge(0.001)) and "left" not in line(gauge(1.5))
    assert "18 s or more left" in line(note=(("f: 6 of 60 points", 0.1), {"open": True})).replace("18.0", "18")
    assert "left" not in line(gauge(0.5), note=(("step 3",), {}))  # one evaluation of how many?
    assert "3 min left" in line(gauge(0.01001, limit=False, samplings=1))
    assert "1.0 s left" in line(gauge(0.5, limit=False), after=3.0)  # of what was told a second ago


@pytest.mark.parametrize("columns", [10, 20, 30, 40, 60, 80])
def test_the_line_fits_on_the_screen(columns):
    told = line(gauge(0.25, evaluations=123_456_789), columns)
    assert len(told) < columns and told.isascii() and "2.0 s"[: columns - 1] in told


def test_a_second_integral_that_is_sampled_says_no_time():
    seen = Gauge()
    seen.begin()
    seen.samplings = 1
    seen.sampled(0.5, False)
    assert (seen.share, seen.limit) == (0.5, False)
    seen.spent(5_000_000, 20_000_000)
    assert seen.share == 0.5
    seen.samplings = 2
    seen.sampled(0.5, False)
    assert seen.share == 0.0


def test_evaluations_say_how_far_they_are(talk):
    from potto.runtime.evaluation.gauge import watching

    def told(text):
        seen = Gauge()
        shares = []
        spent, sampled = Gauge.spent, Gauge.sampled
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Gauge, "spent", lambda self, *a: (spent(self, *a), shares.append(self.share)))
            patch.setattr(Gauge, "sampled", lambda self, *a: (sampled(self, *a), shares.append(self.share)))
            with watching(seen):
                talk.all(text)
        return seen, shares

    talk("def h(t) integral ([0, 1], [0, 1]) [x*y < t]*sin(x + y) d(x, y)")
    seen, shares = told(":eval h(0.3)")
    assert seen.limit and 0 < seen.evaluations == talk.data(":eval h(0.3)")["evals"]
    assert shares[-1] == seen.evaluations / talk.session.settings.max_evals
    talk.all(":method mc", ":set samples 200000")
    seen, shares = told(":eval h(0.3)")
    assert shares == sorted(shares) and shares[-1] == 1 and len(shares) > 4 and not seen.limit
    talk(":method qmc")
    seen, shares = told(":eval deriv(h)((0.3, 1))")
    growing = [share for share in shares if share]
    assert 0.99 < growing[-1] <= 1 and len(growing) > 4


def test_the_line_is_dim_and_goes_away_before_an_answer():
    screen = Written()
    progress = Progress(screen, lambda: 80, dim=True)
    with progress:
        for _ in range(100):
            time.sleep(0.05)
            if screen.text:
                break
        progress.say("an answer\n")
        said = screen.text
    shown, _, rest = said.partition("an answer\n")
    assert shown.startswith("\r\x1b[K\x1b[2mevaluating") and shown.endswith("\r\x1b[K") and rest == ""


def test_the_line_never_mixes_with_what_is_said():
    screen = Written()
    progress = Progress(screen, lambda: 80)
    with progress:
        progress._shown = True
        threads = [threading.Thread(target=progress.say, args=(f"line {n}\n",)) for n in range(20)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    kept = [part.rpartition("\r\x1b[K")[2] for part in screen.text.split("\n") if part]
    assert sorted(kept) == sorted(f"line {n}" for n in range(20))


def test_a_narrow_terminal_is_left_clean(tmp_path):
    screen = Screen(tmp_path, columns=20)
    screen.say(":set max_evals 100000000000", "max_evals")
    screen.process.sendline(SLOW.replace("def slow(t)", "").replace("*t", ""))
    screen.process.expect("Ctrl-C")
    screen.interrupt()
    screen.settle(lambda text: text.endswith("po>"))
    assert "Ctrl-C" not in screen.text.replace("Ctrl-D", "") and "evaluat" not in screen.text.partition("po>")[2]
    screen.say("1 + 2", "= 3 ")
    assert screen.leave() == 0
