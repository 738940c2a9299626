// The process of the language server: ours from its start to its end, so that none is ever left behind.
import { type ChildProcessWithoutNullStreams, spawn } from "node:child_process";
import type { Program } from "./finding";

const WORDS = 2000; // characters of what it said last that are kept

/** A server that was started. It has a group of its own: what it started itself ends with it. */
export class ServerProcess {
  private said = "";
  private over: string | undefined;
  /** How it ended, in words; when it has. */
  readonly ended: Promise<string>;

  private constructor(readonly child: ChildProcessWithoutNullStreams) {
    child.stderr.on("data", (text: Buffer) => (this.said = (this.said + text.toString()).slice(-WORDS)));
    for (const stream of [child.stdin, child.stdout, child.stderr]) stream.on("error", () => undefined); // its end tells
    this.ended = new Promise((resolve) => {
      child.once("exit", (status, signal) => {
        this.over = status === null ? `it was ended by ${signal ?? "a signal"}` : `it ended with status ${status}`;
        resolve(this.over);
      });
    });
  }

  /** Start it. Throws what the system says where it cannot be started. */
  static start(program: Program, args: readonly string[], folder: string | undefined): Promise<ServerProcess> {
    const child = spawn(program.command, [...program.args, ...args], {
      ...(folder === undefined ? {} : { cwd: folder }),
      detached: process.platform !== "win32",
      windowsHide: true,
    });
    const made = new ServerProcess(child);
    return new Promise((resolve, reject) => {
      child.once("spawn", () => resolve(made));
      child.once("error", reject);
    });
  }

  /** The last line that it wrote to its errors: of a Python that fails, what is wrong. */
  get lastWords(): string {
    return this.said.trim().split(/\r?\n/).at(-1)?.trim() ?? "";
  }

  /** End it if it has not ended by itself, with all that it started. */
  kill(): void {
    const { pid } = this.child;
    if (pid === undefined) return;
    try {
      if (process.platform === "win32") this.child.kill();
      else process.kill(-pid, "SIGKILL");
    } catch {
      // They are gone already.
    }
  }

  /** Wait until it has ended; whether it did so in time. */
  async endsWithin(milliseconds: number): Promise<boolean> {
    if (this.over !== undefined) return true;
    let timer: NodeJS.Timeout | undefined;
    const late = new Promise<boolean>((resolve) => (timer = setTimeout(() => resolve(false), milliseconds)));
    const inTime = await Promise.race([this.ended.then(() => true), late]);
    clearTimeout(timer);
    return inTime;
  }
}
