"""The client, the ways to it, and what is known of its programs: all that the parts of a session share.

Owns `Connection`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from potto_lsp.client import Client

if TYPE_CHECKING:
    from potto_lsp.analysis import Analysis
    from potto_lsp.evaluation import EvaluationQueue
    from potto_lsp.publishing import Publisher

Reply = Callable[[Any, Any], None]  # the client's answer and its error; one of them is None


class Connection:
    """One client, and the analysis of what it has open."""

    analysis: Analysis
    publisher: Publisher
    evaluator: EvaluationQueue

    def __init__(
        self,
        client: Client,
        notify: Callable[[str, Any], None],
        request: Callable[[str, Any, Reply | None], None],
        later: Callable[[Callable[[], None]], None],
    ) -> None:
        self.client, self.notify, self.request = client, notify, request
        self.later = later  # do something on the thread that owns the database
        self.cancels: dict[int | str, Callable[[], None]] = {}  # what a user can cancel, by progress token

    def diagnostics_changed(self) -> None:
        """Diagnostics have changed for another reason than an edit."""
        if self.client.pulls and self.client.can("workspace.diagnostics.refreshSupport"):
            self.request("workspace/diagnostic/refresh", None, None)
