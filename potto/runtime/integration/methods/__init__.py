"""Ways to integrate: along cuts, variables eliminated, members, directions or summands by themselves."""
