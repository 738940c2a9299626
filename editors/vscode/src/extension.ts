// Potto in Visual Studio Code: what is registered when the first Potto file is opened. The server starts beside it.
import { began, took } from "./clock";
import * as vscode from "vscode";
import type { Location, Position } from "vscode-languageclient/node";
import { Derivatives, evaluate } from "./answers";
import { openPreview } from "./preview/panel";
import { onInterpreterChanged } from "./python";
import { Server, type ServerState } from "./server";
import { explain, showMenu, showStatus } from "./status";
import { openRepl, runFile, runSelection } from "./terminal";
import { utf16 } from "./text";
import { openView } from "./view/panel";

/** What other extensions, and tests, may use. */
export interface Api {
  readonly state: () => ServerState["kind"];
  /** The state in words. */
  readonly explanation: () => string;
  readonly ready: () => Promise<boolean>;
  /** What it took to load the extension and to register everything, without waiting for a processor. */
  readonly activationMilliseconds: number;
}

const EXAMPLE = `# How much of the unit square lies below a line that moves
def cover(t)
    integral ([0, 1], [0, 1]) [x + y < t] d(x, y)

#> deriv(cover)(dt=(0.5, 1))
#= (0.125, 0.5)
`;

const SETTLED = 1000; // ms after a program was written, until what it needs is there too

let server: Server | undefined;
const loaded = took(began);

export function activate(context: vscode.ExtensionContext): Api {
  const started = { wall: performance.now(), processor: process.cpuUsage() };
  const made = new Server();
  server = made;
  const derivatives = new Derivatives(made);
  context.subscriptions.push(showStatus(made), derivatives);
  registerCommands(context, made, derivatives);
  watch(context, made);
  setImmediate(() => void made.start());
  return {
    state: () => made.state.kind,
    explanation: () => explain(made.state),
    ready: async () => (await made.ready()) !== undefined,
    activationMilliseconds: loaded + took(started),
  };
}

export function deactivate(): Promise<void> | undefined {
  return server?.dispose();
}

function registerCommands(context: vscode.ExtensionContext, server: Server, derivatives: Derivatives): void {
  const command = (name: string, run: (...args: never[]) => unknown): void => {
    context.subscriptions.push(vscode.commands.registerCommand(`potto.${name}`, run));
  };
  command("restartServer", () => server.restart());
  command("showOutput", () => server.log.show(true));
  command("showMenu", () => showMenu(server));
  command("selectServer", () => selectServer());
  command("toggleTrace", () => chooseTrace(server));
  command("newExample", async () => {
    await vscode.window.showTextDocument(await vscode.workspace.openTextDocument({ language: "potto", content: EXAMPLE }));
  });
  command("openRepl", () => openRepl(server, vscode.window.activeTextEditor?.document));
  command("runFile", async (uri?: vscode.Uri | string) => {
    const document = await documentOf(uri);
    if (document) await runFile(server, document);
  });
  command("runSelection", async () => {
    if (vscode.window.activeTextEditor) await runSelection(server, vscode.window.activeTextEditor);
  });
  command("preview", async (uri?: vscode.Uri | string, name?: unknown) => {
    const document = await documentOf(uri);
    if (!document) return;
    const position = vscode.window.activeTextEditor?.selection.active;
    await openPreview(context, server, document.uri, typeof name === "string" ? name : undefined, position);
  });
  command("view", () => openView(context, server));
  command("evaluate", (uri?: vscode.Uri | string, expression?: unknown) => evaluateCommand(server, uri, expression));
  command("differentiate", async (uri?: vscode.Uri | string, name?: unknown) => {
    const document = await documentOf(uri);
    const shown = typeof name === "string" ? name : await definitionAtCursor();
    if (document && shown) await derivatives.show(document.uri, shown);
  });
  command("more", async (uri?: vscode.Uri | string, name?: unknown) => {
    const document = await documentOf(uri);
    const asked = typeof name === "string" ? name : await definitionAtCursor();
    if (document && asked) await chooseOffer(server, document.uri.toString(), asked);
  });
  command("showReferences", (uri: string, position: Position, locations: Location[]) => {
    const range = ({ start, end }: Location["range"]): vscode.Range =>
      new vscode.Range(start.line, start.character, end.line, end.character);
    return vscode.commands.executeCommand(
      "editor.action.showReferences",
      vscode.Uri.parse(uri),
      new vscode.Position(position.line, position.character),
      locations.map((location) => new vscode.Location(vscode.Uri.parse(location.uri), range(location.range))),
    );
  });
  command("rename", async (uri: string, offset: number) => {
    const editor = await vscode.window.showTextDocument(vscode.Uri.parse(uri));
    const position = editor.document.positionAt(utf16(editor.document.getText(), offset));
    editor.selection = new vscode.Selection(position, position);
    await vscode.commands.executeCommand("editor.action.rename");
  });
}

function watch(context: vscode.ExtensionContext, server: Server): void {
  const elsewhere = (): void => {
    if (!vscode.workspace.getConfiguration("potto").get("server.path")) void server.restart();
  };
  context.subscriptions.push(
    vscode.workspace.onDidChangeConfiguration((event) => {
      if (event.affectsConfiguration("potto.server")) void server.restart();
      else if (event.affectsConfiguration("python.defaultInterpreterPath")) elsewhere();
      if (event.affectsConfiguration("potto.trace")) server.trace.refresh();
    }),
    vscode.workspace.onDidGrantWorkspaceTrust(() => void server.start()),
    onInterpreterChanged(elsewhere),
    whenInstalled(() => server.lookAgain()),
  );
}

/** Call back when Potto may have been installed: into the workspace, in a terminal, or while another window was used. */
function whenInstalled(look: () => void): vscode.Disposable {
  let timer: NodeJS.Timeout | undefined;
  const soon = (): void => {
    clearTimeout(timer);
    timer = setTimeout(look, SETTLED);
  };
  const environments = vscode.workspace.createFileSystemWatcher("**/{.venv,venv,env}");
  const programs = vscode.workspace.createFileSystemWatcher("**/{.venv,venv,env}/{bin,Scripts}/potto*");
  return vscode.Disposable.from(
    environments,
    programs,
    environments.onDidCreate(soon),
    environments.onDidChange(soon), // one in the place of another
    programs.onDidCreate(soon),
    programs.onDidChange(soon),
    vscode.window.onDidChangeWindowState(({ focused }) => focused && soon()),
    vscode.window.onDidCloseTerminal(soon),
    vscode.window.onDidChangeActiveTextEditor((editor) => editor?.document.languageId === "potto" && soon()),
    vscode.workspace.onDidChangeWorkspaceFolders(soon),
    { dispose: () => clearTimeout(timer) },
  );
}

/** A file that a command is about: the one given, else the one that is edited. */
async function documentOf(uri: vscode.Uri | string | undefined): Promise<vscode.TextDocument | undefined> {
  if (uri) return vscode.workspace.openTextDocument(typeof uri === "string" ? vscode.Uri.parse(uri) : uri);
  const document = vscode.window.activeTextEditor?.document;
  if (document?.languageId === "potto") return document;
  void vscode.window.showInformationMessage("Open a Potto file first.");
  return undefined;
}

interface Offer {
  readonly title: string;
  readonly command: string;
  readonly arguments: readonly unknown[];
}

/** Let the user choose from what the server can do with a definition, and do it. */
async function chooseOffer(server: Server, uri: string, name: string): Promise<void> {
  const client = await server.ready();
  const asked = { command: "potto.more", arguments: [uri, name] };
  const found = await client?.sendRequest<{ offers: Offer[] }>("workspace/executeCommand", asked);
  const items = (found?.offers ?? []).map((offer) => ({ label: offer.title, offer }));
  const picked = items.length ? await vscode.window.showQuickPick(items, { title: name }) : undefined;
  if (picked) await vscode.commands.executeCommand(picked.offer.command, ...picked.offer.arguments);
}

/** Without an expression: the file runs if it was named (that is what its lens asks for), else one is asked for. */
async function evaluateCommand(
  server: Server,
  uri: vscode.Uri | string | undefined,
  expression: unknown,
): Promise<string | undefined> {
  const document = await documentOf(uri);
  if (!document) return undefined;
  if (typeof expression === "string") return evaluate(server, document.uri, expression);
  if (uri) {
    await runFile(server, document);
    return undefined;
  }
  const editor = vscode.window.activeTextEditor;
  const value = editor && !editor.selection.isEmpty ? editor.document.getText(editor.selection) : "";
  const asked = value || (await vscode.window.showInputBox({ title: "Evaluate", prompt: "An expression in the names of this file" }));
  return asked ? evaluate(server, document.uri, asked) : undefined;
}

/** The name of the definition that the cursor is in. */
async function definitionAtCursor(): Promise<string | undefined> {
  const editor = vscode.window.activeTextEditor;
  if (!editor) return undefined;
  const symbols = await vscode.commands.executeCommand<vscode.DocumentSymbol[] | undefined>(
    "vscode.executeDocumentSymbolProvider",
    editor.document.uri,
  );
  const here = symbols?.find((symbol) => symbol.range.contains(editor.selection.active));
  if (!here) void vscode.window.showInformationMessage("Put the cursor into a definition first.");
  return here?.name;
}

/** Ask for the program, and keep it in the setting. */
async function selectServer(): Promise<void> {
  const picked = await vscode.window.showQuickPick(
    [
      { label: "$(folder-opened) Choose a program…", detail: "potto, or a Python that has it", act: "browse" },
      { label: "$(search) Look for it", detail: "in the selected Python environment, the workspace and PATH", act: "look" },
      { label: "$(gear) Open the setting", detail: "potto.server.path", act: "setting" },
    ],
    { title: "Potto: where is the language server?" },
  );
  const configuration = vscode.workspace.getConfiguration("potto");
  const target = vscode.workspace.workspaceFolders ? vscode.ConfigurationTarget.Workspace : vscode.ConfigurationTarget.Global;
  if (picked?.act === "browse") {
    const [file] = (await vscode.window.showOpenDialog({ openLabel: "Use", title: "potto, or a Python that has it" })) ?? [];
    if (file) await configuration.update("server.path", file.fsPath, target);
  } else if (picked?.act === "look") {
    const { globalValue, workspaceValue } = configuration.inspect("server.path") ?? {};
    if (workspaceValue) await configuration.update("server.path", undefined, vscode.ConfigurationTarget.Workspace);
    if (globalValue) await configuration.update("server.path", undefined, vscode.ConfigurationTarget.Global);
    await vscode.commands.executeCommand("potto.restartServer");
  } else if (picked) await vscode.commands.executeCommand("workbench.action.openSettings", "potto.server.path");
}

async function chooseTrace(server: Server): Promise<void> {
  const picked = await vscode.window.showQuickPick(["off", "messages", "verbose"], { title: "Trace the language server" });
  if (!picked) return;
  await vscode.workspace.getConfiguration("potto").update("trace.server", picked, vscode.ConfigurationTarget.Global);
  if (picked !== "off") server.trace.show();
}
