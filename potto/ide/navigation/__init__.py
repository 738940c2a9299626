"""Going to places: definitions, references, outlines, links; renaming, which is finding all of them."""
