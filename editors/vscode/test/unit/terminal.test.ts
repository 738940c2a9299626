import assert from "node:assert/strict";
import { test } from "node:test";
import type { TextDocument, TextEditor } from "vscode";
import type { Server } from "../../src/server";
import { openRepl, runSelection } from "../../src/terminal";
import { terminals } from "./vscode.stub";

const server = { program: async () => ({ command: "potto", args: [] }), start: async () => undefined } as unknown as Server;

function document(path: string, more: object = {}): TextDocument {
  const lines = ["def f(x)", "    x^2"];
  return {
    uri: { scheme: "file", fsPath: path }, languageId: "potto", isDirty: false,
    getText: () => lines.join("\n"), lineAt: (line: number) => ({ text: lines[line] }), ...more,
  } as unknown as TextDocument;
}

test("a prompt that is opened takes the keyboard, so that what is typed does not land in the program", async () => {
  terminals.length = 0;
  await openRepl(server, document("/w/f.po"));
  assert.deepEqual(terminals.map(({ name, args, kept }) => [name, args, kept]), [["Potto: f.po", ["repl", "/w/f.po"], [false]]]);
});

test("so does one that is there already", async () => {
  terminals.length = 0;
  await openRepl(server, document("/w/g.po"));
  await openRepl(server, document("/w/g.po"));
  assert.deepEqual(terminals.map(({ kept }) => kept), [[false, false]]);
});

test("so does one without a file, one for another file, and one in the place of one that has ended", async () => {
  terminals.length = 0;
  await openRepl(server, undefined);
  await openRepl(server, document("/w/h.po"));
  for (const shown of terminals) shown.exitStatus = { code: 0 };
  await openRepl(server, document("/w/h.po"));
  assert.deepEqual(terminals.map(({ args, kept }) => [args, kept]), [
    [["repl"], [false]], [["repl", "/w/h.po"], [false]], [["repl", "/w/h.po"], [false]],
  ]);
});

test("a program with changes is saved first, and the prompt takes the keyboard after that", async () => {
  terminals.length = 0;
  const order: string[] = [];
  const save = async (): Promise<boolean> => (order.push(`saved before ${terminals.length} terminals`), true);
  await openRepl(server, document("/w/i.po", { isDirty: true, save }));
  assert.deepEqual([order, terminals.map(({ kept }) => kept)], [["saved before 0 terminals"], [[false]]]);
});

test("what is sent from the editor leaves the keyboard there, for the next", async () => {
  terminals.length = 0;
  const place = { isEmpty: true, active: { line: 0 } };
  const editor = { document: document("/w/j.po"), selections: [place] } as unknown as TextEditor;
  await runSelection(server, editor);
  await runSelection(server, editor);
  assert.deepEqual(terminals.map(({ kept, sent }) => [kept, sent.length]), [[[true, true], 2]]);
  assert.match(terminals[0]?.sent[0] ?? "", /def f\(x\)/);
});

test("without a program there is no terminal", async () => {
  terminals.length = 0;
  const none = { program: async () => undefined, start: async () => undefined } as unknown as Server;
  assert.equal(await openRepl(none, document("/w/k.po")), undefined);
  assert.deepEqual(terminals, []);
});
