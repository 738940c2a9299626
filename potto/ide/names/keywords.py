"""The words of the language for people: what each keyword means, what completion writes for it, letters by name.

Owns `KEYWORDS`, `SPECIALS` and `LETTERS`. Builtins and measures say for themselves what they are, in their registries.
"""

from __future__ import annotations

from typing import Literal

from msgspec import Struct

Where = Literal["top", "expression", "clause"]


class Keyword(Struct, frozen=True):
    """A keyword: what it means, how it is used, and the snippet that writes it. `where`: what it may begin."""

    name: str
    doc: str
    form: str
    snippet: str
    where: Where


_ALL = (
    Keyword("def", "Defines a function. The last line of its block is its result; a further group of parameters makes "
            "it curried.", "def f(a, b)\n    a + b", "def ${1:name}(${2:x})\n    ${0:x}", "top"),
    Keyword("diffeo", "Defines a diffeomorphism of the variables before the `;`, with the parameters after it; or, in "
            "an expression, makes a condition of coordinates. It holds where the first coordinate is at least 0. "
            "Coordinates that are left out are completed.",
            "diffeo half(x, y; c) = (x + y + c, x - y)", "diffeo ${1:name}(${2:x, y}; ${3:c}) = (${0:x + c, y})",
            "top"),
    Keyword("from", "Imports names from a module: a file beside this one or under a root of the workspace.",
            "from m import f, g as h", "from ${1:module} import ${0:name}", "top"),
    Keyword("import", "Imports a module; its definitions are then written `m.f`.", "import m as k",
            "import ${0:module}", "top"),
    Keyword("for", "Runs statements for each element of an array, at the top of a script. In an array or a fold: "
            "what it goes through.",
            "for v in [1, 2]:\n    print(f(v))", "for ${1:v} in ${2:list}:\n    ${0:print(v)}", "top"),
    Keyword("print", "Prints values, at the top of a script.", "print(f(1))", "print(${0})", "top"),
    Keyword("integral", "An integral over bounds, one interval for each variable; the first variable is the "
            "outermost. Its derivative counts what happens inside and on the surfaces at which the body jumps.",
            "integral ([0, 1], [0, 1]) body d(x, y)", "integral [${1:0}, ${2:1}] ${0:body} d(${3:x})", "expression"),
    Keyword("sum", "A sum over whole numbers or the elements of an array.", "sum i in 1..n (1/i)",
            "sum ${1:i} in ${2:1}..${3:n} (${0:i})", "expression"),
    Keyword("product", "A product over whole numbers or the elements of an array; `min` and `max` are written alike.",
            "product i in 1..n (i)", "product ${1:i} in ${2:1}..${3:n} (${0:i})", "expression"),
    Keyword("fold", "A state that is updated for each whole number in a range, or for each element of an array. It "
            "is differentiated as it runs.", "fold s = 0 for i in 1..n (s/2 + i)",
            "fold ${1:s} = ${2:0} for ${3:i} in ${4:1}..${5:n} (${0:s})", "expression"),
    Keyword("record", "Defines a record: a tuple whose parts have names. Its name makes one, by name or by place.",
            "record Camera(eye: (Real, Real), focal: Real)", "record ${1:Name}(${2:x}: ${0:Real})", "top"),
    Keyword("if", "A conditional. A plain condition must not vary with a variable of integration; a diffeomorphism, "
            "or a comparison in brackets, may: its boundary term is counted.", "if [x < t] then a else b",
            "if ${1:condition} then ${2:a} else ${0:b}", "expression"),
    Keyword("then", "What a conditional gives where its condition holds.", "if p then a else b", "then ", "clause"),
    Keyword("else", "What a conditional gives where its condition does not hold.", "if p then a else b", "else ",
            "clause"),
    Keyword("let", "Names a value for the expression after `in`.", "let a = 1 in a + a",
            "let ${1:a} = ${2:1} in ${0:a}", "expression"),
    Keyword("in", "Ends the names of a `let`, or says what `for` and `sum` go through.", "let a = 1 in a", "in ",
            "clause"),
    Keyword("and", "Holds where both conditions hold.", "[a < x and x < b]", "and ", "clause"),
    Keyword("or", "Holds where at least one of the conditions holds.", "[x < a or b < x]", "or ", "clause"),
    Keyword("not", "Holds where the condition does not.", "[not x < a]", "not ", "expression"),
    Keyword("as", "Another name for what is imported.", "from m import f as g", "as ", "clause"),
    Keyword("inverse", "The inverse of a diffeomorphism, from its author: from values of the coordinates back to the "
            "variables. It is verified.", "inverse (u, v) . (u + v, u - v)",
            "inverse (${1:u, v}) . (${0:u, v})", "clause"),
    Keyword("where", "Conditions that select the branch on which a diffeomorphism is used: a box, or a sign.",
            "where x > 0", "where ${0:x > 0}", "clause"),
    Keyword("d", "The variables of an integral, the outermost first.", "integral [0, 1] x d(x)", "d(${0:x})", "clause"),
)  # fmt: skip

KEYWORDS: dict[str, Keyword] = {keyword.name: keyword for keyword in _ALL}


class Special(Struct, frozen=True):
    """A builtin that is not a function of numbers: its type for people to read, and what it does."""

    name: str
    type: str
    doc: str
    derivative: str
    example: str
    parameters: tuple[str, ...] = ("x",)


_SPECIALS = (
    Special("deriv", "(A -> B) -> D A -> D B", "The derivative of a function: it takes duals `(value, tangent)` under "
            "the names of the parameters with a `d` in front and gives the dual of the result. A plain number stands "
            "for one with tangent 0.", "", "deriv(f)(dc=(0.5, 1))", ("f",)),
    Special("D", "(A -> B) -> A -> B", "The derivative of a function by its first parameter, `D(f)(0.3)`, or by the "
            "one that is named, `D(f, c)(0.3, 2)`. It takes what the function takes.", "", "D(\\t . t^2)(3)",
            ("f", "parameter")),
    Special("grad", "(A -> Real) -> A -> A", "The derivatives of a function by all its parameters, or by those that "
            "are named, `grad(f, a, b)`: a tuple in their order. Of a tuple, an array or a record they have its shape.",
            "", "grad(\\(a, b) . a*b)(2, 3)", ("f", "parameters")),
    Special("delta", "Real -> Dist", "The Dirac delta of a diffeomorphism's first coordinate. It has a meaning under "
            "an integral over the variables that it varies with.", "", "integral [0, 1] x*delta(x - 0.5) d(x)"),
    Special("fst", "(a, b) -> a", "The first part of a tuple.", "d fst(p) = fst(dp)", "fst((1, 2))", ("p",)),
    Special("snd", "(a, b) -> b", "The second part of a tuple.", "d snd(p) = snd(dp)", "snd((1, 2))", ("p",)),
    Special("len", "[n] a -> Real", "How many elements an array has.", "", "len([1, 2, 3])", ("xs",)),
    Special("dot", "([n] Real, [n] Real) -> Real", "The inner product of two vectors, tuples or arrays of one size.",
            "d dot(u, v) = dot(du, v) + dot(u, dv)", "dot((1, 2), (3, 4))", ("u", "v")),
    Special("norm", "[n] Real -> Real", "The length of a vector, a tuple or an array of numbers.",
            "d norm(u) = dot(u, du)/norm(u)", "norm((3, 4))", ("u",)),
    Special("cross", "((Real, Real, Real), (Real, Real, Real)) -> (Real, Real, Real)",
            "The cross product of two vectors of three numbers, tuples or arrays.",
            "d cross(u, v) = cross(du, v) + cross(u, dv)", "cross((1, 0, 0), (0, 1, 0))", ("u", "v")),
    Special("interp", "(xs: [n] Real, ys: [n] a, x: Real*) -> a",
            "Linear between the values `ys` at the places `xs`, which must increase, and constant beyond them. "
            "The places are kinks that the integrator knows. The values may be tuples, arrays or records.",
            "", "interp([0, 1, 3], [10, 20, 0], 2)", ("xs", "ys", "x")),
    Special("image", "(photo: [h, w] a, u: Real*, v: Real*) -> a",
            "Bilinear between the centres of pixels, `u` from 0 to 1 along the rows and `v` from 0 to 1 "
            "down the columns; constant beyond the outermost centres.", "",
            "image([[1, 2], [3, 5]], 0.5, 0.5)", ("photo", "u", "v")),
    Special("load", "the name of a file -> a", "What a file of data holds: the columns of a table (`.csv`) as the "
            "fields of a record, arrays (`.npy`, `.npz`), nested lists (`.json`), pictures (`.png`, `.jpg`).", "",
            'load("heights.csv")', ("file",)),
    Special("pi", "Real", "The ratio of a circle's circumference to its diameter, 3.14159…", "d pi = 0", "sin(pi/2)"),
    Special("inf", "Real", "Infinity, for bounds of integrals.", "", "integral [0, inf] exp(-x) d(x)"),
)  # fmt: skip

SPECIALS: dict[str, Special] = {special.name: special for special in _SPECIALS}

TYPES: dict[str, str] = {
    "Real": "A number that varies with no variable of integration; `Real*` accepts one that does, and `Real[x]` varies "
    "with x.",
    "Dist": "A distribution over variables of integration, such as the derivative of something that jumps. Only an "
    "integral turns it into a number.",
    "Diffeo": "What a diffeomorphism gives: coordinates that may stand as a condition.",
}

_GREEK = (
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu", "nu", "xi",
    "omicron", "pi", "rho", "sigma", "tau", "upsilon", "phi", "chi", "psi", "omega",
)  # fmt: skip
LETTERS: dict[str, str] = {
    **dict(zip(_GREEK, "αβγδεζηθικλμνξοπρστυφχψω")),
    **{name.capitalize(): letter for name, letter in zip(_GREEK, "ΑΒΓΔΕΖΗΘΙΚΛΜΝΞΟΠΡΣΤΥΦΧΨΩ")},
    "vartheta": "ϑ", "varphi": "ϕ", "varrho": "ϱ", "varepsilon": "ϵ", "ell": "ℓ", "hbar": "ħ",
    "integral": "∫", "int": "∫", "le": "≤", "leq": "≤", "ge": "≥", "geq": "≥", "ne": "≠", "neq": "≠",
    **{f"_{digit}": letter for digit, letter in zip("0123456789", "₀₁₂₃₄₅₆₇₈₉")},
}  # fmt: skip
"""Letters and signs by name: `\\theta` is θ. Signs are those that the lexer knows."""
