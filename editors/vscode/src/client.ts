// The client of the language server: how it is started, and what of the protocol is ours.
import * as vscode from "vscode";
import {
  type ClientCapabilities,
  CloseAction,
  ErrorAction,
  type FeatureState,
  LanguageClient,
  type LanguageClientOptions,
  RevealOutputChannelOn,
  type ServerCapabilities,
  State,
  type StaticFeature,
  TransportKind,
} from "vscode-languageclient/node";
import type { Found } from "./finding";

interface Channels {
  readonly log: vscode.LogOutputChannel;
  readonly trace: vscode.LogOutputChannel;
}

/** What becomes of a client; `closed` says whether to start the server again, `lost` that the client did not manage to. */
interface Events {
  running(): void;
  starting(): void;
  closed(): boolean;
  lost(): void;
}

export function makeClient(program: Found, { log, trace }: Channels, events: Events): LanguageClient {
  const more = vscode.workspace.getConfiguration("potto").get<string[]>("server.arguments", []);
  const folder = vscode.workspace.workspaceFolders?.[0]?.uri;
  const options: LanguageClientOptions = {
    documentSelector: [{ language: "potto", scheme: "file" }, { language: "potto", scheme: "untitled" }],
    outputChannel: log,
    traceOutputChannel: trace,
    revealOutputChannelOn: RevealOutputChannelOn.Never,
    initializationOptions: () => ({ potto: vscode.workspace.getConfiguration("potto") }),
    synchronize: {
      configurationSection: "potto",
      fileEvents: vscode.workspace.createFileSystemWatcher("**/{*.po,*.diffeo,potto.toml}"),
    },
    diagnosticPullOptions: { onChange: true, onTabs: true },
    errorHandler: {
      // What is written to a server that has just died fails, often many times before its end is noticed. To shut down
      // for that would keep it from being started again.
      error: () => ({ action: ErrorAction.Continue, handled: true }),
      closed: () => ({ action: events.closed() ? CloseAction.Restart : CloseAction.DoNotRestart, handled: true }),
    },
  };
  const client = new LanguageClient(
    "potto",
    "Potto",
    {
      command: program.command,
      args: [...program.args, "lsp", ...more],
      transport: TransportKind.stdio,
      options: folder?.scheme === "file" ? { cwd: folder.fsPath } : {},
    },
    options,
  );
  client.registerFeature(new OwnCommands());
  client.onDidChangeState(({ newState }) => {
    if (newState === State.Running) events.running();
    else if (newState === State.Starting) events.starting();
    else events.lost();
  });
  return client;
}

/** Commands are ours: what the server answers is shown, and what only an editor can do is offered to it. */
class OwnCommands implements StaticFeature {
  fillClientCapabilities(capabilities: ClientCapabilities): void {
    capabilities.experimental = { commands: { commands: ["potto.preview", "potto.showReferences", "potto.rename"] } };
  }
  preInitialize(capabilities: ServerCapabilities): void {
    delete capabilities.executeCommandProvider;
  }
  initialize(): void {}
  getState(): FeatureState {
    return { kind: "static" };
  }
  clear(): void {}
}
