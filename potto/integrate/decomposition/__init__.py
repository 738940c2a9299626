"""Where integrals are cut: roots of surfaces, by formulas and by certified searches, and critical places."""
