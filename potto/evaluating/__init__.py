"""Programs that are evaluated while they are written: worlds, live expressions, the prompt's session."""
