"""The language server of Potto: the only package that will know the protocol. It comes with a later release."""
