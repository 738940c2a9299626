"""What keys do at the prompt: Enter, Tab, indentation, pastes, and suggestions that only the right arrow takes.

Owns `bindings`. What text means is decided in `editing` and `backslash_symbols`.
"""

from __future__ import annotations

from prompt_toolkit.application import get_app
from prompt_toolkit.application.current import get_app_or_none
from prompt_toolkit.buffer import Buffer
from prompt_toolkit.completion import CompleteEvent, get_common_complete_suffix
from prompt_toolkit.enums import DEFAULT_BUFFER
from prompt_toolkit.filters import Condition, Filter, emacs_mode, has_focus, is_searching, vi_insert_mode
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.keys import Keys

from potto_repl.backslash_symbols import expanded, typed
from potto_repl.editing import INDENT, indentation, is_over, unprompted, untabbed


def bindings() -> KeyBindings:
    """The keys of the prompt, over those of prompt_toolkit."""
    keys = KeyBindings()
    typing = has_focus(DEFAULT_BUFFER) & ~is_searching & (emacs_mode | vi_insert_mode)
    _lines(keys, typing)
    _blanks(keys, typing)
    _suggestions(keys, typing)
    return keys


def _lines(keys: KeyBindings, typing: Filter) -> None:
    """Enter, pastes and completion."""
    pasted: list[str] = [""]

    @keys.add("enter", filter=typing)
    def _enter(event: KeyPressEvent) -> None:
        buffer = event.current_buffer
        if buffer.complete_state is not None and buffer.complete_state.current_completion is not None:
            buffer.complete_state = None  # what was chosen stays
            return
        hand_in(buffer, buffer.text == pasted[0])

    @keys.add("escape", "enter", filter=typing)
    def _newline(event: KeyPressEvent) -> None:
        event.current_buffer.insert_text("\n" + indentation(event.current_buffer.document.text_before_cursor))

    @keys.add(Keys.BracketedPaste, filter=typing)
    def _paste(event: KeyPressEvent) -> None:
        text = untabbed(unprompted(event.data)).rstrip("\n")
        event.current_buffer.insert_text(text)
        pasted[0] = event.current_buffer.text

    @keys.add("tab", filter=typing)
    def _tab(event: KeyPressEvent) -> None:
        complete(event.current_buffer)


def _blanks(keys: KeyBindings, typing: Filter) -> None:
    """Indentation: a step less with Shift-Tab and Backspace."""

    @keys.add(" ", filter=typing & blank_line)
    def _blank(event: KeyPressEvent) -> None:
        """Lines that come in a rush, without being marked as a paste, bring their own indentation."""
        buffer = event.current_buffer
        if len(event.key_sequence) == 1 and event.key_processor.input_queue:
            buffer.delete_before_cursor(len(buffer.document.current_line_before_cursor))
            while event.key_processor.input_queue and event.key_processor.input_queue[0].key == " ":
                event.key_processor.input_queue.popleft()
                buffer.insert_text(" ")
        buffer.insert_text(" ")

    @keys.add("s-tab", filter=typing & blank_line)
    @keys.add("backspace", filter=typing & blank_line & Condition(lambda: _indented()))
    def _less(event: KeyPressEvent) -> None:
        event.current_buffer.delete_before_cursor(indent_before(event.current_buffer))


def _suggestions(keys: KeyBindings, typing: Filter) -> None:
    """The right arrow alone takes a suggestion: the other keys that would, move as they do without one."""
    suggested = typing & emacs_mode & Condition(lambda: get_app().current_buffer.suggestion is not None)

    @keys.add("c-e", filter=suggested)
    def _end(event: KeyPressEvent) -> None:
        buffer = event.current_buffer
        buffer.cursor_position += buffer.document.get_end_of_line_position()

    @keys.add("c-f", filter=suggested)
    def _forward(event: KeyPressEvent) -> None:
        event.current_buffer.cursor_right()

    @keys.add("escape", "f", filter=suggested)
    def _word(event: KeyPressEvent) -> None:
        buffer = event.current_buffer
        buffer.cursor_position += buffer.document.find_next_word_ending() or 0


@Condition
def blank_line() -> bool:
    """Whether there are only blanks before the cursor on a line that is not the first."""
    app = get_app_or_none()
    if app is None:
        return False
    document = app.current_buffer.document
    return document.cursor_position_row > 0 and not document.current_line_before_cursor.strip()


def _indented() -> bool:
    return bool(get_app().current_buffer.document.current_line_before_cursor)


def indent_before(buffer: Buffer) -> int:
    """How many blanks one step of indentation takes off."""
    before = len(buffer.document.current_line_before_cursor)
    return min(before, before % INDENT or INDENT)


def hand_in(buffer: Buffer, whole: bool = False) -> None:
    """Enter: the entry is handed in if it is over, else the line is."""
    document = buffer.document
    last_line = "\n" not in document.text_after_cursor.rstrip()
    if last_line and (is_over(buffer.text) or (whole and is_over(buffer.text + "\n"))):
        buffer.validate_and_handle()
    else:
        buffer.insert_text("\n" + indentation(document.text_before_cursor))


def complete(buffer: Buffer) -> None:
    """Tab: a symbol, indentation, or the menu."""
    before = buffer.document.text_before_cursor
    word = typed(before)
    symbol = expanded(word) if word is not None else None
    if word is not None and symbol is not None:
        buffer.delete_before_cursor(len(word))
        buffer.insert_text(symbol)
    elif not buffer.document.current_line_before_cursor.strip() and before:
        buffer.insert_text(" " * (INDENT - len(buffer.document.current_line_before_cursor) % INDENT))
    elif buffer.complete_state is not None:
        buffer.complete_next()
    else:
        _offer(buffer)


def _offer(buffer: Buffer) -> None:
    """The only completion, or a menu and what all of them begin with: at once, for Enter may come before the menu."""
    document = buffer.document
    found = list(buffer.completer.get_completions(document, CompleteEvent(completion_requested=True)))
    if len(found) == 1:
        buffer.apply_completion(found[0])
    elif found:
        buffer.insert_text(get_common_complete_suffix(document, found))
        buffer.start_completion()
