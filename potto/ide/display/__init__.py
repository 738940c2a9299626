"""What editors show beside and over a text: tokens, hints, lenses, folds, inline values, pictures."""
