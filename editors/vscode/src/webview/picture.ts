// A picture of one quantity over two axes: coloured cells, a scale, a cross at the probe.
import { type Field, label, span, ticks } from "./numbers";

export interface View {
  x0: number;
  x1: number;
  y0: number;
  y1: number;
}

export interface Palette {
  readonly text: string;
  readonly faint: string;
  readonly value: string;
  readonly slope: string;
  readonly font: string;
}

type Shade = (numbers: number[]) => [number, number, number];

const HOLE: [number, number, number] = [140, 60, 120];

/** Cells as pixels, and what the scale beside them means. `component` is -1 for three of them as a colour. */
export interface Cells {
  readonly image: HTMLCanvasElement;
  readonly view: View;
  readonly low: number;
  readonly high: number;
  readonly shade: Shade;
}

export function cells(field: Field, columns: number, rows: number, component: number, signed: boolean, view: View): Cells {
  const parts = component < 0 ? field.values.slice(0, 3) : [field.values[component] ?? new Float64Array()];
  let [low, high] = span(parts);
  if (signed) [low, high] = [-Math.max(-low, high, Number.MIN_VALUE), Math.max(-low, high, Number.MIN_VALUE)];
  else if (component < 0 && low >= 0 && high <= 1) [low, high] = [0, 1]; // colours as they are meant
  const shade = component < 0 ? colours(low, high) : signed ? diverging(high) : greys(low, high);
  const image = document.createElement("canvas");
  image.width = columns;
  image.height = rows;
  const pixels = new ImageData(columns, rows);
  for (let i = 0; i < columns * rows; i++) {
    const numbers = parts.map((part) => part[i] ?? NaN);
    const [r, g, b] = numbers.every(Number.isFinite) ? shade(numbers) : HOLE;
    pixels.data.set([r, g, b, 255], 4 * i);
  }
  image.getContext("2d")?.putImageData(pixels, 0, 0);
  return { image, view: { ...view }, low, high, shade };
}

function greys(low: number, high: number): Shade {
  const scale = 255 / (high - low || 1);
  return ([value = 0]) => {
    const level = (value - low) * scale;
    return [level, level, level];
  };
}

function colours(low: number, high: number): Shade {
  const scale = 255 / (high - low || 1);
  return ([r = 0, g = 0, b = 0]) => [(r - low) * scale, (g - low) * scale, (b - low) * scale];
}

/** Blue below 0, white at 0, orange above. */
function diverging(most: number): Shade {
  return ([value = 0]) => {
    const share = Math.sqrt(Math.min(Math.abs(value) / most, 1)); // what is small is to be seen too
    const end = value < 0 ? [33, 102, 172] : [203, 75, 22];
    return end.map((channel) => 247 + (channel - 247) * share) as [number, number, number];
  };
}

const SCALE = 14; // of the bar below the picture, with its labels

/** Draw cells, moved to where they belong in the view of now; returns nothing where the canvas has no size yet. */
export function drawCells(
  canvas: HTMLCanvasElement, made: Cells, view: View, palette: Palette, probe: readonly [number, number] | undefined,
): void {
  const { context, width, height } = sized(canvas);
  const tall = height - 2 * SCALE - 4;
  const across = (x: number): number => ((x - view.x0) / (view.x1 - view.x0)) * width;
  const down = (y: number): number => ((view.y1 - y) / (view.y1 - view.y0)) * tall;
  context.save();
  context.beginPath();
  context.rect(0, 0, width, tall);
  context.clip();
  context.imageSmoothingEnabled = false;
  const [left, top] = [across(made.view.x0), down(made.view.y1)];
  context.drawImage(made.image, left, top, across(made.view.x1) - left, down(made.view.y0) - top);
  if (probe) {
    context.strokeStyle = palette.slope;
    context.globalAlpha = 0.8;
    strokes(context, [[across(probe[0]), 0, across(probe[0]), tall], [0, down(probe[1]), width, down(probe[1])]]);
  }
  context.restore();
  bar(context, made, width, tall + 4, palette);
}

function bar(context: CanvasRenderingContext2D, made: Cells, width: number, top: number, palette: Palette): void {
  const steps = 64;
  for (let i = 0; i < steps; i++) {
    const value = made.low + ((i + 0.5) / steps) * (made.high - made.low);
    context.fillStyle = `rgb(${made.shade([value, value, value]).map(Math.round).join(",")})`;
    context.fillRect((i / steps) * width, top, width / steps + 1, SCALE - 4);
  }
  context.fillStyle = palette.text;
  context.font = palette.font;
  context.textBaseline = "top";
  const line = top + SCALE - 2;
  context.textAlign = "left";
  context.fillText(label(made.low, made.low, made.high || made.low + 1), 0, line);
  context.textAlign = "right";
  context.fillText(label(made.high, made.low || made.high - 1, made.high), width, line);
}

/** A curve over one axis, with the band that its errors leave. */
export function drawCurve(
  canvas: HTMLCanvasElement, field: Field, sampled: View, view: View, component: number,
  colour: string, palette: Palette, probe: number | undefined,
): void {
  const { context, width, height } = sized(canvas);
  const [left, bottom] = [52, height - 20];
  const values = field.values[Math.max(component, 0)] ?? new Float64Array();
  const errors = field.errors[Math.max(component, 0)] ?? new Float32Array();
  const [low, high] = padded(span([values]));
  const across = (x: number): number => left + ((x - view.x0) / (view.x1 - view.x0)) * (width - left);
  const down = (y: number): number => bottom - ((y - low) / (high - low)) * (bottom - 6);
  const place = (i: number): number => across(sampled.x0 + ((sampled.x1 - sampled.x0) * i) / Math.max(values.length - 1, 1));
  axes(context, view, [low, high], [left, bottom, width], across, down, palette);
  context.save();
  context.beginPath();
  context.rect(left, 0, width - left, bottom);
  context.clip();
  context.fillStyle = colour;
  context.strokeStyle = colour;
  context.lineWidth = 1.5;
  context.lineJoin = "round";
  for (const [first, last] of stretches(values)) {
    context.globalAlpha = 0.25;
    context.beginPath();
    for (let i = first; i <= last; i++) context.lineTo(place(i), down((values[i] ?? 0) + finite(errors[i], high - low)));
    for (let i = last; i >= first; i--) context.lineTo(place(i), down((values[i] ?? 0) - finite(errors[i], high - low)));
    context.fill();
    context.globalAlpha = 1;
    context.beginPath();
    for (let i = first; i <= last; i++) context.lineTo(place(i), down(values[i] ?? 0));
    if (first === last) context.rect(place(first) - 1, down(values[first] ?? 0) - 1, 2, 2);
    context.stroke();
  }
  if (probe !== undefined) {
    context.strokeStyle = palette.text;
    context.lineWidth = 1;
    context.globalAlpha = 0.5;
    strokes(context, [[across(probe), 0, across(probe), bottom]]);
  }
  context.restore();
}

/** An error that is not finite fills the picture: nothing is known there. */
function finite(error: number | undefined, all: number): number {
  return error !== undefined && Number.isFinite(error) ? error : all;
}

function padded([low, high]: [number, number]): [number, number] {
  const pad = high > low ? 0.06 * (high - low) : Math.max(Math.abs(high), 1) * 0.5;
  return [low - pad, high + pad];
}

/** The runs of places that have values. */
export function stretches(values: ArrayLike<number>): [number, number][] {
  const found: [number, number][] = [];
  let first = -1;
  for (let i = 0; i <= values.length; i++) {
    const there = i < values.length && Number.isFinite(values[i]);
    if (there && first < 0) first = i;
    if (!there && first >= 0) {
      found.push([first, i - 1]);
      first = -1;
    }
  }
  return found;
}

function axes(
  context: CanvasRenderingContext2D, view: View, [low, high]: [number, number], [left, bottom, width]: [number, number, number],
  across: (x: number) => number, down: (y: number) => number, palette: Palette,
): void {
  context.font = palette.font;
  context.fillStyle = palette.text;
  context.strokeStyle = palette.faint;
  context.lineWidth = 1;
  context.textAlign = "center";
  context.textBaseline = "top";
  for (const x of ticks(view.x0, view.x1, Math.max(width / 90, 2))) {
    strokes(context, [[across(x), 0, across(x), bottom]]);
    context.fillText(label(x, view.x0, view.x1), Math.min(across(x), width - 12), bottom + 4);
  }
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const y of ticks(low, high, Math.max(bottom / 45, 2))) {
    strokes(context, [[left, down(y), width, down(y)]]);
    context.fillText(label(y, low, high), left - 5, down(y));
  }
}

function strokes(context: CanvasRenderingContext2D, lines: readonly (readonly [number, number, number, number])[]): void {
  for (const [x0, y0, x1, y1] of lines) {
    context.beginPath();
    context.moveTo(Math.round(x0) + 0.5, Math.round(y0) + 0.5);
    context.lineTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5);
    context.stroke();
  }
}

/** The height of the part of a canvas that shows cells. */
export function pictureHeight(canvas: HTMLCanvasElement): number {
  return canvas.clientHeight - 2 * SCALE - 4;
}

/** A canvas with as many pixels as the screen has for it, cleared. */
function sized(canvas: HTMLCanvasElement): { context: CanvasRenderingContext2D; width: number; height: number } {
  const [width, height] = [Math.max(canvas.clientWidth, 1), Math.max(canvas.clientHeight, 1)];
  const scale = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  const context = canvas.getContext("2d");
  if (!context) throw new Error("this canvas cannot be drawn on");
  context.setTransform(scale, 0, 0, scale, 0, 0);
  return { context, width, height };
}
