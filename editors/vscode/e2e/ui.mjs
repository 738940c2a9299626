// What a person sees and does: keys and the mouse in a window, and a picture of each step.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import assert from "node:assert/strict";
import { PREVIEWS, RENAMED } from "./previews.mjs";
import { THEMES } from "./themes.mjs";
import { VIEWS } from "./views.mjs";
import { until } from "./waiting.mjs";
import { EDITOR, frameOf, preview, showPreview, windowOn } from "./window.mjs";

export async function uiTests(code, pictures, report, only) {
  const run = async (name, window, test) => {
    const started = Date.now();
    let error = null;
    let skipped;
    try {
      skipped = await test(window);
    } catch (problem) {
      error = problem.stack ?? String(problem);
      await window.page.screenshot({ path: join(pictures, `failed-${name.replace(/\W+/g, "-")}.png`) });
    }
    report({ name: `ui: ${name}`, error, skipped, milliseconds: Date.now() - started });
    await window.page.keyboard.press("Escape");
    return error === null;
  };
  /** Tests in one window, each of which goes on from where the one before it has ended. */
  const series = async (file, tests) => {
    const window = await windowOn(code, code.workspace, file, pictures);
    const names = Object.keys(tests);
    for (const [place, name] of names.entries()) {
      if (await run(name, window, tests[name])) continue;
      const rest = names.length - place - 1;
      if (rest) report({ name: `ui: ${rest} more`, error: "not run, as they go on from where the one above should have ended", milliseconds: 0 });
      break;
    }
    await window.page.context().close();
  };
  await series("moving.po", VIEWS);
  if (only === "views") return;
  await series("broken.po", { ...TESTS, ...PREVIEWS, ...THEMES, ...PROMPT, ...RENAMED });
  const lost = await windowOn(code, code.lost, "shapes.po", pictures);
  await run("one message with a button when there is no server", lost, noServer);
  await lost.page.context().close();
  const several = await windowOn(code, code.several, "one/broken.po", pictures);
  await run("several folders, of which one has the server", several, severalFolders);
  await run("the walkthrough leads from a new program to its preview", several, walkthrough);
  await several.page.context().close();
}

const TESTS = {
  async "P0301 is underlined, with the place that it comes from"({ page, picture }) {
    await page.locator(`${EDITOR} .squiggly-error`).first().waitFor();
    await page.keyboard.press("Control+Shift+M");
    const rows = page.locator(".markers-panel .monaco-list-row");
    await rows.filter({ hasText: "depends on the variable of integration" }).first().waitFor();
    await rows.filter({ hasText: "is bound here" }).first().waitFor();
    await picture("squiggle");
    await page.keyboard.press("Control+J");
  },

  async "a preview of a program with an error says what is wrong, and follows when it is put right"({ page, picture, go }) {
    await go(1, 6);
    await showPreview(page, "broken.po");
    await frameOf(page).locator("#problem", { hasText: "P0301" }).waitFor();
    await picture("preview-of-error");
    await page.keyboard.press("Control+1");
  },

  async "the quick fix is applied and the squiggle is gone"({ page, picture, go, text }) {
    await go(2, 30);
    await page.keyboard.press("Control+.");
    const fix = page.locator(".action-widget .monaco-list-row", { hasText: "Count the jump" }).first();
    await fix.waitFor();
    await picture("quick-fix");
    await page.keyboard.press("Enter");
    await page.locator(`${EDITOR} .squiggly-error`).first().waitFor({ state: "detached" });
    assert.match(await text(), /if \[x \+ c > 0\.5\] then 1 else 0/);
    await picture("fixed");
    await page.keyboard.press("Control+S");
    await preview(page);
    await frameOf(page).locator("#problem").waitFor({ state: "hidden" });
    await page.locator(".tab", { hasText: "Preview broken.po" }).locator(".codicon-close").click();
  },

  async "a hover shows the type of the derivative"({ page, picture, file, go }) {
    await file("renderer.po");
    await go(10, 6);
    await page.keyboard.press("Control+K");
    await page.keyboard.press("Control+I");
    const hover = page.locator(".monaco-hover:visible", { hasText: "dcover" }).first();
    await hover.waitFor();
    assert.match((await hover.innerText()).replaceAll("\u00a0", " "), /dcover : \(dt: \(Real, Real\)\) -> \(Real, Real\)/);
    await picture("hover");
    await page.keyboard.press("Escape");
  },

  async "live expressions show their values"({ page, picture }) {
    const values = page.locator(`${EDITOR} .view-line`, { hasText: "= (0.125, 0.5)" });
    await values.first().waitFor();
    const line = page.locator(`${EDITOR} .view-line`, { hasText: "#> pixel" });
    await line.filter({ hasText: /=\s1\.1/ }).first().waitFor();
    await picture("live");
  },

  async "completion offers what is in scope"({ page, picture, go }) {
    await go(15, 1);
    await page.keyboard.press("Control+End");
    await page.keyboard.type("\ndef half(angle) cov");
    await page.keyboard.press("Control+Space");
    const row = page.locator(".suggest-widget.visible .monaco-list-row", { hasText: "cover" }).first();
    await row.waitFor();
    await picture("completion");
    await page.keyboard.press("Escape");
  },

  async "parameter hints name the arguments"({ page, picture, command }) {
    await page.keyboard.press("Control+End");
    for (let i = 0; i < 3; i++) await page.keyboard.press("Backspace");
    await page.keyboard.type("pixel(1, ", { delay: 60 });
    const hints = page.locator(".parameter-hints-widget.visible");
    await hints.waitFor();
    assert.match((await hints.innerText()).replaceAll("\u00a0", " "), /px.*py.*r.*c/);
    await picture("parameter-hints");
    await page.keyboard.press("Escape");
    await command("File: Revert File");
    await page.locator(`${EDITOR} .view-line`, { hasText: "def half" }).waitFor({ state: "detached" });
  },

  async "rename changes all files"({ page, picture, code, file, go, command }) {
    await file("shapes.po");
    await go(2, 6);
    await page.keyboard.press("F2");
    const box = page.locator(".rename-box input");
    await box.waitFor();
    await box.fill("ball");
    await picture("rename");
    await page.keyboard.press("Enter");
    await page.locator(`${EDITOR} .view-line`, { hasText: "def ball" }).first().waitFor();
    await file("renderer.po");
    await page.locator(`${EDITOR} .view-line`, { hasText: "import ball" }).first().waitFor();
    await page.locator(`${EDITOR} .view-line`, { hasText: "0.8*ball(x" }).first().waitFor();
    await picture("renamed");
    await command("File: Save All");
    const saved = () => readFileSync(join(code.workspace, "renderer.po"), "utf8").includes("import ball");
    assert.ok(await until(saved), "the other file is not saved");
    await page.locator(`${EDITOR} .squiggly-error`).waitFor({ state: "detached" });
  },

};

const PROMPT = {
  async "a prompt opens with the file, takes the keyboard, and a selection"({ page, picture, code, file, command, go, text }) {
    if (!code.terminal) return "no terminal could be built here";
    await file("shapes.po");
    await command("Potto: Open REPL");
    const terminal = page.locator(".terminal-wrapper.active .xterm-rows");
    await terminal.filter({ hasText: /1\spo>/ }).waitFor();
    const before = await text();
    await page.keyboard.type("40 + 2", { delay: 60 }); // without a click: it lands in the prompt, not in the program
    await page.keyboard.press("Enter");
    await terminal.filter({ hasText: /2\spo>/ }).waitFor();
    assert.match((await terminal.innerText()).replaceAll("\u00a0", " "), /40 \+ 2\s+_1 = 42/);
    assert.equal(await text(), before);
    await go(2, 1);
    await page.keyboard.press("Shift+Enter");
    await terminal.filter({ hasText: /ball\s:\s\(x:\sReal\*,\sy:\sReal\*,\sr:\sReal\*\)\s->\sReal/ }).waitFor();
    await picture("prompt");
  },
};

async function noServer({ page, picture }) {
  const message = page.locator(".notification-toast", { hasText: "/nowhere/potto" });
  await message.first().waitFor();
  assert.equal(await message.count(), 1);
  await picture("no-server");
  await message.locator(".monaco-button", { hasText: "Select Server" }).click();
  await page.locator(".quick-input-list .monaco-list-row", { hasText: "Choose a program" }).first().waitFor();
  await page.keyboard.press("Escape");
  await page.locator(".statusbar-item", { hasText: "Potto" }).first().waitFor();
}

async function severalFolders({ page, picture, file }) {
  const row = page.locator(".explorer-folders-view .monaco-list-row", { hasText: "two" }).first();
  await row.waitFor({ timeout: 8000 }).catch(() => page.reload()); // a window now and then misses its workspace
  await row.waitFor();
  await page.locator(`${EDITOR} .squiggly-error`).first().waitFor();
  await page.locator(".statusbar-item", { hasText: "Potto" }).locator(".codicon-check").first().waitFor();
  await file("renderer.po");
  await page.locator(`${EDITOR} .view-line`, { hasText: "= (0.125, 0.5)" }).first().waitFor();
  await picture("several-folders");
}

async function walkthrough({ page, picture, command }) {
  await command("Welcome: Open Walkthrough...");
  await page.locator(".quick-input-widget input").first().fill("Potto");
  await page.locator(".quick-input-list .monaco-list-row", { hasText: "Get started with Potto" }).first().waitFor();
  await page.keyboard.press("Enter");
  const step = page.locator(".getting-started-step", { hasText: "Write a program" });
  await step.first().click();
  await picture("walkthrough");
  await step.locator(".monaco-button", { hasText: "New Potto file" }).click();
  await page.locator(`${EDITOR} .view-line`, { hasText: "= (0.125, 0.5)" }).first().waitFor();
  await page.keyboard.press("Control+K");
  await page.keyboard.press("v");
  const frame = await preview(page);
  await frame.locator("main.curves").waitFor();
  await picture("untitled");
  await frame.locator("#save").click();
  const box = page.locator(".quick-input-widget input").first();
  await box.waitFor();
  await until(async () => /\/one\/cover\.png$/.test(await box.inputValue()));
  assert.match(await box.inputValue(), /\/one\/cover\.png$/);
  await page.keyboard.press("Escape");
  await page.keyboard.press("Control+1");
  await page.locator(".tab", { hasText: "Walkthrough" }).first().click();
  for (const done of ["Connect the language server", "Write a program", "Preview it"])
    await page.locator(".getting-started-step", { hasText: done }).locator(".codicon-getting-started-step-checked").first().waitFor();
}
