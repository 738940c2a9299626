"""What a client reports without a question: documents, files, folders, settings.

Owns `NOTIFICATIONS`, the handler of each method. They run on the reading thread. Documents change at once; what the
analysis must know follows as an edit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from potto_lsp.uris import to_key

if TYPE_CHECKING:
    from potto_lsp.connection import Reply
    from potto_lsp.documents import Documents
    from potto_lsp.session import ClientSession
    from potto_lsp.work import Worker

PATTERNS = ("**/*.{po,diffeo}", "**/potto.toml", "**/*.{csv,tsv,npy,npz,json,png,jpg,jpeg}")


class NotifiedServer(Protocol):
    """What notifications need of a server. `edit` changes what the analysis sees, on its thread."""

    documents: Documents
    session: ClientSession | None
    worker: Worker | None

    def edit(self, change: Callable[[], object]) -> None: ...

    def request(self, method: str, params: Any, reply: Reply | None = None) -> None: ...


Handler = Callable[[NotifiedServer, Any], None]


def _session(server: NotifiedServer) -> ClientSession:
    assert server.session is not None
    return server.session


def initialized(server: NotifiedServer, params: Any) -> None:
    """The client can now be asked."""
    session = _session(server)
    if session.watched:
        watchers = [{"globPattern": pattern} for pattern in PATTERNS]
        registration = {
            "id": "potto-files",
            "method": "workspace/didChangeWatchedFiles",
            "registerOptions": {"watchers": watchers},
        }
        server.request("client/registerCapability", {"registrations": [registration]})
    if session.client.can("workspace.didChangeConfiguration.dynamicRegistration"):
        registration = {
            "id": "potto-settings",
            "method": "workspace/didChangeConfiguration",
            "registerOptions": {"section": "potto"},
        }
        server.request("client/registerCapability", {"registrations": [registration]})
    if session.client.can("workspace.configuration"):
        _ask_settings(server)
    assert server.worker is not None
    server.worker.check_again()


def _ask_settings(server: NotifiedServer) -> None:
    def reply(result: Any, error: Any) -> None:
        if isinstance(result, list) and result and isinstance(result[0], Mapping):
            settings = result[0]
            server.edit(lambda: _configure(server, settings))

    server.request("workspace/configuration", {"items": [{"section": "potto"}]}, reply)


def _configure(server: NotifiedServer, settings: Any) -> None:
    session = _session(server)
    session.configure(settings)
    session.diagnostics_changed()


def did_change_configuration(server: NotifiedServer, params: Any) -> None:
    """Settings have changed. If the client can be asked for them, it is."""
    if _session(server).client.can("workspace.configuration"):
        _ask_settings(server)
    else:
        server.edit(lambda: _configure(server, params.get("settings")))


def did_open(server: NotifiedServer, params: Any) -> None:
    document = server.documents.open(params)

    def opened() -> None:
        session = _session(server)
        key = session.analysis.put(document)
        session.to_prepare.add(key)
        if session.analysis.finds_project(key):
            session.projects_changed()

    server.edit(opened)


def did_change(server: NotifiedServer, params: Any) -> None:
    document = server.documents.change(params)
    if document is not None:
        server.edit(lambda: _session(server).analysis.put(document))


def did_close(server: NotifiedServer, params: Any) -> None:
    document = server.documents.close(params)
    if document is None:
        return

    def close() -> None:
        session = _session(server)
        session.publisher.closed(document, session.analysis.close(document))

    server.edit(close)


def did_save(server: NotifiedServer, params: Any) -> None:
    """Look at the disk again, for clients that don't watch files."""
    key = to_key(params["textDocument"]["uri"])

    def saved() -> None:
        session = _session(server)
        session.saved(key)
        if not session.watched:
            session.analysis.files.refresh((key, *session.analysis.files.data_files()))

    server.edit(saved)


def did_change_watched_files(server: NotifiedServer, params: Any) -> None:
    """Files have changed on disk, appeared or gone."""
    changes = params["changes"]
    keys = [to_key(change["uri"]) for change in changes]
    only_texts = all(change["type"] == 2 for change in changes)

    def refresh() -> None:
        session = _session(server)
        if any(key.endswith("potto.toml") for key in keys):
            session.analysis.reload_projects()
            session.projects_changed()
        session.analysis.files.refresh(keys if only_texts else None)
        session.diagnostics_changed()

    server.edit(refresh)


def files_moved(server: NotifiedServer, params: Any) -> None:
    """The client has created, renamed or deleted files."""
    server.edit(lambda: _session(server).analysis.files.refresh())


def did_change_workspace_folders(server: NotifiedServer, params: Any) -> None:
    event = params["event"]
    added = [folder["uri"] for folder in event.get("added", [])]
    removed = {to_key(folder["uri"]) for folder in event.get("removed", [])}

    def change() -> None:
        from potto_lsp.uris import to_uri

        session = _session(server)
        kept = [folder for folder in session.analysis.folders if folder not in removed]
        session.set_folders([*map(to_uri, kept), *added])
        session.diagnostics_changed()

    server.edit(change)


def cancel_progress(server: NotifiedServer, params: Any) -> None:
    """The user has cancelled something."""
    stop = _session(server).cancels.get(params["token"])
    if stop is not None:
        stop()


def ignore(server: NotifiedServer, params: Any) -> None:
    """Nothing to be done."""


NOTIFICATIONS: Mapping[str, Handler] = {
    "initialized": initialized,
    "textDocument/didOpen": did_open,
    "textDocument/didChange": did_change,
    "textDocument/didClose": did_close,
    "textDocument/didSave": did_save,
    "workspace/didChangeWatchedFiles": did_change_watched_files,
    "workspace/didChangeWorkspaceFolders": did_change_workspace_folders,
    "workspace/didChangeConfiguration": did_change_configuration,
    "workspace/didCreateFiles": files_moved,
    "workspace/didRenameFiles": files_moved,
    "workspace/didDeleteFiles": files_moved,
    "window/workDoneProgress/cancel": cancel_progress,
    "$/setTrace": ignore,
}
