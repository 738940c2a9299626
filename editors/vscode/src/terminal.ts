// Potto in the terminal: a prompt with a file's names, and scripts.
import * as vscode from "vscode";
import type { Server } from "./server";
import { chunkAt, entryOf } from "./text";

const NAME = "Potto";
const [PASTE, PASTED] = ["\u001b[200~", "\u001b[201~"]; // a terminal's marks around a text that is pasted

interface Prompt {
  readonly terminal: vscode.Terminal;
  readonly file: string | undefined;
}

let prompt: Prompt | undefined;

/** The prompt with the names of a file; one that is open for that file is used again. Who opens it is to type there. */
export async function openRepl(
  server: Server,
  document: vscode.TextDocument | undefined,
  preserveFocus = false,
): Promise<vscode.Terminal | undefined> {
  const file = document?.uri.scheme === "file" && document.languageId === "potto" ? document.uri.fsPath : undefined;
  if (prompt && prompt.file === file && prompt.terminal.exitStatus === undefined) {
    prompt.terminal.show(preserveFocus);
    return prompt.terminal;
  }
  if (document?.isDirty && file) await document.save();
  const program = await programOrComplaint(server);
  if (!program) return undefined;
  const terminal = vscode.window.createTerminal({
    name: file ? `${NAME}: ${vscode.workspace.asRelativePath(file)}` : NAME,
    shellPath: program.command,
    shellArgs: [...program.args, "repl", ...(file ? [file] : [])],
    iconPath: new vscode.ThemeIcon("graph-line"),
  });
  prompt = { terminal, file };
  terminal.show(preserveFocus);
  return terminal;
}

/** Send what is selected to the prompt; the whole definition at the cursor if nothing is. The next is sent from there. */
export async function runSelection(server: Server, editor: vscode.TextEditor): Promise<void> {
  const texts = editor.selections.map((selection) => selected(editor.document, selection)).filter((text) => text.trim());
  if (!texts.length) return;
  const before = prompt?.terminal;
  const terminal = await openRepl(server, editor.document, true);
  if (!terminal) return;
  if (terminal !== before) await new Promise((resolve) => setTimeout(resolve, 1500)); // it reads once it has drawn its prompt
  for (const text of texts) terminal.sendText(`${PASTE}${entryOf(text)}${PASTED}`, true);
}

function selected(document: vscode.TextDocument, selection: vscode.Selection): string {
  if (!selection.isEmpty) return document.getText(selection);
  const line = document.lineAt(selection.active.line).text;
  if (/^\s*#>/.test(line)) return line;
  const lines = document.getText().split(/\r\n|\r|\n/);
  const [first, last] = chunkAt(lines, selection.active.line);
  return lines.slice(first, last + 1).join("\n");
}

/** Run a file as a script, in the terminal of a task. */
export async function runFile(server: Server, document: vscode.TextDocument): Promise<void> {
  const saved = await savedAs(document);
  if (!saved) return;
  const program = await programOrComplaint(server);
  if (!program) return;
  const execution = new vscode.ProcessExecution(program.command, [...program.args, "run", saved.fsPath]);
  const folder = vscode.workspace.getWorkspaceFolder(saved) ?? vscode.TaskScope.Workspace;
  const name = `run ${vscode.workspace.asRelativePath(saved)}`;
  const task = new vscode.Task({ type: "process" }, folder, name, NAME, execution);
  task.presentationOptions = { reveal: vscode.TaskRevealKind.Always, panel: vscode.TaskPanelKind.Dedicated, clear: true };
  await vscode.tasks.executeTask(task);
}

/** The file that holds a text as it is now: one without a name gets one first, if the user gives it. */
async function savedAs(document: vscode.TextDocument): Promise<vscode.Uri | undefined> {
  if (document.isUntitled) return vscode.workspace.save(document.uri);
  if (document.uri.scheme === "file") return !document.isDirty || (await document.save()) ? document.uri : undefined;
  void vscode.window.showInformationMessage("Save this program as a file on disk first.");
  return undefined;
}

async function programOrComplaint(server: Server): Promise<{ command: string; args: readonly string[] } | undefined> {
  const program = await server.program();
  if (!program) await server.start(); // which says what is missing
  return program;
}
