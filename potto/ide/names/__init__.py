"""What stands at a place of a text, and what its names mean."""
