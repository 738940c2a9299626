"""`textDocument/signatureHelp`."""

from __future__ import annotations

from potto import ide
from potto.source import Span
from potto_lsp import convert, protocol
from potto_lsp.asking import Ask
from potto_lsp.text import units

FORMATS = "textDocument.signatureHelp.signatureInformation.documentationFormat"


def signature_help(ask: Ask) -> protocol.SignatureHelp | None:
    found = ide.signature_help(ask.db, ask.file, ask.offset)
    if found is None or not found.signatures:
        return None
    answer: protocol.SignatureHelp = {
        "signatures": [_signature(ask, signature) for signature in found.signatures],
        "activeSignature": found.active,
    }
    active = found.signatures[found.active].active
    if active is not None:
        answer["activeParameter"] = active
    return answer


def _signature(ask: Ask, signature: ide.Signature) -> protocol.SignatureInformation:
    found: protocol.SignatureInformation = {
        "label": signature.label,
        "parameters": [_parameter(ask, signature.label, parameter) for parameter in signature.parameters],
    }
    if signature.documentation:
        found["documentation"] = convert.markup(ask.client, FORMATS, signature.documentation)
    if signature.active is not None:
        found["activeParameter"] = signature.active
    return found


def _parameter(ask: Ask, label: str, parameter: ide.ParameterText) -> protocol.ParameterInformation:
    """A parameter. Offsets in a label count UTF-16 units, whatever was negotiated."""
    found: protocol.ParameterInformation = {"label": _columns(label, parameter.span)}
    if parameter.documentation:
        found["documentation"] = convert.markup(ask.client, FORMATS, parameter.documentation)
    return found


def _columns(label: str, span: Span) -> list[int]:
    return [units(label[: span.start], "utf-16"), units(label[: span.end], "utf-16")]
