"""How the prompt looks and behaves: options that `:set` changes, apart from those of numbers.

Owns `Options` and the reading of their values.
"""

from __future__ import annotations

from typing import Any

from msgspec import Struct
from msgspec.structs import replace

THEMES = ("dark", "light", "none")
KEYS = ("emacs", "vi")


class Options(Struct, frozen=True):
    """What `:set` knows besides the settings of numbers.

    unicode: symbols such as ± and braille; off where the locale cannot write them.
    theme: colours for dark or light screens, or none. keys: emacs or vi. suggest: grey suggestions from the history.
    check: underline what is wrong while one types. details: the dim line on method, evaluations and time.
    """

    unicode: bool = True
    theme: str = "dark"
    keys: str = "emacs"
    suggest: bool = True
    check: bool = True
    details: bool = True


CHOICES: dict[str, tuple[str, ...]] = {"theme": THEMES, "keys": KEYS}
NAMES = Options.__struct_fields__


def choices(name: str) -> tuple[str, ...]:
    """The values that an option can have."""
    return CHOICES.get(name, ("on", "off"))


def shown(options: Options, name: str) -> str:
    """The value of an option as `:set` writes it."""
    value = getattr(options, name)
    return ("on" if value else "off") if isinstance(value, bool) else str(value)


def changed(options: Options, name: str, text: str) -> Options | None:
    """The options with one changed; None if it cannot have that value."""
    value: Any = text
    if name not in CHOICES:
        value = {"on": True, "yes": True, "true": True, "1": True, "off": False, "no": False, "false": False,
                 "0": False}.get(text.lower())  # fmt: skip
        if value is None:
            return None
    elif text not in CHOICES[name]:
        return None
    return replace(options, **{name: value})
