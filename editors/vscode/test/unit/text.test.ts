import assert from "node:assert/strict";
import { test } from "node:test";
import { chunkAt, entryOf, renamed, utf16 } from "../../src/text";

const PROGRAM = ["# a comment", "def f(x)", "    y = x", "", "    # inside", "    y", "", "# of g", "def g(x) [", "] x", "1"];

test("a chunk goes from one line with code in its first column to the next", () => {
  assert.deepEqual(chunkAt(PROGRAM, 2), [1, 5]);
  assert.deepEqual(chunkAt(PROGRAM, 1), [1, 5]);
  assert.deepEqual(chunkAt(PROGRAM, 9), [8, 9]);
  assert.deepEqual(chunkAt(PROGRAM, 10), [10, 10]);
  assert.deepEqual(chunkAt([""], 0), [0, 0]);
});

test("a live expression is sent without its marks", () => {
  assert.equal(entryOf("  #> f(1) "), "f(1)");
  assert.equal(entryOf("\n  def f(x)\n    x\n\n"), "  def f(x)\n    x");
});

test("places are counted in UTF-16", () => {
  assert.equal(utf16("a𝄞b", 2), 3);
  assert.equal(utf16("abc", 2), 2);
  assert.equal(utf16("a", 9), 1);
});

test("a file follows the name of its folder, and of no other that begins alike", () => {
  assert.equal(renamed("file:///a/b.po", "file:///a/b.po", "file:///a/c.po"), "file:///a/c.po");
  assert.equal(renamed("file:///a/b.po", "file:///a", "file:///d/e"), "file:///d/e/b.po");
  assert.equal(renamed("file:///ab/b.po", "file:///a", "file:///d"), undefined);
});
