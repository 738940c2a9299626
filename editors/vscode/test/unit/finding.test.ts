import assert from "node:assert/strict";
import { chmodSync, mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { homedir, tmpdir } from "node:os";
import { delimiter, dirname, join } from "node:path";
import { after, test } from "node:test";
import { candidates, find, type Places } from "../../src/finding";

const folder = mkdtempSync(join(tmpdir(), "potto-finding-"));
after(() => rmSync(folder, { recursive: true }));

/** A program that answers `--version`. */
function program(path: string, says: string): string {
  const whole = join(folder, path);
  mkdirSync(dirname(whole), { recursive: true });
  writeFileSync(whole, `#!/bin/sh\n${says}\n`);
  chmodSync(whole, 0o755);
  return whole;
}

const nowhere: Places = { setting: "", interpreter: undefined, folders: [], path: "", windows: false };
const found = async (places: Partial<Places>): Promise<string[] | undefined> => {
  const answer = await find({ ...nowhere, ...places }, () => undefined);
  return answer && [answer.command, ...answer.args, answer.version];
};

const selected = program("selected/bin/potto", "echo potto 1.0");
const python = program("selected/bin/python3.12", "exit 1");
const workspace = program("work/.venv/bin/potto", "echo potto 2.0");
const onPath = program("path/potto", "echo potto 3.0");
const other = program("named/potto-nightly", "echo potto 4.0-dev");
const module = program("module/bin/python", '[ "$1 $2 $3" = "-m potto --version" ] && echo potto 5.0');
const wrong = program("wrong/potto", "echo something else 9");
const places = { interpreter: python, folders: [join(folder, "work")], path: [dirname(wrong), dirname(onPath)].join(delimiter) };

test("the selected environment comes first, then the workspace, then PATH", async () => {
  assert.deepEqual(await found(places), [selected, "1.0"]);
  assert.deepEqual(await found({ ...places, interpreter: undefined }), [workspace, "2.0"]);
  assert.deepEqual(await found({ path: places.path }), [onPath, "3.0"]);
});

test("a program that does not say that it is Potto is none", async () => {
  assert.equal(await found({ path: dirname(wrong) }), undefined);
  assert.equal(await found({ setting: wrong }), undefined);
  assert.equal(await found({}), undefined);
});

test("a setting is never overruled", async () => {
  assert.deepEqual(await found({ ...places, setting: other }), [other, "4.0-dev"]);
  assert.equal(await found({ ...places, setting: join(folder, "gone") }), undefined);
});

test("a setting may be a Python, an environment, or start at the workspace", async () => {
  assert.deepEqual(await found({ setting: module }), [module, "-m", "potto", "5.0"]);
  assert.deepEqual(await found({ setting: join(folder, "selected") }), [selected, "1.0"]);
  assert.deepEqual(await found({ ...places, setting: "${workspaceFolder}/.venv" }), [workspace, "2.0"]);
  assert.deepEqual(await found({ ...places, setting: "./.venv/bin/potto" }), [workspace, "2.0"]);
  assert.equal(candidates({ ...nowhere, setting: "~/potto" })[0]?.command, join(homedir(), "potto"));
});

test("an interpreter without Potto beside it is asked for the module", async () => {
  assert.deepEqual(await found({ interpreter: module }), [module, "-m", "potto", "5.0"]);
});

test("programs have other names on Windows", () => {
  const [first] = candidates({ ...nowhere, folders: ["w"], windows: true });
  assert.match(first?.command ?? "", /Scripts.potto\.exe$/);
});
