"""The page of `potto view`: what it answers, and to whom; and in a browser, where there is one."""

from __future__ import annotations

import json
import shutil
import subprocess
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from potto.cli.view_page import Answers, serve
from potto.evaluating.world import World

PROGRAM = "def f(t) integral [0, 1] [x < t] d(x)\n#> f(0.25)\ndef g(t) t\n"


@pytest.fixture
def address() -> Iterator[str]:
    world = World()
    answers = Answers(world, world.put("program.po", PROGRAM), None, {}, None)
    server, address = serve(answers)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield address
    server.shutdown()
    server.server_close()
    thread.join()
    answers.close()


def asked(address: str, path: str, body: Any, host: str = "") -> Any:
    url = address.replace("/?", f"{path}?")
    request = urllib.request.Request(url, json.dumps(body).encode(), {"Host": host} if host else {})
    with urllib.request.urlopen(request, timeout=30) as answer:
        return json.load(answer)


def test_a_slider_moves_the_numbers(address: str) -> None:
    assert asked(address, "/names", {}) == {"names": ["f", "g"], "chosen": "f"}
    assert asked(address, "/open", {"name": "f"}) == {"values": {"t": 0.25}, "wrt": "t"}
    for t in (0.25, 0.75):
        found = asked(address, "/look", {"name": "f", "values": {"t": t}, "wrt": "t", "which": 0})
        assert found["numbers"]["value"] == pytest.approx(t)
        assert found["numbers"]["boundary"] == pytest.approx(1)
        assert "<svg" in found["svg"]


def test_what_is_wrong_comes_as_words(address: str) -> None:
    assert "no integral" in asked(address, "/open", {"name": "g"})["error"]
    assert "not one of this page" in asked(address, "/look", {"name": "f"})["error"]


def test_only_who_has_the_token_is_answered(address: str) -> None:
    for url, host in ((address[:-1], ""), (address.partition("?")[0], ""), (address, "evil.example")):
        with pytest.raises(urllib.error.HTTPError) as refused:
            asked(url if "?" in url else url + "?", "/names", {}, host)
        assert refused.value.code == 404


def test_it_is_bound_to_this_machine(address: str) -> None:
    assert address.startswith("http://127.0.0.1:")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="needs chromium")
def test_a_browser_shows_the_picture(address: str, tmp_path: Path) -> None:
    command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}",
               "--virtual-time-budget=10000", "--dump-dom", address]  # fmt: skip
    seen = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False).stdout
    assert 'data-surface="0"' in seen
    assert "derivative by t 1 " in seen
