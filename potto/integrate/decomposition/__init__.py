"""Where integrals are cut: roots of surfaces, what coincides, what is empty, where what lies further in turns."""
