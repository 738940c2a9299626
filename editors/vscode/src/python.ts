// The Python that is selected in the editor, if the Python extension is there.
import * as vscode from "vscode";

interface PythonEnvironments {
  readonly environments?: {
    getActiveEnvironmentPath(resource?: vscode.Uri): { readonly path: string };
    resolveEnvironment(path: unknown): Promise<{ readonly executable: { readonly uri?: vscode.Uri } } | undefined>;
    readonly onDidChangeActiveEnvironmentPath: vscode.Event<unknown>;
  };
}

const ID = "ms-python.python";

async function environments(): Promise<PythonEnvironments["environments"]> {
  const extension = vscode.extensions.getExtension<PythonEnvironments>(ID);
  return extension && (extension.isActive ? extension.exports : await extension.activate())?.environments;
}

/** The path of the interpreter: the selected one, or that of the setting. */
export async function selectedInterpreter(): Promise<string | undefined> {
  const folder = vscode.workspace.workspaceFolders?.[0]?.uri;
  try {
    const known = await environments();
    const resolved = known && (await known.resolveEnvironment(known.getActiveEnvironmentPath(folder)));
    if (resolved?.executable.uri) return resolved.executable.uri.fsPath;
  } catch {
    // Another extension's trouble is not ours: the setting may still say it.
  }
  const setting = vscode.workspace.getConfiguration("python", folder).get<string>("defaultInterpreterPath");
  return setting && /[/\\]/.test(setting) ? setting.replaceAll("${workspaceFolder}", folder?.fsPath ?? "") : undefined;
}

/** Call back when another environment is selected; also if the Python extension comes later. */
export function onInterpreterChanged(changed: () => void): vscode.Disposable {
  let listening: vscode.Disposable | undefined;
  let gone = false;
  const listen = async (): Promise<void> => {
    if (listening) return;
    try {
      const found = (await environments())?.onDidChangeActiveEnvironmentPath(changed);
      if (gone || listening) found?.dispose();
      else listening = found;
    } catch {
      // It does not work: neither does selecting an environment.
    }
  };
  void listen();
  const installed = vscode.extensions.onDidChange(() => void listen());
  return new vscode.Disposable(() => {
    gone = true;
    installed.dispose();
    listening?.dispose();
  });
}
