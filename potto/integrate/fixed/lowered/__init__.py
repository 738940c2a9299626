"""The fixed rules as machine code: their texts, as LLVM reads them, and what calls the functions made of these."""
