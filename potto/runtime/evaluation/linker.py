"""The definitions of a program, as they are evaluated: each looked up once, with what follows from it.

Owns `Linker`. All machines of a program share one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from potto.calculus.inlining.numbers import with_numbers
from potto.calculus.surfaces.branch_cuts import opened
from potto.core.terms import Data, Deriv, Global, Integral, Lam, Term, postorder
from potto.diagnostics import PottoError
from potto.integrate.outline import Outlines
from potto.kernels.cells import Pattern, Value
from potto.kernels.compile import references
from potto.kernels.making import counts
from potto.kernels.written import Kernel
from potto.projects.settings import Settings
from potto.runtime.evaluation.reach import Reach
from potto.runtime.evaluation.written_in import WrittenIn

Definitions = Mapping[tuple[str, str], Term]
Named = Callable[[Term, Definitions], Term]


class Linker:
    """The definitions that a program refers to. `lookup` gives the term of a definition or raises PottoError.

    held: definitions that have a value already, which is not computed again. named: what gives a term, for people, the
    names that these definitions know its parts by.
    """

    def __init__(
        self,
        lookup: Callable[[str, str], Term],
        held: Mapping[tuple[str, str], Value] | None = None,
        named: Named | None = None,
    ) -> None:
        self.lookup, self._named = lookup, named
        self.held = held if held is not None else {}
        self.terms: dict[tuple[str, str], Term] = {}
        self.exactness: dict[Term, bool] = {}
        self._ready: dict[Term, Term] = {}
        self.reach = Reach(lambda name: self.term(name.module, name.name))
        self.alike: dict[Any, Any] = {}
        self.data: dict[Data, Value] = {}
        self.outlines = Outlines()
        self.constants: dict[tuple[str, str, Settings], Value] = {}
        self.duals: dict[tuple[Lam, bool], Lam] = {}
        self.reaches: dict[tuple[Term, ...], tuple[tuple[str, str, bytes], ...]] = {}
        self.written_in = WrittenIn(self.function)
        # the ones met, without a lookup
        self.kernels: dict[tuple[Lam, tuple[Pattern, ...], int, bool, bool, int, bool], Kernel] = {}

    def term(self, module: str, name: str) -> Term:
        key = (module, name)
        if key not in self.terms:
            self.terms[key] = self.ready(self.lookup(module, name))
            counts.linked += 1
        return self.terms[key]

    def named(self, term: Term) -> Term:
        """A term with the names of the program's fields."""
        return term if self._named is None else self._named(term, self.terms)

    def ready(self, term: Term) -> Term:
        """The term as it is evaluated: with branch cuts told, and numbers in the place of their names; found out once,
        where no names get values meanwhile."""
        found = None if self.held else self._ready.get(term)
        if found is None:
            found = self._ready[term] = with_numbers(opened(term), self._number)
        return found

    def _number(self, name: Global) -> Term | None:
        """The term of a definition that has no value yet; of a broken one nothing is said before it is needed."""
        if (name.module, name.name) in self.held:
            return None
        try:
            return self.lookup(name.module, name.name)
        except PottoError:
            return None

    def inexact(self, term: Term) -> bool:
        """Whether a value of the term may carry an integration error: whether an integral is reached from it."""
        found = self.exactness.get(term)
        if found is not None:
            return found
        self.exactness[term] = False  # while a recursion comes back here
        result = False
        for node in postorder(term):
            if isinstance(node, Integral) or (
                isinstance(node, Global) and self.inexact(self.term(node.module, node.name))
            ):
                result = True
                break
        self.exactness[term] = result
        return result

    def reached(self, *terms: Term) -> tuple[tuple[str, str, bytes], ...]:
        """The definitions that terms lead to, with the digests of what they are: what a plan depends on."""
        found = self.reaches.get(terms)
        if found is None:
            names, waiting = set[Global](), list(terms)
            while waiting:  # what a definition refers to is known from before, as most of them are
                new = [name for name in references(waiting.pop()) if name not in names]
                names.update(new)
                waiting += [known for name in new if (known := self.reach.resolve(name)) is not None]
            each = ((name.module, name.name) for name in names)
            found = self.reaches[terms] = tuple(sorted((*name, self.term(*name).digest) for name in each))
        return found

    def function(self, head: Term) -> Lam | Deriv | None:
        """The function, or derivative of one, that a Global leads to, through definitions that are other names."""
        for _ in range(100):
            if isinstance(head, Lam | Deriv):
                return head
            if not isinstance(head, Global):
                return None
            head = self.term(head.module, head.name)
        return None
