"""Close bounds hold what a formula is worth in exact arithmetic, and are within those that hold what is computed."""

from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from potto.core.terms import Const, Prim, Term, Var, const, postorder, prim, var
from potto.integrate.rules.intervals import CLOSE_INTERVALS, INTERVALS, marked

NUMBERS = st.integers(-(2**53), 2**53).map(lambda k: k * 2.0**-51)
LEAVES = st.sampled_from([var("x"), var("y"), const(0.1), const(-3.0)])


def grown(parts: st.SearchStrategy[Term]) -> st.SearchStrategy[Term]:
    several = st.lists(parts, min_size=2, max_size=4)
    return st.one_of(
        several.map(lambda args: prim("add", *args)),
        several.map(lambda args: prim("mul", *args)),
        st.tuples(parts, parts).map(lambda args: prim("div", *args)),
        parts.map(lambda arg: prim("neg", arg)),
        st.tuples(parts, st.sampled_from([2.0, 3.0])).map(lambda args: prim("pow", args[0], const(args[1]))),
    )


def exact(term: Term, env: dict[str, Fraction]) -> Fraction:
    match term:
        case Const(value=value):
            return Fraction(value)
        case Var(name=name):
            return env[name]
        case Prim(op=op, args=args):
            numbers = [exact(arg, env) for arg in args]
    first, *others = numbers
    for number in others:
        first = {
            "add": lambda a, b: a + b,
            "mul": lambda a, b: a * b,
            "div": lambda a, b: a / b,
            "pow": lambda a, b: a ** int(b),
        }[op](first, number)
    return -first if op == "neg" else first


@given(st.recursive(LEAVES, grown, max_leaves=12), NUMBERS, NUMBERS)
def test_hold_the_exact_value(term: Term, x: float, y: float):
    env = {"x": marked(x, x), "y": marked(y, y)}
    (low, high), (least, most) = (arithmetic.walk((term,), env, {})[0] for arithmetic in (CLOSE_INTERVALS, INTERVALS))
    sizes = [abs(end) for node in postorder(term) for end in INTERVALS.walk((node,), env, {})[0]]
    if not all(size == 0 or 1e-200 < size < 1e200 for size in sizes):
        return  # no value, or beneath what rounding is relative to
    value = exact(term, {"x": Fraction(x), "y": Fraction(y)})
    assert Fraction(float(low)) <= value <= Fraction(float(high))
    assert least <= low and high <= most


def test_are_close():
    """0.1 x + y at 3 and 0.5: two roundings of at most 2^-54, and what widens the bounds by as much again."""
    term = prim("add", prim("mul", const(0.1), var("x")), var("y"))
    low, high = CLOSE_INTERVALS.walk((term,), {"x": marked(3.0, 3.0), "y": marked(0.5, 0.5)}, {})[0]
    assert 0 < high - low <= 8 * 2.0**-53
