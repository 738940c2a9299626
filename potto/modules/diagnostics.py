"""What is said about a file as a whole."""

from potto.diagnostics import Diagnostic
from potto.query import Database, query


@query
def module_diagnostics(db: Database, file: str) -> tuple[Diagnostic, ...]:
    """Being written."""
    return ()
