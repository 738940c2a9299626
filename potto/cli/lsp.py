"""`potto lsp`: the language server."""

from __future__ import annotations

import argparse

from potto.cli.console import Console
from potto.extras import install_command

SUMMARY = "serve editors: diagnostics, hovers, derivatives, … (LSP)"
ORIGIN_HELP = "with --ws: pages from there may be the client (https://editor.example); else none may"
EXAMPLE = "  potto lsp --log potto.log"


def configure(parser: argparse.ArgumentParser) -> None:
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--stdio", action="store_true", help="speak on standard streams, which is the default")
    where.add_argument("--tcp", metavar="HOST:PORT", type=address, help="wait for one client on a socket")
    where.add_argument("--ws", metavar="HOST:PORT", type=address, help="wait for one client on a WebSocket")
    parser.add_argument("--origin", metavar="ORIGIN", action="append", default=[], help=ORIGIN_HELP)
    parser.add_argument("--log", metavar="FILE", help="write a log to a file")


def address(text: str) -> tuple[str, int]:
    """`HOST:PORT`, or a port alone for this computer; port 0 takes a free one."""
    host, _, port = text.rpartition(":")
    if not port.isdigit() or int(port) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is not HOST:PORT")
    return host.strip("[]") or "127.0.0.1", int(port)


def run(options: argparse.Namespace, console: Console) -> int:
    from potto_lsp import main

    try:
        if options.ws is None:
            return main.serve(options.tcp, options.log)
        return main.serve_websocket(options.ws, options.origin, options.log)
    except ImportError as error:
        if error.name != "websockets":
            raise
        console.complain(f"potto: --ws needs the library websockets: {install_command('websocket')}")
        return 2
    except OSError as error:  # the log or the socket
        console.complain(f"potto: {error.strerror or error}: {error.filename or options.tcp or options.ws or ''}")
        return 2
