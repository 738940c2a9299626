"""Commands that ask about expressions and names: types, derivatives in symbols, surfaces, documentation, sources."""

from __future__ import annotations

import difflib
import os

from potto.calculus.explanation.layout import DerivativeText
from potto.checking.facts import surfaces
from potto.checking.typeset import derivative_latex, function_derivative
from potto.modules import DefinitionTarget, ModuleTarget, chunk_start, names, resolve
from potto.modules.lookup import find_module, resolve_module, scope
from potto.modules.texts import chunk_text
from potto.reports import pages
from potto.reports.render import display_name
from potto.syntax import nodes, print_expression
from potto.types import format_type, interface
from potto.types.types import Diffeo, Function
from potto_repl.backslash_symbols import pretty
from potto_repl.documentation import documentation, documented
from potto_repl.expressions import Asked, checked, without_parens
from potto_repl.registry import COMMANDS, command
from potto_repl.reply import Part, Refusal, answer
from potto_repl.session import Conversation

UNNAMED = "it"  # what a function without a name is called


@command("type", "t", argument="EXPR", completes="expression")
def show_type(session: Conversation, text: str) -> Part:
    """Show the type of an expression without evaluating it."""
    asked = checked(session, text, ":type EXPR")
    type = format_type(asked.type)
    return Part("answer", f"{text.strip()} : {type}", {"type": type}, prose=True)


@command("deriv", "d", argument="FUNCTION", completes="expression")
def show_derivative(session: Conversation, text: str) -> Part:
    """Show the derivative of a function in symbols: interior, boundary, surfaces.

    For numbers at a point write `deriv(f)((0.3, 1))`, or `:grad f(0.3)` for all parameters at once.
    """
    asked = checked(session, text, ":deriv f")
    expr = without_parens(asked.expr)
    if isinstance(expr, nodes.Apply) and not isinstance(asked.type, Function | Diffeo):
        raise Refusal(
            f"`{text.strip()}` is a value, and the derivative is that of a function",
            f"write `:grad {text.strip()}` for numbers, or name the function alone",
        )
    if not isinstance(asked.type, Function | Diffeo):
        raise Refusal(f"`{text.strip()}` is not a function, so there is nothing to differentiate by")
    found = derivative_text(session, asked)

    def named(text: str) -> str:
        return text.replace(f"d{UNNAMED} :", "its derivative :", 1) if found.name == UNNAMED else text

    data = {"name": found.name, "type": found.type, "tangent": found.tangent, "text": named(found.text),
            "_latex": lambda: derivative_latex(found, "f" if found.name == UNNAMED else found.name)}  # fmt: skip
    return Part("answer", named(found.typeset if session.options.unicode else found.text), data)


def derivative_text(session: Conversation, asked: Asked) -> DerivativeText:
    """The derivative of a function in symbols, of a name under its own."""
    return function_derivative(session.db, session.file, asked.expr, UNNAMED)


@command("surfaces", argument="EXPR", completes="expression")
def show_surfaces(session: Conversation, text: str) -> Part:
    """Show where the value or the integrand of an expression jumps, and which parameters move that place."""
    asked = checked(session, text, ":surfaces f")
    expr = without_parens(asked.expr)
    while isinstance(expr, nodes.Apply):  # a call jumps where the function does
        expr = without_parens(expr.function)
        asked = checked(session, print_expression(expr), ":surfaces f")
    found = surfaces(session.db, session.file, asked.expr)
    moved: dict[str, str] = {}
    if isinstance(asked.type, Function):
        for item in derivative_text(session, asked).integrals:
            for surface in item.surfaces:
                by = ", ".join(surface.moved_by)
                where = f"; {', '.join(surface.roots)}" if surface.roots else ""
                moved[surface.equation] = f"{f'moved by {by}' if by else 'moved by no parameter'}{where}"
    lines = [f"{equation}   ({how})" for equation, how in moved.items()] or list(found)
    shown = pretty("\n".join(lines), session.options.unicode) if lines else "none: nothing in it jumps"
    return answer(shown, surfaces=list(moved) or list(found))


@command("doc", argument="NAME", completes="name")
def show_doc(session: Conversation, text: str) -> Part:
    """Say what a name means: its type and comment, or what a builtin computes and how it is differentiated.

    `name?` asks the same.
    """
    name = text.strip()
    if not name:
        raise Refusal("a name is missing", "write `:doc sqrt`, or `sqrt?`")
    target = _target(session, name)
    found = documentation(session.db, name, target if isinstance(target, DefinitionTarget) else None)
    if found is None and isinstance(target, ModuleTarget):
        return show_module(session, target.file)
    if found is None:
        raise _unknown(session, name)
    return Part("answer", found, {"name": name, "doc": found}, prose=True)


def _target(session: Conversation, name: str) -> DefinitionTarget | ModuleTarget | None:
    path, _, last = name.rpartition(".")
    found = resolve(session.db, session.file, name)
    if found is not None or not path:
        return found
    module = resolve_module(session.db, session.file, path)
    return None if module is None else resolve(session.db, module, last)


def _unknown(session: Conversation, name: str) -> Refusal:
    known = [*session.names(), *documented()]
    near = difflib.get_close_matches(name, known, 1)
    if name in COMMANDS:
        return Refusal(f"`{name}` is a command of the prompt", f"`:help {name}` says what it does")
    help = f"did you mean `{near[0]}`?" if near else "`:browse` lists what does"
    return Refusal(f"`{name}` means nothing here", help)


@command("source", argument="NAME", completes="name")
def show_source(session: Conversation, text: str) -> Part:
    """Show the text of a definition and where it stands. `name??` asks the same."""
    name = text.strip()
    if not name:
        raise Refusal("a name is missing", "write `:source f`, or `f??`")
    target = _target(session, name)
    if not isinstance(target, DefinitionTarget):
        if documentation(session.db, name, None) is not None:
            raise Refusal(f"`{name}` is built in", f"`:doc {name}` says what it does")
        raise _unknown(session, name)
    body = chunk_text(session.db, target.file, target.name) or ""
    source = session.source(target.file)
    line = 1 if source is None else source.position(chunk_start(session.db, target.file, target.name)).line + 1
    place = f"{display_name(target.file)}:{line}"
    return answer(f"# {place}\n{body}", file=target.file, line=line, source=body)


@command("browse", "b", argument="[MODULE]", completes="name")
def browse(session: Conversation, text: str) -> Part:
    """List the names that are defined with their types, or those of a module or a file."""
    name = text.strip()
    if name:
        file = resolve_module(session.db, session.file, name) or find_module(session.db, session.file, name)
        if file is None and os.path.exists(name):
            file = session.world.key(name)
        if file is None:
            raise Refusal(f"there is no module `{name}`", "`:browse` alone lists what is defined here")
        return show_module(session, file)
    found = session.names()
    rows = {n: _typed(session, target) for n, target in found.items()}
    if not rows:
        return answer("nothing is defined yet", names={})
    return answer("\n".join(f"{n} : {type}" for n, type in reversed(rows.items())), names=rows)


def show_module(session: Conversation, file: str) -> Part:
    """The names of a file with their types."""
    rows = {}
    for name in (*names(session.db, file), *(n for n in scope(session.db, file) if n not in names(session.db, file))):
        target = resolve(session.db, file, name)
        rows[name] = _typed(session, target if isinstance(target, DefinitionTarget) else None)
    return answer("\n".join(f"{n} : {type}" for n, type in rows.items()) or "it defines nothing", names=rows)


def _typed(session: Conversation, target: DefinitionTarget | None) -> str:
    return "module" if target is None else format_type(interface(session.db, target.file, target.name).type)


@command("explain", argument="[CODE]", completes="code")
def explain(session: Conversation, text: str) -> Part:
    """Explain a diagnostic at length, with a wrong and a right program; without a code, the last one."""
    code = text.strip().upper() or session.last_code
    if code is None:
        raise Refusal("there was no diagnostic yet", "write `:explain P0301`")
    page = pages.page(code)
    if page is None:
        near = difflib.get_close_matches(code, pages.codes(), 1)
        help = f"did you mean `{near[0]}`?" if near else "a code is like P0301"
        raise Refusal(f"there is no diagnostic {code}", help)
    return Part("answer", page.text.rstrip(), {"code": code, "title": page.title}, prose=True)
