"""Addition, multiplication, division and powers: the builtins that programs write as operators, and `pow`."""

from __future__ import annotations

from potto.core.terms import ONE, ZERO, Const, Term, div, if_, mul, neg, pow_, prim, sub
from potto.primitives.registry import Primitive, Terms, register
from potto.primitives.sizes import of_power, of_product, of_quotient, of_same_size, of_sum


def _product_partials(*args: Term) -> Terms:
    return tuple(mul(*args[:i], *args[i + 1 :]) for i in range(len(args)))


def _quotient_partials(a: Term, b: Term) -> Terms:
    # Not a/b^2: b^2 overflows or vanishes long before the quotient does. One division less than (a/b)/b.
    rate = div(ONE, b)
    return rate, neg(mul(div(a, b), rate))


def _power_partials(base: Term, exponent: Term) -> Terms:
    # Where the exponent is 0 the power is 1 everywhere, but 0 * base^(-1) is nan at base 0; where the power is 0 it
    # stays so as a positive exponent moves, but 0 * log(0) is nan. At 0^0 it falls from infinity by 1 to 0.
    power = prim("pow", base, exponent)
    by_base = if_(prim("eq", exponent, ZERO), ZERO, mul(exponent, pow_(base, sub(exponent, ONE))))
    by_exponent = if_(prim("eq", power, ZERO), ZERO, mul(power, prim("log", base)))
    return by_base, by_exponent


PLAIN_POWER = 64.0  # up to this power a number falls, from 1 on, no faster than polynomials can follow


def _power_edges(base: Term, exponent: Term) -> Terms:
    """At base 0, unless the exponent is a natural number."""
    whole = isinstance(exponent, Const) and exponent.value >= 0 and exponent.value.is_integer()
    return () if whole else (base,)


def _power_exponents(base: Term, exponent: Term) -> Terms:
    """The exponent of it as an exponential; none where it is a power that polynomials can follow."""
    if base.free and isinstance(exponent, Const) and abs(exponent.value) <= PLAIN_POWER:
        return ()
    return (mul(exponent, prim("log", prim("abs", base))),)


add = register(
    Primitive(
        "add",
        arity=None,
        numpy="add",
        mpmath="potto.total",
        scalar="potto.total",
        surface=False,
        doc="The sum of its arguments.",
        magnitude=of_sum,
        partials=lambda *args: (ONE,) * len(args),
        domain=((-1e6, 1e6),),
        example="1 + 2 + 3",
    )
)

mul_ = register(
    Primitive(
        "mul",
        arity=None,
        numpy="multiply",
        mpmath="potto.product",
        scalar="potto.product",
        surface=False,
        doc="The product of its arguments.",
        magnitude=of_product,
        partials=_product_partials,
        domain=((-1e6, 1e6),),
        example="2*3*4",
    )
)

neg_ = register(
    Primitive(
        "neg",
        arity=1,
        numpy="negative",
        mpmath="operator.neg",
        scalar="operator.neg",
        ulp=0.0,
        roots=(0.0,),
        parity=-1,
        surface=False,
        doc="The number with the other sign.",
        magnitude=of_same_size,
        partials=lambda x: (neg(ONE),),
        domain=((-1e6, 1e6),),
        inverse=lambda y: (neg(y),),
        increasing=-1,
        example="-3",
    )
)

div_ = register(
    Primitive(
        "div",
        arity=2,
        numpy="divide",
        mpmath="potto.divide",
        scalar="operator.truediv",
        broken=True,
        surface=False,
        doc="The quotient of two numbers.",
        magnitude=of_quotient,
        partials=_quotient_partials,
        domain=((-1e6, 1e6), (1e-6, 1e6)),
        edges=lambda a, b: (b,),
        example="1/4",
    )
)

pow_entry = register(
    Primitive(
        "pow",
        arity=2,
        numpy="power",
        mpmath="potto.power",
        scalar="math.pow",
        broken=True,
        topic="Roots, exponentials, logarithms, powers",
        doc="A base to a real exponent, the same as `base ^ exponent`. A negative base takes whole exponents only.",
        magnitude=of_power,
        partials=_power_partials,
        domain=((1e-3, 1e3), (-20.0, 20.0)),
        edges=_power_edges,
        exponents=_power_exponents,
        steep=lambda base, exponent: not isinstance(exponent, Const) or 0 < exponent.value < 1,
        example="pow(2, 10)",
    )
)
