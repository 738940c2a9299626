// What the server answers to commands, shown: values in a message, derivatives in a document of their own.
import * as vscode from "vscode";
import type { Server } from "./server";
import { renamed } from "./text";

const SCHEME = "potto-derivative"; // also the language of these documents: that of programs, with long lines wrapped
const PAUSE = 150; // ms after the last change, before a derivative that is shown is written anew

interface Answer {
  readonly text: string;
}

async function ask(server: Server, command: string, ...args: unknown[]): Promise<Answer | undefined> {
  const client = await server.ready();
  return client?.sendRequest<Answer>("workspace/executeCommand", { command, arguments: args });
}

/** The value of an expression, in a message that can be copied. */
export async function evaluate(server: Server, uri: vscode.Uri, expression: string): Promise<string | undefined> {
  try {
    const { text } = (await ask(server, "potto.evaluate", uri.toString(), expression)) ?? {};
    if (text === undefined) return undefined;
    void vscode.window.showInformationMessage(`${expression} = ${text}`, "Copy").then((copy) => {
      if (copy) void vscode.env.clipboard.writeText(text);
    });
    return text;
  } catch (error) {
    void vscode.window.showErrorMessage(error instanceof Error ? error.message : String(error));
    return undefined;
  }
}

/** A definition as its document names it, and the definitions of the program when it was last found, in their order. */
interface Followed {
  readonly name: string;
  readonly all: readonly string[];
}

/** Derivatives in symbols, as documents that follow the program: also when the definition is renamed, or its file. */
export class Derivatives implements vscode.TextDocumentContentProvider, vscode.Disposable {
  private readonly changed = new vscode.EventEmitter<vscode.Uri>();
  readonly onDidChange = this.changed.event;
  private readonly gone: vscode.Disposable;
  private readonly followed = new Map<string, Followed>();
  private readonly programs = new Map<string, string>(); // of documents whose program has another name by now
  private timer: NodeJS.Timeout | undefined;

  constructor(private readonly server: Server) {
    this.gone = vscode.Disposable.from(
      vscode.workspace.registerTextDocumentContentProvider(SCHEME, this),
      vscode.workspace.onDidChangeTextDocument((event) => {
        if (event.document.languageId === "potto") this.refreshSoon();
      }),
      vscode.workspace.onDidRenameFiles(({ files }) => {
        for (const { oldUri, newUri } of files) this.move(oldUri.toString(), newUri.toString());
      }),
    );
  }

  dispose(): void {
    clearTimeout(this.timer);
    this.gone.dispose();
    this.changed.dispose();
  }

  async show(uri: vscode.Uri, name: string): Promise<void> {
    const shown = vscode.Uri.from({ scheme: SCHEME, path: `/derivative of ${name}`, query: uri.toString(), fragment: name });
    for (const names of [this.followed, this.programs]) names.delete(shown.toString()); // of before: this is its name now
    const document = await vscode.workspace.openTextDocument(shown);
    await vscode.languages.setTextDocumentLanguage(document, SCHEME);
    await vscode.window.showTextDocument(document, {
      viewColumn: vscode.ViewColumn.Beside,
      preserveFocus: true,
      preview: true,
    });
    this.changed.fire(shown);
  }

  async provideTextDocumentContent(uri: vscode.Uri): Promise<string> {
    try {
      const name = await this.nameNow(uri);
      const answer = await ask(this.server, "potto.differentiate", this.program(uri), name);
      return answer?.text ?? "# the language server is not running";
    } catch (error) {
      return `# ${error instanceof Error ? error.message : String(error)}`;
    }
  }

  /** The file that a document is about, as it is called now. */
  private program(uri: vscode.Uri): string {
    return this.programs.get(uri.toString()) ?? uri.query;
  }

  private move(from: string, to: string): void {
    for (const { uri } of vscode.workspace.textDocuments) {
      const now = uri.scheme === SCHEME ? renamed(this.program(uri), from, to) : undefined;
      if (now === undefined) continue;
      this.programs.set(uri.toString(), now);
      this.refreshSoon();
    }
  }

  /** What the definition of a document is called now. One that is gone is the one that came in its place, if all others
   * are as they were. */
  private async nameNow(uri: vscode.Uri): Promise<string> {
    const before = this.followed.get(uri.toString()) ?? { name: uri.fragment, all: [] };
    const found = await vscode.commands.executeCommand<vscode.DocumentSymbol[] | undefined>(
      "vscode.executeDocumentSymbolProvider",
      vscode.Uri.parse(this.program(uri)),
    );
    const all = (found ?? []).map((symbol) => symbol.name);
    if (all.length === 0) return before.name;
    let { name } = before;
    if (!all.includes(name)) {
      const place = before.all.indexOf(name);
      const others = before.all.length === all.length && all.every((other, n) => n === place || other === before.all[n]);
      if (place < 0 || !others) return name;
      name = all[place] ?? name;
    }
    this.followed.set(uri.toString(), { name, all });
    return name;
  }

  private refreshSoon(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      for (const { uri } of vscode.workspace.textDocuments) if (uri.scheme === SCHEME) this.changed.fire(uri);
    }, PAUSE);
  }
}
