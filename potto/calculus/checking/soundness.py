"""Of which definitions it is known what they mean: those that are right themselves, and use none that is guessed.

Owns `is_sound` and `rests_on_guesses`. Whoever looks at what a definition means asks these first: of a text that is
being typed only the type is told to others, and the rest waits until it is whole.
"""

from __future__ import annotations

from potto.modules import DefinitionTarget, refer, references
from potto.modules.lookup import ImportBinding, meaning
from potto.query import Database, query
from potto.types import check_definition, interface
from potto.types.types import TupleOf, Unknown


@query(travels=True)
def is_sound(db: Database, file: str, name: str) -> bool:
    """Whether a definition could be read and has a type."""
    wrong = any(said.severity == "error" for said in check_definition(db, file, name))
    return not wrong and not interface(db, file, name).broken


def rests_on_guesses(db: Database, file: str, name: str) -> bool:
    """Whether a definition uses one of which there is only a guess, or an import that fails: what it means is known
    once that is mended, and until then its conditions are not looked through."""
    for path, used in references(db, file, name):
        target = refer(db, file, path, used)
        if isinstance(target, DefinitionTarget):
            if _is_guessed(db, target.file, target.name):
                return True
        elif target is None and _is_imported(db, file, path or used):
            return True
    return False


@query(cuts=True)
def _is_guessed(db: Database, file: str, name: str) -> bool:
    """Whether a definition could not be read, has no type, or is a record that is wrong itself."""
    found = interface(db, file, name)
    if found.broken or isinstance(found.result, Unknown):
        return True
    return isinstance(found.result, TupleOf) and found.result.record is not None and not is_sound(db, file, name)


def _is_imported(db: Database, file: str, path: str) -> bool:
    """Whether the name that a path begins with is one that an import of the file binds, or would bind."""
    bound = meaning(db, file, path) or meaning(db, file, path.partition(".")[0])
    return isinstance(bound, ImportBinding)
