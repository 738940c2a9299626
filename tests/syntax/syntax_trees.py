"""Random syntax trees for the properties: as a parser makes them, without spans and without `Paren`."""

from __future__ import annotations

from hypothesis import strategies as st

from potto.source import NOWHERE as O
from potto.syntax.nodes import (
    Apply,
    Argument,
    ArrayType,
    Binder,
    Binding,
    Bracket,
    Chain,
    Clause,
    Compare,
    Comprehension,
    DeclaredInverse,
    Definition,
    DiffeoDefinition,
    DiffeoType,
    Expr,
    ExpressionStatement,
    Field,
    Fold,
    For,
    FromImport,
    FunctionType,
    If,
    Import,
    ImportedName,
    Index,
    InlineDiffeo,
    Integral,
    Interval,
    Item,
    Lambda,
    Let,
    ListLiteral,
    Logic,
    MeasureBound,
    Member,
    Name,
    NamedType,
    Number,
    Operand,
    Parameter,
    Power,
    Print,
    Range,
    RealType,
    RecordDefinition,
    Reduction,
    Size,
    Statement,
    Tuple,
    TupleType,
    TypeExpr,
    Unary,
    With,
)

names = st.sampled_from(["a", "b", "x", "y", "θ", "px_0", "shader", "e", "deriv", "dx"])
numbers = st.sampled_from(["0", "2", "0.5", "1e-3", "12.25e2", "3."]).map(lambda t: Number(O, t, float(t)))
atoms = st.one_of(
    names.map(lambda n: Name(O, n)), numbers, st.tuples(names, names).map(lambda p: Member(O, f"m.{p[0]}", O, p[1], O))
)
distinct_names = st.lists(names, min_size=1, max_size=3, unique=True)


def _parameters(types: bool = True) -> st.SearchStrategy[tuple[Parameter, ...]]:
    annotation = st.none() | type_trees if types else st.none()
    return distinct_names.flatmap(
        lambda found: st.tuples(*(annotation.map(lambda t, n=n: Parameter(O, n, t)) for n in found))
    )


def _function_type(parts: st.SearchStrategy[TypeExpr]) -> st.SearchStrategy[TypeExpr]:
    parameter = st.tuples(st.sampled_from(["", "c"]), parts).map(lambda p: Parameter(O, *p))
    return st.tuples(st.lists(parameter, max_size=3).map(tuple), parts).map(lambda p: FunctionType(O, *p))


sizes = st.one_of(
    st.integers(0, 99).map(lambda n: Size(O, None, n)),
    st.tuples(st.sampled_from(["n", "m", "_"]), st.integers(-3, 3)).map(lambda p: Size(O, *p)),
)


def _array_type(found: tuple[list[Size], TypeExpr]) -> TypeExpr:
    return ArrayType(O, tuple(found[0]), found[1])


type_trees: st.SearchStrategy[TypeExpr] = st.recursive(
    st.sampled_from(
        [
            RealType(O, "Real", False, ()),
            RealType(O, "Real", True, ()),
            RealType(O, "Real", False, ("x", "y")),
            RealType(O, "Dist", False, ("x",)),
            DiffeoType(O, 2),
            NamedType(O, "Camera"),
            NamedType(O, "scene.Camera"),
        ]
    ),
    lambda parts: st.one_of(
        st.lists(parts, min_size=2, max_size=3).map(lambda ts: TupleType(O, tuple(ts))),
        parts.map(lambda t: ArrayType(O, (Size(O, "", 0),), t)),
        st.tuples(st.lists(sizes, min_size=1, max_size=2), parts).map(_array_type),
        _function_type(parts),
    ),
    max_leaves=4,
)


def _chain(parts: st.SearchStrategy[Expr], ops: str) -> st.SearchStrategy[Expr]:
    operand = st.tuples(st.sampled_from(ops.split()), parts).map(lambda p: Operand(p[0], O, p[1]))
    kind = Compare if "<" in ops else Chain
    return st.tuples(parts, st.lists(operand, min_size=1, max_size=3)).map(lambda p: kind(O, p[0], tuple(p[1])))


def is_condition(expr: Expr) -> bool:
    return isinstance(expr, Compare | Logic) or (isinstance(expr, Unary) and expr.op == "not")


def _call(parts: st.SearchStrategy[Expr]) -> st.SearchStrategy[Expr]:
    plain = parts.map(lambda e: Argument(O, None, None, e))
    named = distinct_names.flatmap(
        lambda found: st.tuples(*(parts.map(lambda e, n=n: Argument(O, n, O, e)) for n in found))
    )
    arguments = st.tuples(st.lists(plain, max_size=3), st.just(()) | named).map(lambda p: (*p[0], *p[1]))
    called = st.tuples(parts, arguments).map(lambda p: Apply(O, p[0], p[1], True))
    juxtaposed = st.tuples(parts, atoms).map(lambda p: Apply(O, p[0], (Argument(O, None, None, p[1]),), False))
    return called | juxtaposed


def _bindings(parts: st.SearchStrategy[Expr]) -> st.SearchStrategy[tuple[Binding, ...]]:
    targets = distinct_names.map(lambda found: tuple(Binder(O, n) for n in found))
    one = st.tuples(targets, parts).map(lambda p: Binding(O, *p))
    return st.lists(one, min_size=1, max_size=3).map(tuple)


def _integral(parts: st.SearchStrategy[Expr]) -> st.SearchStrategy[Expr]:
    def bound(name: str) -> st.SearchStrategy[Interval | MeasureBound]:
        interval = st.tuples(parts, parts).map(lambda p: Interval(O, *p))
        values = st.lists(parts, max_size=2).map(tuple)
        shaped = values.map(
            lambda v: MeasureBound(O, name, O, "normal", O, v, f"normal({', '.join('_' * len(v))})", ())
        )
        return interval | shaped

    def whole(found: list[str]) -> st.SearchStrategy[Expr]:
        binders = tuple(Binder(O, n) for n in found)
        return st.tuples(st.tuples(*map(bound, found)), parts).map(lambda p: Integral(O, p[0], p[1], binders))

    return distinct_names.flatmap(whole)


_targets = distinct_names.map(lambda found: tuple(Binder(O, n) for n in found))


def _clauses(parts: st.SearchStrategy[Expr]) -> st.SearchStrategy[tuple[Clause, ...]]:
    ranges = st.tuples(parts, parts).map(lambda p: Range(O, *p))
    one = st.tuples(names, parts | ranges).map(lambda p: Clause(O, Binder(O, p[0]), p[1]))
    return st.lists(one, min_size=1, max_size=2).map(tuple)


def _given(parts: st.SearchStrategy[Expr]) -> st.SearchStrategy[tuple[Argument, ...]]:
    return distinct_names.flatmap(
        lambda found: st.tuples(*(parts.map(lambda e, n=n: Argument(O, n, O, e)) for n in found))
    )


def _fields(parts: st.SearchStrategy[Expr]) -> st.SearchStrategy[Expr]:
    """Of what is no bare name: `a.x` is a member."""
    whole = parts.filter(lambda e: not isinstance(e, Name | Member))
    digits = st.tuples(parts, st.sampled_from(["0", "12"]))
    return (digits | st.tuples(whole, st.sampled_from(["x", "focal"]))).map(lambda p: Field(O, p[0], p[1], O))


def _inner(parts: st.SearchStrategy[Expr]) -> st.SearchStrategy[Expr]:
    lists = st.lists(parts, max_size=3).map(lambda items: ListLiteral(O, tuple(items)))
    groups = st.lists(_parameters(), min_size=1, max_size=2).map(tuple)
    return st.one_of(
        _chain(parts, "+ -"),
        _chain(parts, "* /"),
        _chain(parts, "< <= > >= == !="),
        st.tuples(parts, parts).map(lambda p: Power(O, *p)),
        st.tuples(st.sampled_from(["-", "+", "not"]), parts).map(lambda p: Unary(O, *p)),
        st.tuples(st.sampled_from(["and", "or"]), st.lists(parts, min_size=2, max_size=3)).map(
            lambda p: Logic(O, p[0], tuple(p[1]))
        ),
        lists,
        st.tuples(parts, parts).map(lambda p: Bracket(O, Compare(O, p[0], (Operand("<", O, p[1]),)))),
        st.lists(parts, min_size=2, max_size=3).map(lambda items: Tuple(O, tuple(items))),
        st.tuples(parts, parts, parts, st.sampled_from(["if", "?:"])).map(lambda p: If(O, *p)),
        st.tuples(groups, parts).map(lambda p: Lambda(O, *p)),
        _call(parts),
        _integral(parts),
        st.tuples(st.sampled_from(["sum", "product", "min", "max"]), _clauses(parts), parts).map(
            lambda p: Reduction(O, *p)
        ),
        st.tuples(_targets, parts, _clauses(parts), parts).map(lambda p: Fold(O, *p)),
        st.tuples(parts, _clauses(parts)).map(lambda p: Comprehension(O, *p)),
        st.tuples(parts, st.lists(parts.filter(lambda e: not is_condition(e)), min_size=1, max_size=2)).map(
            lambda p: Index(O, p[0], tuple(p[1]))
        ),
        _fields(parts),
        st.tuples(parts, _given(parts)).map(lambda p: With(O, *p)),
        st.tuples(_bindings(parts), parts).map(lambda p: Let(O, *p)),
        st.lists(parts, min_size=1, max_size=2).map(lambda items: InlineDiffeo(O, tuple(items))),
    )


expressions: st.SearchStrategy[Expr] = st.recursive(atoms, _inner, max_leaves=12)


def _statements() -> st.SearchStrategy[Statement]:
    simple = st.one_of(
        st.lists(expressions, max_size=2).map(lambda items: Print(O, tuple(items))),
        expressions.filter(lambda e: not (isinstance(e, Apply) and e.function == Name(O, "print"))).map(
            lambda e: ExpressionStatement(O, e)
        ),
    )
    body = simple | _bindings(expressions).map(lambda found: found[0])
    loop = st.tuples(names, expressions, st.lists(body, min_size=1, max_size=3)).map(
        lambda p: For(O, Binder(O, p[0]), p[1], tuple(p[2]))
    )
    return simple | loop


def _definitions() -> st.SearchStrategy[Item]:
    groups = distinct_names.map(lambda found: tuple((Parameter(O, n),) for n in found))
    typed = distinct_names.flatmap(
        lambda found: st.tuples(*(type_trees.map(lambda t, n=n: Parameter(O, n, t)) for n in found))
    )
    records = st.tuples(st.sampled_from(["Camera", "record", "a"]), typed).map(
        lambda p: RecordDefinition(O, p[0], O, p[1])
    )
    blocks = st.just(()) | _bindings(expressions)
    keyword = st.tuples(names, groups, st.none() | type_trees, blocks, expressions).map(
        lambda p: Definition(O, p[0], O, p[1], p[2], p[3], p[4], True)
    )
    plain = st.tuples(names, st.none() | type_trees, expressions).map(
        lambda p: Definition(O, p[0], O, (), p[1], (), p[2], False)
    )
    return keyword | plain | records


def _diffeos() -> st.SearchStrategy[Item]:
    components = st.lists(expressions, min_size=2, max_size=3).map(tuple)
    inverse = st.tuples(_parameters(types=False), components).map(lambda p: DeclaredInverse(O, *p))
    variables = distinct_names.map(lambda found: tuple(Parameter(O, n) for n in found))
    where = st.lists(expressions, max_size=2).map(tuple)
    blocks = st.just(()) | _bindings(expressions)
    return st.tuples(names, variables, st.booleans(), blocks, components, st.none() | inverse, where).map(
        lambda p: DiffeoDefinition(
            O, p[0], O, p[1], ((Parameter(O, "k"),),) if p[2] else (), p[3], p[4], p[5], p[6], True
        )
    )


def _imports() -> st.SearchStrategy[Item]:
    dotted = st.sampled_from(["m", "pkg.m"])
    aliases = st.none() | names
    taken = st.tuples(names, aliases).map(lambda p: ImportedName(O, p[0], O, p[1], None if p[1] is None else O))
    some = st.tuples(dotted, st.lists(taken, min_size=1, max_size=3)).map(lambda p: FromImport(O, p[0], O, tuple(p[1])))
    whole = st.tuples(dotted, aliases).map(lambda p: Import(O, p[0], O, p[1], None if p[1] is None else O))
    return some | whole


items: st.SearchStrategy[Item] = st.one_of(_definitions(), _diffeos(), _statements(), _imports())
