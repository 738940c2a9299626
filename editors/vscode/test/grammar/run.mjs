// Tests the grammar: assertions in language.po, and snapshots of every example program.
// A snapshot holds its program, so that it tests the grammar and nothing else: an example may change meanwhile.
// `--update` takes the examples as they are now; look at what changed before committing it.
import { spawnSync } from "node:child_process";
import { copyFileSync, existsSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, relative, sep } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const root = join(here, "..", "..");
const examples = join(root, "..", "..", "examples");
const snapshots = join(here, "snapshots");
const update = process.argv.includes("--update");

function run(tool, ...args) {
  const path = join(root, "node_modules", ".bin", tool);
  return spawnSync(path, args, { cwd: root, stdio: "inherit" }).status === 0;
}

/** The example programs, by the names of their snapshots. */
function programs(folder) {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = join(folder, entry.name);
    if (entry.isDirectory()) return programs(path);
    return /\.(po|diffeo)$/.test(entry.name) ? [[relative(examples, path).split(sep).join("."), readFileSync(path, "utf8")]] : [];
  });
}

/** The program that a snapshot is of. */
function recorded(snapshot) {
  const lines = readFileSync(snapshot, "utf8").split("\n");
  return lines.filter((line) => line.startsWith(">")).map((line) => line.slice(1)).join("\n");
}

let good = run("vscode-tmgrammar-test", "--config", join(root, "package.json"), join(here, "language.po"));

// The tool keeps a snapshot beside its program, so it works on copies.
const copies = mkdtempSync(join(tmpdir(), "potto-grammar-"));
try {
  const now = new Map(programs(examples));
  const kept = readdirSync(snapshots).map((name) => name.replace(/\.snap$/, ""));
  const names = update ? [...now.keys()] : kept;
  for (const name of names) {
    const snapshot = join(snapshots, `${name}.snap`);
    writeFileSync(join(copies, name), update ? now.get(name) : recorded(snapshot));
    if (existsSync(snapshot)) copyFileSync(snapshot, join(copies, `${name}.snap`));
  }
  const options = ["--config", join(root, "package.json"), ...(update ? ["--updateSnapshot"] : ["--expandDiff"])];
  good = names.length > 0 && run("vscode-tmgrammar-snap", ...options, ...names.map((name) => join(copies, name))) && good;
  if (update) {
    for (const name of names) copyFileSync(join(copies, `${name}.snap`), join(snapshots, `${name}.snap`));
    for (const name of kept) if (!now.has(name)) rmSync(join(snapshots, `${name}.snap`));
  } else {
    const behind = [...now].filter(([name, text]) => !kept.includes(name) || recorded(join(snapshots, `${name}.snap`)) !== text);
    if (behind.length) console.log(`*** examples that changed since their snapshots: ${behind.map(([name]) => name).join(", ")}; npm run snapshots`);
  }
} finally {
  rmSync(copies, { recursive: true });
}
process.exit(good ? 0 : 1);
