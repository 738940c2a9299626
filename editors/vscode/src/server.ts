// The life of the language server: looked for, started, watched, restarted, and missed.
// The client is loaded when there is a server, so that opening the first file waits for nothing.
import * as vscode from "vscode";
import type { LanguageClient } from "vscode-languageclient/node";
import { find, type Found } from "./finding";
import { ServerProcess } from "./process";
import { selectedInterpreter } from "./python";
import { TraceChannel } from "./trace";

export type ServerState =
  | { readonly kind: "off" | "looking" | "missing" | "untrusted" }
  | { readonly kind: "starting" | "running"; readonly program: Found }
  | { readonly kind: "failed"; readonly program: Found; readonly reason: string };

/** A server that was started, and who speaks with it. */
interface Run {
  readonly program: Found;
  readonly process: ServerProcess;
  readonly client: LanguageClient;
}

const CRASHES = 4; // in three minutes, before it is left alone
const MINUTES = 3 * 60_000;
const FAREWELL = 1500; // ms for a server to shut down; all must be over before the editor ends us
const DRAIN = 300; // ms for what a process that has ended said last

/** A start that was given up, as something else is wanted now. */
class GivenUp extends Error {}

export class Server implements vscode.Disposable {
  private readonly changed = new vscode.EventEmitter<ServerState>();
  readonly onDidChangeState = this.changed.event;
  readonly log = vscode.window.createOutputChannel("Potto", { log: true });
  readonly trace = new TraceChannel();
  private now: ServerState = { kind: "off" };
  private running: Run | undefined;
  private crashes: number[] = [];
  private turn = Promise.resolve();
  private giveUp: ((error: Error) => void) | undefined;
  private disposed = false;

  get state(): ServerState {
    return this.now;
  }

  /** The client of a server that runs. */
  get client(): LanguageClient | undefined {
    return this.now.kind === "running" ? this.running?.client : undefined;
  }

  /** Look for the server and start it; one start or stop at a time. */
  start(): Promise<void> {
    return this.queue(() => this.startNow());
  }

  /** Start the server if there is one by now; nothing is said if there still is none. */
  lookAgain(): void {
    if (this.now.kind === "missing") void this.queue(() => this.startNow(true));
  }

  /** Also a start that is under way is given up for a new one. */
  restart(): Promise<void> {
    this.giveUp?.(new GivenUp());
    return this.queue(async () => {
      await this.stopNow();
      await this.startNow();
    });
  }

  stop(): Promise<void> {
    this.giveUp?.(new GivenUp());
    return this.queue(() => this.stopNow());
  }

  /** A server that runs, started if need be; undefined if there is none, which the user has been told. */
  async ready(): Promise<LanguageClient | undefined> {
    await this.turn;
    if (!this.client) await this.start();
    return this.client;
  }

  /** The program, also where the server failed: it may still run files. */
  async program(): Promise<Found | undefined> {
    await this.turn;
    if ("program" in this.now) return this.now.program;
    return vscode.workspace.isTrusted ? this.look() : undefined;
  }

  dispose(): Promise<void> {
    this.disposed = true;
    return this.stop().finally(() => {
      this.changed.dispose();
      this.log.dispose();
      this.trace.dispose();
    });
  }

  private queue(action: () => Promise<void>): Promise<void> {
    this.turn = this.turn.then(action).catch((error: unknown) => this.log.error(String(error)));
    return this.turn;
  }

  private set(state: ServerState): void {
    this.now = state;
    void vscode.commands.executeCommand("setContext", "potto.serverRunning", state.kind === "running");
    this.changed.fire(state);
  }

  private async look(quietly = false): Promise<Found | undefined> {
    const setting = vscode.workspace.getConfiguration("potto").get<string>("server.path", "");
    const folders = (vscode.workspace.workspaceFolders ?? []).filter((folder) => folder.uri.scheme === "file");
    return find(
      {
        setting,
        interpreter: setting ? undefined : await selectedInterpreter(),
        folders: folders.map((folder) => folder.uri.fsPath),
        path: process.env["PATH"] ?? "",
        windows: process.platform === "win32",
      },
      (line) => (quietly ? this.log.debug(line) : this.log.info(line)),
    );
  }

  private async startNow(quietly = false): Promise<void> {
    if (this.running || this.disposed) return;
    if (!vscode.workspace.isTrusted) {
      this.set({ kind: "untrusted" });
      return;
    }
    if (!quietly) this.set({ kind: "looking" });
    const program = await this.look(quietly);
    if (program) return this.launch(program);
    if (quietly) return;
    this.log.error("no Potto was found in any of the places above");
    this.set({ kind: "missing" });
  }

  private async launch(program: Found): Promise<void> {
    this.set({ kind: "starting", program });
    const settings = vscode.workspace.getConfiguration("potto");
    const folder = vscode.workspace.workspaceFolders?.[0]?.uri;
    let process: ServerProcess | undefined;
    try {
      const args = ["lsp", ...settings.get<string[]>("server.arguments", [])];
      process = await ServerProcess.start(program, args, folder?.scheme === "file" ? folder.fsPath : undefined);
      const { makeClient } = await import("./client");
      const run: Run = { program, process, client: makeClient(process, this, () => this.ended(run)) };
      await this.answers(run, settings.get("server.startLimit", 60));
      this.running = run;
      this.set({ kind: "running", program });
      void process.ended.then(() => setTimeout(() => this.ended(run), DRAIN));
    } catch (error) {
      process?.kill();
      const words = process?.lastWords;
      const reason = `${error instanceof Error ? error.message : String(error)}${words ? `: ${words}` : ""}`;
      this.set(error instanceof GivenUp ? { kind: "off" } : { kind: "failed", program, reason });
    }
  }

  /** Wait until a server has said what it can do. Throws if it ends, takes too long, or is not wanted any more. */
  private async answers({ client, process }: Run, limit: number): Promise<void> {
    const trouble = new Promise<never>((_, reject) => {
      this.giveUp = reject;
      void process.ended.then((how) => setTimeout(() => reject(new Error(`${how} while it started`)), DRAIN));
    });
    const late = setTimeout(() => this.giveUp?.(new Error(`it did not answer within ${limit} seconds`)), 1000 * limit);
    // A client whose process ends fails in words of its own, or not even that: those of the process say more.
    const started = client.start().then(
      () => (client.isRunning() ? undefined : trouble),
      async (error: unknown) => ((await process.endsWithin(DRAIN)) ? trouble : Promise.reject(error)),
    );
    try {
      await Promise.race([trouble, started]);
    } finally {
      clearTimeout(late);
      this.giveUp = undefined;
    }
  }

  private async stopNow(): Promise<void> {
    const run = this.running;
    this.running = undefined;
    this.crashes = [];
    this.set({ kind: "off" });
    if (run) await this.leave(run, FAREWELL);
  }

  /** Let go of a server: it may shut down by itself, and is ended otherwise. */
  private async leave({ client, process }: Run, patience: number): Promise<void> {
    const until = Date.now() + patience;
    try {
      await client.dispose(patience);
      await process.endsWithin(until - Date.now());
    } catch (error) {
      this.log.warn(`the server did not stop by itself: ${String(error)}`);
    }
    process.kill();
  }

  /** The server ended by itself: it is started again, which helps unless it does nothing else. */
  private ended(run: Run): void {
    if (this.running !== run) return;
    this.running = undefined;
    const now = Date.now();
    this.crashes = [...this.crashes.filter((then) => now - then < MINUTES), now];
    const reason = `it ended ${this.crashes.length} times within three minutes`;
    if (this.crashes.length < CRASHES) this.set({ kind: "starting", program: run.program });
    else this.set({ kind: "failed", program: run.program, reason });
    const again = this.crashes.length < CRASHES;
    void this.queue(async () => {
      await this.leave(run, 0);
      if (again) await this.startNow();
    });
  }
}
