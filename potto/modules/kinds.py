"""The kinds of diagnostics about files, modules and the names in them."""

from __future__ import annotations

from potto.diagnostics import declare

NO_MODULE = declare("P0202", "a module that is not found")
NOT_IN_MODULE = declare("P0203", "a name that its module does not have")
CIRCULAR = declare("P0204", "a name that is imported in a circle")
ITSELF = declare("P0205", "a module that imports itself")
DEFINED_TWICE = declare("P0206", "a name that is defined twice")
TWO_MEANINGS = declare("P0207", "a name that is imported with two meanings")
UNREADABLE = declare("P0208", "a file that cannot be read")
NOT_TEXT = declare("P0209", "a file that is not UTF-8 text")

UNUSED_IMPORT = declare("P0620", "an import that is not used", "warning")
HIDES_IMPORT = declare("P0621", "a definition that hides an import", "warning")
HIDES_BUILTIN = declare("P0622", "a name that hides a builtin", "warning")
TWO_FILES = declare("P0623", "a module name that means two files", "warning")
IMPORTED_TWICE = declare("P0624", "an import that is repeated", "warning")
MUTUAL = declare("P0625", "modules that import each other", "warning")
