"""Syntax: text to trees and back.

Owns the grammar, chunks, parsing with repair, printing and formatting. Knows no names, types or meaning. The only user
of lark.
"""

from potto.syntax.chunks import Chunk, goes_on, pieces, split
from potto.syntax.dump import dump_tree
from potto.syntax.formatter import format_source
from potto.syntax.live import Live, live_expressions
from potto.syntax.parser import ParsedChunk, ParsedExpression, completeness, defined_name, parse_chunk, parse_expression
from potto.syntax.printer import print_expression, print_item, print_type
from potto.syntax.tokens import RESERVED, Comment, Token
from potto.syntax.walk import children, extent, node_at, walk, without_spans
from potto.syntax.words import tokenize

__all__ = [
    "RESERVED",
    "Chunk",
    "Comment",
    "Live",
    "ParsedChunk",
    "ParsedExpression",
    "Token",
    "children",
    "completeness",
    "defined_name",
    "dump_tree",
    "extent",
    "format_source",
    "goes_on",
    "live_expressions",
    "node_at",
    "parse_chunk",
    "parse_expression",
    "pieces",
    "print_expression",
    "print_item",
    "print_type",
    "split",
    "tokenize",
    "walk",
    "without_spans",
]
