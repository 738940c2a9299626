// The channel of the conversation with the server, which the setting `potto.trace.server` opens.
import * as vscode from "vscode";

/** A log channel whose level is ours to set: the client traces when it is Trace. */
export class TraceChannel implements vscode.LogOutputChannel {
  readonly name = "Potto Trace";
  private readonly channel = vscode.window.createOutputChannel(this.name);
  private readonly changed = new vscode.EventEmitter<vscode.LogLevel>();
  readonly onDidChangeLogLevel = this.changed.event;
  logLevel: vscode.LogLevel = level();

  /** Follow the setting. */
  refresh(): void {
    this.logLevel = level();
    this.changed.fire(this.logLevel);
  }

  trace(message: string): void {
    this.channel.appendLine(`[${new Date().toISOString().slice(11, 23)}] ${message}`);
  }
  debug(message: string): void {
    this.trace(message);
  }
  info(message: string): void {
    this.trace(message);
  }
  warn(message: string): void {
    this.trace(message);
  }
  error(message: string | Error): void {
    this.trace(String(message));
  }
  append(value: string): void {
    this.channel.append(value);
  }
  appendLine(value: string): void {
    this.channel.appendLine(value);
  }
  replace(value: string): void {
    this.channel.replace(value);
  }
  clear(): void {
    this.channel.clear();
  }
  show(): void {
    this.channel.show(true);
  }
  hide(): void {
    this.channel.hide();
  }
  dispose(): void {
    this.channel.dispose();
    this.changed.dispose();
  }
}

function level(): vscode.LogLevel {
  const traced = vscode.workspace.getConfiguration("potto").get<string>("trace.server", "off") !== "off";
  return traced ? vscode.LogLevel.Trace : vscode.LogLevel.Info;
}
