"""What each construct reads as. The trees are written by hand; spans are checked by the text that they cover."""

from __future__ import annotations

import pytest
from syntax_help import everything, expression, item
from syntax_samples import PAPER, SAMPLES

from potto.source import Span
from potto.syntax import parse_chunk, print_expression, print_item, print_type, split, walk
from potto.syntax.nodes import (
    Apply,
    Bracket,
    Chain,
    Compare,
    Definition,
    DiffeoDefinition,
    DiffeoType,
    ExpressionStatement,
    For,
    FromImport,
    FunctionType,
    If,
    Import,
    InlineDiffeo,
    Integral,
    Interval,
    Lambda,
    Let,
    ListLiteral,
    Logic,
    MeasureBound,
    Member,
    Name,
    Number,
    Operand,
    Paren,
    Power,
    Print,
    Range,
    RealType,
    Reduction,
    Tuple,
    TupleType,
    Unary,
)


def brackets(text: str) -> str:
    """An expression with every operation in parentheses: how it was read, without spans."""
    return _full(expression(text))


def _full(expr) -> str:  # type: ignore[no-untyped-def]
    match expr:
        case Chain(first=first, rest=rest) | Compare(first=first, rest=rest):
            return "(" + _full(first) + "".join(f" {o.op} {_full(o.value)}" for o in rest) + ")"
        case Power(base=base, exponent=exponent):
            return f"({_full(base)} ^ {_full(exponent)})"
        case Unary(op=op, operand=operand):
            return f"({op} {_full(operand)})"
        case Logic(op=op, operands=operands):
            return "(" + f" {op} ".join(map(_full, operands)) + ")"
        case Apply(function=function, arguments=arguments):
            return f"{_full(function)}<{', '.join(_full(a.value) for a in arguments)}>"
        case If(condition=condition, then=then, orelse=orelse):
            return f"({_full(condition)} ? {_full(then)} : {_full(orelse)})"
        case Paren(inner=inner):
            return _full(inner)
        case Lambda(groups=groups, body=body):
            return "(" + "".join("\\" + ",".join(p.name for p in group) + "." for group in groups) + _full(body) + ")"
        case _:
            return print_expression(expr)


@pytest.mark.parametrize(
    ("text", "reads"),
    [
        ("a + b - c", "(a + b - c)"),
        ("a - b*c/d", "(a - (b * c / d))"),
        ("-x^2", "(- (x ^ 2))"),
        ("2^-1", "(2 ^ (- 1))"),
        ("2^-x^2*y", "((2 ^ (- (x ^ 2))) * y)"),
        ("a^b^c", "(a ^ (b ^ c))"),
        ("-a*b", "((- a) * b)"),
        ("a - -b", "(a - (- b))"),
        ("- - a", "(- (- a))"),
        ("f x^2", "(f<x> ^ 2)"),
        ("f x y", "f<x><y>"),
        ("f (x, y) c", "f<x, y><c>"),
        ("-f x + g(y)", "((- f<x>) + g<y>)"),
        ("a < b + 1 <= c", "(a < (b + 1) <= c)"),
        ("a ≤ b ≠ c ≥ d", "(a <= b != c >= d)"),
        ("p and q or r and s", "((p and q) or (r and s))"),
        ("not p and q", "((not p) and q)"),
        ("not a < b", "(not (a < b))"),
        ("not not p", "(not (not p))"),
        ("a ? b : c ? d : e", "(a ? b : (c ? d : e))"),
        ("a or b ? c : d", "((a or b) ? c : d)"),
        ("1 + if p then a else b + c", "(1 + (p ? a : (b + c)))"),
        ("if p then a else if q then b else c", "(p ? a : (q ? b : c))"),
        (r"\x . x + 1", r"(\x.(x + 1))"),
        (r"\x.x", r"(\x.x)"),
        (r"\(x,y) . c.1", r"(\x,y.\c.1)"),
        (r"\(x,y) . c. x", r"(\x,y.\c.x)"),
        (r"\(x,y) . \c . x", r"(\x,y.(\c.x))"),
        (r"\(x,y).(a,b).x", r"(\x,y.\a,b.x)"),
        (r"\p . p.0*p.1", r"(\p.(p.0 * p.1))"),
        (r"\(p,q) . (p + q).y", r"(\p,q.(p + q).y)"),
        (r"\x . c . c.0", r"(\x.\c.c.0)"),
        ("λθ . θ", r"(\θ.θ)"),
        ("2 − 1", "(2 - 1)"),
        ("d + d*2", "(d + (d * 2))"),
        ("d(x)", "d<x>"),
        ("exp(x) [x<t]", "exp<x><[x < t]>"),
    ],
)
def test_precedence(text: str, reads: str) -> None:
    assert brackets(text) == reads


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("2", Number),
        ("1e-3", Number),
        ("2.", Number),
        ("θ_0", Name),
        ("m.f", Member),
        ("pkg.m.f", Member),
        ("[x < t]", Bracket),
        ("[a <= x < b]", Bracket),
        ("[p and q]", Bracket),
        ("[not p]", Bracket),
        ("[(x < t)]", Bracket),
        ("[x < t,]", ListLiteral),
        ("[]", ListLiteral),
        ("[a]", ListLiteral),
        ("[a, b < c]", ListLiteral),
        ("(a)", Paren),
        ("(a, b)", Tuple),
        ("f x", Apply),
        ("p ? a : b", If),
        ("diffeo(u, v)", InlineDiffeo),
        ("sum i in 1..n (i)", Reduction),
        ("let a = 1 in a", Let),
        ("integral [0, 1] x d(x)", Integral),
        ("delta(x - t)", Apply),
        ("deriv(f)", Apply),
        ("  x  # why", Name),
    ],
)
def test_forms(text: str, kind: type) -> None:
    assert isinstance(expression(text), kind)


def test_number_keeps_its_text_and_value() -> None:
    assert expression("2.50e-1") == Number(Span(0, 7), "2.50e-1", 0.25)


def test_member_knows_its_parts() -> None:
    found = expression("pkg.m.f")
    assert isinstance(found, Member)
    assert (found.path, found.name) == ("pkg.m", "f")
    assert (found.path_span, found.name_span) == (Span(0, 5), Span(6, 7))


def test_named_arguments() -> None:
    found = expression("drenderer(dc=(-2,1), dshader)")
    assert isinstance(found, Apply)
    assert found.parenthesized
    assert [argument.name for argument in found.arguments] == ["dc", None]


def test_a_long_sum_is_flat() -> None:
    found = expression(" + ".join(f"a{i}" for i in range(5000)))
    assert isinstance(found, Chain)
    assert len(found.rest) == 4999


class TestIntegrals:
    def test_bounds_and_variables(self) -> None:
        found = expression("integral ([0,1], [lo, hi]) x*y d(x, y)")
        assert isinstance(found, Integral)
        assert [print_expression(b.hi) for b in found.bounds if isinstance(b, Interval)] == ["1", "hi"]
        assert [v.name for v in found.variables] == ["x", "y"]

    def test_the_body_may_start_with_a_bracket(self) -> None:
        found = expression("integral [0,1] [x < t] d(x)")
        assert isinstance(found, Integral)
        assert isinstance(found.body, Bracket)

    def test_measures_mix_with_intervals(self) -> None:
        found = expression("integral (x ~ normal(m, s), [0, 1]) b d(x, y)")
        assert isinstance(found, Integral)
        first, second = found.bounds
        assert isinstance(first, MeasureBound)
        assert isinstance(second, Interval)
        assert (first.variable, first.measure, len(first.arguments)) == ("x", "normal", 2)

    def test_d_ends_the_innermost_integral_at_its_depth(self) -> None:
        found = expression("integral [0,1] integral [0,x] x*y d(y) d (x)")
        assert isinstance(found, Integral)
        assert isinstance(found.body, Integral)
        assert [v.name for v in found.body.variables] == ["y"]

    def test_d_deeper_in_brackets_is_a_name(self) -> None:
        found = expression("integral [0,1] (d(x) + d) d(x)")
        assert isinstance(found, Integral)
        assert print_expression(found.body) == "((d)(x) + d)"

    def test_goes_on_after_d(self) -> None:
        assert brackets("2*integral [0,1] x d(x)^2 + 1") == "((2 * (integral [0, 1] x d(x) ^ 2)) + 1)"

    @pytest.mark.parametrize("body", ["if x < t then 1 else 0", r"\y . y", "let a = x in a", "p ? 1 : x"])
    def test_open_ended_bodies(self, body: str) -> None:
        found = expression(f"integral [0,1] {body} d(x)")
        assert isinstance(found, Integral)
        assert isinstance(found.body, If | Lambda | Let)

    def test_the_sign(self) -> None:
        assert isinstance(expression("∫ [0, inf] x d(x)"), Integral)


@pytest.mark.parametrize(
    ("text", "hi", "body"),
    [
        ("sum i in 1..n (i^2)", "n", "i^2"),
        ("sum i in 1..n(i^2)", "n", "i^2"),
        ("sum i in 1..f(n)(i)", "f(n)", "i"),
        ("sum i in 1..f(n) + 1 (i)", "f(n) + 1", "i"),
        ("sum i in 1..(n) (i, 2)", "(n)", "(i, 2)"),
        ("sum i in a..-b (sum j in 1..i (j))", "-b", "sum j in 1..i (j)"),
    ],
)
def test_sum(text: str, hi: str, body: str) -> None:
    found = expression(text)
    assert isinstance(found, Reduction)
    (clause,) = found.clauses
    assert isinstance(clause.over, Range)
    assert (print_expression(clause.over.hi), print_expression(found.body)) == (hi, body)


def test_let_goes_on_at_lines_within_brackets() -> None:
    found = expression("(let a = 1\n     (b, c) = g(a)\n in a + b)")
    assert isinstance(found, Paren)
    assert isinstance(found.inner, Let)
    assert [[t.name for t in b.targets] for b in found.inner.bindings] == [["a"], ["b", "c"]]


class TestDefinitions:
    def test_groups_annotations_and_result(self) -> None:
        found = item("def f(a: Real, g: (Real*, y: Real) -> Real)(b: [Real]) -> (Real, Dist[x, y]): a")
        assert isinstance(found, Definition)
        assert [[p.name for p in group] for group in found.groups] == [["a", "g"], ["b"]]
        assert found.result is not None
        assert print_type(found.result) == "(Real, Dist[x, y])"
        second = found.groups[0][1].annotation
        assert isinstance(second, FunctionType)
        assert print_type(second) == "(Real*, y: Real) -> Real"

    @pytest.mark.parametrize(
        ("text", "kind"), [("Diffeo[2]", DiffeoType), ("(Real)", RealType), ("(Real, Real)", TupleType)]
    )
    def test_types(self, text: str, kind: type) -> None:
        found = item(f"x: {text} = 1")
        assert isinstance(found, Definition)
        assert isinstance(found.result, kind)

    @pytest.mark.parametrize(
        "head", ["def f(x)", "def f(x):", "def f (x) :", "def f(x) -> Real", "def f(x)\n    -> Real"]
    )
    def test_a_block(self, head: str) -> None:
        found = item(f"{head}\n    y = x\n\n    # why\n    (a, b) = y\n    a +\n      b\n")
        assert isinstance(found, Definition)
        assert len(found.bindings) == 2
        assert print_expression(found.body) == "a + b"

    @pytest.mark.parametrize(
        "text",
        [
            "def f(x) (x + 1)",
            "def f(x): (x + 1)",
            "def f(x) -> Real (x + 1)",
            "def f(x)\n  (x + 1)",
            "def f(x) (x\n  + 1)",
        ],
    )
    def test_a_body_in_parentheses_is_no_group_of_parameters(self, text: str) -> None:
        found = item(text)
        assert isinstance(found, Definition)
        assert len(found.groups) == 1
        assert isinstance(found.body, Paren)

    def test_curried_groups_are_written_without_a_blank(self) -> None:
        found = item("def f(x)(y) x + y")
        assert isinstance(found, Definition)
        assert len(found.groups) == 2

    def test_lines_that_can_only_continue(self) -> None:
        found = item("def f(x)\n    if x > 0\n    then x\n    else 0\n      - x")
        assert isinstance(found, Definition)
        assert isinstance(found.body, If)

    def test_a_minus_starts_a_line(self) -> None:
        found = item("def f(x)\n    y = x\n    -y")
        assert isinstance(found, Definition)
        assert isinstance(found.body, Unary)

    def test_d_on_a_line_of_its_own(self) -> None:
        found = item("def f(t)\n    integral [0, 1]\n        [x < t]\n    d(x)")
        assert isinstance(found, Definition)
        assert isinstance(found.body, Integral)


class TestDiffeomorphisms:
    def test_in_a_diffeo_file(self) -> None:
        found = item(PAPER["half_plane.diffeo"], diffeo=True)
        assert isinstance(found, DiffeoDefinition)
        assert [p.name for p in found.variables] == ["x", "y"]
        assert [[p.name for p in group] for group in found.groups] == [["c"]]
        assert [print_expression(c) for c in found.components] == ["x + y + c", "x - y + c"]

    def test_clauses_below_or_beside(self) -> None:
        for gap in (" ", "\n    "):
            found = item(f"p = \\x . x^2{gap}inverse (u) . (sqrt(u)){gap}where x > 0, x < 9", diffeo=True)
            assert isinstance(found, DiffeoDefinition)
            assert found.inverse is not None
            assert [print_expression(c) for c in found.inverse.components] == ["sqrt(u)"]
            assert len(found.where) == 2

    def test_in_a_po_file(self) -> None:
        found = item(
            "diffeo polar(x, y; c) =\n    r = x\n    (r - c, y)\n    inverse (u, v) . (u + c, v)\n    where x > 0"
        )
        assert isinstance(found, DiffeoDefinition)
        assert found.keyword
        assert len(found.bindings) == 1
        assert [[p.name for p in group] for group in found.groups] == [["c"]]
        assert found.inverse is not None

    def test_local_names_in_a_diffeo_file(self) -> None:
        found = item(r"p = \(x, y) . let r = x + y in (r, x - y)", diffeo=True)
        assert isinstance(found, DiffeoDefinition)
        assert len(found.bindings) == 1

    def test_inverse_and_where_are_names_elsewhere(self) -> None:
        assert isinstance(item("inverse = where + 1"), Definition)
        assert isinstance(item(r"inverse = \x . where + x", diffeo=True), DiffeoDefinition)
        found = item("diffeo where(x) =\n    inverse = x\n    (inverse, 2)\n    where where > 0")
        assert isinstance(found, DiffeoDefinition)
        assert (len(found.bindings), len(found.where)) == (1, 1)


class TestImportsAndStatements:
    def test_from_goes_on_by_indentation_or_in_parentheses(self) -> None:
        for text in ("from pkg.m import a,\n    b as c", "from pkg.m import (a,\n  b as c,)"):
            found = item(text)
            assert isinstance(found, FromImport)
            assert found.module == "pkg.m"
            assert [(n.name, n.alias) for n in found.names] == [("a", None), ("b", "c")]

    def test_import(self) -> None:
        found = item("import pkg.m as k")
        assert isinstance(found, Import)
        assert (found.module, found.alias) == ("pkg.m", "k")

    def test_imports_in_a_diffeo_file(self) -> None:
        assert isinstance(item("from m import a", diffeo=True), FromImport)

    @pytest.mark.parametrize("text", ["for v in xs:\n    print(v)", "for v in xs\n  print(v)", "for v in xs: print(v)"])
    def test_for(self, text: str) -> None:
        found = item(text)
        assert isinstance(found, For)
        assert isinstance(found.body[0], Print)

    def test_for_in_for(self) -> None:
        found = item("for v in p ? a : b:\n    for w in v\n        print(w, v)\n        w\n    y = v\n    y + 1")
        assert isinstance(found, For)
        inner, _, last = found.body
        assert isinstance(inner, For)
        assert len(inner.body) == 2
        assert isinstance(last, ExpressionStatement)

    def test_print(self) -> None:
        found = item("print(a, b)")
        assert isinstance(found, Print)
        assert len(found.arguments) == 2


def test_the_paper_parses_to_the_letter() -> None:
    for name, text in PAPER.items():
        for _, parsed in everything(text, name.endswith(".diffeo")):
            assert parsed.diagnostics == ()


def test_spans_lie_within_their_parents_and_operands_are_where_they_say() -> None:
    for name, text in SAMPLES.items():
        for chunk in split(text):
            parsed = parse_chunk(chunk.text, name.endswith(".diffeo"))
            assert parsed.diagnostics == (), chunk.text
            assert parsed.item is not None
            for node in walk(parsed.item):
                if isinstance(node, Operand):
                    assert chunk.text[node.op_span.start : node.op_span.end] == node.op
                    continue
                assert 0 <= node.span.start <= node.span.end <= len(chunk.text)
                if isinstance(node, Name):
                    assert chunk.text[node.span.start : node.span.end] == node.id
                if isinstance(node, Number):
                    assert chunk.text[node.span.start : node.span.end] == node.text


def test_an_item_is_printed_back() -> None:
    text = "def f(a, b: Real)(c) -> Real\n    y = a\n    y + c"
    assert print_item(item(text)) == text


def test_annotated_parameters_of_a_lambda() -> None:
    found = expression(r"\(x: Real, y) . x")
    assert isinstance(found, Lambda)
    assert isinstance(found.groups[0][0].annotation, RealType)
