"""An expression as boxes: what stands beside, above and below what, with nothing said of how it is drawn.

Owns `Box` and `boxes`. Names of tangents, `dr`, become what they are, the variation of `r`.
"""

from __future__ import annotations

from collections.abc import Container, Sequence

from msgspec import Struct

from potto.syntax import nodes
from potto.syntax.parser import parse_expression
from potto.syntax.printer import print_expression

_LETTERS = (
    "alpha=α beta=β gamma=γ delta=δ epsilon=ε eta=η theta=θ kappa=κ lambda=λ mu=μ nu=ν rho=ρ sigma=σ tau=τ phi=φ "
    "chi=χ psi=ψ omega=ω pi=π inf=∞"
)
GREEK = dict(pair.split("=") for pair in _LETTERS.split())
SIGNS = {"<=": "≤", ">=": "≥", "!=": "≠", "==": "=", "-": "−", "*": "·"}
_PRIME = "delta_prime"  # what the derivative of a delta is called while it is parsed: `delta'` is not a name
_CALLED = {"delta": "δ", _PRIME: "δ′"}
_TURNED = {">": "<", ">=": "<="}


class Word(Struct, frozen=True):
    """A name, a number or a sign."""

    text: str
    kind: str = "name"  # or number, sign, function, words


class Row(Struct, frozen=True):
    """Boxes side by side; `sum`: with its signs, so that lines may break before them."""

    items: tuple[Box, ...]
    sum: bool = False


class Fenced(Struct, frozen=True):
    """Something between two signs, which grow with it."""

    left: str
    inner: Box
    right: str


class Fraction(Struct, frozen=True):
    """One over another. inline: as it is written on a line, with the parentheses that it needs there."""

    top: Box
    below: Box
    inline: Box


class Raised(Struct, frozen=True):
    """A power."""

    base: Box
    exponent: Box


class SquareRoot(Struct, frozen=True):
    """A square root."""

    inner: Box


class Big(Struct, frozen=True):
    """An integral or a sum. signs: for each variable what stands below and above; last: what closes it, as dx."""

    sign: str
    limits: tuple[tuple[Box, Box], ...]
    body: Box
    last: tuple[Box, ...]


class Cases(Struct, frozen=True):
    """then where the condition holds, else orelse."""

    condition: Box
    then: Box
    orelse: Box


class Where(Struct, frozen=True):
    """A formula, and equations that say what names in it stand for."""

    body: Box
    equations: Box


Box = Word | Row | Fenced | Fraction | Raised | SquareRoot | Big | Cases | Where


def boxes(text: str, tangents: Container[str]) -> Box | None:
    """An expression as boxes, `tangents` being the names that stand for variations; None if it does not parse."""
    parsed = parse_expression(text.replace("delta'", _PRIME))
    return None if parsed.diagnostics else _Boxes(tangents).of(parsed.expr)


def bare(node: nodes.Expr) -> nodes.Expr:
    """Without the parentheses around it."""
    while isinstance(node, nodes.Paren):
        node = node.inner
    return node


class _Boxes:
    def __init__(self, tangents: Container[str]) -> None:
        self.tangents = tangents

    def of(self, node: nodes.Expr) -> Box:
        match node:
            case nodes.Number(text=text):
                return Word(text, "number")
            case nodes.Name(id=name):
                return self.name(name)
            case nodes.Paren(inner=inner):
                return Fenced("(", self.of(inner), ")")
            case nodes.Tuple(items=items):
                return Fenced("(", self.listed(items), ")")
            case nodes.ListLiteral(items=items):
                return Fenced("[", self.listed(items), "]")
            case nodes.Bracket(condition=condition):
                return Fenced("[", self.of(condition), "]")
            case nodes.Unary(op=op, operand=operand):
                return Row((Word(SIGNS.get(op, "¬" if op == "not" else op), "sign"), self.of(operand)))
            case nodes.Chain():
                return self.chain(node)
            case nodes.Power(base=base, exponent=exponent):
                return Raised(self.of(base), self.of(bare(exponent)))
            case nodes.Compare(first=first, rest=rest):
                return self.compared(first, [(o.op, o.value) for o in rest])
            case nodes.Logic(op=op, operands=operands):
                return self.logic(op, operands)
            case nodes.If(condition=condition, then=then, orelse=orelse):
                return Cases(self.of(_unbracketed(condition)), self.of(then), self.of(orelse))
            case nodes.Let(bindings=bindings, body=body):
                return Where(self.of(body), _separated([self.meaning(binding) for binding in bindings]))
            case nodes.Apply():
                return self.call(node)
            case nodes.Integral():
                return self.integral(node)
            case nodes.Reduction(op="sum", clauses=clauses, body=body):
                limits = tuple(self.limit(clause) for clause in clauses)
                return Big("∑", limits, self.enclosed(body), ())
            case nodes.Index(array=array, indices=indices):
                return Row((self.of(array), Fenced("[", self.listed(indices), "]")))
            case nodes.Field(value=value, name=name):
                return Row((self.of(value), Word(f".{name}", "words")))
            case nodes.Member(path=path, name=name) if path in self.tangents:
                return Row((self.name(path), Word(f".{name}", "words")))
            case _:
                return Word(print_expression(node), "words")

    def name(self, name: str) -> Box:
        if name in self.tangents:
            return Row((Word("∂", "sign"), self.name(name[1:])))
        return Word(GREEK.get(name, name) if name != "delta" else name)

    def meaning(self, binding: nodes.Binding) -> Box:
        named = self.listed([nodes.Name(target.span, target.name) for target in binding.targets])
        return Row((named, Word("=", "sign"), self.of(binding.value)))

    def listed(self, items: Sequence[nodes.Expr]) -> Box:
        return _separated([self.of(item) for item in items])

    def enclosed(self, node: nodes.Expr) -> Box:
        """As what is integrated: a sum or a choice between parentheses."""
        inner = bare(node)
        loose = isinstance(inner, nodes.If) or (isinstance(inner, nodes.Chain) and inner.rest[0].op in "+-")
        return Fenced("(", self.of(inner), ")") if loose else self.of(inner)

    def chain(self, node: nodes.Chain) -> Box:
        if node.rest[0].op in "+-":
            items: list[Box] = [self.of(node.first)]
            for operand in node.rest:
                items += [Word(SIGNS.get(operand.op, operand.op), "sign"), self.of(operand.value)]
            return Row(tuple(items), True)
        above: list[nodes.Expr] = [node.first]
        done: Box | None = None
        for operand in node.rest:
            if operand.op == "*":
                above.append(operand.value)
                continue
            done = self.fraction(done, above, operand.value)
            above = []
        whole = self.product(above) if above else None
        if done is None or whole is None:
            return done or whole or Word("")
        return Row((done, Word("·", "sign"), whole))

    def fraction(self, before: Box | None, above: list[nodes.Expr], below: nodes.Expr) -> Box:
        inner = self.product(above) if above else None
        joined = [b for b in (before, inner) if b is not None]
        inline = Row((*_between(joined), Word("/", "sign"), self.of(below)))
        single = self.of(bare(above[0])) if len(above) == 1 and before is None else Row(tuple(_between(joined)))
        return Fraction(single, self.of(bare(below)), inline)

    def product(self, factors: list[nodes.Expr]) -> Box:
        return Row(tuple(_between([self.of(f) for f in factors]))) if len(factors) > 1 else self.of(factors[0])

    def compared(self, first: nodes.Expr, rest: list[tuple[str, nodes.Expr]]) -> Box:
        items: list[Box] = [self.of(first)]
        for op, value in rest:
            items += [Word(SIGNS.get(op, op), "sign"), self.of(value)]
        return Row(tuple(items))

    def logic(self, op: str, operands: tuple[nodes.Expr, ...]) -> Box:
        """`0 < t and t < 1` as 0 < t < 1, others joined by signs."""
        if op == "or":
            return _separated([self.of(o) for o in operands], " ∨ ")
        found: list[Box] = []
        waiting = list(operands)
        while waiting:
            first = _rising(waiting.pop(0))
            for other in waiting if first is not None else ():
                second = _rising(other)
                joined = None if second is None or first is None else _joined(first, second)
                if joined is not None:
                    waiting.remove(other)
                    found.append(self.compared(joined[0], joined[1:]))  # type: ignore[arg-type]
                    break
            else:
                found.append(self.of(operands[len(operands) - len(waiting) - 1]) if first is None else
                             self.compared(first[0], [(first[1], first[2])]))  # fmt: skip
        return _separated(found, " ∧ ")

    def call(self, node: nodes.Apply) -> Box:
        head = node.function
        arguments = tuple(a.value for a in node.arguments)
        inner = _separated([
            Row((Word(f"{a.name} = ", "words"), self.of(a.value))) if a.name else self.of(a.value)
            for a in node.arguments
        ])  # fmt: skip
        if isinstance(head, nodes.Name) and len(arguments) == 1:
            match head.id:
                case "sqrt":
                    return SquareRoot(self.of(arguments[0]))
                case "abs":
                    return Fenced("|", self.of(arguments[0]), "|")
                case "deriv" if isinstance(arguments[0], nodes.Name):
                    return Row((Word("∂", "sign"), self.of(arguments[0])))
        if isinstance(head, nodes.Name) and head.id not in self.tangents:
            return Row((Word(_CALLED.get(head.id) or GREEK.get(head.id, head.id), "function"), Fenced("(", inner, ")")))
        return Row((self.of(head), Fenced("(", inner, ")")))

    def integral(self, node: nodes.Integral) -> Box:
        names = [self.name(b.name) for b in node.variables]
        same = len({print_bounds(b) for b in node.bounds}) == 1
        limits: list[tuple[Box, Box]] = []
        for bound, name in zip(node.bounds, names, strict=False):
            if isinstance(bound, nodes.Interval):
                low = self.of(bound.lo)
                limits.append((low if same else Row((name, Word("=", "sign"), low)), self.of(bound.hi)))
            else:
                arguments = _separated([self.of(a) for a in bound.arguments])
                measure = Row((Word(bound.measure, "function"), Fenced("(", arguments, ")")))
                limits.append((Row((self.name(bound.variable), Word("~", "sign"), measure)), Word("")))
        return Big("∫", tuple(limits), self.enclosed(node.body), tuple(Row((Word("d", "words"), n)) for n in names))

    def limit(self, clause: nodes.Clause) -> tuple[Box, Box]:
        name = self.name(clause.variable.name)
        if isinstance(clause.over, nodes.Range):
            return Row((name, Word("=", "sign"), self.of(clause.over.lo))), self.of(clause.over.hi)
        return Row((name, Word("∈", "sign"), self.of(clause.over))), Word("")


def print_bounds(bound: nodes.Interval | nodes.MeasureBound) -> str:
    """The ends as text."""
    if isinstance(bound, nodes.Interval):
        return f"{print_expression(bound.lo)}, {print_expression(bound.hi)}"
    return f"{bound.measure}({', '.join(map(print_expression, bound.arguments))})"


def _between(items: list[Box]) -> list[Box]:
    out = items[:1]
    for item in items[1:]:
        out += [Word("·", "sign"), item]
    return out


def _separated(items: list[Box], by: str = ", ") -> Box:
    out: list[Box] = items[:1]
    for item in items[1:]:
        out += [Word(by, "words"), item]
    return out[0] if len(out) == 1 else Row(tuple(out))


def _unbracketed(node: nodes.Expr) -> nodes.Expr:
    return node.condition if isinstance(node, nodes.Bracket) else node


def _rising(node: nodes.Expr) -> tuple[nodes.Expr, str, nodes.Expr] | None:
    """A comparison with the lesser side first."""
    if not isinstance(node, nodes.Compare) or len(node.rest) != 1:
        return None
    op, other = node.rest[0].op, node.rest[0].value
    if op in _TURNED:
        return other, _TURNED[op], node.first
    return (node.first, op, other) if op in ("<", "<=") else None


def _joined(
    first: tuple[nodes.Expr, str, nodes.Expr], second: tuple[nodes.Expr, str, nodes.Expr]
) -> tuple[nodes.Expr | tuple[str, nodes.Expr], ...] | None:
    """a < b and b < c as a < b < c."""
    for lower, upper in ((first, second), (second, first)):
        if print_expression(lower[2]) == print_expression(upper[0]):
            return lower[0], (lower[1], lower[2]), (upper[1], upper[2])
    return None
