"""Core terms as text that reads like Potto.

Owns `format_term`, `format_equation` and `sides_of`. The text has the parentheses that its meaning needs, and those
around integrals and sums among factors; a branch between 1 and 0 is an Iverson bracket, its surface turned so that it
reads as a comparison (`[x < t]` for t - x).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import reduce

from msgspec import Struct

from potto.core.consing import Base, short_text
from potto.core.copies import names_of_copies, renamed
from potto.core.numerals import Numbers, decimal, numeral
from potto.core.terms import (
    ONE,
    ZERO,
    App,
    Array,
    Branch,
    Const,
    Data,
    Delta,
    Deriv,
    Fold,
    Global,
    Hole,
    If,
    Index,
    Integral,
    Lam,
    Length,
    ListOf,
    Prim,
    Proj,
    Sum,
    Term,
    Tuple,
    Var,
    postorder,
    unknown,
)

# How tightly a text holds together; an operand looser than its place needs parentheses.
_OPEN, _OR, _AND, _NOT, _COMPARE, _ADD, _SIGN, _MUL, _POW, _ATOM = range(10)
_COMPARISONS = {"lt": "<", "le": "<=", "eq": "==", "ne": "!="}
_LOGIC = {"and": _AND, "or": _OR}
_NUMBER = re.compile(r"-?[\d.]+(e[-+]?\d+)?(/\d+)?")
_NAME = re.compile(r"[^\W\d][\w.]*")  # or a part of what has one
_LIKE_A_HEAD = re.compile(r"[^\W\d][\w']*\.\d")  # `c.2`, which begins a function of c where a function's head ends


class _Chain(Struct, frozen=True):
    """What a condition begins with, `low < ... < high`: `rising` is its text, `rest` what comes after it."""

    low: str
    high: str
    rising: str
    rest: str


class _Text(Struct, frozen=True):
    """A printed term; if it is 1 or 0 by a condition, that condition; if it is one, the comparisons it begins with."""

    text: str
    holds: int
    condition: _Text | None = None
    chain: _Chain | None = None

    def at(self, place: int) -> str:
        return self.text if self.holds >= place else f"({self.text})"


_Texts = dict[Term, _Text]


_LIMIT = 20_000  # characters of a part that is written
LONGEST = 120  # characters of a term that a message shows whole
LEFT_OUT = "..."  # what stands for a part that is too long to be written


def abridged(term: Term) -> str:
    """A term that fits a line of a message, by its beginning and its end."""
    return shortened(format_term(term))


def shortened(text: str) -> str:
    """The same of a text."""
    if len(text) <= LONGEST:
        return text
    return f"{text[: LONGEST // 2]} … {text[-LONGEST // 3 :]} ({len(text):,} characters)"


def format_term(term: Term, limit: int = _LIMIT, numbers: Numbers = Numbers.STORED) -> str:
    """A term as Potto source on one line. Parts longer than `limit` characters are `LEFT_OUT`.

    Copies of bound variables, which have names that nobody can write (`k'1`), get names that one can (`k1`).
    """
    return _texts(term, limit, numbers)[term].text


def format_equation(surface: Term, variables: Iterable[str] = (), numbers: Numbers = Numbers.STORED) -> str:
    """Where a surface is 0, as people write it, whatever its sign: `x = t` for t - x.

    A name that stands alone comes first, of two one of the `variables`; else what is longer, and a number last.
    """
    match surface:
        case Prim(op="neg", args=(inner,)):
            surface = inner
        case _:
            pass
    less, more, _ = _sides(surface, _texts(surface, _LIMIT, numbers))

    def place(side: str) -> tuple[bool, bool, bool, int]:
        alone = _NAME.fullmatch(side) is not None
        return _NUMBER.fullmatch(side) is not None, not alone, side not in variables, 0 if alone else -len(side)

    return " = ".join(sorted(sorted((less, more), reverse=True), key=place))


def sides_of(surface: Term) -> tuple[str, str]:
    """The lower and the higher side of `surface > 0` as it is written: `x` and `t` for t - x."""
    less, more, _ = _sides(surface, _texts(surface, _LIMIT, Numbers.STORED))
    return less, more


# What terms without copies are written as: whoever looks for the shortest formula asks for the same parts all the time.
_KNOWN: dict[tuple[int, Numbers], _Texts] = {}
_KEPT = 1 << 14


def _texts(term: Term, limit: int, numbers: Numbers) -> _Texts:
    known = _KNOWN.setdefault((limit, numbers), {})
    if len(known) > _KEPT:
        known.clear()
    nodes: tuple[Term, ...] = tuple(unknown(term, known))
    names = names_of_copies(nodes)
    if names:
        known, nodes = {}, tuple(postorder(term))
        names = names_of_copies(nodes)
    for node in nodes:
        text = _number(node, numbers) or _node(node if not names else renamed(node, names), known)
        known[node] = text if len(text.text) <= limit else _Text(LEFT_OUT, _ATOM)
    return known


@short_text.register(Base)
def _short(term: Term) -> str:
    return format_term(term, 200)


def _number(node: Term, numbers: Numbers) -> _Text | None:
    """A number, or a quotient that is written as one; None for other terms."""
    match node:
        case Const(name=None, value=value):
            return _numeral(numeral(value, numbers))
        case Prim(op="div", args=(Const(name=None, value=top), Const(name=None, value=below))):
            whole = decimal(top, below) if numbers is Numbers.DECIMALS else None
            return None if whole is None else _numeral(numeral(whole, numbers))
        case _:
            return None


def _numeral(text: str) -> _Text:
    return _Text(text, _SIGN if text.startswith("-") else _MUL if "/" in text else _ATOM)


def _opposite(number: str) -> str:
    return "0" if number == "0" else number[1:] if number.startswith("-") else f"-{number}"


def _node(node: Term, texts: _Texts) -> _Text:
    match node:
        case Const() | Var() | Global():
            return _Text(str(node.name), _ATOM)
        case Prim():
            return _builtin(node, texts)
        case If():
            text = f"if {texts[node.condition].text} then {texts[node.then].text} else {texts[node.orelse].text}"
            return _Text(text, _OPEN)
        case Branch():
            return _branch(node, texts)
        case Tuple(items=items):
            comma = "," if len(items) == 1 else ""
            return _Text(f"({_list(items, texts)}{comma})", _ATOM)
        case ListOf(items=items):
            return _Text(f"[{_list(items, texts)}]", _ATOM)
        case Proj():
            return _projection(node, texts)
        case Delta(coordinates=coordinates):
            return _Text(f"delta({_list(coordinates, texts)})", _ATOM)
        case Deriv(function=function):
            return _Text(f"deriv({texts[function].text})", _ATOM)
        case Hole():
            return _Text("?", _ATOM)
        case Index(array=whole, index=place):
            return _Text(f"{texts[whole].at(_ATOM)}[{texts[place].text}]", _ATOM)
        case Length(array=whole):
            return _Text(f"len({texts[whole].text})", _ATOM)
        case Data(path=path, column=column):
            return _Text(f'load("{path}")' + (f".{column}" if column else ""), _ATOM)
        case Lam() | App() | Integral() | Sum() | Array() | Fold():
            return _binder(node, texts)


def _binder(node: Lam | App | Integral | Sum | Array | Fold, texts: _Texts) -> _Text:
    match node:
        case Lam(params=params):
            group = params[0] if len(params) == 1 else f"({', '.join(params)})"
            body = texts[node.body].text
            body = f"({body})" if _LIKE_A_HEAD.match(body) else body
            return _Text(f"\\{group} . {body}", _OPEN)
        case App(function=function, args=args):
            return _Text(f"{texts[function].at(_ATOM)}({_list(args, texts)})", _ATOM)
        case Integral():
            pairs = ", ".join(f"[{texts[lo].text}, {texts[hi].text}]" for lo, hi in node.bounds)
            bounds = pairs if len(node.bounds) == 1 else f"({pairs})"
            return _Text(f"integral {bounds} {texts[node.body].text} d({', '.join(node.variables)})", _SIGN)
        case Sum():
            limits = f"{texts[node.lo].at(_ADD)}..{texts[node.hi].at(_ADD)}"
            return _Text(f"sum {node.variable} in {limits} ({texts[node.body].text})", _SIGN)
        case Array():
            return _Text(f"[{texts[node.body].text} for {node.variable} in 0..{_last(node.size, texts)}]", _ATOM)
        case Fold():
            limits = f"{texts[node.lo].at(_ADD)}..{texts[node.hi].at(_ADD)}"
            head = f"fold {node.state} = {texts[node.start].text} for {node.variable} in {limits}"
            return _Text(f"{head} ({texts[node.body].text})", _SIGN)


def _last(size: Term, texts: _Texts) -> str:
    """The last place of an array: `n - 1`, and of `n + 1` elements `n`."""
    match size:
        case Const(name=None, value=value):
            return numeral(value - 1, Numbers.STORED)
        case Prim(op="add", args=(*rest, Const(name=None, value=value))) if rest:
            last = [texts[part] for part in rest]
            return _sum([*last, *([_numeral(numeral(value - 1, Numbers.STORED))] if value != 1 else [])])
        case _:
            return f"{texts[size].at(_ADD)} - 1"


def _list(items: tuple[Term, ...], texts: _Texts) -> str:
    return ", ".join(texts[item].text for item in items)


def _projection(node: Proj, texts: _Texts) -> _Text:
    """`fst` and `snd` are of pairs alone."""
    return _Text(f"{texts[node.term].at(_ATOM)}.{node.index}", _ATOM)


def _builtin(node: Prim, texts: _Texts) -> _Text:
    parts = [texts[a] for a in node.args]
    match node.op:
        case "add":
            return _Text(_sum(parts), _ADD)
        case "neg":
            return _Text(f"-{parts[0].at(_MUL)}", _SIGN)
        case "mul":
            return _product("*", parts)
        case "div":
            return _product("/", parts)
        case "pow":
            return _Text(f"{parts[0].at(_ATOM)}^{parts[1].at(_POW)}", _POW)
        case "not":
            return _Text(f"not {parts[0].at(_NOT)}", _NOT)
        case "and" | "or":
            place = _LOGIC[node.op]
            return _Text(f" {node.op} ".join(p.at(place) for p in parts), place)
        case op if op in _COMPARISONS:
            return _Text(f"{parts[0].at(_ADD)} {_COMPARISONS[op]} {parts[1].at(_ADD)}", _COMPARE)
        case op:
            return _Text(f"{op}({_list(node.args, texts)})", _ATOM)


def _product(sign: str, parts: list[_Text]) -> _Text:
    # A minus sign in front of the first factor is one in front of the product.
    first = parts[0].at(_SIGN if parts[0].text.startswith("-") else _MUL)
    return _Text(sign.join([first, *(p.at(_POW) for p in parts[1:])]), _SIGN if first.startswith("-") else _MUL)


def _sum(parts: list[_Text]) -> str:
    texts = [part.at(_ADD if i == 0 else _SIGN) for i, part in enumerate(parts)]
    if texts[0].startswith("-"):  # 1 - x rather than -x + 1
        first = next((i for i, text in enumerate(texts) if not text.startswith("-")), 0)
        texts.insert(0, texts.pop(first))
    pieces = texts[:1]
    for text in texts[1:]:
        # What starts with a minus sign is a number or a product, so that the sign belongs to all of it.
        pieces.append(f" - {text[1:]}" if text.startswith("-") else f" + {text}")
    return "".join(pieces)


# Conditions


def _branch(node: Branch, texts: _Texts) -> _Text:
    then, orelse = texts[node.then], texts[node.orelse]
    condition = _combined(node, then, orelse, texts)
    if condition is not None:
        return _Text(f"[{condition.text}]", _ATOM, condition)
    if len(node.coordinates) > 1 and not node.strict:
        return _Text(f"if diffeo({_list(node.coordinates, texts)}) then {then.text} else {orelse.text}", _OPEN)
    tests, inner = [_comparison(node, True, texts)], node.then
    while isinstance(inner, Branch) and inner.orelse is node.orelse and len(inner.coordinates) == 1:
        tests.append(_comparison(inner, True, texts))
        inner = inner.then
    test = reduce(lambda rest, first: _joined("and", first, rest), reversed(tests))
    return _Text(f"if [{test.text}] then {texts[inner].text} else {orelse.text}", _OPEN)


def _combined(node: Branch, then: _Text, orelse: _Text, texts: _Texts) -> _Text | None:
    """The condition under which a branch is 1, if it is 0 elsewhere."""
    if node.then is ONE and node.orelse is ZERO:
        return _comparison(node, True, texts)
    if node.then is ZERO and node.orelse is ONE:
        return _comparison(node, False, texts)
    if node.orelse is ZERO and then.condition is not None:
        return _joined("and", _comparison(node, True, texts), then.condition)
    if node.then is ONE and orelse.condition is not None:
        return _joined("or", _comparison(node, True, texts), orelse.condition)
    if node.then is ZERO and orelse.condition is not None:
        return _joined("and", _comparison(node, False, texts), orelse.condition)
    if node.orelse is ONE and then.condition is not None:
        return _joined("or", _comparison(node, False, texts), then.condition)
    return None


def _joined(word: str, first: _Text, second: _Text) -> _Text:
    """Both conditions, or one of them; what two comparisons share stands between them: `0 < x < 1`."""
    place = _LOGIC[word]
    a, b = first.chain, second.chain
    if word == "and" and a and b and a.high == b.low and not a.rest:
        rising = a.rising + b.rising.removeprefix(b.low)
        chain = _Chain(a.low, b.high, rising, b.rest)
        return _Text(rising + b.rest, place if b.rest else _COMPARE, None, chain)
    rest = f" {word} {second.at(place)}"
    leads = _Chain(a.low, a.high, a.rising, a.rest + rest) if a and word == "and" else None
    return _Text(first.at(place) + rest, place, None, leads)


def _comparison(node: Branch, holds: bool, texts: _Texts) -> _Text:
    """That a branch's surface is on the side of `then` (or of `orelse`), as a comparison."""
    less, more, greater_first = _sides(node.surface, texts)
    equals = "" if node.strict == holds else "="
    low, high = (less, more) if holds else (more, less)
    chain = _Chain(low, high, f"{low} <{equals} {high}", "")
    if greater_first == holds:
        return _Text(f"{high} >{equals} {low}", _COMPARE, None, chain)
    return _Text(chain.rising, _COMPARE, None, chain)


def _sides(surface: Term, texts: _Texts) -> tuple[str, str, bool]:
    """less, more with surface = more - less, and whether to write the greater one first: what is taken away against
    what is added, with a number where it has no minus sign; against the number, where there is only one of the two."""
    parts = surface.args if isinstance(surface, Prim) and surface.op == "add" else (surface,)
    numbers = [texts[p].text for p in parts if _is_number(p)]
    if len(numbers) == len(parts):
        return "0", texts[surface].at(_ADD), True
    others = [p for p in parts if not _is_number(p)]
    taken = [texts[p.args[0]] for p in others if isinstance(p, Prim) and p.op == "neg"]
    added = [texts[p] for p in others if not (isinstance(p, Prim) and p.op == "neg")]
    if taken and added:
        for number in numbers:
            (taken if number.startswith("-") else added).append(_numeral(number.removeprefix("-")))
        return _sum(taken), _sum(added), False
    if taken:
        return _sum(taken), _sum(list(map(_numeral, numbers))) if numbers else "0", False
    return _sum([_numeral(_opposite(number)) for number in numbers]) if numbers else "0", _sum(added), True


def _is_number(term: Term) -> bool:
    """Whether a side of a comparison can be this: a number or a fraction."""
    match term:
        case Prim(op="neg", args=(Prim(op="div") as part,)) | (Prim(op="div") as part):
            return all(isinstance(arg, Const) and arg.name is None for arg in part.args)
        case _:
            return isinstance(term, Const) and term.name is None
