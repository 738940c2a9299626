"""The kinds of diagnostics about names, types and dependence. Each has a page `docs/errors/CODE.md`.

Declared in one place rather than beside each check because the checks share them: a shape is found wrong by `infer`,
`calls` or `annotations`, and the same rule about variation is broken in several ways that `rules` words.
"""

from potto.diagnostics import declare

NOT_DEFINED = declare("P0201", "a name that is not defined")

VARYING_CONDITION = declare("P0301", "a variable of integration in a plain condition")
VARYING_JUMP = declare("P0302", "a variable of integration in a builtin that jumps")
VARYING_SUM = declare("P0303", "a variable of integration in the bounds of a sum")
EQUALITY = declare("P0304", "an equality over variables of integration")
DECLARED_PLAIN = declare("P0305", "something that varies given to a parameter declared Real")
MISMATCH = declare("P0306", "a value of the wrong type")
NOT_A_FUNCTION = declare("P0307", "something that is not a function is applied")
TOO_MANY = declare("P0308", "too many arguments")
MISSING = declare("P0309", "a missing argument")
UNKNOWN_KEYWORD = declare("P0310", "an unknown keyword")
NOT_A_CONDITION = declare("P0312", "a condition that is neither a comparison nor a diffeomorphism")
ESCAPES = declare("P0313", "a function where a value is needed")
LIST_INSIDE = declare("P0314", "a list where numbers are needed")
TUPLE_ARITHMETIC = declare("P0315", "arithmetic on a tuple")
ANNOTATION = declare("P0316", "an annotation that does not hold")
ENDLESS = declare("P0317", "a recursion that no plain condition ends")
INNER_BOUND = declare("P0318", "a bound that depends on a variable further in")
LONE_DELTA = declare("P0320", "a delta outside of an integral")
DELTA_PRODUCT = declare("P0321", "a distribution where a number is needed")
MEASURE = declare("P0322", "a measure that is used wrongly")
SPECIAL = declare("P0323", "deriv, delta or print used as a value")
TRUTH_ESCAPES = declare("P0324", "a comparison where a number is needed")
TOO_LARGE = declare("P0325", "a tuple that is too large")

SIZES = declare("P0326", "sizes that do not agree")
NO_FIELD = declare("P0327", "something that has no such part")
OUT_OF_RANGE = declare("P0328", "an index that is out of range")
NOT_AN_ARRAY = declare("P0329", "something that is not an array")
NOT_WHOLE = declare("P0330", "an index or a range that is not of whole numbers")
WITHIN_ITSELF = declare("P0331", "a record that contains itself")
UNKNOWN_FIELD = declare("P0332", "a field that a record does not have")
NO_RECORD = declare("P0333", "`with` behind something that is not a record")
EMPTY = declare("P0334", "the least or the greatest of nothing")
NO_RISE = declare("P0335", "places that are written in the wrong order")

UNUSED_LOCAL = declare("P0610", "a local name that is not used", "warning")
UNUSED_VARIABLE = declare("P0611", "a variable of integration that is not used", "warning")
SHADOWED = declare("P0612", "a name that hides another one", "warning")
STILL_SURFACE = declare("P0613", "a surface that no parameter moves", "hint")
CONSTANT_CONDITION = declare("P0614", "a condition that never changes", "warning")
NO_TANGENT = declare("P0615", "a derivative called without a tangent", "warning")
