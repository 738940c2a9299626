"""Modules: files to definitions, and names to what they mean across files.

Owns the texts and chunks of files (`texts`), loading (`files`), lookup of modules and names (`lookup`), who needs whom
(`graph`), free names (`free`), and what is said about imports and about definitions side by side (`diagnostics`).
"""

from potto.modules.diagnostics import module_diagnostics
from potto.modules.files import Files, load_file, open_files
from potto.modules.free import free_members, free_names, free_references
from potto.modules.graph import (
    dependencies,
    import_cycle,
    import_group,
    imported_files,
    is_recursive,
    refer,
    references,
    strongly_connected,
)
from potto.modules.lookup import (
    DefinitionTarget,
    ModuleTarget,
    Target,
    find_module,
    resolve,
    resolve_member,
    resolve_module,
)
from potto.modules.misread import syntax_diagnostics
from potto.modules.texts import (
    ChunkRef,
    DefinitionPlace,
    StatementRef,
    Unreadable,
    chunk_start,
    chunk_text,
    chunks,
    definition,
    imports,
    is_diffeo,
    names,
    parsed,
    source,
    statements,
)

__all__ = [
    "ChunkRef",
    "DefinitionPlace",
    "DefinitionTarget",
    "Files",
    "ModuleTarget",
    "StatementRef",
    "Target",
    "Unreadable",
    "chunk_start",
    "chunk_text",
    "chunks",
    "definition",
    "dependencies",
    "find_module",
    "free_members",
    "free_names",
    "free_references",
    "import_cycle",
    "import_group",
    "imported_files",
    "imports",
    "is_diffeo",
    "is_recursive",
    "load_file",
    "module_diagnostics",
    "names",
    "open_files",
    "parsed",
    "refer",
    "references",
    "resolve",
    "resolve_member",
    "resolve_module",
    "source",
    "statements",
    "strongly_connected",
    "syntax_diagnostics",
]
