// Tests the grammar: assertions in language.po, and snapshots of every example program.
// `--update` writes the snapshots anew; look at what changed before committing them.
import { spawnSync } from "node:child_process";
import { copyFileSync, existsSync, mkdtempSync, readdirSync, rmSync } from "node:fs";
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

function programs(folder) {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = join(folder, entry.name);
    return entry.isDirectory() ? programs(path) : /\.(po|diffeo)$/.test(entry.name) ? [path] : [];
  });
}

let good = run("vscode-tmgrammar-test", "--config", join(root, "package.json"), join(here, "language.po"));

// The tool keeps a snapshot beside its program; ours are kept here, so it works on copies.
const copies = mkdtempSync(join(tmpdir(), "potto-grammar-"));
try {
  const names = programs(examples).map((path) => {
    const name = relative(examples, path).split(sep).join(".");
    copyFileSync(path, join(copies, name));
    return name;
  });
  for (const name of names) {
    const kept = join(snapshots, `${name}.snap`);
    if (existsSync(kept)) copyFileSync(kept, join(copies, `${name}.snap`));
    else if (!update) {
      console.error(`no snapshot of ${name}: run with --update`);
      good = false;
    }
  }
  const options = ["--config", join(root, "package.json"), ...(update ? ["--updateSnapshot"] : ["--expandDiff"])];
  good = run("vscode-tmgrammar-snap", ...options, ...names.map((name) => join(copies, name))) && good;
  if (update) for (const name of names) copyFileSync(join(copies, `${name}.snap`), join(snapshots, `${name}.snap`));
  for (const kept of readdirSync(snapshots)) {
    if (names.includes(kept.replace(/\.snap$/, ""))) continue;
    if (update) rmSync(join(snapshots, kept));
    else {
      console.error(`${kept} is the snapshot of nothing`);
      good = false;
    }
  }
} finally {
  rmSync(copies, { recursive: true });
}
process.exit(good ? 0 : 1);
