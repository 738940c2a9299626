// What becomes of the language server, and of programs that come, move and go.
const assert = require("node:assert/strict");
const fs = require("node:fs");
const path = require("node:path");
const vscode = require("vscode");
const { api, eventually, find, folder, open, run, text, uri } = require("./helpers");

const at = (...names) => path.join(folder.fsPath, ...names);
const state = () => api().state();
const restart = () => vscode.commands.executeCommand("potto.restartServer");
const diagnostics = (uri) => vscode.languages.getDiagnostics(uri).map((found) => found.code?.value ?? found.code);

/** Processes as the system lists them: their parent and their words. Those that have ended are none. */
function processes() {
  return fs.readdirSync("/proc").flatMap((id) => {
    try {
      const [state, parent] = fs.readFileSync(`/proc/${id}/stat`, "utf8").replace(/.*\) /, "").split(" ");
      const words = fs.readFileSync(`/proc/${id}/cmdline`, "utf8").split("\0");
      return state === "Z" ? [] : [{ id: Number(id), parent: Number(parent), words }];
    } catch {
      return [];
    }
  });
}
const servers = () => processes().filter(({ parent, words }) => parent === process.pid && words.includes("lsp")).map(({ id }) => id);
const evaluations = (server) => processes().filter(({ parent }) => parent === server).map(({ id }) => id);
const isThere = (id) => processes().some((process) => process.id === id);

/** The one server of this window, when it runs. */
async function server() {
  assert.ok(await api().ready(), state());
  const [only] = await eventually(servers, (found) => found.length === 1);
  return only;
}

/** The server has an evaluation process; its number. */
async function evaluating(document) {
  const server_ = await server();
  await vscode.commands.executeCommand("potto.evaluate", document.uri.toString(), "1 + 1");
  const [only] = await eventually(() => evaluations(server_), (found) => found.length === 1);
  return only;
}

/** A program that says that it is Potto, and then does something else. */
function impostor(name, does) {
  fs.mkdirSync(path.dirname(at(name)), { recursive: true });
  fs.writeFileSync(at(name), `#!/bin/sh\n[ "$1" = --version ] && { echo potto 9.9; exit; }\n${does}\n`);
  fs.chmodSync(at(name), 0o755);
  return at(name);
}

/** Settings of Potto for a while. */
async function withSettings(settings, body) {
  const set = async (values) => {
    for (const [name, value] of Object.entries(values))
      await vscode.workspace.getConfiguration("potto").update(name, value, vscode.ConfigurationTarget.Workspace);
  };
  await set(settings);
  try {
    return await body();
  } finally {
    await set(Object.fromEntries(Object.keys(settings).map((name) => [name, undefined])));
    await vscode.commands.executeCommand("notifications.clearAll");
    await eventually(state, (now) => now === "running");
    await eventually(servers, (found) => found.length === 1);
  }
}

async function hovers(document) {
  const [hover] = await eventually(() => run("HoverProvider", document.uri, find(document, "cover(t)")), (found) => found.length > 0);
  assert.match(text(hover.contents), /cover/);
}

exports.LIFE = {
  async "a server that dies is started again"() {
    const { document } = await open("renderer.po");
    await restart();
    const old = await server();
    process.kill(old, "SIGKILL");
    const dead = Date.now() + 100;
    while (Date.now() < dead); // its end goes unnoticed while requests are written to it
    for (let i = 0; i < 10; i++) void run("HoverProvider", document.uri, find(document, "cover(t)", i % 5)).then(undefined, () => undefined);
    await eventually(servers, (found) => found.length === 1 && found[0] !== old);
    await eventually(state, (now) => now === "running");
    await hovers(document);
  },

  async "a server that dies takes its evaluation with it"() {
    const { document } = await open("renderer.po");
    const [old, evaluation] = [await server(), await evaluating(document)];
    process.kill(old, "SIGKILL");
    await eventually(() => isThere(evaluation), (there) => !there);
    await eventually(servers, (found) => found.length === 1 && found[0] !== old);
    await eventually(state, (now) => now === "running");
  },

  async "one that dies again and again is left alone, until it is restarted"() {
    const { document } = await open("renderer.po");
    await restart(); // from here on its ends are counted anew
    for (let times = 1; times <= 4; times++) {
      const old = await server();
      process.kill(old, "SIGKILL");
      const [many, then] = times < 4 ? [1, "running"] : [0, "failed"];
      await eventually(() => ({ now: servers(), state: state() }), (found) => found.now.length === many && found.now[0] !== old && found.state === then);
    }
    assert.deepEqual(servers(), []);
    assert.match(api().explanation(), /it ended 4 times within three minutes/);
    await vscode.commands.executeCommand("notifications.clearAll");
    await restart();
    assert.equal(state(), "running");
    await hovers(document);
  },

  async "one that hangs is ended by a restart"() {
    const { document } = await open("renderer.po");
    const old = await server();
    process.kill(old, "SIGSTOP");
    await restart();
    assert.ok(!isThere(old), "the one that hung is still there");
    assert.equal(state(), "running");
    await hovers(document);
  },

  async "one that hangs at its start is given up"() {
    const sleeper = impostor("impostors/hangs", "while :; do sleep 1; done");
    await withSettings({ "server.path": sleeper }, async () => {
      await eventually(state, (now) => now === "starting");
      const [hanging] = await eventually(servers, (found) => found.length === 1);
      await vscode.workspace.getConfiguration("potto").update("server.startLimit", 0.5, vscode.ConfigurationTarget.Workspace);
      await eventually(() => isThere(hanging), (there) => !there);
      await eventually(state, (now) => now === "failed");
      assert.match(api().explanation(), /it did not answer within 0\.5 seconds/);
      assert.deepEqual(servers(), []);
      await vscode.workspace.getConfiguration("potto").update("server.startLimit", undefined, vscode.ConfigurationTarget.Workspace);
      await eventually(servers, (found) => found.length === 1); // and what follows does not wait for it
    });
    assert.ok(!processes().some(({ words }) => words.includes(sleeper)));
  },

  async "one that ends at its start says why"() {
    const broken = impostor("impostors/broken", "echo Traceback >&2; echo 'ImportError: no potto_lsp' >&2; exit 3");
    await withSettings({ "server.path": broken }, async () => {
      await eventually(state, (now) => now === "failed");
      assert.match(api().explanation(), /it ended with status 3 while it started: ImportError: no potto_lsp/);
    });
  },

  async "one that is installed later is found"() {
    const { document } = await open("renderer.po");
    const [PATH, real] = [process.env.PATH, fs.realpathSync(at(".venv"))];
    fs.renameSync(at(".venv"), at("elsewhere"));
    process.env.PATH = "/nowhere";
    try {
      await restart();
      assert.equal(state(), "missing");
      impostor(".venv/bin/potto", `exec ${real}/bin/potto "$@"`); // as an installer writes it
      await eventually(state, (now) => now === "running");
      assert.match(api().explanation(), /9\.9: running, from .*\.venv$/);
      await hovers(document);
    } finally {
      process.env.PATH = PATH;
      fs.rmSync(at(".venv"), { recursive: true });
      fs.renameSync(at("elsewhere"), at(".venv"));
      await vscode.commands.executeCommand("notifications.clearAll");
      await restart();
    }
    assert.equal(state(), "running");
  },

  async "the Python environment that is selected is used"() {
    const python = await vscode.extensions.getExtension("ms-python.python").activate();
    const other = impostor("selected/bin/potto", `exec ${at(".venv/bin/potto")} "$@"`);
    fs.writeFileSync(at("selected/bin/python3"), "");
    const old = await server();
    python.select(path.join(path.dirname(other), "python3"));
    await eventually(() => api().explanation(), (now) => /9\.9: running, from the selected Python environment/.test(now));
    assert.ok(!isThere(old));
    python.select(undefined);
    await eventually(() => api().explanation(), (now) => /running, from .*\.venv$/.test(now));
    await eventually(servers, (found) => found.length === 1);
  },

  async "an evaluation that dies is started again"() {
    const { document } = await open("renderer.po");
    const old = await evaluating(document);
    process.kill(old, "SIGKILL");
    const value = () => vscode.commands.executeCommand("potto.evaluate", document.uri.toString(), "cover(1)");
    assert.ok(Math.abs(Number(await eventually(value, (found) => found !== undefined)) - 0.5) < 1e-12);
    assert.notEqual(await evaluating(document), old);
    await vscode.commands.executeCommand("notifications.clearAll");
  },

  async "a document without a file is checked and evaluated"() {
    const content = "def third(a)\n    integral [0, 1] a*x^2 d(x)\nbad = nowhere\n";
    const document = await vscode.workspace.openTextDocument({ language: "potto", content });
    const editor = await vscode.window.showTextDocument(document);
    assert.equal(document.uri.scheme, "untitled");
    await eventually(() => diagnostics(document.uri), (codes) => codes.join() === "P0201");
    await editor.edit((edit) => edit.delete(document.lineAt(2).range));
    await eventually(() => diagnostics(document.uri), (codes) => !codes.length);
    const value = await vscode.commands.executeCommand("potto.evaluate", document.uri.toString(), "third(3)");
    assert.ok(Math.abs(Number(value) - 1) < 1e-12, value);
    await vscode.commands.executeCommand("workbench.action.revertAndCloseActiveEditor");
  },

  async "a file that is renamed is imported by its new name"() {
    const { document } = await open("renderer.po");
    const rename = async (from, to) => {
      const move = new vscode.WorkspaceEdit();
      move.renameFile(uri(from), uri(to));
      assert.ok(await vscode.workspace.applyEdit(move));
      await eventually(() => document.lineAt(1).text, (line) => line === `from ${to.slice(0, -3)} import disc`);
      await eventually(() => diagnostics(document.uri), (codes) => !codes.length);
    };
    await rename("shapes.po", "forms.po");
    await rename("forms.po", "shapes.po");
  },

  async "files that are renamed and deleted are followed"() {
    const [one, two] = [uri("fleeting.po"), uri("moved.po")];
    fs.writeFileSync(one.fsPath, "bad = nowhere\n");
    await eventually(() => diagnostics(one), (codes) => codes.join() === "P0201");
    await vscode.window.showTextDocument(one);
    const move = new vscode.WorkspaceEdit();
    move.renameFile(one, two);
    assert.ok(await vscode.workspace.applyEdit(move));
    await eventually(() => [diagnostics(one), diagnostics(two)].join("|"), (codes) => codes === "|P0201");
    fs.rmSync(two.fsPath);
    await vscode.commands.executeCommand("workbench.action.closeActiveEditor");
    await eventually(() => diagnostics(two), (codes) => !codes.length);
  },
};

/** Megabytes of memory that a process holds. */
const memory = (id) => Number(/VmRSS:\s+(\d+)/.exec(fs.readFileSync(`/proc/${id}/status`, "utf8"))[1]) / 1000;

exports.LIFE["memory stays small with all examples open"] = async () => {
  const before = memory(process.pid);
  fs.cpSync(path.join(__dirname, "..", "..", "..", "..", "examples"), at("examples"), { recursive: true });
  const names = fs.readdirSync(at("examples"), { recursive: true }).filter((name) => /\.(po|diffeo)$/.test(name));
  const programs = names.map((name) => uri(`examples/${name}`));
  assert.ok(programs.length > 10);
  for (const uri of programs) await vscode.window.showTextDocument(uri, { preview: false });
  const last = await vscode.workspace.openTextDocument(programs.at(-1));
  const evaluation = await evaluating(last);
  const id = await server();
  const [host, own, other] = [memory(process.pid), memory(id), memory(evaluation)];
  exports.figures = { programs: programs.length, host, before, server: own, evaluation: other };
  assert.ok(host - before < 100 && own < 300 && other < 600, JSON.stringify(exports.figures));
};
