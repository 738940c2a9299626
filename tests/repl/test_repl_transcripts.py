"""Sessions of every kind of entry, saved as programs that say what was said and that the checker takes."""

from __future__ import annotations

import re
import subprocess
import sys

FILES = {
    "m.po": "# the area below the diagonal\ndef h(x) integral [0, x] u d(u)\nlin = \\(x, y) . c . x + y + c\n",
    "half.diffeo": "cond = \\(x, y) . \\c . (x + y + c, x - y + c)\n",
}
ENTRIES = [
    ":load m.po", "from half import cond", "import m",
    "def f(t)\n    # left of t\n    integral [0, 1] [x < t]*t^2 d(x)",
    "f(0.3)", "_*2", "Out[4] + _5", "deriv(f)((0.3, 1))", "fst(_)", "_7", "f", "\\x . x^2", "_(3)", "def f(t) t + 1",
    "f(2)",
    "a = f(3)", "a", "print(a, f(1))", "for v in [1, 2]:\n    print(v, f(v))", "(f(1), [2, a])", "[1, 2, h(2)]", "1/0",
    ":method mc", "h(2)", "_ + 1", ":method auto", "_ * 2", "m.h(1)", "cond",
    "def r(c, s) integral ([0, 1], [0, 1]) s(x, y)(c)*(cond(x, y)(c) ? 1 : 0) d(x, y)", "r(-0.7, lin)",
    "diffeo rot(x, y; a) = (x*cos(a) - y*sin(a), x*sin(a) + y*cos(a))",
    "def turned(a) integral ([0, 1], [0, 1]) (if rot(x, y)(a) then 1 else 0) d(x, y)", "deriv(turned)((0.5, 1))",
    "let z = 3 in z^2", "1 +\n  2", "θ = 0.5", "sin(θ)", "∫ [0, 1] x d(x)", "deriv(\\t . \\x . [x < t])((0.3, 1))",
    "def fact(n) if n > 0 then n*fact(n-1) else 1", "fact(5)", "def a(x) x", "a(2)", "g = deriv(f)", "g((1, 1))",
    ":undo",
    "#> f(1)\n1e-300*1e-300", "def k(a) a*2", "a = 3", "k(a=a)", "# said first\nk(1)  # said last",
    "(k(1),  # first\n k(2))",
    "a = 4", "k(a)", "k(a=1) + _",
]  # fmt: skip


def potto(folder, *arguments):
    command = [sys.executable, "-m", "potto", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, check=False)


def test_a_session_of_everything_is_saved_as_a_program(talk):
    for name, text in FILES.items():
        talk.write(name, text)
    talk.all(*ENTRIES)
    for wrong in ("nothing", "def f(t", "f(1, 2)", ":nonsense"):
        assert talk(wrong).failed  # of these nothing is kept
    talk.all(":save session.po")
    text = (talk.folder / "session.po").read_text()
    live = text.count("\n#> ")
    done = potto(talk.folder, "test", "session.po")
    assert done.returncode == 0 and f"{live} live expressions in 1 file: all hold" in done.stdout, done.stderr + text
    assert "1 file: no problems" in potto(talk.folder, "check", "session.po").stderr
    assert potto(talk.folder, "run", "session.po").stdout.splitlines() == ["4 2", "1 2", "2 3"]
    expected = re.findall(r"^#= (.*)$", text, re.MULTILINE)
    assert len(expected) > 25 and "(0.7268487550781, -0.6492232052048)" in expected


def test_names_that_an_entry_binds_itself_stay(talk):
    talk.all("a = 1", "def k(a) a*2", "(k(a=a), sum a in 1..3 (a))", "\\a . a", "a = 2", "a", ":save session.po")
    text = (talk.folder / "session.po").read_text()
    assert "def k(a) a*2" in text and "#> (k(a=a_1), sum a in 1..3 (a))\n#= (2, 6)" in text and "#> \\a . a" in text


def test_comments_stay_above_what_they_are_about(talk):
    talk.all("# why\n1 + 1  # two", ":save session.po")
    assert (talk.folder / "session.po").read_text() == "# why\n#> 1 + 1\n#= 2\n"


def test_what_was_sampled_is_not_expected_to_the_digit(talk):
    talk.all("def f(t) integral [0, 1] [x < t]*t^2 d(x)", ":method mc", "f(0.3)", ":method auto", "_*2")
    talk.all(":save session.po")
    text = (talk.folder / "session.po").read_text()
    assert "answer_2 = f(0.3)" in text and "#> answer_2*2" in text and "#=" not in text
