"""A workspace like a large project of one's own: 200 modules, 42,000 lines, one module of 2,000.

Owns `workspace`, without arrays and with them, `resigned`, `longer` and `written`. Definitions are of the size of those
in the paper and in `examples/`: shaders, small integrals with a condition, helpers, documented; a module imports a few
others that come before it, so that there are leaves, a middle and a top, and no cycles.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

MODULES, LINES, LARGE = 200, 42_000, 2_000


def module_name(number: int) -> str:
    """The name of a module; `large` is the one of 2,000 lines, in the middle."""
    return "large" if number == MODULES // 2 else f"m{number}"


def imports_of(number: int) -> list[int]:
    """What a module imports: a few of those before it; one in twenty the leaf."""
    wanted = {number - 1 - (number * 7) % 5, number // 2, (number * 13) % 23}
    if number % 20 == 1:
        wanted.add(0)
    return sorted(other for other in wanted if 0 <= other < number)[:4]


def called(index: int, imported: list[str]) -> str:
    """What a definition adds: a call of the one before it, or of one that is imported."""
    helper = f"f{index - 1}" if index and index % 3 else None
    other = imported[index % len(imported)] if imported else None
    calls = [f"{call}(t, {n + 1}/2)" for n, call in enumerate(c for c in (helper, other) if c) if index % 2 or n]
    return "".join(f" + {call}" for call in calls[:1])


def definition(module: int, index: int, imported: list[str]) -> list[str]:
    """One definition of about seven lines."""
    name, turn, extra = f"f{index}", (module + index) % 6, called(index, imported)
    head = [f"# {name} of module {module}: what a reader wants to know", "# before using it."]
    match turn:
        case 0:
            body = [f"def {name}(t, k)", f"    a = k^2 + {index}", f"    integral [0, 1] [x < t] * a * x d(x){extra}"]
        case 1:
            body = [
                f"def {name}(t, k)",
                f"    scale = sqrt(t^2 + {index + 1})",
                "    shift = k/scale",
                f"    scale*exp(-shift){extra}",
            ]
        case 2:
            body = [
                f"def {name}(t, k)",
                "    width = if k > 0 then k else 1",
                f"    integral ([0, 1], [0, 1]) [x + y*width < t] * (x - y) d(x, y){extra}",
            ]
        case 3:
            body = [f"{name} = \\(t, k) . 1/(sqrt(2)*(t + k + {index + 2})^2 + 1)"]
        case 4:
            body = [
                f"def {name}(t, k)",
                "    lo = min(t, k)",
                "    hi = max(t, k)",
                f"    (hi - lo)*sin({index}*t) + cos(k){extra}",
            ]
        case _:
            body = [f"def {name}(t, k)", f"    u = t - k/{index + 1}", "    v = if u > 0 then log(1 + u) else u",
                    f"    integral [0, 2] v*x^2 d(x){extra}"]  # fmt: skip
    return [*head, *body, ""]


def of_arrays(module: int, index: int, imported: list[str]) -> list[str]:
    """One definition as long as that of `definition`, and called like it, with arrays, records and what goes through
    them."""
    name, turn, extra = f"f{index}", (module + index) % 6, called(index, imported)
    head = [f"# {name} of module {module}: what a reader wants to know", "# before using it."]
    match turn:
        case 0:
            body = [f"def {name}(t, k)", f"    a = [k^2 + {index}*i for i in 0..3]",
                    f"    integral [0, 1] sum i in 0..3 ([x < t*a[i]] * a[i] * x) d(x){extra}"]  # fmt: skip
        case 1:
            body = [f"def {name}(t, k)", f"    u = (t, sqrt(k^2 + {index + 1}), 1)", "    v = 2*u - (0, k, 0)",
                    f"    dot(u, v)/norm(v)*exp(-u.x){extra}"]  # fmt: skip
        case 2:
            body = [f"def {name}(t, k)", f"    spot = Spot(at=(t, k), r=1/{index + 2})",
                    f"    integral ([0, 1], [0, 1]) inside(spot with r = k, x, y)*(x - y) d(x, y){extra}"]  # fmt: skip
        case 3:
            body = [f"{name} = \\(t, k) . sum i in 0..4 (1/(sqrt(2)*(t + k*i + {index + 2})^2 + 1))"]
        case 4:
            body = [f"def {name}(t, k)", "    xs = [t*i + k for i in 0..7]",
                    "    (s, w) = fold (s, w) = (k, 1) for x in xs ((s/2 + x*w, w*0.9))",
                    f"    s*sin({index}*t) + max x in xs (x*w){extra}"]  # fmt: skip
        case _:
            body = [f"def {name}(t, k)", f"    places = [0, 1/{index + 2}, 1]", "    values = [t, k, t*k]",
                    f"    integral [0, 2] interp(places, values, x/2)*x^2 d(x){extra}"]  # fmt: skip
    return [*head, *body, ""]


RECORDS = [
    "record Spot(at: (Real, Real), r: Real)", "def inside(s: Spot, x, y) [(x - s.at.x)^2 + (y - s.at.y)^2 < s.r]", ""
]  # fmt: skip


def module_text(number: int, lines: int, arrays: bool) -> str:
    """A module of at least so many lines."""
    imports = imports_of(number)
    written, imported = [], []
    for place, other in enumerate(imports):
        if place % 2:
            written.append(f"import {module_name(other)} as lib{other}")
            imported.append(f"lib{other}.f0")
        else:
            written.append(f"from {module_name(other)} import f1 as g{other}")
            imported.append(f"g{other}")
    written += ["", *RECORDS] if arrays else [""]
    index = 0
    while len(written) < lines:
        written += (of_arrays if arrays else definition)(number, index, imported)
        index += 1
    return "\n".join(written) + "\n"


def workspace(arrays: bool = False) -> dict[str, str]:
    """The modules by name; `arrays`: of definitions with arrays."""
    rest = (LINES - LARGE) // (MODULES - 1)
    sizes = {n: LARGE if module_name(n) == "large" else rest for n in range(MODULES)}
    return {module_name(n): module_text(n, lines, arrays) for n, lines in sizes.items()}


def resigned(leaf: str, number: int | None) -> tuple[str, str]:
    """The leaf with signatures that do not fit its importers, as they fill a parameter that is not there any more, and
    with some that do. With a number the parameters have names that they never had before."""
    first, *others = re.split(r"(?m)^(?=def )", leaf)
    t, k = ("t", "k") if number is None else (f"t{number}", f"k{number}")
    fitting = first
    for other in others:
        if other.startswith(("def f0(", "def f1(")):
            other = re.sub(r"\bk\b", k, re.sub(r"\bt\b", t, other))
        fitting += other
    return re.sub(rf"(?m)^(def f[01]\({t}), {k}\)", r"\1)", fitting), fitting


def longer(leaf: str, number: int) -> str:
    """The leaf with six more parameters in the signatures that its importers call, of types as no other number has."""
    types = ("(Real, Real)" if number >> n & 1 else "Real" for n in range(6))
    more = "".join(f", more{n}: {type}" for n, type in enumerate(types))
    return re.sub(r"(?m)^(def f[01]\(t, k)\)", rf"\1{more})", leaf)


@contextmanager
def written(texts: dict[str, str]) -> Iterator[Path]:
    """The modules of a workspace in a folder, and nothing on disk from before."""
    with tempfile.TemporaryDirectory(prefix="potto-bench-") as name, tempfile.TemporaryDirectory() as cache:
        os.environ["POTTO_CACHE"] = cache
        for module, text in texts.items():
            (Path(name) / f"{module}.po").write_text(text)
        lines = sum(text.count("\n") for text in texts.values())
        print(f"{len(texts)} modules, {lines:,} lines, one of {texts['large'].count(chr(10)):,}", file=sys.stderr)
        print(f"load {os.getloadavg()[0]:.1f} of {os.cpu_count()} processors", file=sys.stderr)
        yield Path(name)
        print(f"load {os.getloadavg()[0]:.1f}", file=sys.stderr)
