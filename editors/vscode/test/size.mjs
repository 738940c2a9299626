// What the extension weighs: its bundles stay under 1 MB.
import { statSync } from "node:fs";

const MOST = 1_000_000;
const bundles = ["dist/extension.js", "dist/preview.js"].map((name) => [name, statSync(name).size]);
const whole = bundles.reduce((sum, [, size]) => sum + size, 0);
console.log(bundles.map(([name, size]) => `${name}: ${(size / 1000).toFixed(0)} kB`).join(", "));
if (whole >= MOST) {
  console.error(`the bundles weigh ${whole} bytes; the most is ${MOST}`);
  process.exit(1);
}
