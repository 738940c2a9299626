"""Calling derivatives: duals in, duals out.

Owns `call_derivative` (the derivative of a function, called with pairs) and `call_paired` (a function written by hand
for duals, standing for the function whose derivative it is). One direction of differentiation is carried by the
kernels of the function itself; under a derivative already being taken the function is first replaced by its dual as a
term, which is then differentiated like any other.
"""

from __future__ import annotations

from potto.calculus.inlining.currying import sizes_of
from potto.integrate.pieces import still
from potto.kernels import errors
from potto.kernels.cells import Cell, Rows, Trace, Value, map_cells
from potto.kernels.tape import Untaped
from potto.runtime.evaluation.arguments import fit, uncurried
from potto.runtime.evaluation.derivatives.compared import compared, held
from potto.runtime.evaluation.derivatives.second_derivatives import dual_function
from potto.runtime.evaluation.derivatives.sides import as_a_whole
from potto.runtime.evaluation.functions import Closure, Derivative, Paired, holds_functions
from potto.runtime.evaluation.machine import Machine


def call_derivative(
    machine: Machine, function: Derivative, groups: tuple[tuple[Value, ...], ...], trace: Trace | None
) -> Value:
    primal = function.primal
    if isinstance(primal, Derivative):
        primal = dual_function(machine, primal.primal)
        machine.record.second = True
    if machine.directions or isinstance(primal, Paired):
        machine.record.second = machine.record.second or machine.directions > 0
        pairs = tuple(tuple(_with_tangent(arg, machine.directions) for arg in group) for group in groups)
        value = machine.call(dual_function(machine, primal), pairs, None)
        return value if isinstance(primal, Paired) else held(machine, Derivative(primal), groups, value)
    _, arities = uncurried(primal.lam, sizes_of(groups))
    carrying = machine.with_directions(1)
    dual_groups = tuple(
        tuple(merge(arg) for arg in fit(group, arity)) for group, arity in zip(groups, arities, strict=False)
    )

    def called(own: Machine, given: Value) -> Value:
        return own.call(primal.padded(1), given, trace)  # type: ignore[arg-type]

    value = split(as_a_whole(carrying, primal.lam, dual_groups, called))
    return compared(machine, function.primal, groups, value) if isinstance(function.primal, Derivative) else value


def _with_tangent(arg: Value, directions: int) -> Value:
    """A plain number, or an array of them, as a dual with tangent 0; a dual as it is."""
    if isinstance(arg, tuple | list) and holds_functions(arg):
        message = "a second derivative stops at a tuple, record or array in which there are functions"
        raise errors.wrong_call(message, "give the functions as parameters of their own")
    if isinstance(arg, Cell | Rows):
        motionless = (None,) * directions
        return arg, map_cells(arg, lambda _: Cell(0.0, None, motionless, motionless))
    return arg


def merge(arg: Value) -> Value:
    """A dual as a number that carries its tangent; a plain number has tangent 0."""
    if isinstance(arg, Cell):
        return Cell(arg.v, arg.e, (None,))
    if isinstance(arg, Derivative):
        return arg.primal.padded(1)
    if isinstance(arg, Closure):
        return Paired(arg.padded(1))
    if isinstance(arg, list):
        return [merge(item) for item in arg]
    if isinstance(arg, Rows):
        return Rows(merge_still(arg.item), arg.size)
    if not isinstance(arg, tuple):
        raise errors.wrong_call("a derivative takes duals, pairs `(value, tangent)`")
    if holds_functions(arg):  # which are duals of their own, so that each item is one
        return tuple([merge(item) for item in arg])
    if len(arg) == 2 and all(isinstance(part, Cell) for part in arg):
        v, t = arg
        assert isinstance(v, Cell) and isinstance(t, Cell)
        return Cell(v.v, v.e, (_unit(t),), (t.e,))
    if len(arg) == 2 and all(isinstance(part, Rows) for part in arg):
        values, tangents = arg
        assert isinstance(values, Rows) and isinstance(tangents, Rows)
        if values.size == tangents.size:
            return Rows(merge((values.item, tangents.item)), values.size)
    if len(arg) == 2 and all(isinstance(part, tuple) for part in arg):
        values, tangents = arg
        assert isinstance(values, tuple) and isinstance(tangents, tuple)
        if len(values) == len(tangents):
            return tuple(merge((v, t)) for v, t in zip(values, tangents, strict=True))
    raise errors.wrong_call("a derivative takes duals, pairs `(value, tangent)`")


def merge_still(value: Value) -> Value:
    """Numbers that have tangent 0."""
    return map_cells(value, lambda cell: Cell(cell.v, cell.e, (None,)))


def _unit(t: Cell) -> float | None:
    """The tangent, with a constant 1 and 0 as kernels recognize them."""
    if isinstance(t.v, (int, float)):
        return None if t.v == 0 and t.e is None else float(t.v)
    return t.v  # type: ignore[return-value]


def split(value: Value) -> Value:
    """A value that carries a tangent as a dual: (value, tangent); of a tuple two tuples, as `merge` takes them."""
    if isinstance(value, Cell):
        t = value.t[0] if value.t else None
        et = value.et[0] if value.et else None
        return (Cell(value.v, value.e), Cell(0.0 if t is None else t, et))
    if isinstance(value, tuple):
        pairs = [split(item) for item in value]
        if holds_functions(value):  # each item is a dual of its own
            return tuple(pairs)
        return (tuple(p[0] for p in pairs), tuple(p[1] for p in pairs))  # type: ignore[index]
    if isinstance(value, Rows):
        values, tangents = split(value.item)  # type: ignore[misc]
        return Rows(values, value.size), Rows(tangents, value.size)
    if isinstance(value, list):
        return [split(item) for item in value]
    return Derivative(value)  # type: ignore[arg-type]


def call_paired(
    machine: Machine, function: Paired, groups: tuple[tuple[Value, ...], ...], trace: Trace | None
) -> Value:
    """Call a function on duals for each direction that is carried. Raises Untaped: numbers are wanted there."""
    if machine.taping:
        raise Untaped
    k = machine.directions
    quiet = machine.with_directions(0)
    v: Cell | None = None
    t: list[object] = []
    et: list[object] = []
    for d in range(max(k, 1)):
        pairs = tuple(tuple(_pair(arg, d) for arg in group) for group in groups)
        result = quiet.call(still(function.pairs), pairs, trace)
        if not (isinstance(result, tuple) and len(result) == 2 and all(isinstance(r, Cell) for r in result)):
            raise errors.wrong_call("a function given for a derivative must give a pair `(value, tangent)`")
        assert isinstance(result[0], Cell) and isinstance(result[1], Cell)
        v = result[0]
        t.append(result[1].v)
        et.append(result[1].e)
    assert v is not None
    return Cell(v.v, v.e, tuple(t[:k]), tuple(et[:k]))  # type: ignore[arg-type]


def _pair(arg: Value, d: int) -> Value:
    if isinstance(arg, Cell):
        t = arg.t[d] if arg.t else None
        return (Cell(arg.v, arg.e), Cell(0.0 if t is None else t, arg.et[d] if arg.et else None))
    if isinstance(arg, tuple):
        return tuple(_pair(item, d) for item in arg)
    if isinstance(arg, Rows):
        values, tangents = _pair(arg.item, d)  # type: ignore[misc]
        return Rows(values, arg.size), Rows(tangents, arg.size)
    if isinstance(arg, list):
        return [_pair(item, d) for item in arg]
    return Derivative(arg)  # type: ignore[arg-type]
