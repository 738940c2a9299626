// The packaged extension in a real Visual Studio Code: first what its providers give, then what a person sees.
// usage: node run.mjs CHROMIUM [host|ui|views]; pictures go to test-results/. The exit status is 1 if anything failed.
import { existsSync, mkdirSync, rmSync } from "node:fs";
import { spawnSync } from "node:child_process";
import { join } from "node:path";
import { hostTests } from "./host.mjs";
import { uiTests } from "./ui.mjs";
import { here, start } from "./vscode.mjs";

const [chromiumPath, only] = process.argv.slice(2);
const vsix = join(here, "..", "dist", "potto.vsix");
if (!chromiumPath || !existsSync(vsix)) {
  console.error("usage: node run.mjs CHROMIUM, after the extension was packaged");
  process.exit(2);
}
const pictures = join(here, "..", "test-results");
rmSync(pictures, { recursive: true, force: true });
mkdirSync(pictures, { recursive: true });
const began = Date.now();
const results = [];
/** Tell how a test went. */
function report(result) {
  const { name, error, skipped, milliseconds } = result;
  results.push(result);
  const how = error ? "FAILED" : skipped ? "SKIPPED" : "ok";
  console.log(`${how.padEnd(7)} ${String(milliseconds).padStart(6)} ms  ${name}${skipped ? `: ${skipped}` : ""}`);
  if (error) console.log(error.replace(/^/gm, "         "));
  if (error && process.env.POTTO_E2E_FAIL_FAST) throw new Error("stopped at the first failure");
}
/** The injection into Markdown, with the grammar of Markdown that Visual Studio Code has. */
function fences() {
  const since = Date.now();
  const extension = join(here, "..");
  const markdown = join(here, "node_modules/code-server/lib/vscode/extensions/markdown-basics/syntaxes/markdown.tmLanguage.json");
  const tool = join(extension, "node_modules", ".bin", "vscode-tmgrammar-snap");
  const options = ["--config", join(extension, "package.json"), "-g", markdown, "--scope", "text.html.markdown", "--expandDiff"];
  const { status, stdout } = spawnSync(tool, [...options, join(here, "markdown", "fence.md")], { encoding: "utf8" });
  report({ name: "grammar: fences in Markdown", error: status === 0 ? null : stdout, milliseconds: Date.now() - since });
}

if (only === undefined) fences();
const code = await start(vsix, chromiumPath);
try {
  if (only === undefined || only === "host") await hostTests(code, report);
  if (only !== "host") await uiTests(code, pictures, report, only);
} catch (error) {
  if (!results.at(-1)?.error) report({ name: "the run", error: error.stack, milliseconds: Date.now() - began });
} finally {
  const since = Date.now();
  const left = await code.close();
  const error = left.length ? `these are still there:\n${left.join("\n")}` : null;
  report({ name: "nothing is left behind when all windows are closed", error, milliseconds: Date.now() - since });
}
const failed = results.filter(({ error }) => error).length;
console.log(`${results.length - failed} of ${results.length} in ${((Date.now() - began) / 1000).toFixed(0)} s`);
process.exit(failed || !results.length ? 1 : 0);
