"""The language server of Potto: the only package that knows the protocol.

`wire` frames messages, `carrier` brings them to their handlers by pygls, `server` answers them, `work` runs what they
ask for on the one thread that owns the database (`analysis`). `documents` holds the open texts, `publishing` says what
is wrong with them, `features` has one thin adapter for each question of `potto.ide`, `convert` turns offsets and values
into positions and messages, and `evaluation` runs programs in a process of its own.
"""
