// How long anything is waited for: until it is there, under one patience.
export const PATIENCE = Number(process.env.POTTO_E2E_PATIENCE ?? 60_000); // ms: what a machine that does much else may take

/** Ask until the answer is true, but no longer than the patience is; the last answer. */
export async function until(ask) {
  for (const end = Date.now() + PATIENCE; ; await new Promise((resolve) => setTimeout(resolve, 50))) {
    const answer = await ask();
    if (answer || Date.now() > end) return answer;
  }
}

/** When nothing moves in what is seen of a page: what goes on for ever, as a caret that blinks, does not count. */
export async function still(page) {
  const moves = () => document.getAnimations().some((each) => each.playState === "running" && each.effect.getComputedTiming().endTime < Infinity);
  const drawn = () => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
  await page.evaluate(drawn); // what was just asked for begins to move
  const frames = page.frames();
  await until(async () => !(await Promise.all(frames.map((frame) => frame.evaluate(moves).catch(() => false)))).some(Boolean));
  await page.evaluate(drawn);
}
