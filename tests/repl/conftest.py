"""What the tests of the prompt share: a session in a folder of its own, and replies as text."""

from __future__ import annotations

import pytest
from potto_repl.respond import respond
from potto_repl.session import Conversation


class Talk:
    """A conversation in tests: `talk("f(0.3)")` is the reply."""

    def __init__(self, folder):
        self.folder = folder
        self.session = Conversation([folder])

    def __call__(self, text):
        return respond(self.session, text)

    def all(self, *texts):
        replies = [self(text) for text in texts]
        for text, reply in zip(texts, replies, strict=True):
            assert not reply.failed, f"{text}\n{reply.text}"
        return replies[-1]

    def data(self, text):
        """The data of the reply to one text, that of its last part with any."""
        reply = self(text)
        assert not reply.failed, reply.text
        return [dict(part.data) for part in reply.parts if part.data is not None][-1]

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return str(path)


@pytest.fixture
def talk(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return Talk(tmp_path)
