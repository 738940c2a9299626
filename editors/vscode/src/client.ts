// The client of the language server: what of the protocol is ours.
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
} from "vscode-languageclient/node";
import type { ServerProcess } from "./process";

interface Channels {
  readonly log: vscode.LogOutputChannel;
  readonly trace: vscode.LogOutputChannel;
}

/** A client that speaks with a process. It is used once: after the process has ended, another one is made. */
export function makeClient(process: ServerProcess, { log, trace }: Channels, stopped: () => void): LanguageClient {
  const options: LanguageClientOptions = {
    documentSelector: [{ language: "potto", scheme: "file" }, { language: "potto", scheme: "untitled" }],
    outputChannel: log,
    traceOutputChannel: trace,
    revealOutputChannelOn: RevealOutputChannelOn.Never,
    initializationOptions: () => ({ potto: vscode.workspace.getConfiguration("potto") }),
    initializationFailedHandler: () => false,
    synchronize: { configurationSection: "potto" }, // which files are watched, the server says
    diagnosticPullOptions: { onChange: true, onTabs: true },
    errorHandler: {
      // What is written to a server that has just died fails, often many times before its end is noticed.
      error: () => ({ action: ErrorAction.Continue, handled: true }),
      closed: () => ({ action: CloseAction.DoNotRestart, handled: true }),
    },
  };
  const client = new QuietClient("potto", "Potto", () => Promise.resolve(process.child), options);
  client.registerFeature(new OwnCommands());
  client.onDidChangeState(({ oldState, newState }) => {
    if (oldState === State.Running && newState !== State.Running) stopped();
  });
  return client;
}

/** Its troubles go to the output channel; the user gets one message for each, which is the status's business. */
class QuietClient extends LanguageClient {
  override error(message: string, data?: unknown): void {
    super.error(message, data, false);
  }
}

/** Commands are ours: what the server answers is shown, and what only an editor can do is offered to it. */
class OwnCommands implements StaticFeature {
  fillClientCapabilities(capabilities: ClientCapabilities): void {
    capabilities.experimental = { commands: { commands: ["potto.preview", "potto.more", "potto.showReferences", "potto.rename"] } };
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
