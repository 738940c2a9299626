// Drives the page of an integral view in a real browser. usage: node browser.mjs PLAYWRIGHT CHROMIUM ADDRESS FOLDER
// Writes pictures into FOLDER and, last, a line of JSON with what was seen.
import { createRequire } from "node:module";
import { join } from "node:path";

const [playwright, chromium, address, folder] = process.argv.slice(2);
const { chromium: browser } = createRequire(join(playwright, "package.json"))(playwright);
const running = await browser.launch({
  executablePath: chromium,
  args: ["--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"],
});
const seen = { errors: [] };
try {
  const page = await running.newPage({ viewport: { width: 1100, height: 900 }, colorScheme: "light" });
  page.on("pageerror", (error) => seen.errors.push(String(error)));
  page.on("console", (message) => message.type() === "error" && seen.errors.push(message.text()));
  const beyond = [];
  await page.route("**", (route) => {
    if (!route.request().url().startsWith("http://127.0.0.1:") && !route.request().url().startsWith("data:")) beyond.push(route.request().url());
    return route.continue();
  });
  await page.goto(address);
  await page.locator("#now svg .surface").first().waitFor();
  const numbers = () => page.locator("#now .numbers td:nth-child(2)").allInnerTexts();
  const picture = () => page.locator("#now svg").evaluate((svg) => svg.outerHTML);
  const settled = async () => {
    await page.waitForFunction(() => !busy && !newest);
  };
  await settled();
  seen.before = await numbers();
  const drawn = await picture();
  await page.screenshot({ path: join(folder, "view-light.png"), fullPage: true });

  // Dragged: many places of the slider, few evaluations, and the last place wins.
  const slider = page.locator('input[data-parameter="t"]');
  const box = await slider.boundingBox();
  await page.evaluate(() => {
    const asked = (window.asked = []);
    const real = window.fetch;
    window.fetch = (path, options) => {
      if (String(path).startsWith("/look")) asked.push(JSON.parse(options.body).values.t);
      return real(path, options);
    };
  });
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  for (let step = 1; step <= 40; step++) await page.mouse.move(box.x + box.width * (0.5 + 0.006 * step), box.y + box.height / 2);
  await page.mouse.up();
  await settled();
  seen.slider = Number(await slider.inputValue());
  seen.asked = await page.evaluate(() => window.asked);
  seen.after = await numbers();
  seen.moved = (await picture()) !== drawn;

  // Both ways between the picture and the text.
  await page.locator("#source mark").first().click();
  seen.litByText = await page.locator("#now svg .surface.lit").getAttribute("data-equation");
  await page.evaluate(() => light(""));
  await page.locator("#now svg .surface .grip").first().click({ force: true });
  seen.litByPicture = await page.locator("#source mark.lit").innerText();

  // Ghosts of differences, nodes, and a pinned state beside the one that moves.
  await page.locator("#ghost").check();
  await settled();
  seen.ghosts = await page.locator("#now svg .ghost").count();
  seen.withGhost = await numbers();
  await page.locator("#nodes").check();
  await settled();
  seen.nodes = await page.locator("#now svg .node").count();
  await page.locator("#pin").click();
  await slider.focus();
  for (let press = 0; press < 10; press++) await page.keyboard.press("ArrowLeft");
  await settled();
  seen.pinned = await page.locator("#pinned .numbers td:nth-child(2)").allInnerTexts();
  seen.compared = await page.locator("#now .changed").allInnerTexts();
  seen.formulas = await page.locator("#formulas math").count();
  await page.screenshot({ path: join(folder, "view-pinned.png"), fullPage: true });

  await page.emulateMedia({ colorScheme: "dark" });
  await page.locator("#name").selectOption("disc");
  await page.locator("#now svg image").waitFor();
  await settled();
  seen.ground = await page.locator("body").evaluate((body) => getComputedStyle(body).backgroundColor);
  await page.screenshot({ path: join(folder, "view-dark.png"), fullPage: true });
  // A section of three variables is dragged along the third; its numbers stay.
  await page.locator("#name").selectOption("ball");
  const section = page.locator('#sliders .section input');
  await section.waitFor();
  await settled();
  const whole = await numbers();
  seen.section = await section.evaluate((input) => [input.dataset.parameter, input.value, input.min, input.max]);
  const along = await section.boundingBox();
  await page.mouse.move(along.x + along.width / 2, along.y + along.height / 2);
  await page.mouse.down();
  for (let step = 1; step <= 20; step++) await page.mouse.move(along.x + along.width * (0.5 + 0.01 * step), along.y + along.height / 2);
  await page.mouse.up();
  await page.waitForFunction(() => !busy && !newest && !dragged);
  seen.sectionThen = Number(await section.inputValue());
  seen.sectioned = await page.locator("#now .list").innerText();
  seen.sectionNumbers = [whole, await numbers()].map((each) => each.join());
  await page.screenshot({ path: join(folder, "view-section.png"), fullPage: true });
  // The range of an index may depend on that of another one.
  await page.locator("#name").selectOption("nested");
  const index = (name) => page.locator(`input[data-parameter="${name}"]`);
  await index("j").waitFor();
  seen.unsectioned = await page.locator("#sliders .section").count();
  await settled();
  seen.inner = [await index("j").inputValue(), await index("j").getAttribute("min")];
  await index("i").focus();
  await page.keyboard.press("ArrowRight");
  await page.waitForFunction(() => !busy && !newest && !dragged);
  seen.innerThen = [await index("j").inputValue(), await index("j").getAttribute("min")];
  seen.summand = await numbers();
  // A function is given another one.
  await page.locator("#name").selectOption("seen");
  const shade = page.locator('input.function[data-parameter="shade"]');
  await shade.waitFor();
  await settled();
  seen.shade = await shade.inputValue();
  seen.shaded = await numbers();
  await shade.fill("\\(x) . 3");
  await shade.press("Enter");
  await page.locator("#now figcaption", { hasText: ". 3" }).waitFor();
  await settled();
  seen.reshaded = await numbers();
  seen.caption = await page.locator("#now figcaption").innerText();
  await page.screenshot({ path: join(folder, "view-function.png"), fullPage: true });
  await page.locator("#name").selectOption("plain");
  await page.locator("#said", { hasText: "no integral" }).waitFor();
  seen.beyond = beyond;
} finally {
  await running.close();
}
console.log(JSON.stringify(seen));
