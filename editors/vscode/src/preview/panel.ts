// The preview beside a file: passes what is to be drawn between its page and the language server.
import { randomBytes } from "node:crypto";
import { posix } from "node:path";
import * as vscode from "vscode";
import type { Server } from "../server";
import { renamed } from "../text";
import type { FromPreview, Pixel, PixelRequest, Samples, Scene, ToPreview } from "./messages";

const CONTENT_MODIFIED = -32801;
const FAR = 1e300; // pixels: a surface that is nowhere in the picture
const LATER = 500; // ms after a file has changed, when the server knows of it too
const panels = new Map<string, Preview>();

/** Open the preview of a file, or show another function in the one that is open. */
export async function openPreview(
  context: vscode.ExtensionContext,
  server: Server,
  uri: vscode.Uri,
  name: string | undefined,
  position: vscode.Position | undefined,
): Promise<void> {
  if (!(await server.ready())) return;
  const scenes = await scenesOf(server, uri).catch((error: unknown) => {
    void vscode.window.showErrorMessage(`There is no preview: ${messageOf(error)}`);
  });
  if (!scenes) return;
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

const messageOf = (error: unknown): string => (error instanceof Error ? error.message : String(error));

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
  private timer: NodeJS.Timeout | undefined;
  private outdated = false; // while it is covered
  private wanted: string | null = null; // the function to show next, if it was asked for

  constructor(
    context: vscode.ExtensionContext,
    private readonly server: Server,
    private uri: vscode.Uri,
    private shown: string,
  ) {
    const roots = ["dist", "media"].map((folder) => vscode.Uri.joinPath(context.extensionUri, folder));
    this.panel = vscode.window.createWebviewPanel(
      "potto.preview",
      title(uri),
      { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true },
      { enableScripts: true, localResourceRoots: roots, retainContextWhenHidden: true },
    );
    this.panel.iconPath = vscode.Uri.joinPath(context.extensionUri, "icons", "potto.svg");
    this.panel.webview.html = page(this.panel.webview, context.extensionUri);
    this.gone.push(
      this.panel.webview.onDidReceiveMessage((message: FromPreview) => void this.received(message)),
      this.panel.onDidDispose(() => this.dispose()),
      this.panel.onDidChangeViewState(() => this.uncovered()),
      server.onDidChangeState((state) => {
        if (state.kind === "running") void this.refresh();
      }),
    );
    this.follow();
  }

  /** Follow the program. It may import other files: what did not change is computed anew, and drawn as it was. */
  private follow(): void {
    const programs = vscode.workspace.createFileSystemWatcher("**/*.{po,diffeo}");
    const unlessOpen = (uri: vscode.Uri): void => {
      if (!vscode.workspace.textDocuments.some((document) => document.uri.toString() === uri.toString())) this.later();
    };
    this.gone.push(
      programs,
      programs.onDidChange(unlessOpen),
      programs.onDidCreate(unlessOpen),
      programs.onDidDelete(() => this.later()),
      vscode.workspace.onDidChangeTextDocument((event) => {
        if (event.document.languageId === "potto" && event.contentChanges.length) void this.refresh();
      }),
      vscode.workspace.onDidRenameFiles(({ files }) => {
        for (const { oldUri, newUri } of files) if (this.move(oldUri, newUri)) this.later();
      }),
      { dispose: () => clearTimeout(this.timer) },
    );
  }

  private later(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.refresh(), LATER);
  }

  /** A file, or a folder, has another name: whether it is ours. */
  private move(from: vscode.Uri, to: vscode.Uri): boolean {
    const own = this.uri.toString();
    const now = renamed(own, from.toString(), to.toString());
    if (now === undefined) return false;
    panels.delete(own);
    this.uri = vscode.Uri.parse(now);
    panels.set(this.uri.toString(), this);
    this.panel.title = title(this.uri);
    return true;
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

  /** A preview that is covered leaves the evaluation to those that are seen, and is drawn anew when it is seen again. */
  private uncovered(): void {
    if (!this.panel.visible) {
      this.outdated ||= this.asked.size > 0;
      for (const source of this.asked.values()) source.cancel();
    } else if (this.outdated) void this.refresh();
  }

  private send(message: ToPreview): void {
    void this.panel.webview.postMessage(message);
  }

  /** Tell the page what can be drawn now; it asks for samples of what it shows. */
  private async refresh(name: string | null = null): Promise<void> {
    this.wanted = name ?? this.wanted;
    this.outdated = !this.panel.visible;
    if (this.outdated) return;
    const show = this.wanted;
    this.wanted = null;
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
      case "pixel":
        return this.find(message.request);
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
      this.send({ type: "failed", id, message: advised(messageOf(error)), outdated });
      if (code === CONTENT_MODIFIED) this.later(); // a file that was closed, or opened, has not changed for an editor
    } finally {
      this.asked.delete(id);
      source.dispose();
    }
  }

  /** A pixel was clicked: select the condition that it is nearest to, wherever it is written, or the definition if there is none. */
  private async find(request: PixelRequest): Promise<void> {
    try {
      const params = { textDocument: { uri: this.uri.toString() }, ...request };
      const found = await this.server.client?.sendRequest<Pixel>("potto/pixel", params);
      if (!found) return;
      const nearest = found.conditions.find(({ pixels }) => pixels < FAR);
      const { start, end } = nearest?.range ?? { start: found.range.start, end: found.range.start };
      const selection = new vscode.Range(start.line, start.character, end.line, end.character);
      const uri = nearest ? vscode.Uri.parse(nearest.uri) : this.uri;
      const columnOf = (wanted: vscode.Uri): vscode.ViewColumn | undefined =>
        vscode.window.visibleTextEditors.find(({ document }) => document.uri.toString() === wanted.toString())?.viewColumn;
      const column = columnOf(uri) ?? columnOf(this.uri);
      await vscode.window.showTextDocument(uri, { viewColumn: column ?? vscode.ViewColumn.One, selection });
      this.send({ type: "pixel", text: nearest ? placed(nearest) : `no condition of ${request.name} is seen here` });
    } catch (error) {
      this.send({ type: "pixel", text: messageOf(error) });
    }
  }

  private async save(name: string, png: string): Promise<void> {
    const beside = this.uri.scheme === "untitled" ? undefined : vscode.Uri.joinPath(this.uri, "..");
    const folder = beside ?? vscode.workspace.workspaceFolders?.[0]?.uri;
    const target = await vscode.window.showSaveDialog({
      ...(folder ? { defaultUri: vscode.Uri.joinPath(folder, `${name}.png`) } : {}),
      filters: { PNG: ["png"] },
    });
    if (!target) return;
    const data = Uint8Array.from(Buffer.from(png.slice(png.indexOf(",") + 1), "base64"));
    try {
      await vscode.workspace.fs.writeFile(target, data);
    } catch (error) {
      void vscode.window.showErrorMessage(`The picture was not saved: ${messageOf(error)}`);
    }
  }
}

/** How far a pixel is from a surface. */
const placed = ({ equation, pixels }: Pixel["conditions"][number]): string =>
  pixels <= 0.5 ? `${equation} goes through this pixel` : `${equation} is ${pixels.toPrecision(2)} pixels off`;

/** What stopped for want of time can be given more. */
const advised = (message: string): string =>
  message.startsWith("stopped after ")
    ? `${message}; the setting potto.evaluation.timeLimit gives it more`
    : message.startsWith("stopped at ")
      ? `${message}; the setting potto.evaluation.memoryLimit gives it more`
      : message;

const title = (uri: vscode.Uri): string => `Preview ${posix.basename(uri.path)}`;

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
  <div id="problem" role="alert" hidden><div></div><button type="button">Try again</button></div>
  <section id="parameters" aria-label="Parameters"></section>
  <script nonce="${nonce}" src="${script}"></script>
</body>
</html>`;
}
