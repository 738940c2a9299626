"""Integrals over one variable whose conditions count through sums of them: as cheap as there are conditions."""
