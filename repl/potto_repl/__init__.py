"""The prompt: a conversation with Potto.

`respond(session, text)` answers an entry or a command without any terminal; `terminal` puts a terminal around it and
`without_terminal` a pipe. Importing this package imports nothing.
"""
