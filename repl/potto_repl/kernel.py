"""The prompt as a Jupyter kernel: cells are entries, pictures are images. `potto kernel install` makes it known.

Owns `PottoKernel`. Imported by nothing but `python -m potto_repl.kernel`; needs the extra `jupyter`.
"""

from __future__ import annotations

from typing import Any

from ipykernel.kernelapp import IPKernelApp
from ipykernel.kernelbase import Kernel

from potto import __version__
from potto.applications.framed import Image
from potto_repl.backslash_symbols import expanded, named, readable, typed
from potto_repl.complete import candidates
from potto_repl.editing import indentation, is_over
from potto_repl.notebook_cells import placed, result
from potto_repl.reply import Part
from potto_repl.respond import respond, stream
from potto_repl.session import Conversation


class PottoKernel(Kernel):
    """One notebook's conversation."""

    implementation = "potto"
    implementation_version = __version__
    banner = f"Potto {__version__}"
    language_info = {"name": "potto", "mimetype": "text/x-potto", "file_extension": ".po"}  # noqa: RUF012  (theirs)

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.conversation = Conversation(["."])

    def do_execute(
        self, code: str, silent: bool, store_history: bool = True, user_expressions: Any = None,
        allow_stdin: bool = False, **more: Any,
    ) -> dict[str, Any]:  # fmt: skip
        """Answer the entries of a cell; the first error ends it."""
        self.conversation.cell = self.execution_count
        try:
            for text in placed(code):
                wrong = [part for part in self._answered(text, silent) if part.is_error]
                if wrong:
                    return self._failed("PottoError", wrong[0].plain())
        except KeyboardInterrupt:
            return self._failed("KeyboardInterrupt", "interrupted; everything that was defined is still there")
        payload = [{"source": "ask_exit", "keepkernel": False}] if self.conversation.leaving else []
        self.conversation.leaving = False
        return {"status": "ok", "execution_count": self.execution_count, "payload": payload, "user_expressions": {}}

    def _answered(self, text: str, silent: bool) -> list[Part]:
        said = []
        for part in stream(self.conversation, readable(text)):
            said.append(part)
            if not silent:
                self._show(part)
        return said

    def _show(self, part: Part) -> None:
        picture = (part.data or {}).get("_picture")
        if picture is not None:
            import base64

            data = {"text/plain": part.text}
            if isinstance(picture, Image):
                data["image/png"] = base64.b64encode(picture.png()).decode()
            data["image/svg+xml"] = picture.svg()  # with axes and a scale, which bare pixels have not
            self.send_response(self.iopub_socket, "display_data", {"data": data, "metadata": {}})
            return
        found = result(part)
        if found is not None:
            content = {"data": found, "metadata": {}, "execution_count": self.execution_count}
            self.send_response(self.iopub_socket, "execute_result", content)
            return
        stream_name = "stderr" if part.is_complaint else "stdout"
        self.send_response(self.iopub_socket, "stream", {"name": stream_name, "text": part.plain() + "\n"})

    def _failed(self, name: str, value: str) -> dict[str, Any]:
        error = {"ename": name, "evalue": value.partition("\n")[0], "traceback": []}
        self.send_response(self.iopub_socket, "error", error)
        return {"status": "error", "execution_count": self.execution_count, **error}

    def do_complete(self, code: str, cursor_pos: int) -> dict[str, Any]:
        """What can stand at the cursor; for `\\theta` its symbol, for `\\the` the names that begin so."""
        word = typed(code[:cursor_pos])
        if word is not None:
            symbol = expanded(word)
            matches, length = [symbol] if symbol is not None else named(word), len(word)
        else:
            found = candidates(self.conversation, code[:cursor_pos])
            matches, length = [item.text for item in found], found[0].length if found else 0
        return {"status": "ok", "matches": matches, "cursor_start": cursor_pos - length, "cursor_end": cursor_pos,
                "metadata": {}}  # fmt: skip

    def do_is_complete(self, code: str) -> dict[str, Any]:
        """Whether a console should hand the cell in."""
        return {"status": "complete"} if is_over(code) else {"status": "incomplete", "indent": indentation(code)}

    def do_inspect(self, code: str, cursor_pos: int, detail_level: int = 0, omit_sections: Any = ()) -> dict[str, Any]:
        """What the name at the cursor means."""
        import re

        before = re.search(r"[^\W\d][\w.]*$", code[:cursor_pos])
        after = re.match(r"\w*", code[cursor_pos:])
        name = (before[0] if before else "") + (after[0] if after else "")
        reply = respond(self.conversation, f":{'source' if detail_level else 'doc'} {name}")
        found = bool(name) and not reply.failed
        return {"status": "ok", "found": found, "data": {"text/plain": reply.text} if found else {}, "metadata": {}}


if __name__ == "__main__":
    IPKernelApp.launch_instance(kernel_class=PottoKernel)
