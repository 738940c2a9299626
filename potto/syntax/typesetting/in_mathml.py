"""Boxes as MathML, which browsers draw without a library.

Owns `mathml`.
"""

from __future__ import annotations

import html
from collections.abc import Container

from potto.syntax.typesetting.boxes import (
    Big,
    Box,
    Cases,
    Fenced,
    Fraction,
    Raised,
    Row,
    SquareRoot,
    Where,
    Word,
    boxes,
)


def mathml(text: str, tangents: Container[str] = ()) -> str:
    """An expression as a `math` element."""
    found = boxes(text, tangents)
    inner = f"<mtext>{html.escape(text)}</mtext>" if found is None else _text(found)
    return f'<math displaystyle="true">{inner}</math>'


def _text(box: Box) -> str:
    match box:
        case Word():
            return _word(box)
        case Row(items=items):
            return f"<mrow>{''.join(map(_text, items))}</mrow>"
        case Fenced(left=left, inner=inner, right=right):
            return f"<mrow><mo>{left}</mo>{_text(inner)}<mo>{right}</mo></mrow>"
        case Fraction(top=top, below=below):
            return f"<mfrac>{_text(top)}{_text(below)}</mfrac>"
        case Raised(base=base, exponent=exponent):
            return f"<msup>{_text(base)}{_text(exponent)}</msup>"
        case SquareRoot(inner=inner):
            return f"<msqrt>{_text(inner)}</msqrt>"
        case Big(sign=sign, limits=limits, body=body, last=last):
            tag = "msubsup" if sign == "∫" else "munderover"
            heads = "".join(f"<{tag}><mo>{sign}</mo>{_text(low)}{_text(high)}</{tag}>" for low, high in limits)
            space = '<mspace width="0.17em"/>'
            return f"<mrow>{heads}{_text(body)}{''.join(space + _text(each) for each in last)}</mrow>"
        case Cases(condition=condition, then=then, orelse=orelse):
            rows = ((then, f"<mrow><mtext>if </mtext>{_text(condition)}</mrow>"), (orelse, "<mtext>else</mtext>"))
            table = "".join(f"<mtr><mtd>{_text(value)}</mtd><mtd>{when}</mtd></mtr>" for value, when in rows)
            return f'<mrow><mo>{{</mo><mtable columnalign="left">{table}</mtable></mrow>'
        case Where(body=body, equations=equations):
            return f"<mrow>{_text(body)}<mtext> where </mtext>{_text(equations)}</mrow>"


def _word(word: Word) -> str:
    text = html.escape(word.text)
    match word.kind:
        case "number":
            return f"<mn>{text}</mn>"
        case "sign" if text == "·":
            return '<mspace width="0.17em"/>'
        case "sign":
            return f"<mo>{text}</mo>"
        case "words" if text == "d":
            return '<mi mathvariant="normal">d</mi>'
        case "words" if text.strip() in (",", "∧", "∨"):
            return f"<mo>{text.strip()}</mo>"
        case "words":
            return f"<mtext>{text}</mtext>"
        case "function":
            return f"<mi>{text}</mi>"
        case _:
            return f"<mi>{text}</mi>" if text else "<mrow></mrow>"
