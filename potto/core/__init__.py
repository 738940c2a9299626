"""The calculus that programs become: core terms, what shortens, prints, checks and evaluates them.

Owns nothing itself. `terms` has the terms; the other modules are passes over them.
"""
