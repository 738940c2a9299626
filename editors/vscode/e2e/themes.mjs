// Colours in the themes that people use: what is asked for in the manifest is what they see.
import { mkdirSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import assert from "node:assert/strict";
import { until } from "./waiting.mjs";
import { EDITOR, preview } from "./window.mjs";

const COMMON = [
  "Default Dark Modern", "Default Dark+", "Default Light+", "Default Light Modern", "Visual Studio Dark", "Visual Studio Light",
  "Default High Contrast", "Default High Contrast Light", "Monokai", "Solarized Dark", "Solarized Light", "Quiet Light",
];
const CONTRAST = 2.9; // that of large text in the guidelines for the web, nearly: Solarized has no more for its accents

/** The style of a word in a line of the editor. */
function style(page, line, word) {
  const span = page.locator(`${EDITOR} .view-line`, { hasText: line }).locator("span > span", { hasText: new RegExp(`^\\s*${word}\\s*$`) });
  return span.first().evaluate((element) => {
    const { color, fontStyle, fontWeight } = getComputedStyle(element);
    return { color, fontStyle, fontWeight };
  });
}

/** What the words look like when they are apart; what they look like in the end if they never are. */
async function seen(page) {
  let found;
  await until(async () => { // a theme's colours come one after another, those of the server last
    const [x, t] = [await style(page, "x + y < t", "x"), await style(page, "x + y < t", "t")];
    const ground = page.locator(`${EDITOR} .monaco-editor-background`).first();
    const background = await ground.evaluate((element) => getComputedStyle(element).backgroundColor);
    const whole = [x.color, t.color, background].every((colour) => /\d/.test(colour));
    found = { x, t, background, apart: whole && x.color !== t.color && x.fontStyle === "italic" && x.fontWeight > t.fontWeight };
    return found.apart;
  });
  return found;
}

/** The contrast of two colours, after the guidelines for the web. */
function contrast(one, other) {
  const luminance = (colour) => {
    const [r, g, b] = colour.match(/[\d.]+/g).slice(0, 3).map((part) => Number(part) / 255)
      .map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const [dark, light] = [luminance(one), luminance(other)].sort((a, b) => a - b);
  return (light + 0.05) / (dark + 0.05);
}

export const THEMES = {
  async "variables of integration are set apart in the common themes"({ page, picture, code, file }) {
    await file("renderer.po");
    await page.locator(".tab", { hasText: "Preview renderer.po" }).first().click();
    const settings = join(code.workspace, ".vscode");
    mkdirSync(settings);
    const workbench = page.locator(".monaco-workbench").first();
    const wrong = [];
    for (const theme of COMMON) {
      const before = await workbench.getAttribute("class");
      const same = theme === COMMON[0]; // the one that is there
      writeFileSync(join(settings, "settings.json"), JSON.stringify({ "workbench.colorTheme": theme }));
      assert.ok(same || (await until(async () => (await workbench.getAttribute("class")) !== before)), `${theme} was not set`);
      const { x, t, background, apart } = await seen(page);
      if (!apart) wrong.push(`${theme}: ${JSON.stringify(x)} beside ${JSON.stringify(t)}`);
      else if (contrast(x.color, background) < CONTRAST) wrong.push(`${theme}: ${x.color} cannot be read on ${background}`);
      if (/Light Modern|High Contrast$|Solarized Light/.test(theme)) await picture(`theme-${theme.replace(/\W+/g, "-").toLowerCase()}`);
    }
    rmSync(settings, { recursive: true });
    assert.deepEqual(wrong, []);
    await workbench.and(page.locator('[class*="dark_modern"]')).waitFor();
    await preview(page);
  },
};
