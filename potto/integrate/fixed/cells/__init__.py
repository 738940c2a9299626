"""Members whose cells are alike: where these lie, a product rule for each shape, and proofs of its orders."""
