import assert from "node:assert/strict";
import { test } from "node:test";
import type { Samples } from "../../src/preview/messages";
import { choiceFor, missing } from "../../src/webview/controls";
import { decoded, estimated, label, short, span, ticks } from "../../src/webview/numbers";
import { stretches } from "../../src/webview/picture";
import { Sampler, type Wish } from "../../src/webview/sampler";

const SAMPLES: Samples = {
  shape: [1], value: [], valueError: [], evals: 1, seconds: 0, compileSeconds: 0, converged: true, reasons: [], method: "exact",
};

function harness(): { sent: string[]; cancelled: number[]; shown: string[]; sampler: Sampler } {
  const [sent, cancelled, shown] = [[] as string[], [] as number[], [] as string[]];
  const sampler = new Sampler(
    (id, request) => sent.push(`${id} ${request.name} ${request.axes[0]?.count}`),
    (id) => cancelled.push(id),
    ({ wish, count, final }) => shown.push(`${wish.key} ${count}${final ? " final" : ""}`),
    (message) => shown.push(message),
  );
  return { sent, cancelled, shown, sampler };
}

const wish = (key: string, levels = [2, 8, 32]): Wish => ({
  key, levels,
  places: (count) => count * count,
  request: (count, rtol) => ({ name: key, axes: [{ name: "x", from: 0, to: 1, count }], values: {}, wrt: null, rtol }),
});

test("a picture is refined until it is as fine as it gets", () => {
  const { sent, shown, sampler } = harness();
  sampler.want(wish("a"));
  for (const id of [1, 2, 3]) sampler.samples(id, SAMPLES);
  assert.deepEqual(sent, ["1 a 2", "2 a 8", "3 a 32"]);
  assert.deepEqual(shown, ["a 2", "a 8", "a 32 final"]);
  assert.ok(sampler.settled);
  sampler.want(wish("a"));
  assert.equal(sent.length, 3);
});

test("a coarse pass goes on, and what is wanted then comes next", () => {
  const { sent, cancelled, sampler } = harness();
  sampler.want(wish("a"));
  sampler.want(wish("b"));
  sampler.want(wish("c"));
  assert.deepEqual([sent, cancelled], [["1 a 2"], []]);
  sampler.samples(1, SAMPLES);
  assert.equal(sent[1]?.split(" ")[1], "c");
});

test("a fine pass for something else is cancelled, and its answer ignored", async () => {
  const { sent, cancelled, shown, sampler } = harness();
  sampler.want(wish("a", [2, 4000]));
  await new Promise((resolve) => setTimeout(resolve, 5)); // a place took about a millisecond, of a fine pass each does so
  sampler.samples(1, SAMPLES);
  sampler.want(wish("b", [2, 4000]));
  assert.deepEqual(cancelled, [2]);
  assert.deepEqual(sent, ["1 a 2", "2 a 400", "3 b 2"]);
  sampler.samples(2, SAMPLES);
  sampler.failure(2, "cancelled", true);
  assert.deepEqual(shown, ["a 2"]);
});

test("a slow picture is as fine as it can be within a few seconds, and is done then", () => {
  const { sent, shown, sampler } = harness();
  const slow = (seconds: number): Samples => ({ ...SAMPLES, seconds, compileSeconds: 1 });
  sampler.want(wish("a", [20, 56, 160]));
  sampler.samples(1, slow(1.4)); // 0.4 s for 20 * 20 places, a millisecond each: 4000 of them are 63 * 63
  sampler.samples(2, slow(4.136)); // as much for each of 56 * 56, and a finer one would have few more
  assert.deepEqual(sent, ["1 a 20", "2 a 56"]);
  assert.deepEqual(shown, ["a 20", "a 56 final"]);
  assert.ok(sampler.settled);
  sampler.want(wish("b", [20, 56, 160]));
  sampler.samples(3, slow(1.8)); // two milliseconds each: 44 * 44
  sampler.samples(4, slow(1.1936)); // less than was thought: 0.1 ms each
  assert.deepEqual(sent.slice(2), ["3 b 20", "4 b 44", "5 b 56"]);
});

test("what failed is told once and tried again when it is asked for anew", () => {
  const { sent, shown, sampler } = harness();
  sampler.want(wish("a"));
  sampler.failure(1, "no", false);
  sampler.want(wish("a"));
  assert.deepEqual([sent.length, shown], [1, ["no"]]);
  sampler.want(wish("a"), true);
  assert.equal(sent.length, 2);
});

test("numbers travel whole", () => {
  const pack = (numbers: ArrayBufferView): string => Buffer.from(numbers.buffer as ArrayBuffer).toString("base64");
  const values = new Float64Array([0.1, -2, NaN, Infinity, 1e300, 6]);
  const grid = decoded({ ...SAMPLES, shape: [2, 3], value: [pack(values)], valueError: [pack(new Float32Array(6))] });
  assert.deepEqual([grid.columns, grid.rows, grid.slope], [3, 2, undefined]);
  assert.deepEqual(grid.value.values[0], values);
  assert.deepEqual(span([values]), [-2, 1e300]);
  assert.deepEqual(span([[NaN]]), [0, 1]);
});

test("numbers are written to the digits that their errors bear out", () => {
  assert.equal(estimated(0.027, 0.0051), "0.0270 ± 0.0051");
  assert.equal(estimated(0.123456789, 1e-4), "0.12346 ± 0.00011"); // the value lost 0.000003
  assert.equal(estimated(-0.02734, Math.fround(0.0051)), "−0.0273 ± 0.0052");
  assert.equal(estimated(9.996, 0.0996), "10.00 ± 0.11");
  assert.equal(estimated(1.99, 7.6), "2.0 ± 7.7");
  assert.equal(estimated(0.3, 51), "0 ± 52");
  assert.equal(estimated(218, 1122), "0.2e3 ± 1.2e3");
  assert.equal(estimated(1.1, 2.2e-16), "1.100000000000000 ± 1e−15");
  assert.equal(estimated(3.3e-7, 1e-10), "3.3000e−7 ± 1.0e−10");
  assert.equal(estimated(0, 1e-17), "0.0e−17 ± 1.0e−17");
  assert.equal(estimated(0.5, Infinity), "0.5 (error unknown)");
  assert.equal(estimated(-2, 0), "−2 ± 0");
  assert.equal(estimated(NaN, NaN), "no value");
  assert.equal(short(1.5e-9), "1.5e−9");
  assert.equal(label(0.30000000000000004, 0, 1), "0.3");
  assert.deepEqual(ticks(0, 1, 5).map((tick) => label(tick, 0, 1)), ["0", "0.2", "0.4", "0.6", "0.8", "1"]);
});

test("a curve is drawn where it has values", () => {
  assert.deepEqual(stretches([NaN, 1, 2, NaN, 3]), [[1, 2], [4, 4]]);
  assert.deepEqual(stretches([]), []);
});

test("a choice starts from what is known and is kept over edits as far as it fits", () => {
  const number = (name: string, value: number[] = []) =>
    ({ name, kind: "number", type: "Real", size: 1, value, fits: [] }) as const;
  const scene = {
    name: "f", range: { start: { line: 0, character: 0 } }, components: 1, axes: ["x", "y"],
    parameters: [number("x"), number("y"), number("c", [-0.7]), { ...number("g"), kind: "function" as const, size: 0, fits: ["h"] }],
  };
  const first = choiceFor(scene, undefined);
  assert.deepEqual([first.axes, first.wrt, first.values.get("c"), first.values.get("g")], [["x", "y"], "c", -0.7, "h"]);
  first.values.set("c", 3);
  assert.equal(choiceFor(scene, first).values.get("c"), 3);
  const without = { ...scene, parameters: scene.parameters.slice(0, 2) };
  assert.equal(choiceFor(without, first).wrt, "x");
  assert.deepEqual(choiceFor({ ...without, axes: ["x"], parameters: [number("x")] }, first).axes, ["x"]);
});

test("a function that nothing fits is asked for, and nothing else is", () => {
  const given = (fits: string[], kind = "function" as "function" | "number" | "tuple") =>
    ({ name: "shade", kind, type: "Real* -> Real", size: kind === "function" ? 0 : 1, value: [], fits }) as const;
  const scene = (...parameters: ReturnType<typeof given>[]) => ({
    name: "f", range: { start: { line: 0, character: 0 } }, components: 1, axes: ["x"],
    parameters: [{ name: "x", kind: "number" as const, type: "Real", size: 1, value: [], fits: [] }, ...parameters],
  });
  const needed = (...parameters: ReturnType<typeof given>[]) => missing(scene(...parameters), choiceFor(scene(...parameters), undefined));
  assert.match(needed(given([])) ?? "", /Give “shade” a function Real\* -> Real\. None was found/);
  assert.equal(needed(given(["flat", "lin"])), undefined);
  assert.equal(needed(given(["\\(x) . 1"])), undefined);
  assert.equal(needed(given([], "number")), undefined);
  assert.equal(needed(given([], "tuple")), undefined);
  assert.match(needed({ ...given([]), name: "a" }, { ...given([]), name: "b" }) ?? "", /“a” .*, and “b” /);
  const whole = scene(given([]));
  const choice = choiceFor(whole, undefined);
  choice.values.set("shade", "\\(x) . x");
  assert.equal(missing(whole, choice), undefined);
  const known = scene(given(["flat"]));
  const emptied = choiceFor(known, undefined);
  emptied.values.set("shade", "");
  assert.equal(missing(known, emptied), "Give “shade” a function Real* -> Real, such as flat.");
  assert.equal(choiceFor(whole, choice).values.get("shade"), "\\(x) . x"); // kept over edits
});
