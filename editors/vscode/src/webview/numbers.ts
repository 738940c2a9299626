// Numbers as they arrive, and as they are shown.
import type { Samples } from "../preview/messages";

/** One quantity over the grid: values with bounds of their errors, component by component. */
export interface Field {
  readonly values: readonly Float64Array[];
  readonly errors: readonly Float32Array[];
}

export interface Grid {
  readonly columns: number;
  readonly rows: number;
  readonly value: Field;
  readonly slope: Field | undefined;
}

export function decoded(samples: Samples): Grid {
  const [first = 1, second] = samples.shape;
  const { value, valueError, tangent, tangentError } = samples;
  return {
    columns: second ?? first,
    rows: second === undefined ? 1 : first,
    value: field(value, valueError),
    slope: tangent && tangentError && field(tangent, tangentError),
  };
}

function field(values: readonly string[], errors: readonly string[]): Field {
  return {
    values: values.map((packed) => new Float64Array(bytes(packed))),
    errors: errors.map((packed) => new Float32Array(bytes(packed))),
  };
}

function bytes(packed: string): ArrayBuffer {
  const text = atob(packed);
  const made = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) made[i] = text.charCodeAt(i);
  return made.buffer;
}

/** The least and the largest number that is finite; 0 and 1 if there is none. */
export function span(arrays: Iterable<ArrayLike<number>>): [number, number] {
  let low = Infinity;
  let high = -Infinity;
  for (const array of arrays)
    for (let i = 0; i < array.length; i++) {
      const number = array[i] ?? NaN;
      if (!Number.isFinite(number)) continue;
      if (number < low) low = number;
      if (number > high) high = number;
    }
  return low <= high ? [low, high] : [0, 1];
}

/** A number in few digits. */
export function short(number: number, digits = 6): string {
  if (!Number.isFinite(number)) return Number.isNaN(number) ? "no value" : number > 0 ? "∞" : "−∞";
  const rounded = Number(number.toPrecision(digits));
  const text = rounded !== 0 && Math.abs(rounded) < 1e-3 ? rounded.toExponential() : rounded.toString();
  return text.replaceAll("-", "−").replace("e+", "e");
}

/** A value to the digits that its error bears out, and the error. */
export function estimated(value: number | undefined, error: number | undefined): string {
  if (value === undefined || error === undefined || !Number.isFinite(value)) return short(value ?? NaN);
  const known = error > 0 && value !== 0 ? Math.floor(Math.log10(Math.abs(value) / error)) + 1 : 10;
  return `${short(value, Math.min(Math.max(known, 1), 10))} ± ${short(error, 2)}`;
}

/** Evenly spaced round numbers within a stretch, about so many. */
export function ticks(low: number, high: number, about: number): number[] {
  const step = 10 ** Math.floor(Math.log10((high - low) / about));
  const round = [1, 2, 5, 10].map((factor) => factor * step).find((size) => (high - low) / size <= about) ?? step * 10;
  const found: number[] = [];
  for (let n = Math.ceil(low / round); n * round <= high && found.length < 50; n++) found.push(n * round);
  return found;
}

/** The step between round numbers, as digits after the point, so that labels agree. */
export function label(number: number, low: number, high: number): string {
  const digits = Math.max(0, Math.min(8, 1 - Math.floor(Math.log10(high - low))));
  return Math.abs(number) >= 1e5 || (high - low) < 1e-6 ? short(number, 4) : Number(number.toFixed(digits)).toString().replace("-", "−");
}
