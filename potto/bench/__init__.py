"""Speed against error: what `potto bench` measures, and how it is shown.

Owns the catalogue of problems (`problems`, `catalogue.json`), the adapters of our methods and of peers (`adapter`,
`ours`, `peers`), the measuring (`measure`) and its report (`report`, `plotting`).
"""
