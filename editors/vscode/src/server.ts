// The life of the language server: looked for, started, watched, restarted, and missed.
// The client is loaded when there is a server, so that opening the first file waits for nothing.
import * as vscode from "vscode";
import type { LanguageClient } from "vscode-languageclient/node";
import { find, type Found } from "./finding";
import { selectedInterpreter } from "./python";
import { TraceChannel } from "./trace";

export type ServerState =
  | { readonly kind: "off" | "looking" | "missing" | "untrusted" }
  | { readonly kind: "starting" | "running"; readonly program: Found }
  | { readonly kind: "failed"; readonly program: Found; readonly reason: string };

const CRASHES = 4; // in three minutes, before it is left alone
const MINUTES = 3 * 60_000;

export class Server implements vscode.Disposable {
  private readonly changed = new vscode.EventEmitter<ServerState>();
  readonly onDidChangeState = this.changed.event;
  readonly log = vscode.window.createOutputChannel("Potto", { log: true });
  readonly trace = new TraceChannel();
  private now: ServerState = { kind: "off" };
  private running: LanguageClient | undefined;
  private crashes: number[] = [];
  private turn = Promise.resolve();

  get state(): ServerState {
    return this.now;
  }

  /** The client of a server that runs. */
  get client(): LanguageClient | undefined {
    return this.now.kind === "running" ? this.running : undefined;
  }

  /** Look for the server and start it; one start or stop at a time. */
  start(): Promise<void> {
    return this.queue(() => this.startNow());
  }

  restart(): Promise<void> {
    return this.queue(async () => {
      await this.stopNow();
      await this.startNow();
    });
  }

  stop(): Promise<void> {
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

  private async look(): Promise<Found | undefined> {
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
      (line) => this.log.info(line),
    );
  }

  private async startNow(): Promise<void> {
    if (this.running) return;
    if (!vscode.workspace.isTrusted) {
      this.set({ kind: "untrusted" });
      return;
    }
    this.set({ kind: "looking" });
    const program = await this.look();
    if (!program) {
      this.log.error("no Potto was found in any of the places above");
      this.set({ kind: "missing" });
      return;
    }
    this.set({ kind: "starting", program });
    const { makeClient } = await import("./client");
    const client: LanguageClient = makeClient(program, this, {
      running: () => this.running === client && this.set({ kind: "running", program }),
      starting: () => this.running === client && this.set({ kind: "starting", program }),
      closed: () => this.closed(program),
      lost: () => started && this.lost(client, program),
    });
    this.running = client;
    let started = false;
    try {
      await client.start();
      started = true;
    } catch (error) {
      this.running = undefined;
      this.set({ kind: "failed", program, reason: String(error) });
    }
  }

  private async stopNow(): Promise<void> {
    const client = this.running;
    this.running = undefined;
    this.crashes = [];
    this.set({ kind: "off" });
    if (!client) return;
    try {
      await client.dispose(2000);
    } catch (error) {
      this.log.warn(`the server did not stop by itself: ${String(error)}`);
    }
  }

  /** The server ended by itself: whether to start it again, which helps unless it does nothing else. */
  private closed(program: Found): boolean {
    const now = Date.now();
    this.crashes = [...this.crashes.filter((then) => now - then < MINUTES), now];
    if (this.crashes.length < CRASHES) {
      this.set({ kind: "starting", program });
      return true;
    }
    this.running = undefined;
    this.fail(program);
    return false;
  }

  /** A client that ran has no server any more, and none came up in its place: another client may have more luck. */
  private lost(client: LanguageClient, program: Found): void {
    if (this.running !== client) return;
    this.running = undefined;
    client.dispose().catch((error: unknown) => this.log.warn(String(error)));
    if (this.crashes.length < CRASHES) void this.start();
    else this.fail(program);
  }

  private fail(program: Found): void {
    this.set({ kind: "failed", program, reason: `it ended ${this.crashes.length} times within three minutes` });
  }
}
