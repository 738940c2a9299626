"""Which surfaces cut which variable, where sections fold and meet, and integrals joined or taken apart."""
