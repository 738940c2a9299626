"""Completion: what can stand where the cursor is.

Owns `completions`, `completions_after` and `resolve_completion`. What stands in front of the cursor decides
(`completion_place`); types and documentation are looked up when an item is resolved, so that a list costs no inference.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from msgspec.structs import replace

from potto.data.files import beside
from potto.ide.actions.imports import import_edit, importable, new_line
from potto.ide.completion.modules import member_items, module_items, name_items
from potto.ide.completion.parts_of_values import changed_items, part_items
from potto.ide.completion.pending_calls import call_in
from potto.ide.completion.place import CompletionPlace, place_in
from potto.ide.completion.signature_help import called_in
from potto.ide.hover.derivatives import fence
from potto.ide.hover.hovers import builtin_markdown, measure_markdown, measure_signature, module_markdown
from potto.ide.hover.local_names import TITLES, local_type
from potto.ide.model import Completion, CompletionKind, Completions
from potto.ide.names.descriptions import definition_head, documentation, type_text, written_kind, written_kinds
from potto.ide.names.keywords import KEYWORDS, LETTERS, SPECIALS, TYPES, Keyword
from potto.ide.names.places import Site, chunk_at, owner, site_after, site_at
from potto.ide.names.symbols import LocalSymbol
from potto.measures import COMPOSITIONS, MEASURES, Measure
from potto.measures.composed import Composition
from potto.modules import DefinitionTarget, ModuleTarget, resolve
from potto.modules.data import path_of
from potto.modules.lookup import bindings, preludes
from potto.modules.texts import imports
from potto.modules.workspace import module_name
from potto.primitives import PRIMITIVES
from potto.query import Database
from potto.source import Span
from potto.types import TupleOf, format_type, groups_of

MOST_IMPORTS = 100  # proposals from other modules in one list
MOST_NAMES = 500  # of the file and of its imports: nobody reads more, and each further letter leaves fewer

# Groups of proposals in the order of their likelihood.
_ARGUMENT, _LOCAL, _OWN, _IMPORTED, _BUILTIN, _WORD, _OTHER = "0123456"
_CLAUSE, _TOP = "00", "0"  # before all others: what closes an open `if`, what begins a line at the top
_OPERAND = re.compile(r"(?<![^\W\d])(?!(?:if|then|else|in|and|or|not|let|integral|sum)\s*$)(?:\w+|[)\]])\s+$")
_OPENERS = {
    "then": r"\bif\b", "else": r"\bthen\b", "in": r"\b(?:let|for|sum)\b", "d": r"\bintegral\b|∫",
}  # fmt: skip


def completions(db: Database, file: str, offset: int, trigger: str = "") -> Completions:
    """What can stand at an offset. `trigger`: the character that was just typed, if that is the reason for asking."""
    return _at(db, site_at(db, file, offset), trigger)


def completions_after(db: Database, file: str, before: str) -> Completions:
    """What can follow a text that belongs to no file, as at a prompt: the names are those of `file` and of the entries
    before it. Spans are relative to the text."""
    return _at(db, site_after(file, before), "")


def _at(db: Database, site: Site, trigger: str) -> Completions:
    file, place = site.file, place_in(site.text, site.offset)
    match place.kind:
        case "letter":
            return Completions(place.span, tuple(_letters(place)))
        case "module":
            return Completions(place.span, tuple(module_items(db, file, place)))
        case "imported":
            return Completions(place.span, tuple(name_items(db, site, place)))
        case "member":
            return Completions(place.span, tuple(member_items(db, site, place)))
        case "measure":
            return Completions(place.span, tuple(_measures(place)))
        case "type":
            return Completions(place.span, (*_types(place), *_records(db, site.file, place)))
        case "part":
            return Completions(place.span, tuple(part_items(db, site, place)))
        case "file":
            return Completions(place.span, tuple(_data_files(site.file, place)))
        case "changed" if fields := tuple(changed_items(db, site, place)):
            return Completions(place.span, fields)
        case "clause":
            return Completions(place.span, (_keyword(KEYWORDS[place.path], place, _WORD),))
        case "new" | "nothing":
            return Completions(place.span, ())
    if trigger == " ":
        return Completions(place.span, ())
    with db.evaluating():
        return _everything(db, site, place)


def _everything(db: Database, site: Site, place: CompletionPlace) -> Completions:
    items: dict[str, Completion] = {}
    for item in (*_arguments(db, site, place), *_locals(db, site, place)):
        items.setdefault(item.label, item)
    names, left_out = _likeliest(list(_file_names(db, site, place)), place.word)
    for item in (*names, *builtin_items(place), *_keywords(site, place)):
        items.setdefault(item.label, item)
    others = _others(db, site.file, place, items) if place.word else []
    incomplete = left_out or not place.word or len(others) >= MOST_IMPORTS
    return Completions(place.span, (*items.values(), *others), incomplete)


def _likeliest(names: list[Completion], word: str) -> tuple[list[Completion], bool]:
    """As many names as a list may have, those that begin like the word first; and whether some are left out."""
    begun = word.casefold()
    if len(names) > MOST_NAMES:
        names.sort(key=lambda item: not item.label.casefold().startswith(begun))
    return names[:MOST_NAMES], len(names) > MOST_NAMES


def _letters(place: CompletionPlace) -> Iterator[Completion]:
    for name, letter in LETTERS.items():
        if name.startswith(place.word) or name.casefold().startswith(place.word.casefold()):
            written = f"\\{name}"
            yield Completion(letter, "symbol", place.span, letter, name, written, detail=written)


def _measures(place: CompletionPlace) -> Iterator[Completion]:
    every: tuple[Measure | Composition, ...] = (*MEASURES.values(), *COMPOSITIONS.values())
    for measure in every:
        name = measure.name
        holes = ", ".join(f"${{{number}:{p}}}" for number, p in enumerate(measure.parameters, 1) if p != "...")
        yield Completion(
            name, "measure", place.span, f"{name}({holes})", name, snippet=True,
            detail=measure_signature(measure), data=("measure", name),
        )  # fmt: skip


def _types(place: CompletionPlace) -> Iterator[Completion]:
    for name in ("Real", "Real*", "Diffeo[2]"):
        doc = TYPES[name.rstrip("*").partition("[")[0]]
        yield Completion(name, "type", place.span, name, name, documentation=doc)


def _records(db: Database, file: str, place: CompletionPlace) -> Iterator[Completion]:
    """The records of a file and of its imports, as types."""
    for item in _file_names(db, site_after(file, ""), place):
        if item.kind == "record":
            yield item


def _data_files(file: str, place: CompletionPlace) -> Iterator[Completion]:
    """The files of data in the folder that is written so far."""
    folder = place.word[: place.word.rfind("/") + 1]
    span = Span(place.span.start + len(folder), place.span.end)
    for name in beside(Path(path_of(file, folder or "."))):
        yield Completion(name, "file", span, name, name)


def _arguments(db: Database, site: Site, place: CompletionPlace) -> Iterator[Completion]:
    """The parameters that the call at hand can be given by name."""
    call = None if site.chunk is None else call_in(db, site.chunk, site.offset - site.chunk.start)
    if call is None or not call.fresh or call.measure:
        return
    called = called_in(db, site.file, call, site.chunk)
    if called is None:
        return
    for group in groups_of(called.type)[called.given :]:
        for number, parameter in enumerate(group):
            if parameter.name is not None and parameter.name not in call.keywords:
                label, sort = f"{parameter.name}=", f"{_ARGUMENT}{number:02}"
                dual = isinstance(parameter.type, TupleOf) and parameter.type.dual
                written = f"{label}(${{1:0}}, ${{2:1}})" if dual else label
                detail = format_type(parameter.type)
                yield Completion(
                    label, "argument", place.span, written, sort, parameter.name, snippet=dual, detail=detail
                )


def _locals(db: Database, site: Site, place: CompletionPlace) -> Iterator[Completion]:
    if site.writing is None or place.kind == "top":
        return
    file, (chunk, relative) = site.file, site.writing
    for number, binder in chunk.index(db).visible(relative):
        if binder.span.start <= relative <= binder.span.end:
            continue
        kind: CompletionKind = "parameter" if binder.kind == "parameter" else "variable"
        data = ("local", file, str(chunk.start), str(number), binder.name)
        sort = f"{_LOCAL}{binder.name}"
        yield Completion(binder.name, kind, place.span, binder.name, sort, description=TITLES[binder.kind], data=data)


def _file_names(db: Database, site: Site, place: CompletionPlace) -> Iterator[Completion]:
    """The names at the top of the file; at a prompt also those of earlier entries."""
    file = site.file
    own = None if site.writing is None else owner(db, site.writing[0])  # a constant cannot be made of itself
    for each in (file, *preludes(db, file)):
        for name, kind in written_kinds(db, each):
            if _has_letters(place.word, name) and not (each == file and name == own and kind == "constant"):
                data = ("definition", each, name)
                yield Completion(name, kind, place.span, name, _OWN + name, data=data)
        for item in imports(db, each):
            for bound, _ in bindings(item):
                target = resolve(db, each, bound)
                if isinstance(target, DefinitionTarget):
                    found = definition_item(db, target.file, target.name, place.span, _IMPORTED)
                    yield replace(found, label=bound, insert=bound, sort=_IMPORTED + bound, description=item.module)
                elif isinstance(target, ModuleTarget):
                    data = ("module", target.file, target.dotted)
                    yield Completion(bound, "module", place.span, bound, _IMPORTED + bound, data=data)


def _has_letters(word: str, name: str) -> bool:
    """Whether a name contains the letters of a word in their order: an editor shows no others. In a file of a thousand
    definitions, listing them all takes longer than checking this."""
    letters = iter(name.casefold())
    return all(letter in letters for letter in word.casefold())


def definition_item(db: Database, file: str, name: str, span: Span, group: str) -> Completion:
    """A definition as a proposal. Its text shows its kind; its type is looked up on resolving."""
    kind: CompletionKind = written_kind(db, file, name)
    return Completion(name, kind, span, name, group + name, data=("definition", file, name))


def builtin_items(place: CompletionPlace) -> Iterator[Completion]:
    """The builtins as proposals."""
    for name, special in SPECIALS.items():
        kind: CompletionKind = "builtin" if "->" in special.type else "constant"
        yield Completion(name, kind, place.span, name, _BUILTIN + name, data=("builtin", name))
    for primitive in PRIMITIVES.values():
        if primitive.surface and not primitive.truth and primitive.name.isidentifier() and primitive.name != "sum":
            name = primitive.name
            yield Completion(name, "builtin", place.span, name, _BUILTIN + name, data=("builtin", name))


def _keywords(site: Site, place: CompletionPlace) -> Iterator[Completion]:
    chunk = site.chunk
    before = "" if chunk is None else site.text[chunk.start : site.offset - len(place.word)]
    goes_on = bool(_OPERAND.search(before)) and place.kind != "top"
    for keyword in KEYWORDS.values():
        group = _WORD
        if keyword.where == "top":
            if place.kind != "top" and keyword.name != "diffeo":
                continue
            group = _TOP if place.kind == "top" else _WORD
        if keyword.where == "clause":
            if not _fits(keyword.name, before, chunk is not None and chunk.diffeo):
                continue
            group = _CLAUSE if goes_on and keyword.name in _OPENERS else _WORD
        if keyword.name == "diffeo" and place.kind != "top":
            keyword = replace(keyword, snippet="diffeo(${0:x})")
        yield _keyword(keyword, place, group)


def _keyword(keyword: Keyword, place: CompletionPlace, group: str) -> Completion:
    kind: CompletionKind = "snippet" if "$" in keyword.snippet else "keyword"
    return Completion(
        keyword.name, kind, place.span, keyword.snippet, group + keyword.name, snippet=kind == "snippet",
        data=("keyword", keyword.name),
    )  # fmt: skip


def _fits(word: str, before: str, diffeo: bool) -> bool:
    """Whether a word that continues something can stand here: whether what it continues is still open."""
    opener = _OPENERS.get(word)
    if opener is not None:
        closer = r"\bd\s*\(" if word == "d" else rf"\b{word}\b"
        return len(re.findall(opener, before)) > len(re.findall(closer, before))
    if word in ("inverse", "where"):
        return re.search(r"\bdiffeo\b", before) is not None or (diffeo and bool(before.strip()))
    return word != "as" and bool(before.strip())


def _others(db: Database, file: str, place: CompletionPlace, items: dict[str, Completion]) -> list[Completion]:
    """Definitions of other modules; choosing one imports it. The import is worked out on resolving."""
    found: list[Completion] = []
    for name, target in importable(db, file, place.word, items, MOST_IMPORTS):
        module = module_name(db, file, target)
        if module is not None:
            item = definition_item(db, target, name, place.span, _OTHER)
            found.append(replace(item, description=f"import from {module}", data=("import", file, target, name)))
    return found


# Resolving


def resolve_completion(db: Database, item: Completion) -> Completion:
    """A proposal with its type, its documentation, and the import that it needs."""
    match item.data:
        case ("definition", file, name):
            return _with_definition(db, item, file, name)
        case ("import", file, target, name):
            edit = import_edit(db, file, target, name)
            return replace(_with_definition(db, item, target, name), edits=() if edit is None else (edit,))
        case ("import", file, target, name, dotted):
            edit = new_line(db, file, f"import {dotted}")
            return replace(_with_definition(db, item, target, name), edits=(edit,))
        case ("module", file, dotted):
            return replace(item, documentation=module_markdown(db, file, dotted))
        case ("builtin", name):
            markdown = builtin_markdown(name)
            detail = markdown.splitlines()[1].partition(" : ")[2]
            return replace(item, detail=detail, documentation=markdown)
        case ("measure", name):
            return replace(item, documentation=measure_markdown(name))
        case ("keyword", name):
            keyword = KEYWORDS[name]
            return replace(item, documentation=f"{fence(keyword.form)}\n\n{keyword.doc}")
        case ("local", file, start, number, name):
            return _with_local(db, item, file, int(start), int(number), name)
        case _:
            return item


def _with_definition(db: Database, item: Completion, file: str, name: str) -> Completion:
    said = documentation(db, file, name)
    markdown = fence(definition_head(db, file, name)) + (f"\n\n{said}" if said else "")
    return replace(item, detail=type_text(db, file, name), documentation=markdown)


def _with_local(db: Database, item: Completion, file: str, start: int, number: int, name: str) -> Completion:
    chunk = chunk_at(db, file, start)
    binders = () if chunk is None else chunk.index(db).binders
    if chunk is None or number >= len(binders) or binders[number].name != name:
        return item  # the text has changed since
    shown = format_type(local_type(db, LocalSymbol(chunk, number, binders[number])))
    what = TITLES[binders[number].kind]
    return replace(item, detail=shown, documentation=f"{fence(f'{name} : {shown}')}\n\n{what}")
