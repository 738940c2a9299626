"""Digests of content: `blake2b`, from where Python has it.

`hashlib` loads OpenSSL for its other digests: 2.5 of the 55 ms that a small command takes.
"""

from __future__ import annotations

try:
    from _blake2 import blake2b
except ImportError:  # a Python that has it elsewhere
    from hashlib import blake2b

__all__ = ["blake2b"]
