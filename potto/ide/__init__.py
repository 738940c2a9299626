"""Editor features as pure questions about a program; they come with the language server, in a later release."""
