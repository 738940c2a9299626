// The integral view. One page with two hosts: a browser asks the server it came from, an editor's webview its extension.
"use strict";
const $ = (id) => document.getElementById(id);
const make = (tag, properties = {}, ...inside) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...inside);
  return element;
};

// Hosts: ask(path, body) answers with an object; an editor also tells where its cursor is.

const editor = typeof acquireVsCodeApi === "function" ? acquireVsCodeApi() : null;
const waiting = new Map();
let number = 0;
async function ask(path, body) {
  if (!editor) return (await fetch(path + location.search, { method: "POST", body: JSON.stringify(body) })).json();
  const id = ++number;
  editor.postMessage({ type: "ask", id, path, body });
  return new Promise((resolve) => waiting.set(id, resolve));
}

let state = { name: "", values: {}, sections: {}, functions: {}, fits: {}, indices: {}, wrt: "", which: 0, integrals: 1 };
let lit = "";
let last = null; // the newest answer
let pinned = null;
let begun = 0; // openings: an answer for an older one is dropped

const dark = () =>
  editor ? document.body.matches(".vscode-dark, .vscode-high-contrast:not(.vscode-high-contrast-light)")
         : matchMedia("(prefers-color-scheme: dark)").matches;
const shade = () => document.documentElement.classList.toggle("dark", dark());

// Asking: the newest state wins, nothing queues. While a slider is dragged answers are coarse, with error bars that say so,
// and a fine one follows when it rests.

const REST = 120; // ms
let busy = false;
let newest = false; // whether something is still to be asked
let dragged = false;
let resting = 0;
async function look() {
  if (busy) { newest = true; return; }
  busy = true;
  newest = false;
  clearTimeout(resting);
  const quick = dragged;
  const opening = begun;
  const since = performance.now();
  const { name, values, sections, functions, wrt, which } = state;
  const body = { name, values: { ...values }, sections: { ...sections }, functions, wrt, which, dark: dark(), nodes: $("nodes").checked };
  if ($("ghost").checked) body.ghost = Math.max(1e-9, +$("step").value * Math.max(1, Math.abs(values[wrt] ?? 0)));
  try {
    const found = await ask("/look", { ...body, quick });
    if (opening === begun) {
      say(found.error ?? "");
      if (!found.error) {
        const kept = !found.numbers && last?.body.name === name && last.wrt === wrt && last.body.which === which;
        last = { ...found, ...(kept && { told: last.told, numbers: last.numbers, old: true }), title: titleOf(name, { ...body.values, ...functions }), wrt, body };
        show($("now"), last, pinned);
        state.indices = found.indices;
        stand(found.indices, state.values, body.values, 0);
        cut(found.sections, body.sections);
        tell(found, performance.now() - since);
      }
    }
  } catch {
    say("the view's server has ended; start it again");
  }
  busy = false;
  if (newest) look();
  else if (quick) {
    newest = true;
    resting = setTimeout(() => { dragged = false; look(); }, REST);
  }
}

/** Light or dark has changed: what is pinned is drawn anew too. */
async function repaint() {
  shade();
  if (state.name) await look();
  if (!pinned) return;
  const found = await ask("/look", { ...pinned.body, dark: dark() });
  if (!found.error && pinned) showPinned({ ...pinned, ...found });
}
function showPinned(shot) {
  pinned = shot;
  show($("pinned"), shot, null);
  $("pinned").querySelector("figcaption").prepend("pinned: ");
}

const titleOf = (name, values) =>
  `${name}(${Object.entries(values).map(([n, v]) => `${n} = ${v.toPrecision ? +v.toPrecision(5) : v}`).join(", ")})`;
const say = (text) => { $("said").textContent = text; };
function tell(found, whole) {
  const time = $("time");
  time.textContent = `${(found.seconds * 1000).toFixed(1)} ms${found.slow ? ", more than a frame" : ""}${found.numbers ? "" : ", numbers follow"}`;
  time.title = `${whole.toFixed(1)} ms until it was drawn`;
  time.classList.toggle("slow", found.slow);
  time.dataset.frames = String(1 + Number(time.dataset.frames ?? 0));
}

// Drawing

function show(figure, shot, beside) {
  const rows = shot.told.map(([name, value], place) => {
    const kind = ["interior", "boundary"].includes(name) ? "part" : place > 3 ? "quiet" : "";
    const row = make("tr", { className: kind }, make("td", { textContent: name.replace(/^central /, "") }), make("td", { textContent: value }));
    if (beside && beside !== shot && beside.body.name === shot.body.name && beside.wrt === shot.wrt)
      row.append(make("td", { className: "changed", textContent: difference(shot, beside, place), title: "less the pinned one" }));
    return row;
  });
  const table = make("table", { className: shot.old ? "numbers old" : "numbers" }, ...rows);
  const picture = make("div");
  picture.innerHTML = shot.svg;
  const list = make("ul", { className: "list" }, ...shot.surfaces.map(surfaceName), ...shot.remarks.map((text) => make("li", { textContent: text })));
  if (shot.numbers?.converged === false) list.prepend(make("li", { textContent: "not as accurate as was asked" }));
  figure.replaceChildren(make("figcaption", { textContent: shot.title }), picture, table, list);
  light(lit);
}

const KEYS = ["value", "tangent", "interior", "boundary", "difference"];
function difference(shot, other, place) {
  const [here, there] = [shot, other].map(({ numbers }) => numbers?.[KEYS[place]] ?? null);
  if (here === null || there === null) return "";
  const by = here - there;
  return `Δ ${by < 0 ? "−" : "+"}${Math.abs(by).toPrecision(3)}`;
}

function surfaceName({ equation, condition, comment }) {
  const name = make("span", { className: "surface-name", textContent: equation });
  name.dataset.equation = condition;
  name.onclick = () => chosen(condition);
  return make("li", {}, name, comment);
}

// From the picture to the code and back

function chosen(equation) {
  light(equation);
  if (editor) editor.postMessage({ type: "reveal", equation });
  else document.querySelector("#source mark.lit")?.scrollIntoView({ block: "nearest" });
}
function light(equation) {
  lit = equation;
  for (const element of document.querySelectorAll("[data-equation]"))
    element.classList.toggle("lit", equation !== "" && element.dataset.equation === equation);
}
$("shots").addEventListener("click", (event) => {
  const surface = event.target.closest("svg .surface");
  if (surface) chosen(surface.dataset.equation);
});

// What is chosen

const fill = (select, names, selected) =>
  select.replaceChildren(...names.map(([value, text]) => new Option(text, value, false, String(value) === String(selected))));

async function open(name, keep = false, which = 0, functions = keep && name === state.name ? state.functions : {}) {
  const opening = ++begun;
  const found = await ask("/open", { name, functions });
  if (opening !== begun) return;
  say(found.error ?? "");
  if (found.error) { if (!keep) $("now").replaceChildren(); return; }
  const same = keep && name === state.name && Object.keys(found.values).join() === Object.keys(state.values).join();
  state = {
    name, integrals: found.integrals, which: Math.min(same ? state.which : which, found.integrals - 1),
    values: same ? state.values : found.values, sections: same ? state.sections : found.sections, functions: found.functions, fits: found.fits, indices: found.indices, wrt: same ? state.wrt : found.wrt,
  };
  $("name").value = name;
  fill($("wrt"), Object.keys(state.values).filter((n) => !(n in state.indices)).map((n) => [n, n]), state.wrt);
  fill($("which"), Array.from({ length: found.integrals }, (_, n) => [n, `integral ${n + 1} of ${found.integrals}`]), state.which);
  $("which").hidden = found.integrals < 2;
  if (!same) sliders();
  if (!same) formulas([]);
  source(found);
  moves();
  await look();
  const said = await ask("/formulas", { name });  // these may take longer than the picture
  if (opening === begun) formulas(said.formulas ?? []);
}

function sliders() {
  $("sliders").replaceChildren(...Object.entries(state.values).map(([name, value]) => {
    const reach = Math.max(1, Math.abs(value)), index = state.indices[name];
    const [min, max, step] = index ? [index[1], index[2], 1] : [value - reach, value + reach, reach / 500];
    const label = slides(name, { min, max, step, value }, state.values);
    label.dataset.name = name;
    return label;
  }), ...Object.entries(state.functions).map(([name, text]) => offers(name, text)));
}
/** A slider that moves one of `values`. */
function slides(name, range, values) {
  const slider = make("input", { type: "range", ...range, name });
  const told = make("output", { textContent: String(+range.value.toPrecision(6)) });
  slider.dataset.parameter = name;
  slider.oninput = () => {
    values[name] = +slider.value;
    told.textContent = String(+(+slider.value).toPrecision(6));
    dragged = true;
    look();
  };
  return make("label", {}, make("span", { className: "name", textContent: name }), slider, told);
}
/** A parameter that is a function is given one that fits, or any expression. */
function offers(name, text) {
  const list = make("datalist", { id: `fits-${name}` }, ...state.fits[name].map((fit) => new Option("", fit)));
  const field = make("input", { className: "function", value: text, spellcheck: false, ariaLabel: name });
  field.setAttribute("list", list.id);
  field.dataset.parameter = name;
  field.onchange = () => void open(state.name, true, 0, { ...state.functions, [name]: field.value });
  return make("label", {}, make("span", { className: "name", textContent: name }), field, list);
}
/** Sliders stand within ranges that other values may have changed; but for one that was dragged on meanwhile. */
function stand(standing, values, asked, parts) {
  for (const [name, [at, min, max]] of Object.entries(standing)) {
    const slider = document.querySelector(`#sliders input[data-parameter="${CSS.escape(name)}"]`);
    if (!slider || values[name] !== asked[name]) continue;
    if (name in values) values[name] = at;
    Object.assign(slider, { min, max, step: parts ? (max - min) / parts || "any" : 1, value: at });
    slider.nextElementSibling.textContent = String(+at.toPrecision(6));
  }
}
/** A section has a slider for each variable that is not seen. One that nobody has moved stays in the middle. */
function cut(sections, asked) {
  const names = Object.keys(sections), before = [...document.querySelectorAll("#sliders .section")];
  if (before.map((label) => label.dataset.section).join() !== names.join()) {
    for (const label of before) label.remove();
    $("sliders").append(...names.map((name) => {
      const [value, min, max] = sections[name];
      const label = slides(name, { min, max, value }, state.sections);
      label.className = "section";
      label.title = "where the section stands";
      label.dataset.section = name;
      return label;
    }));
  }
  stand(sections, state.sections, asked, 500);
}
const moves = () => { for (const label of $("sliders").children) label.classList.toggle("moves", label.dataset.name === state.wrt); };

function formulas(found) {
  const several = new Set(found.map((each) => each.of)).size > 1;
  const rows = found.map((each) => {
    const math = make("td");
    math.innerHTML = each.math;
    return make("tr", {}, make("td", { textContent: several ? `${each.part} ${+each.of + 1}` : each.part }), math);
  });
  $("formulas").replaceChildren(...(rows.length ? [make("h2", { textContent: "Formulas" }), make("table", {}, ...rows)] : []));
}

function source({ source: text, conditions }) {
  if (editor) return;
  const parts = [];
  let at = 0;
  for (const each of [...conditions].sort((a, b) => a.from - b.from)) {
    if (each.from < at) continue;
    const mark = make("mark", { textContent: text.slice(each.from, each.to), onclick: () => chosen(each.equation) });
    mark.dataset.equation = each.equation;
    parts.push(text.slice(at, each.from), mark);
    at = each.to;
  }
  $("source").replaceChildren(...parts, text.slice(at));
}

$("name").onchange = () => {
  if (editor) editor.postMessage({ type: "chosen", name: $("name").value });
  open($("name").value);
};
$("wrt").onchange = () => { state.wrt = $("wrt").value; moves(); look(); };
$("which").onchange = () => { state.which = +$("which").value; look(); };
for (const id of ["ghost", "step", "nodes"]) $(id).oninput = () => look();
$("pin").onclick = () => {
  if (pinned) {
    pinned = null;
    $("pinned").replaceChildren();
  } else if (last) {
    showPinned(last);
  }
  $("pin").textContent = pinned ? "Unpin" : "Pin";
  if (last) show($("now"), last, pinned);
};

async function begin(wanted = "", which = 0) {
  shade();
  const { names, chosen: first, error } = await ask("/names", {});
  if (error) { say(error); return; }
  const name = names.includes(wanted) ? wanted : first;
  fill($("name"), names.map((n) => [n, n]), name);
  if (names.length) await open(name, false, which);
  else say("there is no function of numbers here that has an integral");
}

window.addEventListener("message", ({ data }) => {
  if (!editor) return;
  switch (data.type) {
    case "answer":
      waiting.get(data.id)?.(data.answer);
      waiting.delete(data.id);
      break;
    case "file": // another file, or this one with other names
      lit = data.lit;
      void begin(data.name, data.which);
      break;
    case "follow":
      if (data.name !== state.name) void open(data.name, false, data.which);
      else if (data.which !== state.which && data.which < state.integrals) {
        state.which = data.which;
        $("which").value = String(data.which);
        void look();
      }
      light(data.lit);
      break;
    case "changed": // the text: what the sliders say stays
      void open(state.name, true);
      break;
  }
});
if (editor) {
  new MutationObserver(() => void repaint()).observe(document.body, { attributeFilter: ["class"] });
  shade();
  editor.postMessage({ type: "ready" });
} else {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => void repaint());
  void begin();
}
