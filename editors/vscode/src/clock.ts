/** When the extension began to load, and the processor's time then. Imported first, so that what the others take counts. */
export const began = { wall: performance.now(), processor: process.cpuUsage() };

/** Milliseconds since a beginning: of the processor where that is less, as a busy machine lets us wait. */
export function took({ wall, processor }: typeof began): number {
  const { user, system } = process.cpuUsage(processor);
  return Math.min(performance.now() - wall, (user + system) / 1000);
}
