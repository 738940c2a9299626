// What a person sees and does: keys and the mouse in a window, and a picture of each step.
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import assert from "node:assert/strict";
import { open, remote } from "./vscode.mjs";

const EDITOR = ".part.editor";
const SOON = 15_000;

export async function uiTests(code, pictures, report) {
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
  const main = await windowOn(code, code.workspace, "broken.po", pictures);
  const names = Object.keys(TESTS);
  for (const [place, name] of names.entries()) {
    if (await run(name, main, TESTS[name])) continue;
    const rest = names.length - place - 1; // they go on from where this one should have ended
    if (rest) report({ name: `ui: ${rest} more`, error: "not run, as they go on from where the one above should have ended", milliseconds: 0 });
    break;
  }
  await main.page.context().close();
  const lost = await windowOn(code, code.lost, "shapes.po", pictures);
  await run("one message with a button when there is no server", lost, noServer);
  await lost.page.context().close();
}

async function windowOn(code, folder, file, pictures) {
  const page = await open(code, folder, [["openFile", remote(code, `${folder}/${file}`)]]);
  page.setDefaultTimeout(SOON);
  await page.locator(`${EDITOR} .view-line`).first().waitFor({ timeout: 60_000 });
  return {
    code,
    page,
    /** Keep a picture, after what fades in has done so. */
    async picture(name, clip) {
      await page.waitForTimeout(600);
      await page.screenshot({ path: join(pictures, `${name}.png`), ...(clip ? { clip } : {}) });
    },
    /** Open a file by its name. */
    async file(name) {
      await page.keyboard.press("Control+1"); // the first group of editors
      await page.locator(".explorer-folders-view .monaco-list-row", { hasText: name }).first().dblclick();
      await page.locator(`.tab.active[aria-label*="${name}"]`).first().waitFor();
      await page.locator(`${EDITOR} .view-line`).first().waitFor();
    },
    async command(name) {
      await page.keyboard.press("F1");
      await page.locator(".quick-input-widget input").first().fill(`>${name}`);
      await page.locator(".quick-input-list .monaco-list-row", { hasText: name }).first().waitFor();
      await page.keyboard.press("Enter");
    },
    /** Go to a line and column. */
    async go(line, column) {
      await page.keyboard.press("Control+1"); // the first group of editors
      await page.keyboard.press("Control+G");
      await page.locator(".quick-input-widget input").first().fill(`:${line}:${column}`);
      await page.keyboard.press("Enter");
      await page.locator(".quick-input-widget").waitFor({ state: "hidden" });
    },
    /** The text of the editor, with common blanks. */
    async text() {
      const lines = await page.locator(`${EDITOR} .view-line`).allInnerTexts();
      return lines.map((line) => line.replaceAll("\u00a0", " ")).join("\n");
    },
  };
}

/** The page of the preview, which is a frame within a frame. */
async function preview(page) {
  const outer = page.frameLocator("iframe.webview.ready").last();
  const inner = outer.frameLocator("iframe#active-frame");
  await inner.locator("#status[data-settled=true]").waitFor({ timeout: 60_000 });
  return inner;
}

/** The colours in the middle of a canvas, as a text to compare. */
const pixels = (canvas) =>
  canvas.evaluate((element) => {
    const { width, height } = element;
    const { data } = element.getContext("2d").getImageData(0, 0, width, Math.floor(height * 0.85));
    let hash = 0;
    for (let i = 0; i < data.length; i++) hash = (hash * 31 + data[i]) | 0;
    return `${width}x${height} ${hash} ${new Set(new Uint32Array(data.buffer)).size}`;
  });

async function settledAfter(frame, change) {
  const before = await frame.locator("#status").innerText();
  await change();
  await frame.locator("#status").filter({ hasNotText: before }).waitFor();
  await frame.locator("#status[data-settled=true]").waitFor();
}

const TESTS = {
  async "P0301 is underlined, with the place that it comes from"({ page, picture }) {
    await page.locator(`${EDITOR} .squiggly-error`).first().waitFor({ timeout: 60_000 });
    await page.keyboard.press("Control+Shift+M");
    const rows = page.locator(".markers-panel .monaco-list-row");
    await rows.filter({ hasText: "depends on the variable of integration" }).first().waitFor();
    await rows.filter({ hasText: "is bound here" }).first().waitFor();
    await picture("squiggle");
    await page.keyboard.press("Control+J");
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

  async "variables of integration have a colour of their own"({ page }) {
    const colour = async (line, word) => {
      const span = page.locator(`${EDITOR} .view-line`, { hasText: line }).locator("span > span", { hasText: new RegExp(`^\\s*${word}\\s*$`) }).first();
      return span.evaluate((element) => {
        const style = getComputedStyle(element);
        return `${style.color} ${style.fontStyle}`;
      });
    };
    const [integrated, parameter] = [await colour("x + y < t", "x"), await colour("x + y < t", "t")];
    assert.notEqual(integrated, parameter);
    assert.match(integrated, /italic/);
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
    for (let i = 0; i < 100 && !saved(); i++) await page.waitForTimeout(100);
    assert.ok(saved());
    await page.locator(`${EDITOR} .squiggly-error`).waitFor({ state: "detached" });
  },

  async "the preview shows the value and its derivative"({ page, picture, go }) {
    await go(4, 6);
    await page.keyboard.press("Control+K");
    await page.keyboard.press("v");
    const frame = await preview(page);
    assert.equal(await frame.locator("canvas").count(), 2);
    const status = await frame.locator("#status").innerText();
    assert.match(status, /160 × 160 · .* ms .* error ≤ .*of the derivative ≤ .* evaluations/);
    for (const id of ["value", "slope"]) {
      const colours = Number((await pixels(frame.locator(`#${id}`))).split(" ")[2]);
      assert.ok(colours > 10, `${id} has ${colours} colours`);
    }
    await picture("preview");
  },

  async "both images follow a slider"({ page, picture }) {
    const frame = await preview(page);
    const [value, slope] = [frame.locator("#value"), frame.locator("#slope")];
    const before = [await pixels(value), await pixels(slope)];
    const slider = frame.locator('input[data-parameter="r"]');
    const box = await slider.boundingBox();
    await page.mouse.move(box.x + box.width * 0.5, box.y + box.height / 2);
    await page.mouse.down();
    await settledAfter(frame, async () => {
      for (let step = 1; step <= 20; step++) await page.mouse.move(box.x + box.width * (0.5 + 0.015 * step), box.y + box.height / 2);
    });
    await page.mouse.up();
    assert.ok(Number(await slider.inputValue()) > 0.7);
    const after = [await pixels(value), await pixels(slope)];
    assert.notEqual(after[0], before[0], "the value's image is as it was");
    assert.notEqual(after[1], before[1], "the derivative's image is as it was");
    await picture("preview-slider");
  },

  async "a probe reads a pixel; the mouse pans and zooms"({ page, picture }) {
    const frame = await preview(page);
    const value = frame.locator("#value");
    const box = await value.boundingBox();
    const [x, y] = [box.x + box.width * 0.52, box.y + box.height * 0.4];
    await page.mouse.move(x, y);
    // Within the disc, and above the line x + y + 0.1 > 0: a pixel of 0.01 with 80 and 30.
    await frame.locator("#probe", { hasText: /px = 0\.0\d+, py = 0\.\d+: 1\.1 ± .*∂\/∂r: / }).waitFor();
    await picture("preview-probe");
    const before = await pixels(value);
    await settledAfter(frame, () => page.mouse.wheel(0, -400));
    const zoomed = await pixels(value);
    assert.notEqual(zoomed, before);
    await settledAfter(frame, async () => {
      await page.mouse.down();
      await page.mouse.move(x + 40, y + 30, { steps: 5 });
      await page.mouse.up();
    });
    assert.notEqual(await pixels(value), zoomed);
    await settledAfter(frame, () => frame.locator("#reset").click());
  },

  async "the preview follows the text, and says what is wrong with it"({ page, picture, command }) {
    const frame = await preview(page);
    const before = await pixels(frame.locator("#value"));
    const word = page.locator(`${EDITOR} .view-line`, { hasText: "0.8*ball" }).first();
    await word.click();
    await page.keyboard.press("Home");
    await settledAfter(frame, () => page.keyboard.type("(1 - x)*"));
    assert.notEqual(await pixels(frame.locator("#value")), before);
    await page.keyboard.press("Home");
    await page.keyboard.type("missing*");
    await frame.locator("#problem", { hasText: "missing" }).waitFor();
    await picture("preview-problem");
    for (let i = 0; i < "missing*".length; i++) await page.keyboard.press("Backspace");
    await frame.locator("#problem").waitFor({ state: "hidden" });
    await command("File: Revert File");
    await page.locator(`${EDITOR} .view-line`, { hasText: "(1 - x)" }).waitFor({ state: "detached" });
  },

  async "a function of one number is a curve with its band"({ page, picture }) {
    const frame = await preview(page);
    await frame.locator("#function").selectOption("cover");
    await frame.locator("main.curves").waitFor();
    await frame.locator("#status", { hasText: "513 points" }).waitFor();
    await frame.locator("#status[data-settled=true]").waitFor();
    assert.match(await frame.locator("figcaption").last().innerText(), /∂cover\/∂t/);
    const box = await frame.locator("#value").boundingBox();
    await page.mouse.move(box.x + 52 + (box.width - 52) / 2, box.y + 60);
    // t^2/2 and t at 1/2
    await frame.locator("#probe", { hasText: /t = 0\.\d+: 0\.12\d+ ± .*∂\/∂t: 0\.(49|5)/ }).waitFor();
    await picture("preview-curve");
  },

  async "the picture is saved as a PNG"({ page, code }) {
    const frame = await preview(page);
    await frame.locator("#save").click();
    const box = page.locator(".quick-input-widget input").first();
    await box.waitFor();
    const target = join(code.workspace, "cover.png");
    for (let i = 0; i < 50 && !(await box.inputValue()).endsWith("cover.png"); i++) await page.waitForTimeout(100);
    await page.keyboard.press("Enter");
    for (let i = 0; i < 100 && !existsSync(target); i++) await page.waitForTimeout(100);
    const data = readFileSync(target);
    assert.equal(data.subarray(1, 4).toString(), "PNG");
    assert.ok(data.length > 3000 && data.readUInt32BE(16) > 200);
  },

  async "a slow preview holds up nothing"({ page, file, command }) {
    await file("slow.po");
    await page.keyboard.press("Control+K");
    await page.keyboard.press("v");
    const frame = page.frameLocator("iframe.webview.ready").last().frameLocator("iframe#active-frame");
    await frame.locator("canvas").first().waitFor();
    await page.locator(`${EDITOR} .view-line`, { hasText: "def slow" }).first().click();
    await page.keyboard.press("Control+End");
    const started = Date.now();
    await page.keyboard.type("\nbad = nowhere");
    await page.locator(`${EDITOR} .squiggly-error`).first().waitFor();
    const took = Date.now() - started;
    assert.ok(took < 5000, `a diagnostic took ${took} ms`);
    assert.notEqual(await frame.locator("#status").getAttribute("data-settled"), "true", "it was not slow");
    await command("File: Revert File");
  },

  async "a prompt opens with the file, and takes a selection"({ page, picture, code, file, command, go }) {
    if (!code.terminal) return "no terminal could be built here";
    await file("shapes.po");
    await command("Potto: Open REPL");
    const terminal = page.locator(".terminal-wrapper.active .xterm-rows");
    await terminal.filter({ hasText: /1\spo>/ }).waitFor();
    await go(2, 1);
    await page.keyboard.press("Shift+Enter");
    await terminal.filter({ hasText: /ball\s:\s\(x:\sReal\*,\sy:\sReal\*,\sr:\sReal\*\)\s->\sReal/ }).waitFor();
    await picture("prompt");
  },
};

async function noServer({ page, picture }) {
  const message = page.locator(".notification-toast", { hasText: "/nowhere/potto" });
  await message.first().waitFor({ timeout: 60_000 });
  assert.equal(await message.count(), 1);
  await picture("no-server");
  await message.locator(".monaco-button", { hasText: "Select Server" }).click();
  await page.locator(".quick-input-list .monaco-list-row", { hasText: "Choose a program" }).first().waitFor();
  await page.keyboard.press("Escape");
  await page.locator(".statusbar-item", { hasText: "Potto" }).first().waitFor();
}
