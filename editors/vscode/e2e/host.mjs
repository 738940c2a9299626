// Tests that run inside of the extension host, by a page that is opened with them.
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { here, open, remote } from "./vscode.mjs";

const PATIENCE = 480_000; // all tests on a machine that does much else

export async function hostTests(code, report) {
  const tests = join(here, "host");
  let exited;
  const exit = new Promise((resolve) => (exited = resolve));
  const log = [];
  const page = await open(
    code,
    code.hostWorkspace,
    [["extensionDevelopmentPath", remote(code, tests)], ["extensionTestsPath", remote(code, join(tests, "index.js"))]],
    async (page) => {
      await page.exposeFunction("codeAutomationLog", (kind, args) => void log.push(`${kind} ${args}`));
      await page.exposeFunction("codeAutomationExit", (status) => void exited(status));
    },
  );
  const late = new Promise((resolve) => setTimeout(() => resolve("no exit"), PATIENCE).unref());
  const status = await Promise.race([exit, late]);
  await page.context().close();
  const file = join(code.hostWorkspace, "host-results.json");
  if (!existsSync(file)) throw new Error(`the tests in the extension host gave no results (${status}):\n${log.slice(-40).join("\n")}\n${code.said()}`);
  const { results, activation, memory } = JSON.parse(readFileSync(file, "utf8"));
  console.log(`activation: ${activation.toFixed(1)} ms`);
  if (memory) console.log(`memory, in MB: ${JSON.stringify(memory, (_, value) => (typeof value === "number" ? Math.round(value) : value))}`);
  for (const { name, ...rest } of results) report({ name: `host: ${name}`, ...rest });
}
