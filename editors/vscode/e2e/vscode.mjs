// A real Visual Studio Code without a screen: its server with the packaged extension, and pages of it in Chromium.
import { spawn, spawnSync } from "node:child_process";
import { cpSync, existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, readlinkSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

export const here = dirname(fileURLToPath(import.meta.url));
const root = join(here, "..", "..", "..");
const inner = join(here, "node_modules", "code-server", "lib", "vscode");
const LOADING = 120_000;

const SETTINGS = {
  "chat.disableAIFeatures": true,
  "chat.commandCenter.enabled": false,
  "extensions.autoCheckUpdates": false,
  "extensions.ignoreRecommendations": true,
  "files.autoSave": "off",
  "files.exclude": { "**/.venv": true },
  "git.enabled": false,
  "security.workspace.trust.enabled": false,
  "telemetry.telemetryLevel": "off",
  "terminal.integrated.gpuAcceleration": "off",
  "update.mode": "none",
  "workbench.colorTheme": "Default Dark Modern",
  "workbench.enableExperiments": false,
  "workbench.startupEditor": "none",
  "workbench.tips.enabled": false,
  "editor.fontSize": 13,
  "editor.minimap.enabled": false,
  "editor.accessibilitySupport": "off",
  "files.simpleDialog.enable": true,
  "task.saveBeforeRun": "never",
  "task.problemMatchers.neverPrompt": true,
};

function freePort() {
  return new Promise((resolve, reject) => {
    const probe = createServer();
    probe.on("error", reject);
    probe.listen(0, "127.0.0.1", () => {
      const { port } = probe.address();
      probe.close(() => resolve(port));
    });
  });
}

/** The server with the extension installed from its package, and a browser. Close it in the end, whatever happens. */
export async function start(vsix, chromiumPath) {
  const folder = mkdtempSync(join(tmpdir(), "potto-e2e-"));
  const [hostWorkspace, workspace] = ["host", "ui"].map((name) => {
    const made = join(folder, name, "workspace");
    cpSync(join(here, "workspace"), made, { recursive: true });
    symlinkSync(join(root, ".venv"), join(made, ".venv")); // where the extension is to find the language server
    return made;
  });
  const lost = join(folder, "lost"); // a workspace whose setting names no server
  mkdirSync(join(lost, ".vscode"), { recursive: true });
  cpSync(join(here, "workspace", "shapes.po"), join(lost, "shapes.po"));
  writeFileSync(join(lost, ".vscode", "settings.json"), JSON.stringify({ "potto.server.path": "/nowhere/potto" }));
  const parts = ["one", "two"].map((name) => join(folder, "several", name)); // a workspace of two folders
  for (const part of parts) mkdirSync(part, { recursive: true });
  cpSync(join(here, "workspace", "broken.po"), join(parts[0], "broken.po"));
  for (const name of ["renderer.po", "shapes.po"]) cpSync(join(here, "workspace", name), join(parts[1], name));
  symlinkSync(join(root, ".venv"), join(parts[1], ".venv"));
  const several = join(folder, "several", "both.code-workspace");
  writeFileSync(several, JSON.stringify({ folders: parts.map((path) => ({ path })) }));
  const data = join(folder, "data");
  mkdirSync(join(data, "data", "Machine"), { recursive: true });
  writeFileSync(join(data, "data", "Machine", "settings.json"), JSON.stringify(SETTINGS));
  const common = ["--accept-server-license-terms", "--server-data-dir", data, "--extensions-dir", join(data, "ext")];
  const main = join(inner, "out", "server-main.js");
  // Terminals need a native module, which is built where there is a compiler.
  const terminal = existsSync(join(inner, "node_modules", "node-pty", "build", "Release", "pty.node"));
  const env = { ...process.env, POTTO_E2E_TERMINAL: terminal ? "1" : "" };
  const installed = spawnSync(process.execPath, [main, ...common, "--install-extension", vsix], { env, encoding: "utf8" });
  if (installed.status !== 0) throw new Error(`the extension was not installed:\n${installed.stdout}${installed.stderr}`);
  const port = await freePort();
  const server = spawn(
    process.execPath,
    [main, ...common, "--host", "127.0.0.1", "--port", String(port), "--without-connection-token", "--disable-telemetry",
      "--disable-workspace-trust", "--enable-smoke-test-driver"],
    { env, stdio: ["ignore", "pipe", "pipe"] },
  );
  let said = "";
  for (const stream of [server.stdout, server.stderr]) stream.on("data", (text) => (said += text));
  let browser;
  const close = async () => {
    await browser?.close();
    const ended = new Promise((resolve) => server.on("exit", resolve));
    server.kill();
    await Promise.race([ended, new Promise((resolve) => setTimeout(resolve, 3000))]);
    if (server.exitCode === null) server.kill("SIGKILL");
    const left = await leftIn(folder);
    if (process.env.POTTO_E2E_KEEP) console.log(`kept: ${folder}`);
    else rmSync(folder, { recursive: true, force: true, maxRetries: 5 });
    return left;
  };
  try {
    await answering(`http://127.0.0.1:${port}/`, server, () => said);
    browser = await chromium.launch({
      executablePath: chromiumPath,
      args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
        "--disable-component-update", "--disable-sync"],
    });
  } catch (error) {
    await close();
    throw error;
  }
  return { port, folder, hostWorkspace, workspace, lost, several, browser, terminal, close, said: () => said };
}

/** The processes that work in a folder, and do not end soon. */
async function leftIn(folder) {
  const until = Date.now() + 15_000;
  for (;;) {
    const found = readdirSync("/proc").flatMap((id) => {
      try {
        return readlinkSync(`/proc/${id}/cwd`).startsWith(folder) ? [readFileSync(`/proc/${id}/cmdline`, "utf8").replaceAll("\0", " ")] : [];
      } catch {
        return []; // it has ended, or is not ours
      }
    });
    if (!found.length || Date.now() > until) return found;
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}

async function answering(url, server, said) {
  const until = Date.now() + LOADING;
  while (Date.now() < until) {
    if (server.exitCode !== null) throw new Error(`the server ended:\n${said()}`);
    try {
      if ((await fetch(url)).ok) return;
    } catch {
      // not yet
    }
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  throw new Error(`the server does not answer:\n${said()}`);
}

/** A window on a folder, or on a workspace of several. `payload` are pairs that Visual Studio Code's web page understands. */
export async function open(code, folder, payload, prepare = async () => undefined) {
  const context = await code.browser.newContext({ viewport: { width: 1280, height: 800 } });
  const page = await context.newPage();
  const local = new URL(`http://127.0.0.1:${code.port}/`);
  await page.route("**/*", (route) => {
    const { hostname, protocol } = new URL(route.request().url());
    const inside = hostname === local.hostname || hostname.endsWith(".vscode-resource.vscode-cdn.net") || !/^(https?|wss?):/.test(protocol);
    return inside ? route.continue() : route.abort();
  });
  await prepare(page);
  const kind = folder.endsWith(".code-workspace") ? "workspace" : "folder";
  const query = new URLSearchParams({ [kind]: folder, payload: JSON.stringify([["skipWelcome", "true"], ...payload]) });
  await page.goto(`${local}?${query}`);
  return page;
}

export const remote = (code, path) => `vscode-remote://127.0.0.1:${code.port}${path}`;
