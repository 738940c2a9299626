// The page's controls: which function, over which axes, differentiated by what, and a row for each other parameter.
import type { Given, Scene, SceneParameter } from "../preview/messages";

/** What is chosen for a scene; kept while the preview is open, also over edits. */
export interface Choice {
  axes: string[];
  wrt: string | null;
  /** The component that is drawn; -1 for three as a colour. */
  component: number;
  values: Map<string, Given>;
}

export function choiceFor(scene: Scene, before: Choice | undefined): Choice {
  const numbers = scene.parameters.filter((parameter) => parameter.kind === "number").map((parameter) => parameter.name);
  const kept = before?.axes.every((axis) => numbers.includes(axis)) ? before.axes : undefined;
  const axes = kept ?? [...scene.axes];
  const wrt = before && (before.wrt === null || numbers.includes(before.wrt)) ? before.wrt : firstWrt(numbers, axes);
  const components = scene.components === 3 ? [-1, 0, 1, 2] : [...Array(scene.components).keys()];
  const component = before && components.includes(before.component) ? before.component : (components[0] ?? 0);
  const values = new Map<string, Given>();
  for (const parameter of scene.parameters) {
    const known = before?.values.get(parameter.name);
    values.set(parameter.name, known !== undefined && fits(parameter, known) ? known : start(parameter));
  }
  return { axes, wrt, component, values };
}

/** Differentiate a picture by what moves it, and a curve along its axis. */
function firstWrt(numbers: readonly string[], axes: readonly string[]): string | null {
  return (axes.length === 2 ? numbers.find((name) => !axes.includes(name)) : undefined) ?? numbers[0] ?? null;
}

function fits(parameter: SceneParameter, value: Given): boolean {
  if (typeof value === "string") return parameter.kind === "function" || value !== "";
  return parameter.kind === "number" ? typeof value === "number" : Array.isArray(value) && value.length === parameter.size;
}

function start(parameter: SceneParameter): Given {
  if (parameter.kind === "function") return parameter.fits[0] ?? "";
  if (parameter.kind === "number") return parameter.value[0] ?? 0.5;
  return parameter.value.length ? parameter.value : Array<number>(parameter.size).fill(0.5);
}

/** What a scene still needs before anything can be drawn: functions, where the fields for them are empty. */
export function missing(scene: Scene, choice: Choice): string | undefined {
  const empty = scene.parameters.filter(({ name, kind }) => kind === "function" && choice.values.get(name) === "");
  if (!empty.length) return undefined;
  const needed = empty.map(({ name, type, fits: [first] }) => `“${name}” a function ${type}${first ? `, such as ${first}` : ""}`);
  const found = empty.some(({ fits }) => !fits.length) ? " None was found in this file, in what it imports, or beside it." : "";
  return `Give ${needed.join(", and ")}.${found}`;
}

export class Controls {
  private readonly reach = new Map<string, [number, number]>(); // of sliders

  constructor(
    private readonly head: HTMLElement,
    private readonly rows: HTMLElement,
    private readonly changed: (what: "scene" | "form" | "value", name?: string) => void,
    private readonly actions: readonly (readonly [string, string, () => void])[],
  ) {}

  /** Draw all controls for a scene. */
  show(scenes: readonly Scene[], scene: Scene, choice: Choice): void {
    const numbers = scene.parameters.filter((parameter) => parameter.kind === "number").map((parameter) => parameter.name);
    const [across, down] = choice.axes;
    const none = "—";
    const parts = [
      select("function", "Function", scenes.map((other) => other.name), scene.name, (name) => this.changed("scene", name)),
      select("across", "Across", numbers, across ?? "", (name) => {
        choice.axes = down === undefined || down === name ? [name] : [name, down];
        this.changed("form");
      }),
      select("down", "Up", [none, ...numbers.filter((name) => name !== across)], down ?? none, (name) => {
        choice.axes = name === none ? [across ?? name] : [across ?? name, name];
        this.changed("form");
      }),
      select("wrt", "Derivative by", [none, ...numbers], choice.wrt ?? none, (name) => {
        choice.wrt = name === none ? null : name;
        this.changed("form");
      }),
    ];
    if (scene.components > 1) parts.push(this.components(scene, choice));
    for (const [id, title, act] of this.actions) {
      const button = make("button", { id, type: "button", textContent: title });
      button.addEventListener("click", act);
      parts.push(button);
    }
    this.head.replaceChildren(...parts);
    const free = scene.parameters.filter((parameter) => !choice.axes.includes(parameter.name));
    this.rows.replaceChildren(...free.map((parameter) => this.row(parameter, choice)));
  }

  private components(scene: Scene, choice: Choice): HTMLElement {
    const names = [...Array(scene.components).keys()].map((place) => String(place + 1));
    if (scene.components === 3) names.unshift("colour");
    const now = choice.component < 0 ? "colour" : String(choice.component + 1);
    return select("component", "Component", names, now, (name) => {
      choice.component = name === "colour" ? -1 : Number(name) - 1;
      this.changed("form");
    });
  }

  private row(parameter: SceneParameter, choice: Choice): HTMLElement {
    const row = make("div", { className: "row" });
    const name = make("label", { htmlFor: `p-${parameter.name}`, textContent: parameter.name, title: parameter.type });
    const value = choice.values.get(parameter.name) ?? "";
    const set = (given: Given): void => {
      choice.values.set(parameter.name, given);
      this.changed("value");
    };
    row.append(name, ...(parameter.kind === "number" ? this.number(parameter, value, set) : field(parameter, value, set)));
    return row;
  }

  /** A slider and a field for one number; the field also takes expressions, and moves the slider's ends. */
  private number(parameter: SceneParameter, value: Given, set: (given: Given) => void): HTMLElement[] {
    const slider = make("input", { type: "range", className: "slider", step: "any" });
    slider.setAttribute("aria-label", parameter.name);
    slider.dataset["parameter"] = parameter.name;
    const typed = make("input", { id: `p-${parameter.name}`, type: "text", className: "number", spellcheck: false });
    const place = (number: number): void => {
      let [low, high] = this.reach.get(parameter.name) ??
        parameter.reach ?? [Math.min(0, 2 * number), Math.max(1, 2 * number)];
      if (number < low || number > high) [low, high] = [Math.min(low, 2 * number), Math.max(high, 2 * number)];
      this.reach.set(parameter.name, [low, high]);
      slider.min = String(low);
      slider.max = String(high);
      slider.value = String(number);
    };
    if (typeof value === "number") place(value);
    else slider.disabled = true;
    typed.value = String(value);
    slider.addEventListener("input", () => {
      const number = Number(Number(slider.value).toPrecision(4));
      typed.value = String(number);
      set(number);
    });
    typed.addEventListener("input", () => {
      const number = typed.value.trim() === "" ? NaN : Number(typed.value);
      slider.disabled = !Number.isFinite(number);
      if (Number.isFinite(number)) place(number);
      set(Number.isFinite(number) ? number : typed.value);
    });
    return [slider, typed];
  }
}

/** A field for an expression: a function, or a tuple. */
function field(parameter: SceneParameter, value: Given, set: (given: Given) => void): HTMLElement[] {
  const typed = make("input", { id: `p-${parameter.name}`, type: "text", className: "expression", spellcheck: false });
  typed.placeholder = parameter.kind === "function" ? "a function, such as \\(x, y) . x + y" : "numbers, such as 0.5, 1";
  typed.value = Array.isArray(value) ? value.join(", ") : String(value);
  typed.addEventListener("input", () => {
    const numbers = typed.value.split(",").map((part) => (part.trim() === "" ? NaN : Number(part)));
    set(parameter.kind === "tuple" && numbers.every(Number.isFinite) ? numbers : typed.value);
  });
  if (!parameter.fits.length) return [typed];
  const list = make("datalist", { id: `fits-${parameter.name}` });
  list.append(...parameter.fits.map((name) => make("option", { value: name })));
  typed.setAttribute("list", list.id);
  return [typed, list];
}

function select(
  id: string, title: string, names: readonly string[], chosen: string, picked: (name: string) => void,
): HTMLElement {
  const box = make("select", { id });
  box.append(...names.map((name) => make("option", { value: name, textContent: name, selected: name === chosen })));
  box.addEventListener("change", () => picked(box.value));
  const whole = make("label", { textContent: `${title} ` });
  whole.append(box);
  return whole;
}

export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K, properties: Partial<HTMLElementTagNameMap[K]>,
): HTMLElementTagNameMap[K] {
  return Object.assign(document.createElement(tag), properties);
}

/** A message with its excerpts of programs: they keep their columns, the sentences are wrapped. */
export function explained(message: string): HTMLElement[] {
  const parts: HTMLElement[] = [];
  for (const line of message.split("\n")) {
    const tag = /^\s*(\d+\s*\||\||-->)/.test(line) ? "pre" : "p";
    const last = parts.at(-1);
    if (tag === "pre" && last?.tagName === "PRE") last.textContent = `${last.textContent ?? ""}\n${line}`;
    else parts.push(make(tag, { textContent: tag === "p" ? line.replace(/^\s*= /, "") : line }));
  }
  return parts;
}
