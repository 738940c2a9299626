// What a person does with the integral view.
import assert from "node:assert/strict";
import { until } from "./waiting.mjs";
import { EDITOR, frameOf } from "./window.mjs";

const numbers = (frame) => frame.locator("#now .numbers td:nth-child(2)").allInnerTexts();
const picture = (frame) => frame.locator("#now svg").evaluate((svg) => svg.outerHTML);
const first = (text) => Number(text.split(" ")[0]);
const middle = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

export const VIEWS = {
  async "the integral view opens at the cursor"({ page, picture, go, command }) {
    await page.locator(".statusbar-item", { hasText: "Potto" }).locator(".codicon-check").first().waitFor();
    await go(3, 25);
    await command("Potto: Integral View");
    const frame = frameOf(page);
    await frame.locator('#now svg .surface[data-equation="x = t"]').waitFor({ state: "attached" });
    assert.equal(await frame.locator("#name").inputValue(), "left");
    await frame.locator("#formulas math").first().waitFor();
    assert.match((await frame.locator("#formulas").innerText()).normalize("NFKC"), /δ/);
    await picture("view");
  },

  async "it follows the cursor without a click, and lights the surface of a condition"({ page, picture, go }) {
    const frame = frameOf(page);
    await go(8, 12);
    await frame.locator('#now svg .surface.lit[data-equation="x^2 + y^2 = r^2"]').waitFor({ state: "attached" });
    assert.equal(await frame.locator("#name").inputValue(), "part");
    await go(8, 31);
    await frame.locator('#now svg .surface.lit[data-equation="x = c"]').waitFor({ state: "attached" });
    assert.equal(await frame.locator("#now svg .surface.lit").count(), 1);
    await picture("view-plane");
  },

  async "a click on a surface selects its condition"({ page, picture }) {
    const frame = frameOf(page);
    await frame.locator('#now .surface-name[data-equation="x^2 + y^2 = r^2"]').click();
    await page.locator(".statusbar-item", { hasText: "(15 selected)" }).first().waitFor();
    await frame.locator('#now svg .surface[data-equation="x = c"] .grip').click({ force: true });
    await page.locator(".statusbar-item", { hasText: "(5 selected)" }).first().waitFor();
    await frame.locator('#now svg .surface.lit[data-equation="x = c"]').waitFor({ state: "attached" });
    await picture("view-selected");
  },

  async "a slider moves value, derivative and picture"({ page, picture: keep, go }) {
    const frame = frameOf(page);
    await go(3, 25);
    await frame.locator('#now svg .surface[data-equation="x = t"]').waitFor({ state: "attached" });
    const [before, drawn] = [await numbers(frame), await picture(frame)];
    const slider = frame.locator('input[data-parameter="t"]');
    const whole = await slider.evaluate(async (input) => {
      // As a hand drags it: a place a frame, each timed until its picture is there.
      const frames = () => new Promise(requestAnimationFrame);
      const times = [];
      for (let step = 1; step <= 30; step++) {
        input.value = 0.25 + 0.01 * step;
        const since = performance.now();
        input.dispatchEvent(new Event("input"));
        const count = document.getElementById("time").dataset.frames;
        while (document.getElementById("time").dataset.frames === count) await frames();
        times.push(performance.now() - since);
      }
      return times;
    });
    await frame.locator("#now figcaption", { hasText: "t = 0.55" }).waitFor();
    await frame.locator("#time").filter({ hasNotText: "numbers follow" }).waitFor();
    const after = await numbers(frame);
    assert.notEqual(await picture(frame), drawn);
    assert.notDeepEqual(after.slice(0, 2), before.slice(0, 2));
    assert.ok(Math.abs(first(after[0]) - Math.expm1(0.55)) < 1e-9, after[0]);
    assert.ok(Math.abs(first(after[1]) - Math.exp(0.55)) < 1e-9, after[1]);
    console.log(`        a place of the slider is drawn ${middle(whole).toFixed(0)} ms later (median), evaluated in ${await frame.locator("#time").innerText()}`);
    assert.ok(Math.min(...whole) < 2 * 1000 / 60 + 50, `at best ${Math.min(...whole).toFixed(0)} ms`);
    await keep("view-slider");
  },

  async "a pinned state stays beside the one that moves; ghosts show differences"({ page, picture }) {
    const frame = frameOf(page);
    await frame.locator("#pin").click();
    await frame.locator("#ghost").check();
    await frame.locator("#now svg .ghost").first().waitFor({ state: "attached" });
    const slider = frame.locator('input[data-parameter="t"]');
    await slider.focus();
    for (let press = 0; press < 20; press++) await page.keyboard.press("ArrowRight");
    await frame.locator("#now .changed", { hasText: "Δ +" }).first().waitFor();
    assert.match(await frame.locator("#pinned figcaption").innerText(), /pinned: left\(t = 0\.55\)/);
    await picture("view-pinned");
    await frame.locator("#pin").click();
  },

  async "the view follows what is typed"({ page, go }) {
    const frame = frameOf(page);
    const before = await picture(frame);
    await go(3, 28);
    await page.locator(`${EDITOR} .view-line`, { hasText: "exp(x) d(x)" }).first().waitFor();
    await page.keyboard.type("2*");
    assert.ok(await until(async () => (await picture(frame)) !== before), "the picture is what it was");
    for (let press = 0; press < 2; press++) await page.keyboard.press("Backspace");
  },
};
