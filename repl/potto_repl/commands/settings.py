"""Commands that change how numbers are computed and how the prompt looks."""

from __future__ import annotations

import difflib

from msgspec.structs import replace

from potto.projects.settings import CHOICES, METHODS, Settings, problem
from potto.runtime.answers.printing import format_digits
from potto_repl import options
from potto_repl.registry import command
from potto_repl.reply import Part, Refusal, answer
from potto_repl.session import Conversation

NUMBERS = Settings.__struct_fields__


@command("set", "s", argument="[NAME VALUE]", completes="setting")
def set_option(session: Conversation, text: str) -> Part:
    """Show the settings, or change one: `:set rtol 1e-6`, `:set seed 7`, `:set theme light`, `:set keys vi`.

    Numbers: method, rtol, atol, samples, seed, max_evals, backend. The prompt: unicode, theme, keys, suggest, check,
    details.
    """
    name, _, value = text.replace("=", " ").strip().partition(" ")
    name, value = name.replace("-", "_"), value.strip()
    if not name:
        rows = {n: _shown(getattr(session.settings, n)) for n in NUMBERS}
        rows |= {n: options.shown(session.options, n) for n in options.NAMES}
        return answer("\n".join(f"{n:<10} {value}" for n, value in rows.items()), settings=rows)
    if name in NUMBERS:
        return _number(session, name, value)
    if name not in options.NAMES:
        near = difflib.get_close_matches(name, (*NUMBERS, *options.NAMES), 1)
        raise Refusal(f"there is no setting `{name}`", f"did you mean `{near[0]}`?" if near else "`:set` lists them")
    if not value:
        return answer(f"{name} {options.shown(session.options, name)}", **{name: options.shown(session.options, name)})
    changed = options.changed(session.options, name, value)
    if changed is None:
        raise Refusal(f"`{name}` is one of {', '.join(options.choices(name))}, not `{value}`")
    session.options = changed
    return answer(f"{name} {options.shown(changed, name)}", **{name: options.shown(changed, name)})


def _number(session: Conversation, name: str, text: str) -> Part:
    if text:
        value = text if name in CHOICES else read_number(text)
        complaint = problem(name, value)
        if complaint is not None:
            raise Refusal(complaint)
        session.settings = replace(session.settings, **{name: value})
    value = getattr(session.settings, name)
    return answer(f"{name} {_shown(value)}", **{name: value})


def _shown(value: float | str) -> str:
    return format_digits(value, 15) if isinstance(value, float) else str(value)


def read_number(text: str) -> int | float | str:
    """A number as people write it: `1e6` is whole, `1_000` too. What is not a number stays text, for the complaint."""
    try:
        value = float(text.replace(",", "").replace("_", ""))
    except ValueError:
        return text
    whole = value == value and abs(value) < 2**53 and value == int(value)
    return int(value) if whole else value


@command("method", "m", argument="[METHOD]", completes="method")
def method(session: Conversation, text: str) -> Part:
    """Show or choose how integrals are estimated: auto, quadrature, mc or qmc."""
    if text and text not in METHODS:
        near = difflib.get_close_matches(text, METHODS, 1, 0.3)
        raise Refusal(f"there is no method `{text}`", f"it is one of {', '.join(METHODS)}"
                      + (f"; did you mean `{near[0]}`?" if near else ""))  # fmt: skip
    return _number(session, "method", text)
