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
  return tidy(text);
}

/**
 * A value to the second digit of its error, and the error: as `potto/runtime/answers/printing.py` writes them. The error is
 * rounded up by what the value loses, so that the interval that one reads contains the one that was computed.
 */
export function estimated(value: number | undefined, error: number | undefined): string {
  if (value === undefined || error === undefined || !Number.isFinite(value)) return short(value ?? NaN);
  if (!Number.isFinite(error)) return `${short(value, 3)} (error unknown)`;
  if (error === 0) return `${short(value, 17)} ± 0`;
  for (let place = Math.max(exponent(error) - 1, exponent(value) - 15); ; place++) {
    const scale = Math.max(exponent(value), exponent(error), place);
    const text = written(value, place, scale);
    const unit = 10 ** place;
    const bound = Math.max(Math.ceil((error + Math.abs(Number(text) - value)) / unit - BLUR), 1);
    if (bound >= 100) continue;
    const size = bound >= 10 ? place + 1 : place;
    const plain = place <= 0 && scale >= SMALLEST;
    const bar = plain && size > SMALLEST ? (bound * unit).toFixed(-place) : written(bound * unit, place, size, true);
    return tidy(`${text} ± ${bar}`);
  }
}

const BLUR = 1e-5; // of a unit: errors arrive in single precision, and few decimals are doubles
const SMALLEST = -5; // the power of ten from which on numbers are written without an exponent

/** The power of ten of the first digit; far below every other for zero. */
function exponent(number: number): number {
  return number === 0 ? -400 : Number(number.toExponential().split("e")[1]);
}

/** A number rounded at a power of ten, with the exponent `scale` where it has one. */
function written(number: number, place: number, scale: number, scientific = false): string {
  if (!scientific && place <= 0 && scale >= SMALLEST) return number.toFixed(Math.min(-place, 100));
  const mantissa = Number(`${number.toExponential().split("e")[0]}e${exponent(number) - scale}`);
  return `${number === 0 ? (0).toFixed(scale - place) : mantissa.toFixed(scale - place)}${scale ? `e${scale}` : ""}`;
}

function tidy(text: string): string {
  return text.replaceAll("-", "−").replaceAll("e+", "e");
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
