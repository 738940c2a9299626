// The integral view: a panel that shows the integral at the cursor, and follows it. Its page comes from the server.
import { randomBytes } from "node:crypto";
import * as vscode from "vscode";
import type { Server } from "../server";

interface Parts {
  readonly body: string;
  readonly style: string;
  readonly script: string;
}

interface Place {
  readonly line: number;
  readonly character: number;
}

interface Range {
  readonly start: Place;
  readonly end: Place;
}

interface Viewed {
  readonly name: string;
  readonly range: Range;
  readonly which: number;
  readonly lit: string;
  readonly conditions: readonly { readonly equation: string; readonly range: Range }[];
}

type FromView =
  | { readonly type: "ready" }
  | { readonly type: "ask"; readonly id: number; readonly path: string; readonly body: unknown }
  | { readonly type: "reveal"; readonly equation: string }
  | { readonly type: "chosen"; readonly name: string };

let open: View | undefined;

/** Open the view beside the editor, or bring it to the front. */
export async function openView(context: vscode.ExtensionContext, server: Server): Promise<void> {
  if (!(await server.ready()) || !server.client) return;
  if (open) {
    open.reveal();
    return;
  }
  try {
    const parts = await server.client.sendRequest<Parts>("potto/viewPage", {});
    open = new View(vscode.Uri.joinPath(context.extensionUri, "icons", "potto.svg"), server, parts);
  } catch (error) {
    void vscode.window.showErrorMessage(`There is no integral view: ${messageOf(error)}`);
  }
}

const messageOf = (error: unknown): string => (error instanceof Error ? error.message : String(error));
const rangeOf = ({ start, end }: Range): vscode.Range => new vscode.Range(start.line, start.character, end.line, end.character);

class View {
  private readonly panel: vscode.WebviewPanel;
  private readonly gone: vscode.Disposable[] = [];
  private uri: vscode.Uri | undefined;
  private viewed: Viewed | undefined;
  private asking = false;
  private again = false;
  private loaded = false;

  constructor(
    icon: vscode.Uri,
    private readonly server: Server,
    parts: Parts,
  ) {
    this.panel = vscode.window.createWebviewPanel(
      "potto.view",
      "Integral",
      { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true },
      { enableScripts: true, localResourceRoots: [], retainContextWhenHidden: true },
    );
    this.panel.iconPath = icon;
    this.gone.push(
      this.panel.webview.onDidReceiveMessage((message: FromView) => void this.received(message)),
      this.panel.onDidDispose(() => this.dispose()),
      vscode.window.onDidChangeTextEditorSelection(() => void this.follow()),
      vscode.window.onDidChangeActiveTextEditor(() => void this.follow()),
      vscode.workspace.onDidChangeTextDocument(({ document, contentChanges }) => {
        if (document.languageId !== "potto" || !contentChanges.length || !this.uri) return;
        this.send({ type: "changed" });
        void this.follow();
      }),
      server.onDidChangeState((state) => {
        if (state.kind === "running") this.send({ type: "changed" });
      }),
    );
    this.panel.webview.html = page(parts);
  }

  reveal(): void {
    this.panel.reveal(undefined, true);
    void this.follow();
  }

  private dispose(): void {
    open = undefined;
    for (const disposable of this.gone) disposable.dispose();
  }

  private send(message: unknown): void {
    if (this.loaded) void this.panel.webview.postMessage(message);
  }

  /** Show what the cursor is in. The newest place wins: while one is asked for, only the last of the others is kept. */
  private async follow(): Promise<void> {
    if (this.asking) {
      this.again = true;
      return;
    }
    const editor = vscode.window.activeTextEditor;
    if (!this.loaded || !this.panel.visible || editor?.document.languageId !== "potto") return;
    this.asking = true;
    const { uri } = editor.document;
    const position = editor.selection.active;
    try {
      const params = { textDocument: { uri: uri.toString() }, position: { line: position.line, character: position.character } };
      const found = await this.server.client?.sendRequest<Viewed | null>("potto/viewed", params);
      if (found) this.shown(uri, found);
    } catch {
      // The text has changed meanwhile, and that change asks again.
    }
    this.asking = false;
    if (this.again) {
      this.again = false;
      void this.follow();
    }
  }

  private shown(uri: vscode.Uri, found: Viewed): void {
    const other = uri.toString() !== this.uri?.toString();
    this.uri = uri;
    this.viewed = found;
    this.panel.title = `Integral: ${found.name}`;
    const { name, which, lit } = found;
    this.send({ type: other ? "file" : "follow", name, which, lit });
  }

  private async received(message: FromView): Promise<void> {
    switch (message.type) {
      case "ready":
        this.loaded = true;
        return this.follow();
      case "ask":
        return this.ask(message.id, message.path, message.body);
      case "reveal":
        return this.select(message.equation);
      case "chosen":
        return this.lookAt(message.name);
    }
  }

  private async ask(id: number, path: string, question: unknown): Promise<void> {
    let answer: unknown;
    try {
      if (!this.uri || !this.server.client) throw new Error("the language server is not running");
      const params = { textDocument: { uri: this.uri.toString() }, path, question };
      answer = await this.server.client.sendRequest("potto/view", params);
    } catch (error) {
      answer = { error: messageOf(error) };
    }
    void this.panel.webview.postMessage({ type: "answer", id, answer });
  }

  /** Another function was chosen in the page: its conditions are those that can be clicked now. */
  private async lookAt(name: string): Promise<void> {
    if (!this.uri) return;
    const symbols = await vscode.commands.executeCommand<vscode.DocumentSymbol[] | undefined>(
      "vscode.executeDocumentSymbolProvider",
      this.uri,
    );
    const there = symbols?.find((symbol) => symbol.name === name)?.selectionRange.start;
    if (!there) return;
    const params = { textDocument: { uri: this.uri.toString() }, position: { line: there.line, character: there.character } };
    this.viewed = (await this.server.client?.sendRequest<Viewed | null>("potto/viewed", params)) ?? this.viewed;
  }

  /** A surface was clicked: its condition is selected. */
  private async select(equation: string): Promise<void> {
    const condition = this.viewed?.conditions.find((each) => each.equation === equation);
    if (!condition || !this.uri) return;
    const shown = vscode.window.visibleTextEditors.find((editor) => editor.document.uri.toString() === this.uri?.toString());
    const column = shown?.viewColumn ?? vscode.ViewColumn.One;
    await vscode.window.showTextDocument(this.uri, { viewColumn: column, selection: rangeOf(condition.range) });
  }
}

function page({ body, style, script }: Parts): string {
  const nonce = randomBytes(16).toString("base64");
  const policy = `default-src 'none'; img-src data:; style-src 'nonce-${nonce}'; script-src 'nonce-${nonce}'`;
  return `<!DOCTYPE html>
<html lang="en">
<head>
  <meta charset="UTF-8">
  <meta http-equiv="Content-Security-Policy" content="${policy}">
  <title>Potto integral view</title>
  <style nonce="${nonce}">${style}</style>
</head>
<body>
${body}<script nonce="${nonce}">${script}</script>
</body>
</html>`;
}
