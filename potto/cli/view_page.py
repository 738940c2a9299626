"""The page of `potto view` in a browser, and what answers it: bound to this machine, behind a token, without a network.

Owns `serve` and `Answers`. The page sends the newest values only when the last answer has come, so that nothing queues.
"""

from __future__ import annotations

import contextvars
import secrets
import time
from concurrent.futures import ThreadPoolExecutor
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

import msgspec

from potto.applications.integral_scenes import IntegralScene
from potto.diagnostics import PottoError
from potto.evaluating.world import World
from potto.ide.display.scenes import scenes

HOST = "127.0.0.1"
MOST = 1 << 16  # bytes of a question
FRAME = 0.016  # seconds

PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Potto: integral view</title>
<style>body{font:14px sans-serif;margin:12px;background:#fff;color:#222}label{display:block;margin:4px 0}
input[type=range]{width:300px;vertical-align:middle}#shots{display:flex;gap:16px;flex-wrap:wrap}
.surface:hover path{stroke-width:4}#said{color:#b00;white-space:pre-wrap}#time{color:#777}</style>
<p><select id="name" aria-label="function"></select> by <select id="wrt" aria-label="parameter"></select>
integral <input id="which" type="number" min="1" value="1" style="width:4em" aria-label="integral">
<button id="pin">Pin</button> <span id="time"></span></p>
<div id="sliders"></div><pre id="said"></pre><div id="shots"><div id="now"></div><div id="pinned"></div></div>
<script nonce="NONCE">
const $ = id => document.getElementById(id), ask = async (path, body) =>
  (await fetch(path + location.search, {method: "POST", body: JSON.stringify(body)})).json();
let values = {}, busy = false, newest = false;
const fill = (select, names, chosen) =>
  select.replaceChildren(...names.map(n => new Option(n, n, false, n === chosen)));
async function open(name) {
  const found = await ask("/open", {name});
  $("said").textContent = found.error || "";
  if (found.error) { $("now").replaceChildren(); return; }
  values = found.values; fill($("wrt"), Object.keys(values), found.wrt); $("which").value = 1;
  $("sliders").replaceChildren(...Object.entries(values).map(([n, v]) => {
    const label = document.createElement("label"), slider = document.createElement("input");
    const told = document.createElement("output"), reach = Math.max(1, Math.abs(v));
    Object.assign(slider, {type: "range", min: v - reach, max: v + reach, step: reach / 500, value: v, name: n});
    told.textContent = v;
    slider.oninput = () => { values[n] = +slider.value; told.textContent = slider.value; look(); };
    label.append(n + " ", slider, " ", told); return label; }));
  look();
}
async function look() {
  if (busy) { newest = true; return; }
  busy = true;
  try {
    const which = +$("which").value - 1;
    const found = await ask("/look", {name: $("name").value, values, which, wrt: $("wrt").value});
    $("said").textContent = found.error || "";
    if (!found.error) { $("now").innerHTML = found.svg;
      $("time").textContent = (found.seconds * 1000).toFixed(1) + " ms" + (found.slow ? ", more than a frame" : ""); }
  } catch (gone) { $("said").textContent = "potto view has ended; start it again"; }
  busy = false;
  if (newest) { newest = false; look(); }
}
$("name").onchange = () => open($("name").value);
$("wrt").onchange = $("which").onchange = look;
$("pin").onclick = () => { $("pinned").innerHTML = $("now").innerHTML; };
ask("/names", {}).then(found => { fill($("name"), found.names, found.chosen); open($("name").value); });
</script></html>
"""


class Answers:
    """What the page asks, answered: values in, values out. One question at a time."""

    def __init__(self, world: World, file: str, name: str | None, given: dict[str, str], wrt: str | None) -> None:
        self.world, self.file, self.name, self.given, self.wrt = world, file, name, given, wrt
        self._scenes: dict[str, IntegralScene] = {}
        self._context = contextvars.copy_context()  # with the settings of the command
        self._thread = ThreadPoolExecutor(max_workers=1)  # a program that is compiled belongs to a thread

    def answer(self, path: str, asked: dict[str, Any]) -> dict[str, Any] | None:
        """What goes back as JSON; None for a path that there is not. An error of the program is an `error`."""
        return self._thread.submit(self._context.run, self._answered, path, asked).result()

    def close(self) -> None:
        """Answer nothing more."""
        self._thread.shutdown()

    def _answered(self, path: str, asked: dict[str, Any]) -> dict[str, Any] | None:
        if self.world.refresh():
            self._scenes.clear()
        try:
            match path:
                case "/names":
                    names = [scene.name for scene in scenes(self.world.db, self.file)]
                    return {"names": names, "chosen": self.name or (names[0] if names else "")}
                case "/open":
                    found = self._scene(str(asked["name"]))
                    wrt = self.wrt if self.wrt in found.values else found.moving
                    return {"values": found.values, "wrt": wrt}
                case "/look":
                    return self._look(asked)
        except PottoError as error:
            return {"error": str(error)}
        except (KeyError, TypeError, ValueError):
            return {"error": "the question is not one of this page"}
        return None

    def _scene(self, name: str) -> IntegralScene:
        if name not in self._scenes:
            given = self.given if name == self.name else {}
            self._scenes[name] = IntegralScene(self.world, self.file, name, given)
        return self._scenes[name]

    def _look(self, asked: dict[str, Any]) -> dict[str, Any]:
        found = self._scene(str(asked["name"]))
        values = {name: float(asked["values"][name]) for name in found.values}
        start = time.perf_counter()
        shot = found.look(values, str(asked["wrt"]), int(asked["which"]))
        seconds = time.perf_counter() - start
        return {"svg": shot.svg, "numbers": msgspec.to_builtins(shot.numbers), "seconds": seconds,
                "slow": seconds > FRAME}  # fmt: skip


def serve(answers: Answers, port: int = 0) -> tuple[ThreadingHTTPServer, str]:
    """A server that answers on this machine alone, not yet running, and the address of its page, with its token."""
    token = secrets.token_urlsafe(24)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self._allowed() and urlsplit(self.path).path == "/":
                nonce = secrets.token_urlsafe(12)
                rules = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'nonce-{nonce}'; "
                self._send(200, "text/html; charset=utf-8", PAGE.replace("NONCE", nonce).encode(),
                           rules + "connect-src 'self'")  # fmt: skip
            else:
                self._send(404, "text/plain", b"not found\n")

        def do_POST(self) -> None:
            length = self.headers.get("Content-Length", "")
            if not self._allowed() or not length.isdecimal() or int(length) > MOST:
                return self._send(404, "text/plain", b"not found\n")
            try:
                asked = msgspec.json.decode(self.rfile.read(int(length)), type=dict[str, Any])
            except msgspec.MsgspecError:
                return self._send(400, "text/plain", b"not JSON\n")
            found = answers.answer(urlsplit(self.path).path, asked)
            if found is None:
                return self._send(404, "text/plain", b"not found\n")
            return self._send(200, "application/json", msgspec.json.encode(found))

        def _allowed(self) -> bool:
            """The right token, and asked for by the name of this machine: no other page can have sent it here."""
            given = parse_qs(urlsplit(self.path).query).get("token", [""])[0]
            here = self.headers.get("Host") == f"{HOST}:{self.server.server_port}"  # type: ignore[attr-defined]
            return here and secrets.compare_digest(given.encode(), token.encode())

        def _send(self, status: int, kind: str, body: bytes, rules: str = "default-src 'none'") -> None:
            self.send_response(status)
            heads = {"Content-Type": kind, "Content-Length": str(len(body)), "Cache-Control": "no-store",
                     "Content-Security-Policy": rules, "Referrer-Policy": "no-referrer"}  # fmt: skip
            for name, value in heads.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: Any) -> None:
            """Nothing: the terminal is for people."""

    server = ThreadingHTTPServer((HOST, port), Handler)
    server.daemon_threads = True
    return server, f"http://{HOST}:{server.server_port}/?token={token}"
