"""Elementary functions of vectors: exp, log, sin, cos by polynomials, the others by the C library.

Owns `module`. The four are within 0.78, 0.83, 0.78 and 0.77 units in the last place at three million places each
(`benchmarks/calibration.py elementary`), and held to 1 by `tests/properties/test_machine_code.py`; the C library's are
within 0.52, but take two to three times as long. The argument is reduced by multiples of log 2 or pi/2 in parts whose
products are exact, what is lost is kept, and the last addition is that of a small number to a large one. Series are
those of Taylor, long enough for 2^-58 on the reduced range. (Method: Muller, Elementary Functions, ch. 11; Cody and
Waite, 1980.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping

from potto.kernels.native.vectors import LIBRARY, Vectors, bits, intrinsics

# Added to a number below 2^51, it leaves the nearest whole number in the last bits.
MAGIC = 1.5 * 2.0**52
_MAGIC_BITS = 0x4338000000000000
LOG2_E = 1.4426950408889634
# log 2 and pi/2 in parts of at most 33 bits, whose products with whole numbers below 2^20 are exact, and a rest.
LOG_2 = tuple(map(float.fromhex, ("0x1.62e42feep-1", "0x1.a39ef35793c76p-33")))
HALF_PI = tuple(map(float.fromhex, (
    "0x1.921fb544p+0", "0x1.0b4611a6p-34", "0x1.3198a2ep-69", "0x1.b839a252049c1p-104",
)))  # fmt: skip
ROOT_HALF_BITS = 0x3FE6A09E667F3BCD
FAR = 1e5  # from where on pi/2 in these parts is not enough


class _Writer(Vectors):
    """Vectors with whole numbers in them, and polynomials."""

    def add(self, a: str, b: str) -> str:
        return self.apply("add", a, b)

    def sub(self, a: str, b: str) -> str:
        return self.apply("sub", a, b)

    def mul(self, a: str, b: str) -> str:
        return self.apply("mul", a, b)

    def less(self, a: str, b: float) -> str:
        return self.apply("lt", a, self.number(b))

    def pick(self, mask: str, a: str, b: str) -> str:
        return self.apply("select", mask, a, b)

    def polynomial(self, x: str, coefficients: Iterable[float]) -> str:
        """The sum of c_k x^k, from the highest power down."""
        *rest, highest = map(self.number, coefficients)
        total = highest
        for coefficient in reversed(rest):
            total = self.add(self.mul(total, x), coefficient)
        return total

    def nearest(self, x: str) -> tuple[str, str]:
        """The nearest whole number, as a number and in the last bits of an integer."""
        moved = self.add(x, self.number(MAGIC))
        return self.sub(moved, self.number(MAGIC)), self.integer(moved)

    def integer(self, x: str) -> str:
        return self.once(f"bitcast {self.doubles} {x} to {self.whole_numbers}", x)

    def real(self, x: str) -> str:
        return self.once(f"bitcast {self.whole_numbers} {x} to {self.doubles}", x)

    def whole_op(self, code: str, a: str, b: int | str) -> str:
        other = f"splat (i64 {b})" if isinstance(b, int) else b
        return self.once(f"{code} {self.whole_numbers} {a}, {other}", a, *([b] if isinstance(b, str) else []))

    def power_of_two(self, k: str) -> str:
        """2^k for a whole number in the last bits."""
        return self.real(self.whole_op("add", self.whole_op("shl", k, 52), 1023 << 52))

    def reduced(self, x: str, k: str, parts: tuple[float, ...]) -> tuple[str, str]:
        """x - k*(sum of parts), and what that loses. All products but the last are exact."""
        high, low = x, self.number(0.0)
        for part in parts[:-1]:
            product = self.mul(k, self.number(part))
            here = self.sub(high, product)
            back = self.sub(high, here)  # what is lost: TwoSum
            lost = self.sub(self.sub(high, self.add(here, back)), self.sub(product, back))
            high, low = here, self.add(low, lost)
        low = self.sub(low, self.mul(k, self.number(parts[-1])))
        total = self.add(high, low)
        return total, self.add(self.sub(high, total), low)


def _exp(at: _Writer, x: str) -> str:
    """2^k e^r with |r| <= log(2)/2; in two steps, so that numbers near the ends of the range are reached."""
    bounded = at.apply("max", at.apply("min", x, at.number(710.0)), at.number(-746.0))
    k, _ = at.nearest(at.mul(bounded, at.number(LOG2_E)))
    r, lost = at.reduced(bounded, k, LOG_2)
    rest = at.mul(at.mul(r, r), at.polynomial(r, [1 / math.factorial(n) for n in range(2, 14)]))
    one = at.number(1.0)
    near = at.add(one, r)
    value = at.add(near, at.add(at.add(at.sub(one, near), r), at.add(rest, lost)))
    half, first = at.nearest(at.mul(k, at.number(0.5)))
    _, second = at.nearest(at.sub(k, half))
    value = at.mul(at.mul(value, at.power_of_two(first)), at.power_of_two(second))
    value = at.pick(at.apply("gt", x, at.number(709.782712893384)), at.number(math.inf), value)
    return at.pick(at.less(x, -745.2), at.number(0.0), value)


def _log(at: _Writer, x: str) -> str:
    """k log 2 + log(1 + f) with 1 + f between the roots of 1/2 and 2, and log(1 + f) = 2 artanh(f/(2 + f))."""
    small = at.less(x, 2.0**-1022)
    scaled = at.pick(small, at.mul(x, at.number(2.0**54)), x)
    raw = at.integer(scaled)
    k = at.whole_op("ashr", at.whole_op("sub", raw, ROOT_HALF_BITS), 52)
    f = at.sub(at.real(at.whole_op("sub", raw, at.whole_op("shl", k, 52))), at.number(1.0))
    power = at.sub(at.real(at.whole_op("add", k, _MAGIC_BITS)), at.number(MAGIC))
    power = at.sub(power, at.pick(small, at.number(54.0), at.number(0.0)))
    s = at.apply("div", f, at.add(at.number(2.0), f))
    z = at.mul(s, s)
    series = at.mul(z, at.polynomial(z, [2 / (2 * n + 1) for n in range(1, 13)]))  # 2 artanh(s)/s - 2
    half = at.mul(at.number(0.5), at.mul(f, f))
    rest = at.sub(half, at.add(at.mul(s, at.add(half, series)), at.mul(power, at.number(LOG_2[1]))))
    value = at.add(at.mul(power, at.number(LOG_2[0])), at.sub(f, rest))
    value = at.pick(at.apply("eq", x, at.number(0.0)), at.number(-math.inf), value)
    value = at.pick(at.less(x, 0.0), at.number(math.nan), value)
    return at.pick(at.apply("lt", x, at.number(math.inf)), value, at.pick(at.apply("eq", x, x), x, x))


def _quarters(turn: int) -> Callable[[_Writer, str], str]:
    """sin(x + turn*pi/2), for numbers that are not far."""

    def written(at: _Writer, x: str) -> str:
        k, quarter = at.nearest(at.mul(x, at.number(2 / math.pi)))
        r, lost = at.reduced(x, k, HALF_PI)
        quarter = at.whole_op("add", quarter, turn)
        z = at.mul(r, r)
        odd = at.polynomial(z, [(-1) ** n / math.factorial(2 * n + 1) for n in range(1, 10)])
        even = at.polynomial(z, [(-1) ** n / math.factorial(2 * n) for n in range(2, 11)])
        half = at.mul(at.number(0.5), z)
        # sin(r + lost) = r + (r z odd + lost (1 - z/2)); cos(r + lost) = 1 - z/2 + (z^2 even - r lost)
        sine = at.add(r, at.add(at.mul(at.mul(r, z), odd), at.mul(lost, at.sub(at.number(1.0), half))))
        near = at.sub(at.number(1.0), half)
        rest = at.sub(at.mul(at.mul(z, z), even), at.mul(r, lost))
        cosine = at.add(near, at.add(at.sub(at.sub(at.number(1.0), near), half), rest))
        value = at.pick(_bit(at, quarter, 1), cosine, sine)
        return at.pick(_bit(at, quarter, 2), at.apply("neg", value), value)

    return written


def _bit(at: _Writer, x: str, bit: int) -> str:
    masked = at.whole_op("and", x, bit)
    return at.once(f"icmp ne {at.whole_numbers} {masked}, zeroinitializer", masked)


_OURS: Mapping[str, Callable[[_Writer, str], str]] = {
    "exp": _exp, "log": _log, "sin": _quarters(0), "cos": _quarters(1),
}  # fmt: skip
_NEAR_ONLY = ("sin", "cos")


def module(at: Vectors, name: str, parameters: str) -> str:
    """A module with the function that lines are, and all that it calls."""
    (body,) = at.bodies
    texts = [text for code in at.used for text in _function(code, at)]
    if any("@gather(" in line for line in body):
        texts.append(_gather(at))
    texts.append("\n".join([f"define void @{name}({parameters}) {{", "entry:", *body, "  ret void", "}"]))
    whole = "\n".join(texts)
    return "\n".join([intrinsics(whole, at), whole, ""])


def _function(code: str, at: Vectors) -> list[str]:
    arity = LIBRARY[code]
    declared = f"declare double @{code}({', '.join(['double'] * arity)}) nounwind memory(none)"
    if code not in _OURS:
        return [declared, _one_by_one(code, f"each_{code}", arity, at)]
    if code not in _NEAR_ONLY:
        return [_ours(code, f"each_{code}", at.lanes)]
    far = (
        f"define internal {at.doubles} @each_{code}({at.doubles} %x0) {{\n"
        f"  %size = call {at.doubles} @llvm.fabs.v{at.lanes}f64({at.doubles} %x0)\n"
        f"  %far = fcmp uge {at.doubles} %size, splat (double {bits(FAR)})\n"
        f"  %any = call i1 @llvm.vector.reduce.or.v{at.lanes}i1({at.masks} %far)\n"
        "  br i1 %any, label %one, label %all\n"
        f"one:\n  %slow = call {at.doubles} @library_{code}({at.doubles} %x0)\n  ret {at.doubles} %slow\n"
        f"all:\n  %fast = call {at.doubles} @near_{code}({at.doubles} %x0)\n  ret {at.doubles} %fast\n}}"
    )
    return [declared, _one_by_one(code, f"library_{code}", 1, at), _ours(code, f"near_{code}", at.lanes), far]


def _gather(at: Vectors) -> str:
    lines, found = [], "poison"
    for i in range(at.lanes):
        lines += [
            f"  %i{i} = extractelement {at.whole_numbers} %index, i64 {i}",
            f"  %p{i} = getelementptr double, ptr %memory, i64 %i{i}",
            f"  %x{i} = load double, ptr %p{i}, align 8",
            f"  %v{i} = insertelement {at.doubles} {found}, double %x{i}, i64 {i}",
        ]
        found = f"%v{i}"
    head = f"define internal {at.doubles} @gather(ptr %memory, {at.whole_numbers} %index) {{"
    return "\n".join([head, *lines, f"  ret {at.doubles} {found}", "}"])


def _ours(code: str, name: str, lanes: int) -> str:
    at = _Writer(lanes)
    result = _OURS[code](at, "%x0")
    (body,) = at.bodies
    return "\n".join(
        [f"define internal {at.doubles} @{name}({at.doubles} %x0) {{", *body, f"  ret {at.doubles} {result}", "}"]
    )


def _one_by_one(code: str, name: str, arity: int, at: Vectors) -> str:
    """A function that calls that of the C library at each place."""
    lines = [f"define internal {at.doubles} @{name}({', '.join(f'{at.doubles} %x{i}' for i in range(arity))}) {{"]
    result = "poison"
    for lane in range(at.lanes):
        given = []
        for i in range(arity):
            lines.append(f"  %a{lane}_{i} = extractelement {at.doubles} %x{i}, i32 {lane}")
            given.append(f"double %a{lane}_{i}")
        lines.append(f"  %y{lane} = call double @{code}({', '.join(given)})")
        lines.append(f"  %r{lane} = insertelement {at.doubles} {result}, double %y{lane}, i32 {lane}")
        result = f"%r{lane}"
    return "\n".join([*lines, f"  ret {at.doubles} {result}", "}"])
