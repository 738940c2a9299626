// The status bar item, and what it says when there is no server.
import * as vscode from "vscode";
import type { Server, ServerState } from "./server";

const TEXTS: Record<ServerState["kind"], string> = {
  off: "$(circle-slash) Potto",
  looking: "$(loading~spin) Potto",
  starting: "$(loading~spin) Potto",
  running: "$(check) Potto",
  missing: "$(warning) Potto",
  untrusted: "$(workspace-untrusted) Potto",
  failed: "$(error) Potto",
};

export function showStatus(server: Server): vscode.Disposable {
  const item = vscode.window.createStatusBarItem("potto.status", vscode.StatusBarAlignment.Right, 100);
  item.name = "Potto";
  item.command = "potto.showMenu";
  const refresh = (): void => {
    const { state } = server;
    item.text = TEXTS[state.kind];
    item.tooltip = explain(state);
    item.accessibilityInformation = { label: explain(state) };
    const wrong = state.kind === "missing" || state.kind === "failed";
    item.backgroundColor = wrong ? new vscode.ThemeColor("statusBarItem.warningBackground") : undefined;
    const shown = vscode.window.activeTextEditor?.document.languageId === "potto";
    if (shown || wrong) item.show();
    else item.hide();
  };
  refresh();
  return vscode.Disposable.from(
    item,
    server.onDidChangeState(refresh),
    vscode.window.onDidChangeActiveTextEditor(refresh),
    server.onDidChangeState((state) => void complain(state)),
  );
}

/** A state in words. */
export function explain(state: ServerState): string {
  switch (state.kind) {
    case "off":
      return "Potto: the language server is stopped";
    case "looking":
      return "Potto: looking for the language server";
    case "missing":
      return "Potto: no language server was found";
    case "untrusted":
      return "Potto: the language server runs only in a trusted workspace";
    case "starting":
      return `Potto ${state.program.version}: starting, from ${state.program.origin}`;
    case "running":
      return `Potto ${state.program.version}: running, from ${state.program.origin}`;
    case "failed":
      return `Potto ${state.program.version}: the language server failed: ${state.reason}`;
  }
}

/** One message with what to do, when there is no server. */
async function complain(state: ServerState): Promise<void> {
  if (state.kind === "missing") {
    const where = vscode.workspace.getConfiguration("potto").get<string>("server.path", "");
    const said = where
      ? `The setting potto.server.path names “${where}”, which is neither Potto nor a Python that has it.`
      : "Potto was found neither in the selected Python environment, nor in one of the workspace, nor on PATH.";
    const answer = await vscode.window.showWarningMessage(said, "Select Server…", "Show Output");
    if (answer === "Select Server…") await vscode.commands.executeCommand("potto.selectServer");
    else if (answer) await vscode.commands.executeCommand("potto.showOutput");
  } else if (state.kind === "failed") {
    const said = `Potto's language server failed: ${state.reason}.`;
    const answer = await vscode.window.showErrorMessage(said, "Restart", "Show Output");
    if (answer === "Restart") await vscode.commands.executeCommand("potto.restartServer");
    else if (answer) await vscode.commands.executeCommand("potto.showOutput");
  }
}

/** What can be done about the server, to pick from. */
export async function showMenu(server: Server): Promise<void> {
  const picked = await vscode.window.showQuickPick(
    [
      { label: "$(debug-restart) Restart the language server", command: "potto.restartServer" },
      { label: "$(output) Show its output", command: "potto.showOutput" },
      { label: "$(list-flat) Trace its messages…", command: "potto.toggleTrace" },
      { label: "$(file-binary) Select another server…", command: "potto.selectServer" },
      { label: "$(gear) Settings", command: "workbench.action.openSettings", argument: "@ext:potto.potto" },
    ],
    { title: explain(server.state) },
  );
  if (picked) await vscode.commands.executeCommand(picked.command, picked.argument);
}
