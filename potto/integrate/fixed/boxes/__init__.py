"""Members of a batch over boxes that nothing cuts: on which sides they lie, and their product rules."""
