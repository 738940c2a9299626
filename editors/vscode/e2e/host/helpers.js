// What the tests in the extension host share.
const assert = require("node:assert/strict");
const fs = require("node:fs");
const vscode = require("vscode");

const folder = vscode.workspace.workspaceFolders[0].uri;
const uri = (name) => vscode.Uri.joinPath(folder, name);
const run = (command, ...args) => vscode.commands.executeCommand(`vscode.execute${command}`, ...args);
const api = () => vscode.extensions.getExtension("potto.potto").exports;

/** Open a file; tests edit documents and never save them, and each starts with the text that is on disk. */
async function open(name) {
  const document = await vscode.workspace.openTextDocument(uri(name));
  const editor = await vscode.window.showTextDocument(document);
  const whole = new vscode.Range(document.positionAt(0), document.positionAt(document.getText().length));
  const disk = fs.readFileSync(document.uri.fsPath, "utf8");
  if (document.getText() !== disk) await editor.edit((edit) => edit.replace(whole, disk));
  return { document, editor };
}

/** The position of a word, or of a place in it. */
function find(document, word, after = 0) {
  const offset = document.getText().indexOf(word);
  assert.ok(offset >= 0, `${word} is not in the text`);
  return document.positionAt(offset + after);
}

/** Wait until something holds; what it gave. The limit is that of a machine that does much else. */
async function eventually(ask, holds, seconds = 60) {
  const until = Date.now() + 1000 * seconds;
  for (;;) {
    const found = await ask();
    if (holds(found)) return found;
    if (Date.now() > until) assert.fail(`not so in ${seconds} s: ${JSON.stringify(found)}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

const text = (contents) => contents.map((content) => (typeof content === "string" ? content : content.value)).join("\n");

module.exports = { api, eventually, find, folder, open, run, text, uri };
