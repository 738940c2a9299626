"""A definition's derivative and its conditions, memoized and laid out for reading.

Owns the markdown of what the calculus knows: interior and boundary terms, surfaces and what moves each, the completed
coordinates of conditions with inverse and determinant. What is true is said by `potto.calculus`; here it is set.
"""

from __future__ import annotations

from collections.abc import Container, Iterable

from msgspec import Struct

from potto.calculus.checking.conditions import Condition, called_by, conditions_of
from potto.calculus.checking.diffeo import DiffeoInfo, diffeo_info, exported
from potto.calculus.checking.solvability import ConditionProblem, Role, Verdict, judge
from potto.calculus.explanation.explain import explain_derivative
from potto.calculus.explanation.layout import DerivativeText, IntegralText
from potto.calculus.explanation.notation import Notation, written_notation
from potto.calculus.explanation.readable import readable
from potto.calculus.inlining.currying import parameters_of
from potto.calculus.solving.inverse_map import InverseMap, invert
from potto.checking.check import has_errors
from potto.core.simplify import simplify
from potto.core.terms import ONE, ZERO, Deriv, Global, Hole, Lam, Term, integral, postorder
from potto.elaborate import core, core_term, elaborate_expression
from potto.ide.names.live_expressions import wrong_with
from potto.modules import definition, dependencies, is_recursive, references
from potto.modules.graph import strongly_connected
from potto.query import Database, query
from potto.source import Span
from potto.syntax import nodes, parse_expression
from potto.syntax.typesetting import broken
from potto.types import check_definition, interface

LONG = 400  # characters of a formula beyond which a hover leaves it out
WIDTH = 72  # of its lines


@query
def is_sound(db: Database, file: str, name: str) -> bool:
    """Whether the types of a definition and of all that it needs are right: else its terms mean nothing. Of what it
    needs the answer is asked, so that a chain of calls is not followed to its end from each of its links."""
    group = strongly_connected(db, file, name)
    for target in group:
        if interface(db, target.file, target.name).broken or has_errors(check_definition(db, target.file, target.name)):
            return False
        if (None, "deriv") in references(db, target.file, target.name) and is_recursive(db, target.file, target.name):
            return False  # it needs the derivative of itself: symbols for that have no end
    needed = {needed: None for target in group for needed in dependencies(db, target.file, target.name)}
    return all(is_sound(db, target.file, target.name) for target in needed if target not in group)


@query
def derivative_text(db: Database, file: str, name: str) -> DerivativeText | None:
    """The derivative of a definition in symbols; None for one with errors."""
    return explain_derivative(db, file, name) if is_sound(db, file, name) else None


class ConditionInfo(Struct, frozen=True):
    """What is known of a condition over variables of integration. `span` is relative to the definition's chunk.

    `problem` says why it can't be integrated over; then the rest is empty. `missing` are the coordinates that were left
    out. `equation` says where it changes; if it is `searched` for, there is no diffeomorphism.
    """

    span: Span
    variables: tuple[str, ...]
    coordinates: tuple[str, ...]
    equation: str
    missing: tuple[str, ...] = ()
    pivot: str = ""
    roots: tuple[str, ...] = ()
    inverse: tuple[tuple[str, ...], ...] = ()
    values: tuple[str, ...] = ()
    determinant: str = ""
    problem: str = ""
    notes: tuple[str, ...] = ()
    moved_by: tuple[str, ...] = ()
    calls: tuple[str, ...] = ()
    searched: bool = False


Functions = tuple[tuple[str, str], ...]  # parameters that are functions, each with the text of what it is given


def conditions(
    db: Database, file: str, name: str, given: Functions = (), over: Container[str] = ()
) -> tuple[Condition, ...]:
    """The conditions of a sound definition, and those of functions that it is given. A text that is not a function of
    the file, or not a sound one, has none. over: parameters that vary too, as the axes of a picture do."""
    functions: dict[str, Term] = {}
    for parameter, text in given:
        if wrong_with(db, file, text):
            continue
        term = elaborate_expression(db, file, parse_expression(text).expr).term
        names = [node for node in postorder(term) if isinstance(node, Global)]
        if isinstance(term, Lam | Global | Deriv) and all(is_sound(db, g.module, g.name) for g in names):
            functions[parameter] = term
    return conditions_of(
        _integrated(core(db, file, name).term, over),
        lambda g: exported(db, g.module, g.name),
        lambda g: core_term(db, g.module, g.name),
        functions,
    )


def _integrated(term: Term, over: Container[str]) -> Term:
    """The body of a function, those of its parameters integrated over."""
    params = tuple(p for p in parameters_of(term) if p in over)
    while isinstance(term, Lam):
        term = term.body
    return integral(params, ((ZERO, ONE),) * len(params), term) if params else term


@query
def condition_infos(db: Database, file: str, name: str, given: Functions = ()) -> tuple[ConditionInfo, ...]:
    """The conditions of a definition, in the order of the text; also those that calls lead to. given: what parameters
    that are functions stand for; without that, calls of these lead to none."""
    judged = judged_conditions(db, file, name, given)
    if not judged:
        return ()
    parameters, notation = parameters_of(core_term(db, file, name)), written_notation(db, file, name)
    out: dict[ConditionInfo, None] = {}
    for span, condition, verdict in judged:
        moved = tuple(p for p in parameters if p in condition.surface.free)
        out[_info(notation, span, condition.coordinates, condition.variables, verdict, moved, condition.calls)] = None
    return tuple(sorted(out, key=lambda info: info.span))


@query
def condition_places(db: Database, file: str, name: str, given: Functions = ()) -> tuple[tuple[Span, str], ...]:
    """Of the conditions that can be integrated over, where each is written and where its surface is, in the order of
    the text. What else is known of them, which takes longer to write, is not asked for."""
    judged = judged_conditions(db, file, name, given)
    if not judged:
        return ()
    notation, found = written_notation(db, file, name), dict[tuple[Span, str], None]()
    for span, condition, verdict in judged:
        if isinstance(verdict, Verdict):
            found[span, shown_equation(condition.surface, condition.variables, notation)] = None
    return tuple(sorted(found))


@query
def judged_conditions(
    db: Database, file: str, name: str, given: Functions = ()
) -> tuple[tuple[Span, Condition, Verdict | ConditionProblem], ...]:
    """The conditions of a definition that it writes itself or leads to, with their places in its chunk, and whether
    they can be integrated over; none of one that is not sound."""
    if not is_sound(db, file, name):
        return ()
    spans, found = dict(core(db, file, name).origins), list[tuple[Span, Condition, Verdict | ConditionProblem]]()
    for condition in conditions(db, file, name, given):
        span = spans.get(condition.anchor)
        if span is None or any(isinstance(n, Hole) for c in condition.coordinates for n in postorder(c)):
            continue
        role: Role = "delta" if condition.delta else "bracket"
        found.append((span, condition, judge(condition.coordinates, condition.variables, condition.box, role=role)))
    return tuple(found)


def _info(
    notation: Notation,
    span: Span,
    coordinates: tuple[Term, ...],
    variables: tuple[str, ...],
    verdict: Verdict | ConditionProblem,
    moved: tuple[str, ...],
    calls: tuple[str, ...],
) -> ConditionInfo:
    shown, where = _terms(coordinates, notation), shown_equation(coordinates[0], variables, notation)
    if isinstance(verdict, ConditionProblem):
        said = (*verdict.notes, *([verdict.help] if verdict.help else []))
        return ConditionInfo(
            span, variables, shown, where, problem=verdict.message, notes=said, moved_by=moved, calls=calls
        )
    completed = (*coordinates, *verdict.completion)
    inverse = verdict.inverse
    if inverse is None and len(completed) == len(variables):
        found = invert(completed, variables)
        inverse = found if isinstance(found, InverseMap) else None
    found_roots = () if verdict.roots is None else verdict.roots.roots
    roots = tuple([_term(readable(simplify(root), frozenset()), notation) for root in found_roots])
    return ConditionInfo(
        span,
        variables,
        shown,
        where,
        _terms(verdict.completion, notation),
        verdict.pivot,
        roots,
        () if inverse is None else tuple(_terms(branch, notation) for branch in inverse.branches),
        () if inverse is None else inverse.values,
        "" if verdict.determinant is None else _term(verdict.determinant, notation),
        moved_by=moved,
        calls=calls,
        searched=bool(verdict.searched),
    )


def shown_equation(surface: Term, variables: Iterable[str], notation: Notation) -> str:
    """Where a surface is, for a person to read."""
    return _plain(notation.equation(simplify(surface), variables))


def _term(term: Term, notation: Notation) -> str:
    return _plain(notation.text(simplify(term)))


def _terms(terms: Iterable[Term], notation: Notation) -> tuple[str, ...]:
    return tuple(_term(term, notation) for term in terms)


def _plain(text: str) -> str:
    """Copies of bound variables (`x'1`) by the names that were written."""
    parts = text.split("'")
    return parts[0] + "".join(part.lstrip("0123456789") for part in parts[1:])


# Markdown


def fence(text: str) -> str:
    """A block of Potto."""
    return f"```potto\n{text}\n```"


def code(text: str) -> str:
    """A piece of Potto in a line of text; what is too long is left out."""
    text = text if len(text) <= LONG else "…"
    return f"`` {text} ``" if "`" in text else f"`{text}`"


def derivative_markdown(db: Database, file: str, name: str) -> str | None:
    """All there is to say about a definition's derivative, as markdown."""
    found = derivative_text(db, file, name)
    return None if found is None else fence(found.text)


def derivative_parts(found: DerivativeText, conditions: Iterable[ConditionInfo] = ()) -> list[str]:
    """The interior and boundary terms as they are typeset, and the surfaces with what moves each: those of its own
    integrals, or of `conditions`, which it leaves to others."""
    lines = [f"the derivative of {code(found.name)}"] if found.by else []
    for number, item in enumerate(found.integrals, 1):
        title = f"of integral {number}" if len(found.integrals) > 1 else ""
        lines.append(_integral(found, item, title))
    if not found.integrals and found.tangent:
        lines.append(f"**derivative**\n\n{typeset(f'∂{found.name} = ', found.unicode(found.tangent))}")
        lines += [
            f"nothing jumps at {code(found.unicode(where))}: it is continuous there" for where in found.continuous
        ]
        moved = {surface.equation: surface.moved_by for surface in found.surfaces}
        moved.update({info.equation: info.moved_by for info in conditions if not info.problem})
        if moved:
            listed = [f"- {code(found.unicode(where))} {_moved(by)}" for where, by in moved.items()]
            lines.append("\n".join(["**surfaces**", "", *listed]))
    told = [item.reason for item in found.integrals if item.reason]
    lines += [f"*{note}*" for note in found.notes if not any(reason in note for reason in told)]
    return lines


def typeset(head: str, formula: str) -> str:
    """A formula in a block of its own, its lines cut where it is a sum; one that nobody would read is left out."""
    lines = broken(head, formula, WIDTH) if len(formula) <= LONG else [f"{head}…"]
    return "\n".join(["```text", *lines, "```"])


def _moved(by: tuple[str, ...]) -> str:
    return f"moved by {', '.join(map(code, by))}" if by else "moved by no parameter"


def _integral(found: DerivativeText, item: IntegralText, title: str) -> str:
    """The integrals around interior and boundary, and where the surfaces are."""
    parts = [("interior", item.over(item.interior))] if item.interior else []
    parts += [("boundary", item.over(text)) for text in item.deltas]
    parts += [("moving bound", text) for text in item.bounds]
    parts += [("integrated", text) for text in item.boundary if len(text) <= LONG]
    lines = [f"**derivative** {title}".rstrip(), ""]
    lines += [f"for each {code(found.unicode(item.each))}", ""] if item.each else []
    widest = max((len(kind) for kind, _ in parts), default=0)
    blocks = [line for kind, text in parts for line in _part(kind.ljust(widest), found.unicode(text))]
    if not item.deltas and not item.reason:
        meeting = [f"0: continuous at {found.unicode(where)}" for where in item.continuous]
        blocks += [f"{'boundary'.ljust(widest)}  {text}" for text in meeting or ["0"]]
    lines += ["```text", *blocks, "```"]
    if item.reason:
        lines += ["", f"the boundary is found numerically, because {item.reason}"]
    if item.surfaces:
        lines += ["", "**surfaces**", ""]
    for surface in item.surfaces:
        where = "; at " + ", ".join(code(found.unicode(root)) for root in surface.roots) if surface.roots else ""
        lines.append(f"- {code(found.unicode(surface.equation))} {_moved(surface.moved_by)}{where}")
    return "\n".join(lines)


def _part(kind: str, formula: str) -> list[str]:
    first, *more = broken("", formula, WIDTH) if len(formula) <= LONG else ["…"]
    return [f"{kind}  {first}", *(f"{' ' * (len(kind) + 2)}{line}" for line in more)]


def condition_markdown(info: ConditionInfo) -> str:
    """A condition: its diffeomorphism, inverse and determinant, or why there is none."""
    over = ", ".join(info.variables)
    if info.problem:
        first = f"**not a diffeomorphism** over {code(over)}: {info.problem}"
        return "\n".join([first, *(f"\n{note}" for note in info.notes)])
    if info.searched:
        first = f"**not a diffeomorphism** over {code(over)}: where {code(info.equation)} has no closed form"
        return "\n".join([first, "", *_facts(info)])
    all_of_it = ", ".join((*info.coordinates, *info.missing))
    lines = [fence(f"diffeo({all_of_it})"), f"a diffeomorphism of {code(over)}"]
    if info.missing:
        lines[-1] += f", completed by {code(', '.join(info.missing))}"
    return "\n".join([*lines, "", *_facts(info)])


def _facts(info: ConditionInfo) -> list[str]:
    facts = [f"- {_moved(info.moved_by)}" + ("" if info.moved_by else ": it adds nothing to a derivative")]
    for root in info.roots:
        facts.append(f"- surface: {code(f'{info.pivot} = {root}')}")
    for branch in info.inverse:
        facts.append(f"- inverse: {code(inverse_text(info.values, branch))}")
    if not info.inverse:
        facts.append("- inverse: none in closed form" + ("" if info.roots else "; the surface is found numerically"))
    if info.determinant:
        facts.append(f"- determinant: {code(info.determinant)}")
    if info.calls:
        facts.append(f"- inside {called_by(info.calls)}")
    return facts


def inverse_text(values: Iterable[str], branch: Iterable[str]) -> str:
    """An inverse as a program writes it, without the word."""
    return f"({', '.join(values)}) . ({', '.join(branch)})"


def diffeo_markdown(db: Database, file: str, name: str) -> str | None:
    """A diffeomorphism: its inverse and determinant; None where there is none, the diagnostics say why."""
    info = diffeo_of(db, file, name)
    if info is None:
        return None
    write = written_notation(db, file, name).text
    lines = [f"- inverse: {code(inverse_text(info.values, map(write, branch)))}" for branch in info.branches]
    if info.determinant is not None:
        lines.append(f"- determinant: {code(write(info.determinant))}")
    lines.append(f"- found: {info.method}" if info.method != "given" else "- the inverse was given by the author")
    lines += [f"- {note}" for note in info.notes]
    return "\n".join(lines)


def diffeo_of(db: Database, file: str, name: str) -> DiffeoInfo | None:
    """What is known of a diffeomorphism; None for other definitions."""
    if not isinstance(definition(db, file, name), nodes.DiffeoDefinition) or not is_sound(db, file, name):
        return None
    return diffeo_info(db, file, name)
