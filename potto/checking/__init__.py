"""Programs from files, checked as a whole."""
