"""Syntax: text to trees and back.

Owns the grammar, chunks, parsing with repair, printing and formatting. Knows no names, types or meaning. The only user
of lark.
"""

from potto.syntax.chunks import Chunk, split
from potto.syntax.parser import ParsedChunk, ParsedExpression, parse_chunk, parse_expression
from potto.syntax.tokens import RESERVED, Comment, Token

__all__ = [
    "RESERVED",
    "Chunk",
    "Comment",
    "ParsedChunk",
    "ParsedExpression",
    "Token",
    "parse_chunk",
    "parse_expression",
    "split",
]
