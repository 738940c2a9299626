// What a person does with previews.
import { existsSync, readFileSync, readdirSync, readlinkSync, statSync } from "node:fs";
import { join } from "node:path";
import assert from "node:assert/strict";
import { until } from "./waiting.mjs";
import { EDITOR, frameOf, pixels, preview, redrawnAfter, settledAfter, showPreview } from "./window.mjs";

export const PREVIEWS = {
  async "the preview shows the value and its derivative"({ page, picture, go }) {
    await go(4, 6);
    await showPreview(page, "renderer.po");
    const frame = frameOf(page);
    const told = /160 × 160 · .* ms .* error ≤ .*of the derivative ≤ .* evaluations/;
    await frame.locator("#status[data-settled=true]", { hasText: told }).waitFor();
    assert.equal(await frame.locator("canvas").count(), 2);
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

  async "a click on a pixel selects the condition behind it"({ page, picture }) {
    const frame = await preview(page);
    const box = await frame.locator("#value").boundingBox();
    await page.mouse.click(box.x + box.width * 0.3, box.y + box.height * 0.3);
    await frame.locator("#probe", { hasText: /(goes through this pixel|pixels off)/ }).waitFor();
    const selected = page.locator(".part.editor .view-overlays .selected-text").first();
    await selected.waitFor();
    await picture("preview-pixel");
    await frame.locator("#value").hover();
  },

  async "a probe reads a pixel; the mouse pans and zooms"({ page, picture }) {
    const frame = await preview(page);
    const value = frame.locator("#value");
    const box = await value.boundingBox();
    const [x, y] = [box.x + box.width * 0.52, box.y + box.height * 0.4];
    await page.mouse.move(x, y);
    // Within the disc, and above the line x + y + 0.1 > 0: a pixel of 0.01 with 80 and 30.
    await frame.locator("#probe", { hasText: /px = 0\.0\d+, py = 0\.\d+: 1\.10* ± .*∂\/∂r: / }).waitFor();
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
    const word = page.locator(`${EDITOR} .view-line`, { hasText: "0.8*ball" }).first();
    await word.click();
    await page.keyboard.press("Home");
    await redrawnAfter(frame, () => page.keyboard.type("(1 - x)*"));
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
    assert.ok(await until(async () => (await box.inputValue()).endsWith("cover.png")), "no file is proposed");
    await page.keyboard.press("Enter");
    assert.ok(await until(() => existsSync(target) && statSync(target).size > 3000), "no file is written");
    const data = readFileSync(target);
    assert.equal(data.subarray(1, 4).toString(), "PNG");
    assert.ok(data.readUInt32BE(16) > 200);
  },

  async "a function that a function needs is found, or asked for"({ page, picture, file }) {
    await file("shaded.po");
    await showPreview(page, "shaded.po");
    const frame = await preview(page);
    await frame.locator("main.curves").waitFor();
    assert.equal(await frame.locator("#p-shader").inputValue(), "lin");
    assert.ok(await frame.locator("#problem").isHidden());
    await picture("preview-function");
    const before = await pixels(frame.locator("#value"));
    await settledAfter(frame, () => frame.locator("#p-shader").fill("\\(x, y) . \\(c) . 1"));
    assert.notEqual(await pixels(frame.locator("#value")), before);
    await frame.locator("#p-shader").fill("");
    await frame.locator("#problem.needed", { hasText: "such as lin" }).waitFor();
    await picture("preview-needs-function");
    await settledAfter(frame, () => frame.locator("#p-shader").fill("lin"));
    await frame.locator("#problem").waitFor({ state: "hidden" });
    await page.locator(".tab", { hasText: "Preview shaded.po" }).locator(".codicon-close").click();
  },

  async "a slow preview holds up nothing"({ page, file, command }) {
    await file("slow.po");
    await showPreview(page, "slow.po");
    const frame = frameOf(page);
    await frame.locator("#function option", { hasText: "slow" }).waitFor({ state: "attached" });
    await page.locator(`${EDITOR} .view-line`, { hasText: "def slow" }).first().click();
    await page.keyboard.press("Control+End");
    await page.keyboard.type("\nbad = nowhere");
    await page.locator(`${EDITOR} .squiggly-error`).first().waitFor();
    assert.notEqual(await frame.locator("#status").getAttribute("data-settled"), "true", "it was not slow");
    await command("File: Revert File");
  },

  async "an evaluation that dies under a preview is told, and tried again"({ page, picture, code }) {
    const frame = frameOf(page);
    const again = frame.locator("#problem button");
    const told = frame.locator("#problem", { hasText: /the evaluation process (ended unexpectedly|does not start)/ });
    for (let i = 0; i < 100 && !(await told.isVisible()); i++) {
      if (await again.isVisible()) await again.click(); // it was too slow, or had not begun
      await page.waitForTimeout(600);
      for (const id of evaluations(code.workspace)) process.kill(id, "SIGKILL");
      await page.waitForTimeout(200);
    }
    await told.waitFor();
    await picture("preview-ended");
    await again.click();
    await frame.locator("#problem").waitFor({ state: "hidden" });
    await frame.locator("#status", { hasText: /evaluating|refining/ }).waitFor();
  },

  async "of two previews, the one that is seen is evaluated"({ page, code }) {
    await page.locator(".tab", { hasText: "Preview renderer.po" }).first().click();
    const frame = frameOf(page);
    await frame.locator("#function option", { hasText: "pixel" }).waitFor({ state: "attached" });
    await frame.locator("#function").selectOption("pixel");
    await frame.locator("main.images").waitFor();
    await frame.locator('#status[data-settled=true][data-count="160"]').waitFor();
    for (const id of evaluations(code.workspace)) process.kill(id, "SIGKILL"); // at rest, nobody sees that
    await settledAfter(frame, () => frame.locator('input[data-parameter="c"]').press("ArrowRight"));
    await frame.locator("#problem").waitFor({ state: "hidden" });
  },
};

/** Goes last: what the file was called is gone afterwards. */
export const RENAMED = {
  async "a preview stays with a file that is renamed"({ page, file }) {
    await file("shapes.po");
    await showPreview(page, "shapes.po");
    await preview(page);
    const row = page.locator(".explorer-folders-view .monaco-list-row", { hasText: "shapes.po" }).first();
    await row.click();
    await page.keyboard.press("F2");
    const box = page.locator(".explorer-item-edited input").first();
    await box.fill("forms.po");
    await box.press("Enter");
    await page.locator(".tab", { hasText: "Preview forms.po" }).waitFor();
    const frame = await preview(page);
    await settledAfter(frame, () => frame.locator("#value").press("+"));
    await frame.locator("#problem").waitFor({ state: "hidden" });
  },
};

/** The evaluation processes of the servers that work in a folder. */
function evaluations(folder) {
  return readdirSync("/proc").filter((id) => {
    try {
      return readlinkSync(`/proc/${id}/cwd`) === folder && readFileSync(`/proc/${id}/cmdline`, "utf8").includes("potto_lsp.evaluator");
    } catch {
      return false;
    }
  }).map(Number);
}
