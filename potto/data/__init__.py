"""Files of data as values: tables, arrays, nested lists, pictures.

`shape_of(path, content)` says what kind of value a file holds, without numpy, for whoever checks programs;
`values_of(path, content)` is the value; `read(path)` gives the content. Each of them answers with a `DataMistake`
where something is wrong. `summary` and `thumbnail` show a value. Knows nothing of syntax, types and terms.
"""

from potto.data.display import summary, thumbnail
from potto.data.files import SUFFIXES, digest, read, shape_of, suggest, values_of
from potto.data.mistakes import TITLES, DataMistake
from potto.data.values import Array, Columns, Item, Number, Row, Shape, Sizes, Table, Value, shape

__all__ = [
    "SUFFIXES", "TITLES", "Array", "Columns", "DataMistake", "Item", "Number", "Row", "Shape", "Sizes", "Table",
    "Value", "digest", "read", "shape", "shape_of", "suggest", "summary", "thumbnail", "values_of",
]  # fmt: skip
