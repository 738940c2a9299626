"""The calculus: hash-consed terms, their simplification, their text, and the oracle that evaluates them slowly."""
