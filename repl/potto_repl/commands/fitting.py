"""`:fit`: the parameters that make a value least, found along its derivatives.

Owns how a fit is asked for and told at the prompt; the fitting itself is `potto.applications.fitting`.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Sequence

from msgspec.structs import asdict

from potto.applications.fitting import by_fields
from potto.applications.fitting import fit as fitted
from potto.applications.minimization import Iterate
from potto.applications.minimizing import MOST_TOLD
from potto.applications.pictures import course
from potto.projects.settings import settings
from potto.python.functions import Function
from potto.runtime.answers.printing import (
    format_count,
    format_digits,
    format_error,
    format_number,
    format_seconds,
    with_error,
)
from potto_repl.drawing import braille, room_for_curves
from potto_repl.expressions import checked, split_items
from potto_repl.registry import command
from potto_repl.reply import Part, Refusal
from potto_repl.sampled import free_names
from potto_repl.session import Conversation, plain_names

FEWEST = 3  # steps that are worth a picture
HEIGHT = 6  # of that picture in lines
PATIENCE = 0.5  # seconds before progress is shown


@command("fit", "f", argument="f t=0.5, … [with g=…]", completes="expression")
def fit(session: Conversation, text: str) -> Iterator[Part]:
    """Make a value as small as possible: `:fit loss t=0.5, c=1` starts there and follows the derivatives.

    Parameters after `with` keep what they are given: `:fit loss c=-0.5 with shader=lin_shader`.
    """
    name, start, fixed = _read(plain_names(text))
    free = free_names(session, name)
    for n in free:
        if n not in start and n not in fixed:
            raise Refusal(f"`{n}` has no value", f"let it start somewhere, `{n}=1`, or stay as it is, `with {n}=1`")
    asked = checked(session, f"\\({', '.join(free)}) . ({name})" if free else name, ":fit loss t=0.5")
    function = Function(session.world, session.file, asked.expr, asked.type)
    given = {n: _fixed(session, value) for n, value in fixed.items()}
    begun = time.perf_counter()
    if session.progress is not None:
        session.progress(f"fitting {name}")
    values = {n: _start(session, n, value) for n, value in start.items()}

    def told(step: Iterate) -> None:
        if session.progress is not None and time.perf_counter() - begun > PATIENCE:
            value, slope = format_digits(step.value), format_error(step.slope)
            session.progress(f"step {step.number}, value {value}, slope {slope}")

    with settings(**asdict(session.settings)):
        found = fitted(function, values, given=given, progress=told)
    doubts = found.doubts()
    best = [f"{n} = {format_number(v, doubts[n])}" for n, v in list(found.numbers.items())[:MOST_TOLD]]
    more = f", … {len(found.numbers) - MOST_TOLD:,} more" if len(found.numbers) > MOST_TOLD else ""
    said = [f"{name} = {with_error(found.value, found.error)} at {', '.join(best)}{more}"]
    said.append(f"  slope {format_error(found.slope)}{'' if found.converged else ': ' + found.reason}")
    data = {"fit": name, "value": found.value, "parameters": found.parameters, "slope": found.slope,
            "steps": len(found.steps) - 1, "converged": found.converged}  # fmt: skip
    yield Part("answer", "\n".join(said), data)
    count = len(found.steps) - 1
    cost = f"{format_count(count, 'step')}, {format_count(found.evaluations, 'evaluation')}"
    if count >= FEWEST:
        ends = f"{name} = {with_error(found.value, found.error)} after {cost}"
        yield _course(session, name, [step.value for step in found.steps], ends)
    yield Part("tail", f"{cost}, {format_seconds(time.perf_counter() - begun)}")


def _course(session: Conversation, name: str, values: Sequence[float], ends: str) -> Part:
    """The value from step to step as a picture; its logarithm where it falls far."""
    picture = course(name, values, ends)
    (label,) = picture.labels
    session.last_picture = picture
    said = f"{label} from step to step"
    shown = braille(picture, room_for_curves(session.width()), HEIGHT, unicode=session.options.unicode)
    data = {"course": list(values), "_picture": picture, "_scale": said, "_height": HEIGHT}
    return Part("picture", f"{shown}\n{said}", data)


def _read(text: str) -> tuple[str, dict[str, str], dict[str, str]]:
    """The function, where to start, and what stays fixed."""
    what, _, fixed = text.partition(" with ")
    found = re.match(r"(.*?)\s+([^\W\d]\w*\s*=[^=].*)$", what.strip(), re.DOTALL)
    if found is None:
        raise Refusal("a function and where to start are needed", "write `:fit loss t=0.5`")
    return found[1], _assignments(found[2]), _assignments(fixed) if fixed else {}


def _assignments(text: str) -> dict[str, str]:
    spaced = re.sub(r"(?<=[\w)\]])\s+(?=[^\W\d]\w*\s*=[^=])", ", ", text)
    pairs = [item.partition("=") for item in split_items(spaced)]
    if not all(name.strip().isidentifier() and value.strip() for name, _, value in pairs):
        raise Refusal(f"`{text.strip()}` does not say which parameter it is for", "write `t=0.5, c=1`")
    return {name.strip(): value.strip() for name, _, value in pairs}


def _start(session: Conversation, name: str, text: str) -> object:
    """What a parameter starts at: a number, or what is made of numbers."""
    asked = checked(session, text, ":fit loss t=0.5")
    if asked.groups:
        raise Refusal(f"`{name}` starts at a function, and numbers are fitted", f"let it stay, `with {name}={text}`")
    return by_fields(session.evaluate(asked.text, session.settings).estimate.value, asked.type)


def _fixed(session: Conversation, text: str) -> object:
    asked = checked(session, text, ":fit loss t=0.5 with g=sin")
    if asked.groups:
        return Function(session.world, session.file, asked.expr, asked.type)
    return session.evaluate(asked.text, session.settings).estimate.value
