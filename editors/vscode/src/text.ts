// Pieces of programs. Knows nothing of the editor.

/** The first and last line of the chunk that a line lies in: it starts where code stands in the first column. */
export function chunkAt(lines: readonly string[], line: number): [number, number] {
  const starts = (text: string): boolean => /^[^\s#)\]]/.test(text);
  let first = line;
  while (first > 0 && !starts(lines[first] ?? "")) first--;
  let last = line;
  while (last + 1 < lines.length && !starts(lines[last + 1] ?? "")) last++;
  while (last > first && /^\s*(#.*)?$/.test(lines[last] ?? "")) last--;
  return [first, last];
}

/** What to send to a prompt: a live expression without its marks, else the text without blank lines around it. */
export function entryOf(text: string): string {
  const live = /^\s*#>\s*(.*\S)\s*$/.exec(text);
  return live?.[1] ?? text.replace(/^(?:[ \t]*\r?\n)+/, "").trimEnd();
}

/** The place in UTF-16 of a place counted in code points. */
export function utf16(text: string, codePoints: number): number {
  let at = 0;
  for (let count = 0; count < codePoints && at < text.length; count++) at += (text.codePointAt(at) ?? 0) > 0xffff ? 2 : 1;
  return at;
}

/** What a file is called after it, or a folder that it lies in, was given another name; undefined if it was not. */
export function renamed(uri: string, from: string, to: string): string | undefined {
  return uri === from || uri.startsWith(`${from}/`) ? to + uri.slice(from.length) : undefined;
}
