"""What typing means: when an entry is over, how a new line is indented, what a paste says.

Owns `is_over`, `indentation`, `flush_left`, `unprompted` and `untabbed`. Texts in, texts out: the parser
decides, the keys obey.
"""

from __future__ import annotations

import re

INDENT = 4
_PROMPT = re.compile(r"^\s*(?:\d+ )?(?:po>|>>>) ?")
_CONTINUED = re.compile(r"^\s*\.\.\.+ ?")
_BLOCK = re.compile(r"\s*(?:def|for|diffeo)\b|\s*[^\W\d][\w']*\s*=\s*(?:\n|$)")
_OPENS = re.compile(r"(?:[(\[{,=:+*/^?-]|\b(?:then|else|in|and|or))\s*$")


def is_over(text: str) -> bool:
    """Whether Enter at the end of the text hands it in: the entry is complete or wrong, and no block can continue. A
    block ends at an empty line, or when its last line is not indented."""
    stripped = text.strip()
    if not stripped or stripped.startswith(":") or re.fullmatch(r"\S+\?{1,2}", stripped):
        return True
    from potto.syntax import completeness
    from potto_repl.backslash_symbols import readable

    text = flush_left(text)
    lines = text.split("\n")
    if lines[-1].startswith("#") and all(line.startswith("#") for line in lines):
        return False  # a comment goes with the definition below it; an empty line ends it
    if len(lines) > 2 and not lines[-1].strip() and not lines[-2].strip():
        return True  # two empty lines end anything
    verdict = completeness(readable(text))
    if verdict == "incomplete":
        return False
    if len(lines) == 1 or not lines[-1].strip():
        return True
    return not (_BLOCK.match(text) and lines[-1][:1].isspace()) or verdict == "wrong"


def flush_left(text: str) -> str:
    """An entry whose first line is indented, as when copied from the middle of a page, moved to the first column."""
    blanks = text[: len(text) - len(text.lstrip(" \t"))]
    return "\n".join(line.removeprefix(blanks) for line in text.split("\n")) if blanks else text


def indentation(text: str) -> str:
    """The blanks at the beginning of the next line."""
    line = text.rpartition("\n")[2]
    own = re.match(r"[ \t]*", line)
    blanks = own[0] if own is not None else ""
    code = line.split("#")[0].rstrip()
    if _opens_block(code) or (_OPENS.search(code) and code):
        return blanks + " " * INDENT
    return blanks


def _opens_block(line: str) -> bool:
    """Whether a line is a head whose body is still to come."""
    if re.match(r"\s*for\b", line):
        return line.endswith(":")
    head = re.match(r"\s*(?:def|diffeo)\s+[^\W\d][\w']*\s*(?P<rest>.*)$", line)
    if head is None:
        return False
    depth = 0
    for place, char in enumerate(head["rest"]):
        depth += (char in "([") - (char in ")]")
        if depth == 0 and char in ")]":
            after = head["rest"][place + 1 :].strip().rstrip(":=").strip()
            return not after or after.startswith("->")
    return False


def unprompted(text: str) -> str:
    """A paste without prompts and answers if it is a transcript; any other text as it is."""
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    if not any(_PROMPT.match(line) for line in lines):
        return text
    kept: list[str] = []
    for line in lines:
        if _PROMPT.match(line):
            kept.append(_PROMPT.sub("", line))
        elif _CONTINUED.match(line):
            kept.append(_CONTINUED.sub("", line))
    return "\n".join(kept)


def untabbed(text: str) -> str:
    """A text indented by blanks only: tabs don't show on a screen, and the two may not be mixed."""
    return "\n".join(_indented(line) for line in text.split("\n"))


def _indented(line: str) -> str:
    rest = line.lstrip(" \t")
    return line[: len(line) - len(rest)].expandtabs(INDENT) + rest.replace("\t", " ")
