"""What there is to say about a name: of a program, a builtin, a measure, a word of the language.

Owns `documentation`. The texts are the editor's hovers as plain text. They are imported when asked for, so that the
first answer doesn't wait for them.
"""

from __future__ import annotations

import re

from potto.measures import COMPOSITIONS, MEASURES
from potto.modules import DefinitionTarget
from potto.primitives import PRIMITIVES
from potto.query import Database
from potto.types import format_type, interface


def documentation(db: Database, name: str, target: DefinitionTarget | None) -> str | None:
    """All there is to say about a name; None if it means nothing."""
    from potto.ide.hover.hovers import builtin_markdown, measure_markdown
    from potto.ide.names.keywords import KEYWORDS, SPECIALS

    if target is not None:
        return _of_definition(db, name, target)
    known = []
    if name in SPECIALS or (name in PRIMITIVES and PRIMITIVES[name].surface):
        known.append(plain(builtin_markdown(name)))
    if name in MEASURES or name in COMPOSITIONS:
        known.append(plain(measure_markdown(name)))
    if known:
        return "\n\n".join(known)
    if name in KEYWORDS:
        return f"{KEYWORDS[name].form}\n\n{KEYWORDS[name].doc}"
    return None


def documented() -> list[str]:
    """The names that have an explanation without being defined."""
    from potto.ide.names.keywords import KEYWORDS, SPECIALS

    return [*PRIMITIVES, *MEASURES, *COMPOSITIONS, *KEYWORDS, *SPECIALS]


def plain(markdown: str) -> str:
    """Markdown for a terminal: code as it is, no markup."""
    lines = [line for line in markdown.splitlines() if not line.startswith("```")]
    text = re.sub(r"\*\*([^*]+)\*\*", r"\1", "\n".join(lines))
    return re.sub(r"(?<!`)`([^`]+)`(?!`)", r"\1", text).strip()


def _of_definition(db: Database, name: str, target: DefinitionTarget) -> str:
    from potto.ide.names.descriptions import documentation as comment_of

    found = interface(db, target.file, target.name)
    parts = [f"{name} : {format_type(found.type)}"]
    comment = comment_of(db, target.file, target.name)
    if comment:
        parts.append(comment)
    if found.plain:
        parts.append(f"plain parameters: {', '.join(found.plain)} (they decide a plain condition)")
    return "\n\n".join(parts)
