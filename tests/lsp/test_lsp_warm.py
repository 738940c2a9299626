"""What an edit costs when all is known: which work is done again, counted, and what the client is told."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from potto_lsp.analysis import Analysis
from potto_lsp.client import Client
from potto_lsp.documents import Document
from potto_lsp.publishing import Publisher
from potto_lsp.text import DocumentText

USES, OTHERS = 3, 30
LEAF = "def used(t, k) t*k\n\ndef alone(t) t\n"
PLAIN = "".join(f"\n\ndef plain{n}(t)\n    t + {n}\n" for n in range(OTHERS))
USER = "from leaf import used\n" + "".join(f"\n\ndef user{n}(t) used(t, {n})\n" for n in range(USES)) + PLAIN
FAR = "from user0 import plain0\n\ndef far(t) plain0(t)\n" + PLAIN
FILES = {"leaf": LEAF, "user0": USER, "user1": USER, **{f"far{n}": FAR for n in range(5)}}


class Session:
    """A workspace of these files, all checked, without a client."""

    def __init__(self, folder: Path) -> None:
        for name, text in FILES.items():
            (folder / f"{name}.po").write_text(text)
        self.folder, self.version = folder, 0
        self.analysis = Analysis("utf-16")
        self.analysis.set_folders([folder.as_uri()])
        self.told: list[Any] = []
        self.publisher = Publisher(self.analysis, Client(), lambda method, params: self.told.append(params))
        self.edit("leaf", LEAF)
        self.check()
        self.analysis.settled = True
        self.analysis.forget_trees()

    def key(self, name: str) -> str:
        return str(self.folder / f"{name}.po")

    def edit(self, name: str, text: str) -> None:
        self.version += 1
        uri = (self.folder / f"{name}.po").as_uri()
        self.analysis.put(Document(uri, "potto", self.version, DocumentText(text, "utf-16")))

    def check(self) -> None:
        for step in self.publisher.steps_again():
            step()

    def ran(self, name: str, text: str, kind: str = "executed") -> Counter[str]:
        """The queries that an edit and the checks after it run, by name."""
        self.told.clear()
        with self.analysis.db.recording() as events:
            self.edit(name, text)
            self.check()
        return Counter(event.query for event in events if event.kind == kind)

    def files_told(self) -> list[str]:
        return [Path(said["uri"]).stem for said in self.told]


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return Session(tmp_path)


def test_a_signature_is_checked_against_its_users_alone_and_only_they_are_told(session: Session) -> None:
    changed = LEAF.replace("used(t, k)", "used(t)")
    for turn, text in enumerate((changed, LEAF, changed, LEAF)):
        ran = session.ran("leaf", text)
        assert ran["_analyses"] <= 1 + 2 * USES, ran
        assert session.files_told() == ["leaf", "user0", "user1"]
        counts = [len(said["diagnostics"]) for said in session.told]
        assert counts == ([1, USES, USES] if turn % 2 == 0 else [0, 0, 0])  # `k` is not known


SPOT = "record Spot(at: (Real, Real), r: Real)\n"
LIT = "".join(f"\ndef lit{n}(s: Spot, t) integral [0, 1] [x + s.r < t] * {n}*x d(x)\n" for n in range(OTHERS))


@pytest.mark.parametrize("wrong", ["1r: Real", "r: Reel"])
def test_what_uses_a_record_is_not_looked_through_for_conditions_while_that_is_wrong(
    session: Session, wrong: str
) -> None:
    """Of its fields there is only a guess; one edit more brings everything back."""
    session.edit("leaf", SPOT + LIT)
    session.check()
    for _ in range(2):
        ran = session.ran("leaf", SPOT.replace("r: Real", wrong) + LIT)
        assert {said["code"] for said in session.told[0]["diagnostics"]} <= {"P0103", "P0111", "P0116"}
        assert ran["core"] <= 1 and ran["exported"] <= 1, ran
        assert session.ran("leaf", SPOT + LIT)["core"] <= 1
        assert session.told[0]["diagnostics"] == []


INSIDE = "from beside import plain1\n\ndef inside(r, x, y) [x^2 + y^2 < r]\n"
SHONE = "".join(f"\ndef lit{n}(r, t) integral [0, 1] inside(r, x, t)*{n}*x d(x)\n" for n in range(OTHERS))
BESIDE = "".join(f"\ndef beside{n}(r, t) integral [0, 1] plain1([x < r] * {n}*t) d(x)\n" for n in range(OTHERS))


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("[x^2", "[(x^2"),  # cannot be read
        ("< r]", "< r](x)"),  # has no type
        ("(r, x, y)", "(1r, x, y)"),
        ("from beside", "from besides"),  # there is no such module
    ],
)
def test_what_uses_a_guess_is_not_looked_through_for_conditions_until_that_is_mended(
    session: Session, right: str, wrong: str
) -> None:
    (session.folder / "beside.po").write_text("def plain1(t) t + 1\n")
    text = INSIDE + SHONE + BESIDE
    session.edit("leaf", text)
    session.check()
    for _ in range(2):
        ran = session.ran("leaf", text.replace(right, wrong, 1))
        assert len(session.told[0]["diagnostics"]) == 1
        assert ran["_analyses"] <= OTHERS + 1
        assert ran["core"] <= 1 and ran["exported"] <= 1, ran
        assert session.ran("leaf", text)["core"] <= 1
        assert session.told[0]["diagnostics"] == []


def test_what_nobody_reads_is_looked_at_by_nobody(session: Session) -> None:
    for body in ("2*t", "3*t", "4*t"):
        reused = session.ran("leaf", LEAF.replace("alone(t) t", f"alone(t) {body}"), "reused")
        assert session.files_told() == ["leaf"]
    assert sum(reused.values()) < 8 * len(FILES), reused  # and not once for each of some 240 definitions


def test_trees_of_users_are_made_before_the_first_edit_of_a_signature_needs_them(session: Session) -> None:
    session.analysis.prepare(session.key("leaf"))
    session.analysis.prepare_users(session.key("leaf"))
    ran = session.ran("leaf", LEAF.replace("used(t, k)", "used(t)"))
    assert ran["_analyses"] == 1 + 2 * USES and ran["parsed"] <= 1, ran


def test_the_first_edit_of_an_opened_file_costs_what_the_others_do(session: Session) -> None:
    session.edit("user0", USER)
    session.check()
    first = session.ran("user0", USER + "\n", "reused")
    session.ran("user0", USER)
    assert sum(first.values()) <= sum(session.ran("user0", USER + "\n", "reused").values()) + 60


def test_levels_follow_the_settings(session: Session) -> None:
    key = session.key("leaf")
    assert session.analysis.levels(key) == {}
    session.analysis.settings = {"lints": {"P0601": "error"}}
    assert session.analysis.levels(key) == {"P0601": "error"}
    (session.folder / "potto.toml").write_text('[lints]\nP0620 = "off"\n')
    session.analysis.reload_projects()
    assert session.analysis.levels(key) == {"P0601": "error", "P0620": "off"}
