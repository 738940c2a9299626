// The page of a preview: what is shown, what is asked for, and what the mouse does.
import type { FromPreview, Scene, ToPreview } from "../preview/messages";
import { type Choice, choiceFor, Controls, explained, make, missing } from "./controls";
import { decoded, estimated, type Field, type Grid, short } from "./numbers";
import { type Cells, cells, drawCells, drawCurve, type Palette, pictureHeight, type View } from "./picture";
import { type Outcome, Sampler, type Wish } from "./sampler";

declare function acquireVsCodeApi(): { postMessage(message: FromPreview): void };

const host = acquireVsCodeApi();
const at = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;
const [pictures, probe, status, problem] = ["pictures", "probe", "status", "problem"].map((id) => at(id)) as [
  HTMLElement, HTMLElement, HTMLElement, HTMLElement,
];

/** What is drawn: samples, where they belong, and their colours. */
interface Drawn {
  readonly outcome: Outcome;
  readonly grid: Grid;
  readonly view: View;
  readonly axes: readonly string[];
  readonly wrt: string | null;
  readonly cells: readonly [Cells, Cells | undefined] | undefined;
}

let scenes: readonly Scene[] = [];
let scene: Scene | undefined;
let choice: Choice | undefined;
let view: View = { x0: 0, x1: 1, y0: 0, y1: 1 };
let drawn: Drawn | undefined;
let cross: [number, number] | undefined;
let finest = 160;
const choices = new Map<string, Choice>();
const views = new Map<string, View>();

const sampler = new Sampler(
  (id, request) => host.postMessage({ type: "sample", id, request }),
  (id) => host.postMessage({ type: "cancel", id }),
  arrived,
  complain,
);
const controls = new Controls(at("choices"), at("parameters"), changed, [
  ["reset", "Reset view", () => setView(homeView())],
  ["save", "Save PNG", save],
]);

window.addEventListener("message", ({ data }: MessageEvent<ToPreview>) => {
  if (data.type === "scenes") show(data);
  else if (data.type === "pixel") probe.textContent = data.text;
  else if (data.type === "samples") sampler.samples(data.id, data.samples);
  else sampler.failure(data.id, data.message, data.outdated);
});
new ResizeObserver(draw).observe(pictures);
new MutationObserver(draw).observe(document.body, { attributes: true }); // another theme
host.postMessage({ type: "ready" });

problem.querySelector("button")?.addEventListener("click", () => {
  problem.hidden = true;
  pictures.classList.remove("blank");
  status.textContent = "evaluating…";
  ask(true);
});

/** Say what is wrong, or still needed, and dim what was drawn before. */
function complain(message: string, needed = false): void {
  problem.classList.toggle("needed", needed);
  problem.firstElementChild?.replaceChildren(...explained(message));
  problem.hidden = false;
  pictures.classList.add(drawn ? "stale" : "blank");
  if (status.dataset["settled"] !== "true") status.textContent = "";
}

/** The functions are these now: go on with the one that is shown, or with the one that is asked for. */
function show(message: ToPreview & { type: "scenes" }): void {
  ({ scenes, finest } = message);
  const next = scenes.find((other) => other.name === (message.show ?? scene?.name)) ?? (scene ? undefined : scenes[0]);
  if (!next) {
    complain(scene ? `There is no function ${scene.name} that can be drawn any more.` : "There is nothing to draw.");
    return;
  }
  const same = scene !== undefined && JSON.stringify({ ...scene, range: 0 }) === JSON.stringify({ ...next, range: 0 });
  if (same && choice) {
    scene = next;
    ask(true);
  } else select(next);
}

function select(next: Scene): void {
  if (scene && choice) choices.set(scene.name, choice);
  scene = next;
  choice = choiceFor(next, choices.get(next.name));
  controls.show(scenes, scene, choice);
  layout();
  ask(true);
}

function changed(what: "scene" | "form" | "value", name?: string): void {
  if (what === "scene") {
    const next = scenes.find((other) => other.name === name);
    if (next) select(next);
    host.postMessage({ type: "show", name: name ?? "" });
    return;
  }
  if (what === "form" && scene && choice) {
    controls.show(scenes, scene, choice);
    layout();
  }
  ask();
}

// Where one looks

function viewKey(): string {
  return [scene?.name, ...(choice?.axes ?? [])].join(" ");
}

/** Coordinates are seen around 0, other parameters from 0 to 1 or as far as they are known to go. */
function homeView(): View {
  const [first, second] = (choice?.axes ?? []).map((name) => scene?.parameters.find((parameter) => parameter.name === name));
  const centred = choice?.axes.length === 2 && choice.axes.join() === scene?.axes.join() && scene.parameters.length > 2;
  const reach = (value: number | undefined): [number, number] =>
    centred ? [-1, 1] : value === undefined ? [0, 1] : [Math.min(0, 2 * value), Math.max(1, 2 * value)];
  const [x0, x1] = reach(first?.value[0]);
  const [y0, y1] = reach(second?.value[0]);
  return { x0, x1, y0, y1 };
}

function setView(next: View): void {
  view = next;
  views.set(viewKey(), next);
  draw();
  ask();
}

/** Canvases for what is to be seen: value and derivative, side by side. */
function layout(): void {
  view = views.get(viewKey()) ?? homeView();
  drawn = undefined;
  cross = undefined;
  status.textContent = "evaluating…";
  status.dataset["settled"] = "false";
  const flat = choice?.axes.length === 2;
  const names = choice?.wrt === null ? ["value"] : ["value", "slope"];
  pictures.className = flat ? "images" : "curves";
  pictures.replaceChildren(
    ...names.map((id) => {
      const title = id === "value" ? (scene?.name ?? "") : `∂${scene?.name ?? ""}/∂${choice?.wrt ?? ""}`;
      const figure = make("figure", {});
      const canvas = make("canvas", { id, tabIndex: 0 });
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", title);
      watchMouse(canvas);
      figure.append(make("figcaption", { textContent: title }), canvas);
      return figure;
    }),
  );
}

function ask(again = false): void {
  if (!scene || !choice) return;
  const needed = missing(scene, choice);
  if (needed !== undefined) {
    complain(needed, true);
    return;
  }
  const { axes, wrt, values } = choice;
  const { name } = scene;
  const flat = axes.length === 2;
  const seen = { ...view };
  const [across = "", up = ""] = axes;
  const given = Object.fromEntries([...values].filter(([key]) => !axes.includes(key)));
  const wish: Asked = {
    key: JSON.stringify([name, axes, wrt, seen, given, finest]),
    levels: flat ? [...[20, 56].filter((count) => count < finest), finest] : [33, 129, 513],
    places: (count) => (flat ? count * count : count),
    request: (count, rtol) => ({
      name, wrt, rtol, values: given,
      axes: [
        { name: across, from: seen.x0, to: seen.x1, count },
        ...(flat ? [{ name: up, from: seen.y0, to: seen.y1, count }] : []),
      ],
    }),
    view: seen, axes, wrt,
  };
  if (!sampler.want(wish, again)) return;
  status.dataset["settled"] = "false"; // what is told is of the picture before
  status.dataset["asked"] = String(1 + Number(status.dataset["asked"] ?? 0));
}

interface Asked extends Wish {
  readonly view: View;
  readonly axes: readonly string[];
  readonly wrt: string | null;
}

// What arrives

function arrived(outcome: Outcome): void {
  const asked = outcome.wish as Asked;
  if (!choice || asked.axes.join() !== choice.axes.join() || asked.wrt !== choice.wrt) return;
  const grid = decoded(outcome.samples);
  const { columns, rows, value, slope } = grid;
  const component = choice.component;
  const coloured = asked.axes.length === 2
    ? ([
        cells(value, columns, rows, component, false, asked.view),
        slope && cells(slope, columns, rows, component, true, asked.view),
      ] as const)
    : undefined;
  drawn = { outcome, grid, view: asked.view, axes: asked.axes, wrt: asked.wrt, cells: coloured };
  problem.hidden = true;
  pictures.classList.remove("stale", "blank");
  tell(outcome, grid);
  draw();
}

/** Time, error and evaluations, and what is missing to the accuracy that was asked for. */
function tell({ samples, count, final, milliseconds, tooLong }: Outcome, grid: Grid): void {
  const most = (field: Field | undefined): number =>
    Math.max(0, ...(field?.errors ?? []).map((errors) => errors.reduce((a, b) => (b > a && Number.isFinite(b) ? b : a), 0)));
  const size = grid.rows > 1 ? `${grid.columns} × ${grid.rows}` : `${grid.columns} points`;
  const parts = [
    size,
    `${short(samples.seconds * 1000, 3)} ms (${short(milliseconds, 3)} ms in all)`,
    `error ≤ ${short(most(grid.value), 2)}` + (grid.slope ? `, of the derivative ≤ ${short(most(grid.slope), 2)}` : ""),
    `${samples.evals.toLocaleString("en")} evaluations`,
    ...(samples.converged ? [] : [`not converged: ${samples.reasons.join("; ")}`]),
    ...(final ? [] : ["refining…"]),
    ...(tooLong ? [`finer would take about ${short(tooLong / 1000, 1)} s`] : []),
  ];
  status.textContent = parts.join(" · ");
  status.classList.toggle("unsure", !samples.converged);
  status.dataset["count"] = String(count);
  status.dataset["settled"] = String(final);
}

// Drawing

function palette(): Palette {
  const style = getComputedStyle(document.body);
  const colour = (name: string, otherwise: string): string => style.getPropertyValue(`--vscode-${name}`).trim() || otherwise;
  return {
    text: colour("descriptionForeground", "#888"),
    faint: colour("widget-border", "") || colour("editorIndentGuide-background", "#8884"),
    value: colour("charts-blue", "#3794ff"),
    slope: colour("charts-orange", "#d18616"),
    font: `11px ${style.fontFamily || "sans-serif"}`,
  };
}

function draw(): void {
  if (!drawn || !choice) return;
  const colours = palette();
  for (const [id, field, made] of [
    ["value", drawn.grid.value, drawn.cells?.[0]],
    ["slope", drawn.grid.slope, drawn.cells?.[1]],
  ] as const) {
    const canvas = document.getElementById(id);
    if (!(canvas instanceof HTMLCanvasElement) || !field) continue;
    if (made) drawCells(canvas, made, view, colours, cross);
    else if (!drawn.cells) drawCurve(canvas, field, drawn.view, view, choice.component, colours[id], colours, cross?.[0]);
  }
  read();
}

/** What is known at the probe. */
function read(): void {
  const found = cross && drawn && index(drawn, cross);
  if (!cross || !drawn || !choice || found === undefined) {
    probe.textContent = "Move over the picture to read values; drag to pan, scroll to zoom, click for the code behind a pixel.";
    return;
  }
  const { grid } = drawn;
  const components = choice.component < 0 ? [0, 1, 2] : [choice.component];
  const shown = (field: Field): string =>
    components.map((place) => estimated(field.values[place]?.[found], field.errors[place]?.[found])).join(", ");
  const where = drawn.axes.map((name, place) => `${name} = ${short(cross?.[place] ?? NaN, 4)}`).join(", ");
  probe.textContent = `${where}: ${shown(grid.value)}` + (grid.slope ? ` · ∂/∂${drawn.wrt ?? ""}: ${shown(grid.slope)}` : "");
}

/** The sample nearest to a place. */
function index({ grid, view: sampled }: Drawn, [x, y]: readonly [number, number]): number | undefined {
  const across = (x - sampled.x0) / (sampled.x1 - sampled.x0);
  if (grid.rows === 1) {
    const column = Math.round(across * (grid.columns - 1));
    return column >= 0 && column < grid.columns ? column : undefined;
  }
  const column = Math.floor(across * grid.columns);
  const row = Math.floor(((sampled.y1 - y) / (sampled.y1 - sampled.y0)) * grid.rows);
  const inside = column >= 0 && column < grid.columns && row >= 0 && row < grid.rows;
  return inside ? row * grid.columns + column : undefined;
}

// The mouse and the keys

const LEFT = 52; // of the labels beside a curve

/** The place that a point of a canvas stands for. */
function place(canvas: HTMLCanvasElement, offsetX: number, offsetY: number): [number, number] {
  const flat = choice?.axes.length === 2;
  const left = flat ? 0 : LEFT;
  const tall = flat ? pictureHeight(canvas) : canvas.clientHeight - 20;
  const x = view.x0 + ((offsetX - left) / (canvas.clientWidth - left)) * (view.x1 - view.x0);
  return [x, view.y1 - (offsetY / tall) * (view.y1 - view.y0)];
}

function moved(by: readonly [number, number]): View {
  return { x0: view.x0 - by[0], x1: view.x1 - by[0], y0: view.y0 - by[1], y1: view.y1 - by[1] };
}

function zoomed(around: readonly [number, number], factor: number): View {
  const [x, y] = around;
  return {
    x0: x + (view.x0 - x) * factor, x1: x + (view.x1 - x) * factor,
    y0: y + (view.y0 - y) * factor, y1: y + (view.y1 - y) * factor,
  };
}

function watchMouse(canvas: HTMLCanvasElement): void {
  let held: [number, number] | undefined;
  canvas.addEventListener("pointerdown", (event) => {
    held = place(canvas, event.offsetX, event.offsetY);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    const here = place(canvas, event.offsetX, event.offsetY);
    if (held) setView(moved([here[0] - held[0], here[1] - held[1]]));
    cross = place(canvas, event.offsetX, event.offsetY);
    draw();
  });
  canvas.addEventListener("pointerup", () => (held = undefined));
  let pressed: readonly [number, number] = [0, 0];
  canvas.addEventListener("mousedown", ({ clientX, clientY }) => (pressed = [clientX, clientY]));
  canvas.addEventListener("click", (event) => {
    const still = Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 3;
    if (still) findCode(place(canvas, event.offsetX, event.offsetY));
  });
  canvas.addEventListener("pointerleave", () => {
    if (held) return;
    cross = undefined;
    draw();
  });
  canvas.addEventListener("dblclick", () => setView(homeView()));
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      setView(zoomed(place(canvas, event.offsetX, event.offsetY), Math.exp(event.deltaY * 0.0015)));
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    const [wide, tall] = [0.1 * (view.x1 - view.x0), 0.1 * (view.y1 - view.y0)];
    const middle: [number, number] = [(view.x0 + view.x1) / 2, (view.y0 + view.y1) / 2];
    const views: Record<string, View> = {
      ArrowLeft: moved([wide, 0]), ArrowRight: moved([-wide, 0]), ArrowUp: moved([0, -tall]), ArrowDown: moved([0, tall]),
      "+": zoomed(middle, 0.8), "-": zoomed(middle, 1.25), "0": homeView(),
    };
    const next = views[event.key];
    if (!next) return;
    event.preventDefault();
    setView(next);
  });
}

/** Ask for the code that a place comes from. */
function findCode(here: readonly [number, number]): void {
  if (!scene || !choice) return;
  const sides = [view.x1 - view.x0, view.y1 - view.y0];
  const cell = Object.fromEntries(choice.axes.map((name, n) => [name, (sides[n] ?? 0) / finest]));
  const there = Object.fromEntries(choice.axes.map((name, n) => [name, here[n] ?? 0]));
  host.postMessage({ type: "pixel", request: { name: scene.name, values: { ...Object.fromEntries(choice.values), ...there }, cell } });
}

// A picture to keep

function save(): void {
  const shown = [...pictures.querySelectorAll("canvas")];
  const [first] = shown;
  if (!first || !scene) return;
  const gap = 16;
  const whole = document.createElement("canvas");
  const beside = pictures.className.startsWith("images");
  whole.width = beside ? shown.reduce((sum, canvas) => sum + canvas.width + gap, gap) : first.width + 2 * gap;
  whole.height = beside ? first.height + 2 * gap : shown.reduce((sum, canvas) => sum + canvas.height + gap, gap);
  const context = whole.getContext("2d");
  if (!context) return;
  context.fillStyle = getComputedStyle(document.body).backgroundColor;
  context.fillRect(0, 0, whole.width, whole.height);
  let [x, y] = [gap, gap];
  for (const canvas of shown) {
    context.drawImage(canvas, x, y);
    if (beside) x += canvas.width + gap;
    else y += canvas.height + gap;
  }
  host.postMessage({ type: "save", name: scene.name, png: whole.toDataURL("image/png") });
}
