"""Names that may have been meant, by how they are written.

Owns `near_names`, and how they are offered: as a question, and as changes of the text.
"""

from __future__ import annotations

from collections.abc import Iterable

from potto.diagnostics import Suggestion, suggest
from potto.source import Span

MUCH_WORSE = 0.2  # a second name this much less alike is no help: `grad` for `raduis`, beside `radius`


def near_names(name: str, candidates: Iterable[str], count: int = 2) -> tuple[str, ...]:
    """The names that `name` may have been meant to be, the likeliest first."""
    known = dict.fromkeys(candidate for candidate in candidates if candidate != name)
    exact = [candidate for candidate in known if candidate.casefold() == name.casefold()]
    if exact or len(name) < 2:
        return tuple(exact[:count])
    import difflib  # most programs name what there is

    cutoff = 0.6 if len(name) > 3 else 0.5
    close = difflib.get_close_matches(name, list(known), n=count, cutoff=cutoff)
    scores = [difflib.SequenceMatcher(None, candidate, name).ratio() for candidate in close]
    return tuple(candidate for candidate, score in zip(close, scores) if score > scores[0] - MUCH_WORSE)


def did_you_mean(near: Iterable[str]) -> str:
    """A question, or nothing if there is nothing near."""
    names = [f"`{name}`" for name in near]
    return f"did you mean {' or '.join(names)}?" if names else ""


def instead(span: Span, near: Iterable[str]) -> tuple[Suggestion, ...]:
    """The names that may have been meant, as changes of what stands in a place."""
    return tuple(suggest(span, name, f"Change to `{name}`") for name in near)
