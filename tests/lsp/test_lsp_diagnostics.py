"""What is wrong, pushed and pulled, over edits of text, files, folders and settings."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lsp_client import EVERYTHING, Client, edit

Server = Callable[..., Client]
Uri = Callable[[str], str]
PUSHED = "textDocument/publishDiagnostics"
PULLS: dict[str, Any] = {
    "textDocument": {"diagnostic": {}, "publishDiagnostics": {"relatedInformation": True}},
    "workspace": {"diagnostics": {"refreshSupport": True}},
}
PLAIN = "def f(t)\n    integral [0, 1] (if x < t then 1 else 0) d(x)\n"
WATCHES = {**EVERYTHING, "workspace": {"didChangeWatchedFiles": {"dynamicRegistration": True}}}


def codes(params: Any) -> list[str]:
    return [item["code"] for item in params.get("diagnostics", params.get("items"))]


def pull(client: Client, uri: str, previous: str | None = None) -> Any:
    known = {} if previous is None else {"previousResultId": previous}
    return client.ask("textDocument/diagnostic", {"textDocument": {"uri": uri}, **known})


def test_a_diagnostic_says_all_that_is_known(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), PLAIN)
    (found,) = client.note(PUSHED, uri=uri("main"), version=1)["diagnostics"]
    assert found["range"] == {"start": {"line": 1, "character": 24}, "end": {"line": 1, "character": 29}}
    assert (found["code"], found["severity"], found["source"]) == ("P0301", 1, "potto")
    assert "help: state the jump" in found["message"]
    assert found["codeDescription"]["href"].endswith("P0301.md")
    (related,) = found["relatedInformation"]
    assert related["location"]["range"]["start"] == {"line": 1, "character": 47}


def test_unused_names_are_tagged(server: Server, uri: Uri) -> None:
    client = server(a="def g(t) t\n")
    client.open(uri("main"), "from a import g\ndef f(t) t\n")
    (found,) = client.note(PUSHED, uri=uri("main"), version=1)["diagnostics"]
    assert (found["code"], found["tags"]) == ("P0620", [1])


def test_a_mistake_is_gone_when_it_is_mended(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), PLAIN)
    assert codes(client.note(PUSHED, uri=uri("main"), version=1)) == ["P0301"]
    client.change(uri("main"), 2, edit((1, 20), (1, 44), "[x < t]"))
    assert codes(client.note(PUSHED, uri=uri("main"), version=2)) == []


def test_an_unsaved_signature_reaches_open_importers_and_closed_ones(server: Server, uri: Uri) -> None:
    user = "from leaf import f\ndef g(t) f(t)\n"
    client = server(leaf="def f(t) t\n", open=user, closed=user)
    client.open(uri("leaf"), "def f(t) t\n")
    client.open(uri("open"), user)
    client.note(PUSHED, uri=uri("open"))
    client.change(uri("leaf"), 2, {"text": "f = 3\n"})
    assert codes(client.note(PUSHED, uri=uri("open"))) != []
    assert codes(client.note(PUSHED, uri=uri("closed"))) != []
    client.change(uri("leaf"), 3, {"text": "def f(t) t\n"})
    assert codes(client.note(PUSHED, uri=uri("open"))) == []
    assert codes(client.note(PUSHED, uri=uri("closed"))) == []


def test_closing_goes_back_to_the_disk(server: Server, uri: Uri) -> None:
    client = server(main=PLAIN)
    assert codes(client.note(PUSHED, uri=uri("main"))) == ["P0301"]
    client.open(uri("main"), "def f(t) t\n")
    assert codes(client.note(PUSHED, uri=uri("main"), version=1)) == []
    client.tell("textDocument/didClose", {"textDocument": {"uri": uri("main")}})
    client.note(PUSHED, uri=uri("main"))
    assert codes(client.note(PUSHED, uri=uri("main"))) == ["P0301"]


def test_an_unsaved_document_without_a_file(server: Server) -> None:
    client = server()
    client.open("untitled:Untitled-1", PLAIN)
    assert codes(client.note(PUSHED, uri="untitled:Untitled-1")) == ["P0301"]


def test_a_pulling_client_is_pushed_nothing(server: Server, uri: Uri) -> None:
    client = server(PULLS)
    client.open(uri("main"), PLAIN)
    first = pull(client, uri("main"))
    assert first["kind"] == "full" and codes(first) == ["P0301"]
    assert pull(client, uri("main"), first["resultId"]) == {"kind": "unchanged", "resultId": first["resultId"]}
    client.change(uri("main"), 2, edit((0, 0), (0, 0), "\n"))
    moved = pull(client, uri("main"), first["resultId"])
    assert moved["items"][0]["range"]["start"]["line"] == 2
    client.change(uri("main"), 3, edit((0, 0), (1, 0), ""))
    assert codes(pull(client, uri("main"), moved["resultId"])) == ["P0301"]
    assert not [note for note in client.notes.queue if note["method"] == PUSHED]


def test_the_workspace_is_pulled(server: Server, uri: Uri) -> None:
    client = server(PULLS, good="def f(t) t\n", bad=PLAIN)
    items = client.ask("workspace/diagnostic", {"previousResultIds": []})["items"]
    assert {item["uri"]: codes(item) for item in items} == {uri("good"): [], uri("bad"): ["P0301"]}
    known = [{"uri": item["uri"], "value": item["resultId"]} for item in items]
    known.append({"uri": uri("gone"), "value": "x"})
    again = client.ask("workspace/diagnostic", {"previousResultIds": known})["items"]
    assert [item["kind"] for item in again] == ["unchanged", "unchanged", "full"]
    assert again[-1]["items"] == []


def test_a_file_that_is_deleted_after_it_was_asked_for_is_clean(server: Server, uri: Uri, tmp_path: Path) -> None:
    """Also if the client does not say that it still shows what it was told before the file was closed."""
    client = server(PULLS, bad=PLAIN)
    answer = client.ask("textDocument/diagnostic", {"textDocument": {"uri": uri("bad")}})
    assert codes(answer) == ["P0301"]
    client.tell("textDocument/didClose", {"textDocument": {"uri": uri("bad")}})
    (tmp_path / "bad.po").unlink()
    client.tell("workspace/didChangeWatchedFiles", {"changes": [{"uri": uri("bad"), "type": 3}]})
    items = client.ask("workspace/diagnostic", {"previousResultIds": []})["items"]
    assert [(item["uri"], item["kind"], item["items"]) for item in items] == [(uri("bad"), "full", [])]


def test_files_that_change_on_disk(server: Server, uri: Uri, tmp_path: Path) -> None:
    client = server(WATCHES, main="from other import f\ndef g(t) f(t)\n")
    assert client.asked.get(timeout=10)["params"]["registrations"][0]["method"] == "workspace/didChangeWatchedFiles"
    assert codes(client.note(PUSHED, uri=uri("main")))[0] == "P0202"
    (tmp_path / "other.po").write_text("def f(t) t\n")
    client.tell("workspace/didChangeWatchedFiles", {"changes": [{"uri": uri("other"), "type": 1}]})
    assert codes(client.note(PUSHED, uri=uri("main"))) == []
    (tmp_path / "other.po").write_text("def h(t) t\n")
    client.tell("workspace/didChangeWatchedFiles", {"changes": [{"uri": uri("other"), "type": 2}]})
    assert codes(client.note(PUSHED, uri=uri("main"))) != []


def test_two_roots_and_a_folder_that_joins(server: Server, uri: Uri, tmp_path: Path) -> None:
    lib = tmp_path / "elsewhere" / "lib"
    lib.mkdir(parents=True)
    (lib / "shapes.po").write_text("def f(t) t\n")
    client = Client(tmp_path / "app", EVERYTHING)
    (tmp_path / "app").mkdir()
    client.start()
    main = (tmp_path / "app" / "main.po").as_uri()
    client.open(main, "from shapes import f\ndef g(t) f(t)\n")
    assert codes(client.note(PUSHED, uri=main)) != []
    added = [{"uri": lib.as_uri(), "name": "lib"}]
    client.tell("workspace/didChangeWorkspaceFolders", {"event": {"added": added, "removed": []}})
    assert codes(client.note(PUSHED, uri=main)) == []
    client.tell("workspace/didChangeWorkspaceFolders", {"event": {"added": [], "removed": added}})
    assert codes(client.note(PUSHED, uri=main)) != []
    assert client.stop() == 0


def test_the_project_file(server: Server, uri: Uri, tmp_path: Path) -> None:
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "shapes.po").write_text("def f(t) t\n")
    (tmp_path / "potto.toml").write_text('roots = ["src"]\n[lints]\nP0620 = "off"\n')
    client = server()
    client.open(uri("main"), "from shapes import f\ndef g(t) t\n")
    assert codes(client.note(PUSHED, uri=uri("main"), version=1)) == []
    (tmp_path / "potto.toml").write_text('roots = ["src"]\n[lints]\nP0620 = "error"\n')
    client.tell("workspace/didChangeWatchedFiles", {"changes": [{"uri": uri("potto.toml"), "type": 2}]})
    found = client.note(PUSHED, uri=uri("main"))
    assert codes(found) == ["P0620"] and found["diagnostics"][0]["severity"] == 1


def test_a_broken_project_file_is_told(server: Server, uri: Uri, tmp_path: Path) -> None:
    (tmp_path / "potto.toml").write_text("roots = [\n\nlints = 3 = 4")
    found = server().note(PUSHED, uri=uri("potto.toml"))["diagnostics"]
    assert found and found[0]["severity"] == 1
    (tmp_path / "potto.toml").write_text('root = ["src"]\nroots = "src"\n[lints]\nP0620 = "loud"\n')
    told = [d["message"] for d in server().note(PUSHED, uri=uri("potto.toml"))["diagnostics"]]
    assert len(told) == 3


def test_a_project_file_is_not_read_as_a_program(server: Server, uri: Uri, tmp_path: Path) -> None:
    (tmp_path / "potto.toml").write_text('roots = "src"\n')
    client = server(PULLS)
    assert client.note(PUSHED, uri=uri("potto.toml"))["diagnostics"]
    assert pull(client, uri("potto.toml"))["items"] == []


def test_a_code_in_the_settings_that_means_nothing_is_told_once(server: Server) -> None:
    client = server()
    for _ in range(2):
        client.tell("workspace/didChangeConfiguration", {"settings": {"potto": {"lints": {"P62": "off"}}}})
    client.tell("workspace/didChangeConfiguration", {"settings": {"potto": {"lints": {"P63": "off"}}}})
    assert "P62; lints are" in client.note("window/showMessage")["message"]
    assert "P63; lints are" in client.note("window/showMessage")["message"]


def test_settings_are_heeded(server: Server, uri: Uri) -> None:
    client = server(a="def g(t) t\n")
    client.open(uri("main"), "from a import g\ndef f(t) t\n")
    assert codes(client.note(PUSHED, uri=uri("main"), version=1)) == ["P0620"]
    client.tell("workspace/didChangeConfiguration", {"settings": {"potto": {"lints": {"P0620": "off"}}}})
    assert codes(client.note(PUSHED, uri=uri("main"))) == []


def test_open_files_come_before_the_workspace(server: Server, uri: Uri) -> None:
    client = server(greet=False, **{f"m{n}": PLAIN for n in range(30)})
    client.start()
    client.open(uri("m29"), PLAIN)
    first = client.note(PUSHED)
    assert first["uri"] in (uri("m29"), uri("m0"))  # m0 if the check had begun when the file was opened
    order = [first["uri"]] + [client.note(PUSHED)["uri"] for _ in range(3)]
    assert uri("m29") in order


def test_broken_text_keeps_the_rest_alive(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), "def f(t)\n    (t + \ndef g(t) t\ndef h(t) g(t) + f(t)\n")
    found = client.note(PUSHED, uri=uri("main"), version=1)["diagnostics"]
    assert found and all(item["range"]["start"]["line"] <= 1 for item in found)


def test_typing_is_answered_version_by_version(server: Server, uri: Uri) -> None:
    client = server()
    client.open(uri("main"), "def f(t)\n    t\n")
    client.note(PUSHED, uri=uri("main"), version=1)
    for version in range(2, 40):
        client.change(uri("main"), version, edit((1, 4), (1, 5), "t" if version % 2 else "u"))
        time.sleep(0.002)
    final = client.note(PUSHED, uri=uri("main"), version=39)
    assert codes(final) == []
