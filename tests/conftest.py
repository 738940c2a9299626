"""How laws are tested: with the same examples each time, so that a change is told by its own doing; `make fuzz` looks
for others."""

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("explore", deadline=None)
settings.load_profile("repeatable")
