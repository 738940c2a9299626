"""Files of data as values: tables, arrays, nested lists, pictures.

`summary` and `thumbnail` show a value. Knows nothing of syntax, types and terms.
"""

from potto.data.display import summary, thumbnail
from potto.data.values import Array, Columns, Item, Number, Row, Shape, Sizes, Table, Value, shape

__all__ = [
    "Array", "Columns", "Item", "Number", "Row", "Shape", "Sizes", "Table", "Value", "shape", "summary", "thumbnail",
]  # fmt: skip
