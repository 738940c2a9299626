// A window as a person uses it: files, commands, places, pictures; and the page of a preview.
import assert from "node:assert/strict";
import { dirname, join } from "node:path";
import { open, remote } from "./vscode.mjs";
import { PATIENCE, still, until } from "./waiting.mjs";

export const EDITOR = ".part.editor";

export async function windowOn(code, folder, file, pictures) {
  const first = join(folder.endsWith(".code-workspace") ? dirname(folder) : folder, file);
  const page = await open(code, folder, [["openFile", remote(code, first)]]);
  page.setDefaultTimeout(PATIENCE);
  await page.locator(`${EDITOR} .view-line`).first().waitFor();
  return {
    code,
    page,
    /** Keep a picture, after what fades in has done so. */
    async picture(name, clip) {
      await still(page);
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
export const frameOf = (page) => page.frameLocator("iframe.webview.ready:visible").last().frameLocator("iframe#active-frame");

/** The same, when all is drawn. */
export async function preview(page) {
  const inner = frameOf(page);
  await inner.locator("#status[data-settled=true]").waitFor();
  return inner;
}

/** The colours in the middle of a canvas, as a text to compare. */
export const pixels = (canvas) =>
  canvas.evaluate((element) => {
    const { width, height } = element;
    const { data } = element.getContext("2d").getImageData(0, 0, width, Math.floor(height * 0.85));
    let hash = 0;
    for (let i = 0; i < data.length; i++) hash = (hash * 31 + data[i]) | 0;
    return `${width}x${height} ${hash} ${new Set(new Uint32Array(data.buffer)).size}`;
  });

/** Open the preview of a file that is being edited, by its keys: the editor has them once it is in focus. */
export async function showPreview(page, name) {
  await page.locator(`${EDITOR} .monaco-editor.focused`).first().waitFor();
  await page.keyboard.press("Control+K");
  await page.keyboard.press("v");
  await page.locator(".tab", { hasText: `Preview ${name}` }).first().waitFor();
}

/** Change something in the page of a preview, and wait until what that asks for is drawn. */
export async function settledAfter(frame, change) {
  const before = await frame.locator("#status").getAttribute("data-asked");
  await change();
  await frame.locator(`#status[data-settled=true]:not([data-asked="${before}"])`).waitFor();
}

/** Change the text, and wait until the preview has drawn another picture of it. */
export async function redrawnAfter(frame, change) {
  const value = frame.locator("#value");
  const before = await pixels(value);
  await change();
  assert.ok(await until(async () => (await pixels(value)) !== before), "the picture is as it was");
  await frame.locator("#status[data-settled=true]").waitFor();
}
