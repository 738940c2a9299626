// Where the language server is. Knows nothing of the editor, so that it can be tested without one.
import { execFile } from "node:child_process";
import { access, constants, stat } from "node:fs/promises";
import { homedir } from "node:os";
import { basename, delimiter, dirname, isAbsolute, join } from "node:path";

/** A program with arguments that make it Potto: `potto`, or `python -m potto`. */
export interface Program {
  readonly command: string;
  readonly args: readonly string[];
  /** Where it was found, for people. */
  readonly origin: string;
}

/** A program that answered, with its version. */
export interface Found extends Program {
  readonly version: string;
}

/** What is known about where to look. */
export interface Places {
  /** The setting; empty if there is none. */
  readonly setting: string;
  /** The interpreter that is selected in the editor. */
  readonly interpreter: string | undefined;
  /** The folders of the workspace; none of a workspace that is not trusted. */
  readonly folders: readonly string[];
  readonly path: string;
  readonly windows: boolean;
}

const ENVIRONMENTS = [".venv", "venv", "env"];
const PATIENCE = 10_000; // ms for a program to tell its version

/** Everything that might be Potto, the likeliest first. A setting is the only candidate: it is never overruled. */
export function candidates(places: Places): Program[] {
  const setting = places.setting.trim();
  if (setting) return ofPath(expanded(setting, places.folders), "the setting `potto.server.path`", places.windows);
  const found: Program[] = [];
  if (places.interpreter) found.push(...ofPath(places.interpreter, "the selected Python environment", places.windows));
  for (const folder of places.folders)
    for (const name of ENVIRONMENTS) {
      const bin = join(folder, name, places.windows ? "Scripts" : "bin");
      found.push({ command: join(bin, executable("potto", places.windows)), args: [], origin: join(folder, name) });
    }
  for (const folder of places.path.split(delimiter).filter(isAbsolute))
    found.push({ command: join(folder, executable("potto", places.windows)), args: [], origin: "PATH" });
  for (const folder of places.path.split(delimiter).filter(isAbsolute)) {
    const command = join(folder, executable(places.windows ? "python" : "python3", places.windows));
    found.push({ command, args: ["-m", "potto"], origin: "PATH" });
  }
  return found;
}

/** A program that was named: Potto itself, or a Python that may have it; a folder may be an environment. */
function ofPath(path: string, origin: string, windows: boolean): Program[] {
  const bin = windows ? "Scripts" : "bin";
  if (/^python[\d.]*(\.exe)?$/i.test(basename(path)))
    return [
      { command: join(dirname(path), executable("potto", windows)), args: [], origin },
      { command: path, args: ["-m", "potto"], origin },
    ];
  return [
    { command: path, args: [], origin },
    { command: join(path, bin, executable("potto", windows)), args: [], origin },
  ];
}

function executable(name: string, windows: boolean): string {
  return windows ? `${name}.exe` : name;
}

/** `~` and `${workspaceFolder}` replaced; a path that is relative starts at the first folder. */
function expanded(path: string, folders: readonly string[]): string {
  const first = folders[0] ?? "";
  const written = path.replace(/^~(?=$|[/\\])/, homedir()).replaceAll("${workspaceFolder}", first);
  return isAbsolute(written) || !first || !/[/\\]/.test(written) ? written : join(first, written);
}

/** The first candidate that says that it is Potto. */
export async function find(places: Places, log: (line: string) => void): Promise<Found | undefined> {
  const asked = new Set<string>();
  for (const program of candidates(places)) {
    const key = [program.command, ...program.args].join("\0");
    if (asked.has(key)) continue;
    asked.add(key);
    if (isAbsolute(program.command) && !(await isProgram(program.command))) continue;
    const version = await versionOf(program);
    log(`${[program.command, ...program.args].join(" ")} (${program.origin}): ${version ?? "no Potto"}`);
    if (version !== undefined) return { ...program, version };
  }
  return undefined;
}

async function isProgram(path: string): Promise<boolean> {
  try {
    await access(path, constants.X_OK);
    return (await stat(path)).isFile();
  } catch {
    return false;
  }
}

/** What `--version` says, if it is an answer of Potto's. */
export function versionOf(program: Program): Promise<string | undefined> {
  return new Promise((resolve) => {
    execFile(program.command, [...program.args, "--version"], { timeout: PATIENCE, killSignal: "SIGKILL" }, (error, stdout) => {
      const said = /^potto\s+(\S+)/i.exec(stdout.trim());
      resolve(error || !said ? undefined : said[1]);
    });
  });
}
