// Runs inside of the extension host: what each provider gives, asked through Visual Studio Code itself.
const assert = require("node:assert/strict");
const fs = require("node:fs");
const path = require("node:path");
const vscode = require("vscode");

const { api, eventually, find, folder, open, run, text, uri } = require("./helpers");
const life = require("./life");

const TESTS = {
  async "the extension is off until a Potto file is opened"() {
    const extension = vscode.extensions.getExtension("potto.potto");
    assert.ok(extension, "the package is not installed");
    assert.equal(extension.isActive, false);
    await open("renderer.po");
    await eventually(() => extension.isActive, Boolean);
    assert.ok(await api().ready(), api().state());
    assert.equal(api().state(), "running");
  },

  async "activation takes less than 100 ms"() {
    const took = api().activationMilliseconds;
    console.log(`activation: ${took.toFixed(1)} ms`);
    assert.ok(took < 100, `it took ${took} ms`);
  },

  async "diagnostics with related places, code, link and severity"() {
    const { document } = await open("broken.po");
    const [found] = await eventually(() => vscode.languages.getDiagnostics(document.uri), (all) => all.length === 1);
    assert.equal(found.code.value, "P0301");
    assert.match(found.code.target.toString(), /P0301/);
    assert.equal(found.severity, vscode.DiagnosticSeverity.Error);
    assert.equal(document.getText(found.range), "x + c > 0.5");
    const [related] = found.relatedInformation;
    assert.match(related.message, /bound here/);
    assert.equal(document.getText(related.location.range), "x");
    assert.equal(related.location.range.start.line, 1);
  },

  async "the quick fix makes the diagnostic go away"() {
    const { document } = await open("broken.po");
    const [found] = await eventually(() => vscode.languages.getDiagnostics(document.uri), (all) => all.length === 1);
    const actions = await run("CodeActionProvider", document.uri, found.range, undefined, 10);
    const fix = actions.find((action) => action.isPreferred);
    assert.match(fix.title, /^Count the jump/);
    assert.ok(await vscode.workspace.applyEdit(fix.edit));
    assert.match(document.getText(), /if \[x \+ c > 0\.5\] then/);
    await eventually(() => vscode.languages.getDiagnostics(document.uri), (all) => all.length === 0);
  },

  async "hover shows the type and the derivative's"() {
    const { document } = await open("renderer.po");
    const [hover] = await run("HoverProvider", document.uri, find(document, "cover(t)"));
    assert.match(text(hover.contents), /cover : \(t: Real\) -> Real/);
    assert.match(text(hover.contents), /dcover : \(dt: \(Real, Real\)\) -> \(Real, Real\)/);
  },

  async "completion knows names in scope, imports and builtins"() {
    const { document, editor } = await open("renderer.po");
    const end = document.positionAt(document.getText().length);
    await editor.edit((edit) => edit.insert(end, "\ndef g(radius) ra"));
    const at = document.positionAt(document.getText().length);
    const { items } = await run("CompletionItemProvider", document.uri, at);
    const labels = items.map((item) => item.label.label ?? item.label);
    assert.ok(labels.includes("radius"), labels.join());
  },

  async "signatures say which argument is next"() {
    const { document, editor } = await open("renderer.po");
    const end = document.positionAt(document.getText().length);
    await editor.edit((edit) => edit.insert(end, "\nn = pixel(1, "));
    const help = await run("SignatureHelpProvider", document.uri, document.positionAt(document.getText().length), ",");
    assert.match(help.signatures[0].label, /px.*py.*r.*c/);
    assert.equal(help.activeParameter, 1);
  },

  async "definitions lead into other modules"() {
    const { document } = await open("renderer.po");
    const [place] = await run("DefinitionProvider", document.uri, find(document, "disc(x"));
    const target = place.targetUri ?? place.uri;
    assert.equal(path.basename(target.path), "shapes.po");
    assert.equal((place.targetSelectionRange ?? place.range).start.line, 1);
    for (const kind of ["DeclarationProvider", "ImplementationProvider", "TypeDefinitionProvider"])
      assert.ok(Array.isArray(await run(kind, document.uri, find(document, "disc(x"))), kind);
  },

  async "references and highlights"() {
    const { document } = await open("shapes.po");
    const found = await run("ReferenceProvider", document.uri, find(document, "disc"));
    const files = found.map((place) => path.basename(place.uri.path)).sort();
    assert.deepEqual(files, ["renderer.po", "renderer.po", "shapes.po"]);
    const highlights = await run("DocumentHighlights", document.uri, find(document, "r^2"));
    assert.equal(highlights.length, 2);
  },

  async "rename goes over files"() {
    const { document } = await open("shapes.po");
    const place = await vscode.commands.executeCommand("vscode.prepareRename", document.uri, find(document, "disc"));
    assert.equal(place.placeholder, "disc");
    const edit = await run("DocumentRenameProvider", document.uri, find(document, "disc"), "round");
    const files = edit.entries().map(([file, edits]) => [path.basename(file.path), edits.length]).sort();
    assert.deepEqual(files, [["renderer.po", 2], ["shapes.po", 1]]);
  },

  async "live expressions are hints with their values"() {
    const { document } = await open("renderer.po");
    const whole = new vscode.Range(0, 0, document.lineCount, 0);
    const ask = async () => {
      const hints = await run("InlayHintProvider", document.uri, whole);
      const labels = hints.map((hint) => (typeof hint.label === "string" ? hint.label : hint.label.map((part) => part.value).join("")));
      return labels.filter((label) => label.startsWith("="));
    };
    const [first, second] = await eventually(ask, (values) => values.length === 2, 60);
    // Of the pixel [0.1, 0.2] x [0.2, 0.3] all lies within the disc and above the line: (0.8 + 0.3)*100*0.01.
    assert.ok(Math.abs(Number(first.slice(2).split(" ")[0]) - 1.1) < 1e-9, first);
    // t^2/2 and t
    assert.match(second, /^= \(0\.1250*, 0\.50*\)( ± .*)?$/);
  },

  async "a definition has two lenses, and a menu behind the second"() {
    const { document } = await open("renderer.po");
    const lenses = await run("CodeLensProvider", document.uri, 50);
    const titles = lenses.map((lens) => lens.command?.title ?? "");
    assert.ok(titles.includes("more"), titles.join());
    const lines = lenses.map((lens) => lens.range.start.line);
    for (const line of lines) assert.ok(lines.filter((other) => other === line).length <= 2, titles.join());
    const commands = await vscode.commands.getCommands(true);
    for (const lens of lenses) assert.ok(!lens.command?.command || commands.includes(lens.command.command), lens.command?.command);
  },

  async "semantic tokens set variables of integration apart"() {
    const { document } = await open("renderer.po");
    const legend = await vscode.commands.executeCommand("vscode.provideDocumentSemanticTokensLegend", document.uri);
    const { data } = await vscode.commands.executeCommand("vscode.provideDocumentSemanticTokens", document.uri);
    const bit = legend.tokenModifiers.indexOf("integration");
    const [words, at] = [[], { line: 0, column: 0 }];
    for (let i = 0; i < data.length; i += 5) {
      at.column = data[i] ? data[i + 1] : at.column + data[i + 1];
      at.line += data[i];
      if (data[i + 4] & (1 << bit)) words.push(document.getText(new vscode.Range(at.line, at.column, at.line, at.column + data[i + 2])));
    }
    assert.deepEqual([...new Set(words)].sort(), ["x", "y"]);
    const part = new vscode.Range(0, 0, 2, 0);
    const some = await vscode.commands.executeCommand("vscode.provideDocumentRangeSemanticTokens", document.uri, part);
    assert.ok(some.data.length > 0 && some.data.length < data.length);
  },

  async "outline, workspace symbols, folds, selections, links"() {
    const { document } = await open("renderer.po");
    const symbols = await run("DocumentSymbolProvider", document.uri);
    assert.deepEqual(symbols.map((symbol) => symbol.name), ["pixel", "cover"]);
    const everywhere = await run("WorkspaceSymbolProvider", "disc");
    assert.ok(everywhere.some((symbol) => symbol.name === "disc"));
    assert.ok((await run("FoldingRangeProvider", document.uri)).length > 0);
    const [range] = await run("SelectionRangeProvider", document.uri, [find(document, "x^2".slice(0, 1))]);
    assert.ok(range.parent);
    const links = await run("LinkProvider", document.uri, 10);
    assert.ok(links.every((link) => link.target));
  },

  async "call hierarchy"() {
    const { document } = await open("shapes.po");
    const [item] = await vscode.commands.executeCommand("vscode.prepareCallHierarchy", document.uri, find(document, "disc"));
    const callers = await vscode.commands.executeCommand("vscode.provideIncomingCalls", item);
    assert.deepEqual(callers.map((call) => call.from.name), ["pixel"]);
    const [caller] = callers;
    const calls = await vscode.commands.executeCommand("vscode.provideOutgoingCalls", caller.from);
    assert.ok(calls.some((call) => call.to.name === "disc"));
  },

  async "formatting: document, range and while typing"() {
    const { document, editor } = await open("shapes.po");
    const end = document.positionAt(document.getText().length);
    await editor.edit((edit) => edit.insert(end, "def  g( x )   x+1\n"));
    const edits = await run("FormatDocumentProvider", document.uri, { tabSize: 4, insertSpaces: true });
    const change = new vscode.WorkspaceEdit();
    change.set(document.uri, edits);
    await vscode.workspace.applyEdit(change);
    assert.match(document.getText(), /^def g\(x\) x \+ 1$/m);
    const none = await run("FormatRangeProvider", document.uri, new vscode.Range(0, 0, 1, 0), { tabSize: 4, insertSpaces: true });
    assert.deepEqual(none ?? [], []);
    assert.ok(Array.isArray((await run("FormatOnTypeProvider", document.uri, end, "\n", { tabSize: 4, insertSpaces: true })) ?? []));
  },

  async "evaluate answers, and says why it cannot"() {
    const { document } = await open("renderer.po");
    const text = await vscode.commands.executeCommand("potto.evaluate", document.uri.toString(), "cover(0.5)");
    assert.ok(Math.abs(Number(text) - 0.125) < 1e-12, text);
    assert.equal(await vscode.commands.executeCommand("potto.evaluate", document.uri.toString(), "nowhere(1)"), undefined);
  },

  async "the derivative is shown beside, and follows the program"() {
    const { document } = await open("renderer.po");
    await vscode.commands.executeCommand("potto.differentiate", document.uri.toString(), "cover");
    const shown = () => vscode.workspace.textDocuments.find((other) => other.uri.scheme === "potto-derivative" && other.getText());
    const derivative = await eventually(shown, Boolean);
    assert.equal(derivative.languageId, "potto-derivative");
    assert.equal(vscode.workspace.getConfiguration("editor", derivative).get("wordWrap"), "on");
    assert.match(derivative.getText(), /boundary/);
    const before = derivative.getText();
    const { editor } = await open("renderer.po");
    await editor.edit((edit) => edit.insert(find(document, "[x + y < t]"), "3*"));
    await eventually(() => derivative.getText(), (now) => now !== before);
    const renamed = await run("DocumentRenameProvider", document.uri, find(document, "cover"), "shaded");
    assert.ok(await vscode.workspace.applyEdit(renamed));
    await eventually(() => derivative.getText(), (now) => /^shaded : /.test(now));
    const moved = vscode.Uri.joinPath(document.uri, "..", "painted.po");
    const move = async (from, to) => {
      const edit = new vscode.WorkspaceEdit();
      edit.renameFile(from, to);
      assert.ok(await vscode.workspace.applyEdit(edit));
    };
    await move(document.uri, moved);
    const there = await open("painted.po"); // as it is on the disk
    await there.editor.edit((edit) => edit.insert(find(there.document, "[x + y < t]"), "t*"));
    await eventually(() => derivative.getText(), (now) => now.includes("t*[x + y < t]"));
    await vscode.commands.executeCommand("workbench.action.files.revert");
    await move(moved, document.uri);
  },

  async "rename after extracting moves the cursor to the new name"() {
    const { document, editor } = await open("shapes.po");
    await editor.edit((edit) => edit.insert(new vscode.Position(0, 0), "# 𝄞 takes two places\n"));
    const at = [...document.getText().slice(0, document.getText().indexOf("disc"))].length;
    void vscode.commands.executeCommand("potto.rename", document.uri.toString(), at); // done when its box is closed
    const word = () => document.getText(document.getWordRangeAtPosition(vscode.window.activeTextEditor.selection.active));
    await eventually(word, (now) => now === "disc");
    await vscode.commands.executeCommand("cancelRenameInput");
  },

  async "a script runs as a task"() {
    if (!process.env.POTTO_E2E_TERMINAL) return "no terminal could be built here";
    const { document } = await open("script.po");
    const ended = new Promise((resolve) => {
      const listening = vscode.tasks.onDidEndTaskProcess((event) => {
        listening.dispose();
        resolve(event.exitCode);
      });
    });
    await vscode.commands.executeCommand("potto.runFile", document.uri);
    assert.equal(await ended, 0);
  },

  async "indentation and comments follow the language"() {
    const { document, editor } = await open("shapes.po");
    const end = document.positionAt(document.getText().length);
    await editor.edit((edit) => edit.insert(end, "def g(x)"));
    const last = document.positionAt(document.getText().length);
    const typed = async () => {
      const typedBefore = new vscode.Range(last, document.positionAt(document.getText().length));
      if (!typedBefore.isEmpty) await editor.edit((edit) => edit.delete(typedBefore));
      editor.selection = new vscode.Selection(last, last);
      await vscode.commands.executeCommand("type", { text: "\n" });
      await vscode.commands.executeCommand("type", { text: "x" });
      return eventually(() => document.getText(), (text) => text.endsWith("x"));
    };
    // Typed again until the editor has coloured the line that it indents by, which nothing tells.
    await eventually(typed, (text) => /def g\(x\)\n {4}x$/.test(text));
    await vscode.commands.executeCommand("editor.action.commentLine");
    await eventually(() => document.getText(), (text) => /\n {4}# x$/.test(text));
  },
};

exports.run = async () => {
  const only = process.env.POTTO_E2E_ONLY;
  const results = [];
  for (const [name, test] of Object.entries({ ...TESTS, ...life.LIFE })) {
    if (only && results.length && !new RegExp(only).test(name)) continue;
    const started = Date.now();
    let error = null;
    let skipped;
    try {
      skipped = await Promise.race([test(), new Promise((_, fail) => setTimeout(() => fail(new Error("no end after 90 s")), 90_000).unref())]);
    } catch (problem) {
      error = problem.stack ?? String(problem);
    }
    results.push({ name, error, skipped, milliseconds: Date.now() - started });
    if (error && results.length === 1) break; // there is no extension: nothing else can hold
  }
  await vscode.commands.executeCommand("workbench.action.closeAllEditors").then(undefined, () => undefined);
  fs.writeFileSync(path.join(folder.fsPath, "host-results.json"), JSON.stringify({ results, activation: api()?.activationMilliseconds, memory: life.figures }));
};
