r"""Formulas of Potto as LaTeX, for notebooks and papers.

Owns `expression_latex`, `derivative_latex`, and `function_derivative`, which finds what that typesets. What is typeset
is a text of Potto, as `explain` writes derivatives: an integral is `\int`, a bracket stays one, a name that is that of
a Greek letter is the letter, and `dt`, the tangent of t, is `\partial t`, so that it is told apart from what is
integrated over. Knows nothing of notebooks; MathJax and KaTeX read what it writes.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence

from msgspec import Struct

from potto.calculus.differentiation.higher_order import NoText, first_derivative
from potto.calculus.explanation.explain import describe, explain_derivative
from potto.calculus.explanation.layout import DerivativeText, IntegralText
from potto.checking.facts import LONG
from potto.core.terms import Deriv, Global, Term
from potto.elaborate import core_term, elaborate_expression
from potto.modules import DefinitionTarget, resolve
from potto.query import Database
from potto.syntax import nodes, parse_expression, print_expression
from potto.types import derivative_type, format_type, infer_expression

_GREEK = frozenset(
    (
        *("alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu", "nu"),
        *("xi", "rho", "sigma", "tau", "upsilon", "phi", "chi", "psi", "omega"),
        *("Gamma", "Delta", "Theta", "Lambda", "Xi", "Pi", "Sigma", "Upsilon", "Phi", "Psi", "Omega"),
    )
)
_NAMED = {"inf": r"\infty", "pi": r"\pi", "ell": r"\ell", "ℓ": r"\ell"}
_OPERATORS = frozenset(["sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "min", "max"])
_AROUND = {"abs": (r"\left| ", r" \right|"), "floor": (r"\left\lfloor ", r" \right\rfloor"),
           "ceil": (r"\left\lceil ", r" \right\rceil"), "sqrt": (r"\sqrt{", "}")}  # fmt: skip
_COMPARISONS = {"<": "<", ">": ">", "<=": r"\le", ">=": r"\ge", "==": "=", "!=": r"\ne"}
_LOGIC = {"and": r"\wedge", "or": r"\vee"}
_REDUCTIONS = {"sum": r"\sum", "product": r"\prod", "min": r"\min", "max": r"\max"}
_CODE = r"\mathtt"
_SMALL = 40  # characters that are read in an exponent
_SUBSCRIPT = re.compile(r"(.*?[^\W\d_]'*)_?(\d+)('*)")

# How tightly a text holds together, as in the printers of Potto.
_OPEN, _LOGICAL, _COMPARE, _ADD, _MUL, _POWER, _ATOM = range(7)


class _Set(Struct, frozen=True):
    """A typeset formula, and the place up to which it needs no parentheses; `digit`: whether it begins with a digit."""

    text: str
    holds: int = _ATOM

    def at(self, place: int) -> str:
        return self.text if self.holds >= place else _parens(self.text)

    @property
    def digit(self) -> bool:
        return self.text[:1].isdigit()


def expression_latex(text: str, tangents: frozenset[str] = frozenset()) -> str | None:
    r"""An expression of Potto as LaTeX without `$`; the names in `tangents` are written `\partial t` for `dt`.

    None for what is no expression, too long to be read, or has no form in mathematics, as a fold.
    """
    parsed = parse_expression(text) if len(text) <= LONG else None
    text = "" if parsed is None or parsed.diagnostics else _Typesetter(tangents).set(parsed.expr).text
    return text if text and _CODE not in text else None


def derivative_latex(found: DerivativeText, name: str) -> str | None:
    r"""A derivative as LaTeX without `$`: as the sum of interior and boundary under its integral, and integrated.

    `name` is what the function is called. None where it has no form in symbols, or one that is too long.
    """
    tangents = frozenset(f"d{parameter}" for parameter in found.parameters)
    head = r"\partial " + _name(name, frozenset())
    sides = [_of_integral(found.integrals[0], tangents)] if found.alone and len(found.integrals) == 1 else []
    whole = expression_latex(found.tangent, tangents) if found.tangent else None
    shown = list(dict.fromkeys(side for side in (*sides, whole) if side is not None))
    if not shown:
        return None
    lines = [f"{head if not number else ''} &= {side}" for number, side in enumerate(shown)]
    return r"\begin{aligned}" + r" \\ ".join(lines) + r"\end{aligned}"


def function_derivative(db: Database, file: str, expr: nodes.Expr, name: str) -> DerivativeText:
    """The derivative of an expression that is a function: of a definition in its own words, else of `name`."""
    while isinstance(expr, nodes.Paren):
        expr = expr.inner
    if isinstance(expr, nodes.Name):
        target = resolve(db, file, expr.id)
        if isinstance(target, DefinitionTarget) and not isinstance(core_term(db, target.file, target.name), Deriv):
            return explain_derivative(db, target.file, target.name)
    found = elaborate_expression(db, file, expr)
    type = format_type(derivative_type(infer_expression(db, file, expr).type))

    def term_of(target: Global) -> Term:
        return core_term(db, target.module, target.name)

    try:
        return describe(first_derivative(found.term, term_of), name, type, term_of)
    except NoText as problem:
        return DerivativeText(name, type, "", False, (), (str(problem),))


def _of_integral(item: IntegralText, tangents: frozenset[str]) -> str | None:
    """The derivative of one integral before its deltas are integrated out; None if a part has no form."""
    frame = parse_expression(f"{item.head} 0 d({item.variables})").expr
    if not isinstance(frame, nodes.Integral):
        return None
    parts = [(item.interior, "interior")] if item.interior and (item.interior != "0" or not item.deltas) else []
    parts += [(text, "boundary") for text in item.deltas]
    found = [(expression_latex(text, tangents), what) for text, what in parts]
    bounds = [expression_latex(text, tangents) for text in item.bounds]
    if not found or any(text is None for text, _ in found) or any(text is None for text in bounds):
        return None
    braced = [rf"\underbrace{{{text}}}_{{\text{{{what}}}}}" for text, what in found]
    body = braced[0] if len(braced) == 1 else rf"\Bigl( {' + '.join(braced)} \Bigr)"
    moving = [rf"\underbrace{{{text}}}_{{\text{{moving bound}}}}" for text in bounds]
    return " + ".join([_Typesetter(tangents).integral(frame, body), *moving])


class _Typesetter(Struct, frozen=True):
    """Trees of expressions to LaTeX; `tangents` are names of tangents."""

    tangents: frozenset[str]

    def set(self, expr: nodes.Expr) -> _Set:
        match expr:
            case nodes.Number(text=text):
                return _number(text)
            case nodes.Name(id=name):
                return _Set(_name(name, self.tangents), _MUL if name in self.tangents else _ATOM)
            case nodes.Paren(inner=inner):
                return self.set(inner)
            case nodes.Unary(op=op, operand=operand):
                return _Set(
                    rf"\neg {self.at(operand, _ATOM)}" if op == "not" else f"{op}{self.at(operand, _MUL)}", _ADD
                )
            case nodes.Chain(first=first, rest=rest):
                return self.sum(first, rest) if rest[0].op in "+-" else self.product(first, rest)
            case nodes.Power(base=base, exponent=exponent):
                return _Set(f"{self.at(base, _ATOM)}^{{{self.set(exponent).text}}}", _POWER)
            case nodes.Compare(first=first, rest=rest):
                parts = "".join(f" {_COMPARISONS[each.op]} {self.at(each.value, _ADD)}" for each in rest)
                return _Set(self.at(first, _ADD) + parts, _COMPARE)
            case nodes.Logic(op=op, operands=operands):
                return _Set(f" {_LOGIC[op]} ".join(self.at(each, _COMPARE) for each in operands), _LOGICAL)
            case nodes.Bracket(condition=condition):
                return _Set(rf"\left[{self.set(condition).text}\right]")
            case nodes.Tuple(items=items):
                return _Set(_parens(self.listed(items)))
            case nodes.ListLiteral(items=items):
                return _Set(rf"\left[{self.listed(items)}\right]")
            case nodes.If(condition=condition, then=then, orelse=orelse):
                rows = rf"{self.set(then).text} & {self.set(condition).text} \\ {self.set(orelse).text} & \text{{else}}"
                return _Set(rf"\begin{{cases}} {rows} \end{{cases}}")
            case _:
                return self.larger(expr)

    def larger(self, expr: nodes.Expr) -> _Set:
        """Calls, and what binds variables or reads parts."""
        match expr:
            case nodes.Lambda(groups=groups, body=body):
                names = [", ".join(_name(p.name or "", self.tangents) for p in group) for group in groups]
                heads = [text if len(group) == 1 else _parens(text) for text, group in zip(names, groups, strict=True)]
                return _Set(r" \mapsto ".join([*heads, self.set(body).text]), _OPEN)
            case nodes.Apply():
                return self.call(expr)
            case nodes.Integral(body=body):
                return _Set(self.integral(expr, self.at(body, _MUL)), _MUL)  # its differentials end it
            case nodes.Reduction(op=op, clauses=clauses, body=body):
                head = " ".join(_REDUCTIONS[op] + self.limits(clause) for clause in clauses)
                return _Set(f"{head} {self.at(body, _MUL)}", _ADD)
            case nodes.Comprehension(clauses=clauses, body=body):
                return _Set(rf"\left[{self.set(body).text}\right]" + "".join(map(self.limits, clauses)))
            case nodes.Index(array=whole, indices=indices):
                return _Set(f"{{{self.at(whole, _ATOM)}}}_{{{self.listed(indices)}}}")
            case nodes.Field(value=value, name=name):
                return _Set(rf"{{{self.at(value, _ATOM)}}}_{{\mathrm{{{_escaped(name)}}}}}")
            case nodes.Member(path=path, name=name):
                return _Set(rf"{{{_name(path, self.tangents)}}}_{{\mathrm{{{_escaped(name)}}}}}")
            case _:
                return _Set(rf"{_CODE}{{{_escaped(print_expression(expr))}}}")

    def at(self, expr: nodes.Expr, place: int) -> str:
        return self.set(expr).at(place)

    def listed(self, items: Sequence[nodes.Expr]) -> str:
        return ", ".join(self.set(item).text for item in items)

    def sum(self, first: nodes.Expr, rest: Sequence[nodes.Operand]) -> _Set:
        parts = [self.at(first, _ADD)]
        for each in rest:
            text = self.at(each.value, _MUL)
            parts.append(f"{each.op} {text}")
        return _Set(" ".join(parts), _ADD)

    def product(self, first: nodes.Expr, rest: Sequence[nodes.Operand]) -> _Set:
        """Factors beside each other, what is divided by below a line."""
        found = self.set(first)
        if isinstance(first, nodes.Unary) and first.op == "-":  # a minus sign in front of the whole product
            found = _Set(found.text, _MUL)
        for each in rest:
            other = self.set(each.value)
            if each.op == "/":
                found = _Set(rf"\frac{{{found.text}}}{{{other.text}}}", _MUL)
            else:
                numbers = other.digit or (found.digit and other.text.startswith(r"\frac"))
                between = r" \cdot " if numbers else r" \, "
                found = _Set(f"{found.at(_MUL)}{between}{other.at(_MUL)}", _MUL)
        return _Set(found.text, _ADD) if found.text.startswith("-") else found

    def call(self, expr: nodes.Apply) -> _Set:
        args = [argument.value for argument in expr.arguments]
        head = expr.function
        if isinstance(head, nodes.Name) and len(args) == 1:
            inner = self.set(args[0])
            if head.id in _AROUND:
                before, after = _AROUND[head.id]
                return _Set(f"{before}{inner.text}{after}")
            if head.id == "exp" and len(inner.text) < _SMALL:
                return _Set(f"e^{{{inner.text}}}", _POWER)
            if head.id in ("deriv", "D", "grad"):
                symbol = {"deriv": r"\partial ", "D": r"\mathrm{D} ", "grad": r"\nabla "}[head.id]
                return _Set(symbol + inner.at(_ATOM))
            if head.id == "snd" and isinstance(args[0], nodes.Apply):  # the tangent of a call of a derivative
                return self.call(args[0])
        name = rf"\{head.id}" if isinstance(head, nodes.Name) and head.id in _OPERATORS else self.at(head, _ATOM)
        return _Set(name + _parens(self.listed(args)))

    def integral(self, frame: nodes.Integral, body: str) -> str:
        """An integral of a body; the first variable is the outermost, so that its differential comes last."""
        signs, ends = "", []
        for bound, variable in zip(frame.bounds, frame.variables, strict=True):
            name = _name(variable.name, self.tangents)
            if isinstance(bound, nodes.MeasureBound):
                density = rf"\mathrm{{{_escaped(bound.measure)}}}"
                signs += r"\int "
                ends.append(rf"\, {density}(\mathrm{{d}}{name};\, {self.listed(bound.arguments)})")
            else:
                signs += rf"\int_{{{self.set(bound.lo).text}}}^{{{self.set(bound.hi).text}}} "
                ends.append(rf"\, \mathrm{{d}}{name}")
        return f"{signs}{body}{''.join(reversed(ends))}"

    def limits(self, clause: nodes.Clause) -> str:
        name = _name(clause.variable.name, self.tangents)
        if isinstance(clause.over, nodes.Range):
            return f"_{{{name}={self.set(clause.over.lo).text}}}^{{{self.set(clause.over.hi).text}}}"
        return rf"_{{{name} \in {self.set(clause.over).text}}}"


def _parens(text: str) -> str:
    return rf"\left({text}\right)"


def _number(text: str) -> _Set:
    mantissa, _, exponent = text.lower().partition("e")
    if not exponent:
        return _Set(text)
    power = rf"10^{{{int(exponent)}}}"
    return _Set(power if mantissa == "1" else rf"{mantissa} \times {power}", _MUL)


def _name(name: str, tangents: frozenset[str]) -> str:
    r"""A name as mathematics writes it: `theta` and `θ` are `\theta`, `x1` is x with an index, `dt` is `\partial t`."""
    if name in tangents:
        return rf"\partial {_name(name[1:], tangents)}"
    found = _SUBSCRIPT.fullmatch(unicodedata.normalize("NFKC", name))
    if found is not None:
        return f"{_name(found[1], frozenset())}_{{{found[2]}}}{found[3]}"
    stem = name.rstrip("'")
    letter, primes = _letter(stem), name[len(stem) :]
    if letter in _GREEK:
        return rf"\{letter}{primes}"
    if stem in _NAMED:
        return _NAMED[stem] + primes
    return (stem if len(stem) == 1 else rf"\mathrm{{{_escaped(stem)}}}") + primes


def _letter(name: str) -> str:
    """The name of the Greek letter that a name is, `theta` of `θ`; another name as it is."""
    words = unicodedata.name(name, "").lower().split() if len(name) == 1 else []
    if len(words) != 4 or words[0] != "greek":
        return "lambda" if name == "lamda" else name
    found = "lambda" if words[3] == "lamda" else words[3]
    return found.capitalize() if words[1] == "capital" else found


def _escaped(text: str) -> str:
    replaced = {"\\": r"\backslash ", "^": r"\hat{\ }", "~": r"\sim ", " ": r"\ "}
    return re.sub(r"[\\_#$%&{}^~ ]", lambda found: replaced.get(found[0], rf"\{found[0]}"), text)
