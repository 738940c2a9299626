"""What an entry did, as parts of a reply.

Owns `entry_parts`: definitions with their types, values with their errors, derivatives with their parts, and what to
define for names that mean nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from msgspec.structs import replace

from potto.calculus.differentiation.higher_order import NoText, first_derivative
from potto.calculus.explanation.explain import describe
from potto.calculus.explanation.layout import DerivativeText
from potto.calculus.explanation.notation import Notation, numbers_of
from potto.checking.typeset import derivative_latex
from potto.core.printer import format_term
from potto.core.terms import App, Deriv, Global, Lam, Term
from potto.elaborate import elaborate_expression
from potto.evaluating.session import Defined, Imported, Outcome, Said, Valued
from potto.modules import statements
from potto.modules.hints import elsewhere
from potto.reports.render import Located
from potto.runtime.answers.estimate import Estimate
from potto.source import Span
from potto.syntax import nodes
from potto_repl.backslash_symbols import pretty
from potto_repl.reply import Part, answer, diagnostic, note
from potto_repl.session import Conversation, plain_names
from potto_repl.shown_values import Parts, parts_of, value_parts

NOT_DEFINED = "P0201"
ANSWER = re.compile("_[0-9]*")  # the names under which answers stay at hand
FEW = 8  # answers that are listed
LONG = 100  # characters of a formula that an answer still shows


def entry_parts(session: Conversation, text: str) -> Iterator[Part]:
    """Run an entry and say step by step what came of it."""
    missing: list[str] = []
    otherwise = False  # whether something else is wrong, or the message says itself what to do
    for outcome in session.enter(text):
        if isinstance(outcome, Said):
            found = outcome.located.diagnostic
            otherwise |= outcome.is_error and (found.code != NOT_DEFINED or _is_elsewhere(session, outcome.located))
            session.last_code = found.code
            if found.code == NOT_DEFINED and outcome.located.file == session.entry:
                name = plain_names(session.entries[-1].text)[found.span.start : found.span.end]
                if ANSWER.fullmatch(name):
                    outcome = Said(_no_answer(session, outcome.located, name))
                else:
                    missing.append(name)
        yield from outcome_parts(session, outcome)
    advice = "" if otherwise else _advice(session, list(dict.fromkeys(missing)))
    if advice:
        yield Part("help", advice)


def _is_elsewhere(session: Conversation, located: Located) -> bool:
    """Whether a module defines the name that means nothing here; the message then says so."""
    place, source = located.diagnostic.span, session.source(located.file) if located.file is not None else None
    if source is None or located.file is None:
        return False
    return elsewhere(session.db, located.file, source.text[place.start : place.end]) is not None


def _no_answer(session: Conversation, located: Located, name: str) -> Located:
    """The message about an answer that never existed, at the place where it is written: `Out[3]`, `_3` or `_`."""
    found = located.diagnostic
    names = [o.names[-1] for e in session.entries for o in e.outcomes if isinstance(o, Valued) and o.names]
    listed = ", ".join(f"`{known}`" for known in names[-FEW:])
    which = "the last answers" if len(names) > FEW else "the answers"
    help = f"{which} are {listed}" if names else "an expression gives one, such as `1 + 1`"
    written = re.compile(r"Out\[\d+\]|_\d*").match(session.entries[-1].text, found.span.start)
    span = Span(written.start(), written.end()) if written is not None else found.span
    message = f"there is no answer {name[1:]}" if name != "_" else "there is no answer yet"
    return replace(located, diagnostic=replace(found, span=span, message=message, help=help))


def outcome_parts(session: Conversation, outcome: Outcome) -> Iterator[Part]:
    match outcome:
        case Defined():
            kind = "diffeo" if outcome.diffeo else "definition"
            data = {"kind": kind, "name": outcome.name, "type": outcome.type, "shadows": outcome.shadows}
            yield Part("answer", outcome.text, data, prose=True)
            if outcome.shadows is not None:
                yield note(f"shadows {outcome.shadows}")
        case Imported():
            yield answer(f"imported {', '.join(outcome.names)}", imported=outcome.module, names=list(outcome.names))
        case Valued():
            yield from _valued(session, outcome)
        case Said():
            yield diagnostic(outcome.located, session.source)


def _valued(session: Conversation, outcome: Valued) -> Iterator[Part]:
    if outcome.type is None:
        yield Part("output", outcome.text, {"output": outcome.text})
        return
    name = outcome.names[-1] if outcome.names else ""
    if not outcome.estimates:
        shown, found = _in_symbols(session, name) if outcome.text.startswith("<") else ("", None)
        plain = Estimate(None, None, text=shown or outcome.text)
        yield from value_parts(plain, outcome.type, session.settings, name=name)
        if found is not None and found.tangent and len(found.tangent) <= LONG:
            data = {"tangent_text": found.tangent, "_latex": lambda: derivative_latex(found, "f")}
            yield Part("answer", f"  tangent     {pretty(found.tangent, session.options.unicode)}", data)
        return
    estimate = outcome.estimates[0]
    file, expr = _expression(session, name)
    parts = None
    if estimate.tangent is not None:
        parts = _kept_parts(session, file, expr, estimate)
    yield from value_parts(estimate, outcome.type, session.settings, name=name, parts=parts)


def _kept_parts(session: Conversation, file: str, expr: nodes.Expr, dual: Estimate) -> Parts | None:
    """The parts of a derivative: those of the answer before, where an answer is another one by its name."""
    term = elaborate_expression(session.db, file, expr).term
    path: list[tuple[str, str]] = []
    while isinstance(term, Global) and ANSWER.fullmatch(term.name):
        if (term.module, term.name) in session.parts:
            return session.parts[term.module, term.name]
        path.append((term.module, term.name))
        term = session.world.lookup(term.module, term.name)
    found = parts_of(session.world, file, expr, dual, session.settings)
    session.parts.update(dict.fromkeys(path, found))
    return found


def _in_symbols(session: Conversation, name: str) -> tuple[str, DerivativeText | None]:
    """A function as it is written, nothing where that is too long; and of a derivative what it is in symbols."""
    term = whole = elaborate_expression(session.db, session.file, nodes.Name(Span(0, 0), name)).term
    while isinstance(term, Global):
        known = session.world.lookup(term.module, term.name)
        if isinstance(known, Lam) and not ANSWER.fullmatch(term.name):
            break  # a function that has a name
        term = known
    numbers = numbers_of(session.db, whole)
    text, head = format_term(term, numbers=numbers), term
    while isinstance(head, App):
        head = head.function
    found = _derivative(session, head.function, Notation(numbers=numbers)) if isinstance(head, Deriv) else None
    return text if len(text) <= LONG else "", found


def _derivative(session: Conversation, function: Term, notation: Notation) -> DerivativeText | None:
    def resolve(target: Global) -> Term:
        return session.world.lookup(target.module, target.name)

    try:
        return describe(first_derivative(function, resolve), "", "", resolve, notation)
    except NoText:
        return None


def _expression(session: Conversation, name: str) -> tuple[str, nodes.Expr]:
    """The expression behind an answer: its name, in the scope where it means that."""
    return session.file, nodes.Name(Span(0, 0), name)


def _advice(session: Conversation, missing: list[str]) -> str:
    """What to define for the free names of an expression."""
    expression = session.entries[-1].text.strip()
    if not missing or "\n" in expression or not all(name.isidentifier() for name in missing):
        return ""
    written = statements(session.db, session.entry)
    if not any(isinstance(reference.statement, nodes.ExpressionStatement) for reference in written):
        return ""
    named = " and ".join(f"`{name}`" for name in missing)
    called = [name for name in missing if re.search(rf"\b{re.escape(name)}\s*\(", expression)]
    if called:
        return f"define {named} first, such as `def {called[0]}(x) x^2`; `:load FILE` brings what a file defines"
    function = f"\\({', '.join(missing)}) . {expression}"
    return f"define {named} first, such as `{missing[0]} = 0.5`; or make a function: `{function}`"
