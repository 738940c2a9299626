"""Where surfaces coincide, lie on a bound, run along an axis, or have no value: looked at beside the place."""
