"""The prompt of Potto: the only package that will know the terminal. It comes with a later release."""
