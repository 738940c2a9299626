// What the server answers to commands, shown: values in a message, derivatives in a document of their own.
import * as vscode from "vscode";
import type { Server } from "./server";

const SCHEME = "potto-derivative";
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

/** Derivatives in symbols, as documents that follow the program. */
export class Derivatives implements vscode.TextDocumentContentProvider, vscode.Disposable {
  private readonly changed = new vscode.EventEmitter<vscode.Uri>();
  readonly onDidChange = this.changed.event;
  private readonly gone: vscode.Disposable;
  private timer: NodeJS.Timeout | undefined;

  constructor(private readonly server: Server) {
    this.gone = vscode.Disposable.from(
      vscode.workspace.registerTextDocumentContentProvider(SCHEME, this),
      vscode.workspace.onDidChangeTextDocument((event) => {
        if (event.document.languageId === "potto" && event.document.uri.scheme !== SCHEME) this.refreshSoon();
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
    const document = await vscode.workspace.openTextDocument(shown);
    await vscode.languages.setTextDocumentLanguage(document, "potto");
    await vscode.window.showTextDocument(document, {
      viewColumn: vscode.ViewColumn.Beside,
      preserveFocus: true,
      preview: true,
    });
  }

  async provideTextDocumentContent(uri: vscode.Uri): Promise<string> {
    try {
      const answer = await ask(this.server, "potto.differentiate", uri.query, uri.fragment);
      return answer?.text ?? "# the language server is not running";
    } catch (error) {
      return `# ${error instanceof Error ? error.message : String(error)}`;
    }
  }

  private refreshSoon(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      for (const { uri } of vscode.workspace.textDocuments) if (uri.scheme === SCHEME) this.changed.fire(uri);
    }, PAUSE);
  }
}
