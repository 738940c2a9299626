// The preview beside a file: passes what is to be drawn between its page and the language server.
import { randomBytes } from "node:crypto";
import { posix } from "node:path";
import * as vscode from "vscode";
import type { Server } from "../server";
import type { FromPreview, Samples, Scene, ToPreview } from "./messages";

const CONTENT_MODIFIED = -32801;
const panels = new Map<string, Preview>();

/** Open the preview of a file, or show another function in the one that is open. */
export async function openPreview(
  context: vscode.ExtensionContext,
  server: Server,
  uri: vscode.Uri,
  name: string | undefined,
  position: vscode.Position | undefined,
): Promise<void> {
  const client = await server.ready();
  if (!client) return;
  const scenes = await scenesOf(server, uri);
  const shown = name ?? at(scenes, position);
  if (shown === undefined || !scenes.some((scene) => scene.name === shown)) {
    void vscode.window.showInformationMessage(
      name === undefined
        ? "There is no function of numbers here that could be drawn."
        : `“${name}” cannot be drawn: that takes a function of one or more numbers that gives numbers.`,
    );
    return;
  }
  const open = panels.get(uri.toString());
  if (open) open.show(shown);
  else panels.set(uri.toString(), new Preview(context, server, uri, shown));
}

async function scenesOf(server: Server, uri: vscode.Uri): Promise<readonly Scene[]> {
  return (await server.client?.sendRequest<readonly Scene[]>("potto/scenes", { textDocument: { uri: uri.toString() } })) ?? [];
}

/** The function at a place: the last one that starts above it, else the first. */
function at(scenes: readonly Scene[], position: vscode.Position | undefined): string | undefined {
  const above = scenes.filter((scene) => position && scene.range.start.line <= position.line);
  return (above.at(-1) ?? scenes[0])?.name;
}

class Preview {
  private readonly panel: vscode.WebviewPanel;
  private readonly gone: vscode.Disposable[] = [];
  private readonly asked = new Map<number, vscode.CancellationTokenSource>();

  constructor(
    context: vscode.ExtensionContext,
    private readonly server: Server,
    private readonly uri: vscode.Uri,
    private shown: string,
  ) {
    const roots = ["dist", "media"].map((folder) => vscode.Uri.joinPath(context.extensionUri, folder));
    this.panel = vscode.window.createWebviewPanel(
      "potto.preview",
      `Preview ${posix.basename(uri.path)}`,
      { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true },
      { enableScripts: true, localResourceRoots: roots, retainContextWhenHidden: true },
    );
    this.panel.iconPath = vscode.Uri.joinPath(context.extensionUri, "icons", "potto.svg");
    this.panel.webview.html = page(this.panel.webview, context.extensionUri);
    this.gone.push(
      this.panel.webview.onDidReceiveMessage((message: FromPreview) => void this.received(message)),
      this.panel.onDidDispose(() => this.dispose()),
      vscode.workspace.onDidChangeTextDocument((event) => {
        // Another file may be imported here: what did not change is computed anew, and drawn as it was.
        if (event.document.languageId === "potto" && event.contentChanges.length) void this.refresh();
      }),
      server.onDidChangeState((state) => {
        if (state.kind === "running") void this.refresh();
      }),
    );
  }

  show(name: string): void {
    this.shown = name;
    this.panel.reveal(undefined, true);
    void this.refresh(name);
  }

  private dispose(): void {
    panels.delete(this.uri.toString());
    for (const source of this.asked.values()) source.cancel();
    for (const disposable of this.gone) disposable.dispose();
  }

  private send(message: ToPreview): void {
    void this.panel.webview.postMessage(message);
  }

  /** Tell the page what can be drawn now; it asks for samples of what it shows. */
  private async refresh(show: string | null = null): Promise<void> {
    try {
      const scenes = await scenesOf(this.server, this.uri);
      const finest = vscode.workspace.getConfiguration("potto").get("preview.resolution", 160);
      this.send({ type: "scenes", scenes, show, finest });
    } catch {
      // The text has changed meanwhile, and that change refreshes too.
    }
  }

  private async received(message: FromPreview): Promise<void> {
    switch (message.type) {
      case "ready":
        return this.refresh(this.shown);
      case "show":
        this.shown = message.name;
        return;
      case "cancel":
        this.asked.get(message.id)?.cancel();
        return;
      case "sample":
        return this.sample(message);
      case "save":
        return this.save(message.name, message.png);
    }
  }

  private async sample({ id, request }: FromPreview & { type: "sample" }): Promise<void> {
    const source = new vscode.CancellationTokenSource();
    this.asked.set(id, source);
    try {
      const { client } = this.server;
      if (!client) throw new Error("the language server is not running");
      const params = { textDocument: { uri: this.uri.toString() }, ...request };
      const samples = await client.sendRequest<Samples>("potto/sample", params, source.token);
      this.send({ type: "samples", id, samples });
    } catch (error) {
      const { code } = error as { code?: unknown };
      const outdated = source.token.isCancellationRequested || code === CONTENT_MODIFIED;
      this.send({ type: "failed", id, message: error instanceof Error ? error.message : String(error), outdated });
    } finally {
      this.asked.delete(id);
      source.dispose();
    }
  }

  private async save(name: string, png: string): Promise<void> {
    const folder = vscode.Uri.joinPath(this.uri, "..");
    const target = await vscode.window.showSaveDialog({
      defaultUri: vscode.Uri.joinPath(folder, `${name}.png`),
      filters: { PNG: ["png"] },
    });
    if (!target) return;
    const data = Uint8Array.from(Buffer.from(png.slice(png.indexOf(",") + 1), "base64"));
    try {
      await vscode.workspace.fs.writeFile(target, data);
    } catch (error) {
      void vscode.window.showErrorMessage(`The picture was not saved: ${String(error)}`);
    }
  }
}

function page(webview: vscode.Webview, root: vscode.Uri): string {
  const nonce = randomBytes(16).toString("base64");
  const script = webview.asWebviewUri(vscode.Uri.joinPath(root, "dist", "preview.js")).toString();
  const style = webview.asWebviewUri(vscode.Uri.joinPath(root, "media", "preview.css")).toString();
  const policy = `default-src 'none'; img-src data: blob:; style-src ${webview.cspSource}; script-src 'nonce-${nonce}'`;
  return `<!DOCTYPE html>
<html lang="en">
<head>
  <meta charset="UTF-8">
  <meta http-equiv="Content-Security-Policy" content="${policy}">
  <link rel="stylesheet" href="${style}">
  <title>Potto preview</title>
</head>
<body>
  <header id="choices"></header>
  <main id="pictures"></main>
  <p id="probe" aria-live="off"></p>
  <p id="status" role="status"></p>
  <p id="problem" role="alert" hidden></p>
  <section id="parameters" aria-label="Parameters"></section>
  <script nonce="${nonce}" src="${script}"></script>
</body>
</html>`;
}
