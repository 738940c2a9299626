"""Diffeomorphisms and conditions, checked."""
