"""An integral from its term to its jets: methods, batches, second looks."""
