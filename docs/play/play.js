// The page to play with: controls, pictures and tables. The WebAssembly module computes every number.

const facts = JSON.parse(document.getElementById("facts").textContent);
const HOP = ["ground", "touchdown_time", "x1", "v1", "v2", "u", "ending", "duration", "apex", "aed", "events",
  "command", "y", "force", "spring", "lowest", "takes_off", "stiff"];
const SAMPLE = ["t", "x1", "v1", "x2", "v2", "foot", "ground", "u", "y", "spring", "motor", "body", "energy",
  "predicted", "hop"];
const SAMPLES = 700;
const TOUCHDOWN = 100, TAKEOFF = 101;

const make = (tag, properties) => Object.assign(document.createElement(tag), properties);
const id = (name) => document.getElementById(name);

async function solver() {
  const bytes = Uint8Array.from(atob(id("wasm").textContent.trim()), (letter) => letter.charCodeAt(0));
  return (await WebAssembly.instantiate(bytes, {})).instance.exports;
}
const c = await solver().catch((error) => {
  id("status").textContent = `This page needs WebAssembly, which this browser does not run: ${error.message}.`;
  id("status").classList.add("error");
  throw error;
});

const view = (name, length) => new Float64Array(c.memory.buffer, c[`play_${name}`].value, length);
const rows = (name, keys, count) => {
  const flat = view(name, keys.length * count);
  const row = (n) => Object.fromEntries(keys.map((key, k) => [key, flat[n * keys.length + k]]));
  return Array.from({ length: count }, (_, n) => row(n));
};
const word = (table, number) => facts.words[table].find((each) => each.number === number) ?? { text: "", meaning: "" };
const short = (value, digits = 5) => (Number.isFinite(value) ? String(Number(value.toPrecision(digits))) : "none");

for (const robot of Object.values(facts.robots))
  for (const [name, text] of Object.entries(robot.values)) robot.values[name] = number(text);

// ---- state: what is simulated; the URL holds it ----

const START = { robot: "hopper_c", mode: "controller", h_des: 0.2, u: 3, height: 0.2, terrain: "rough", size: 0.02,
  seed: 1, hops: 12, wrong: 0, speed: 0.25, start: "drop", window: "hop" };
const CHOICES = ["robot", "mode", "terrain", "start", "window"];
const state = { ...START, time: NaN, parameters: {} }; // no time: playback starts at its beginning
const preset = () => facts.robots[state.robot].values;

function readUrl() {
  const address = location.hash.slice(1), asked = new URLSearchParams(address), words = {};
  for (const name of CHOICES)
    words[name] = Array.from(id(name).options, (option) => option.value);
  Object.assign(state, stateOf(address, START, words));
  state.parameters = { ...preset() };
  state.time = NaN;
  for (const { name } of facts.fields)
    if (asked.has(name)) state.parameters[name] = number(asked.get(name));
}

const writeUrl = onceASecond(() => {
  const asked = new URLSearchParams();
  for (const key of Object.keys(START)) if (state[key] !== START[key]) asked.set(key, state[key]);
  for (const { name } of facts.fields)
    if (!Object.is(state.parameters[name], preset()[name])) asked.set(name, repr(state.parameters[name]));
  history.replaceState(null, "", `#${asked}`);
});

// ---- robot files ----

const writeToml = () => `name = "mine"\n${facts.fields
  .map(({ name, unit, meaning }) => `${name} = ${repr(state.parameters[name])} # [${unit}] ${meaning}\n`).join("")}`;

// ---- ground: rounded heights, equal in every browser ----

function ground() {
  let seed = state.seed >>> 0;
  const draw = () => { // mulberry32
    let z = (seed = (seed + 0x6d2b79f5) >>> 0);
    z = Math.imul(z ^ (z >>> 15), z | 1);
    z ^= z + Math.imul(z ^ (z >>> 7), z | 61);
    return ((z ^ (z >>> 14)) >>> 0) / 2 ** 32;
  };
  const kinds = { flat: () => 0, steps: (n) => (Math.floor(n / 3) % 2) * state.size,
    rough: () => Math.round((2 * draw() - 1) * state.size * 1e4) / 1e4 };
  return Array.from({ length: state.hops }, (_, n) => kinds[state.terrain](n));
}

// ---- solve ----

const narrow = matchMedia("(max-width: 850px)"); // as in the style
let run = { status: 0, hops: [], events: [], duration: 0 };

function fill() {
  view("robot", facts.solved.length).set(facts.solved.map((name) => state.parameters[name]));
}

function solve() {
  fill();
  state.hops = Math.min(Math.max(Math.round(state.hops), 1), 40);
  view("terrain", state.hops).set(ground());
  const controlled = state.mode === "controller", refused = refusalOf(state.parameters, facts);
  const asked = [Number(controlled), controlled ? state.h_des : state.u, state.hops, controlled ? state.wrong : 0];
  const status = refused ? -1 : c.play_run(state.height, ...asked);
  const [hops, events] = status < 0 ? [0, 0] : view("counts", 2);
  run = { status, hops: rows("hops", HOP, hops), events: rows("events", ["time", "kind", "side_1", "side_2"], events),
    duration: status < 0 ? 0 : view("duration", 1)[0] };
  state.time = Number.isFinite(state.time) ? Math.min(state.time, run.duration) : startOfPlayback();
  id("status").textContent = status < 0 ? `No run: ${refused || word("STATUSES", status).meaning}.`
    : `${outcome(status, hops)}, ${short(run.duration)} s${notReached()}`;
  id("status").classList.toggle("error", status < 0);
  id("warnings").replaceChildren(...warnings().map((text) => make("li", { textContent: text })));
}

const startOfPlayback = () => (state.start === "touchdown" && run.hops.length ? run.hops[0].touchdown_time : 0);
const outcome = (status, hops) => facts.outcomes[status].replace("{}", hops).replace("{}", hops === 1 ? "" : "s");

// The number of commands that miss the desired apex; the table of hops has the status of each.
function notReached() {
  const missed = run.hops.filter(({ command }) => command && word("COMMANDS", command).text !== "reached").length;
  return missed ? `; desired apex not reached in ${missed} of ${run.hops.length} hops` : "";
}

// The warnings of all stances, each once, as Run.warnings.
function warnings() {
  const of = (hop) => warningsOf(facts.warnings, { ...state.parameters, ...hop, u_largest: hop.u,
    u_size: Math.max(hop.u, -hop.u) });
  return [...new Set(run.hops.flatMap(of))];
}

const sample = (from, to, count) => {
  c.play_sample(from, to, count);
  return rows("samples", SAMPLE, count);
};

function reach() {
  fill();
  const { u_max, x1_min, x1_max } = state.parameters;
  const home = Math.min(Math.max(0, x1_min), x1_max), top = Math.max(0.3, 1.3 * state.height, 1.3 * state.h_des);
  const heights = Array.from({ length: 41 }, (_, n) => home + 0.004 + ((top - home - 0.004) * n) / 40);
  const limit = Number.isFinite(u_max) ? u_max : 3;
  const currents = [0, 1 / 3, 2 / 3, 1].map((part) => part * limit);
  if (state.mode === "constant") currents.push(state.u);
  view("heights", heights.length).set(heights);
  view("currents", currents.length).set(currents);
  const status = c.play_reach(heights.length, currents.length);
  const copy = (name, size) => Array.from(view(name, size));
  const cells = heights.length * currents.length;
  return { status, heights, currents, apex: copy("apex", cells), admissible: copy("admissible", cells),
    lowest: copy("lowest", heights.length), highest: copy("highest", heights.length) };
}

// ---- pictures ----

const element = (name, attributes, text = "") => {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
};

function ticks(low, high, wanted) {
  const raw = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= raw);
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.max(0, Math.floor(high / step + 1e-9) - first + 1) }, (_, n) => (first + n) * step);
}

const path = (points, x, y) => {
  let pen = "M";
  return points.map(([a, b]) => {
    if (!Number.isFinite(b)) return (pen = "M"), "";
    const at = `${pen}${x(a).toFixed(1)} ${y(b).toFixed(1)}`;
    return (pen = "L"), at;
  }).join("");
};

// The legend: named curves with the places of their names, in lines between two edges.
function placed(curves, left, right) {
  let x = left, y = 13;
  return curves.map((curve) => {
    const width = 46 + 6.8 * curve.name.length;
    if (x > left && x + width - 14 > right) [x, y] = [left, y + 17];
    x += width;
    return { ...curve, x: x - width, y };
  });
}

// Draw axes and curves {name, points, colour, dashed} over a background; return the scales.
function plot(svg, { from, to, label, curves, tall = 190, behind = () => [], low = [], square = false }) {
  const wide = Math.max(320, svg.clientWidth || 800), left = 52, right = 12, bottom = 34;
  const legend = placed(curves.filter((curve) => curve.name), left, wide - right), top = 9 + legend.at(-1).y;
  tall += top - 22; // each further line of the legend makes the picture taller
  svg.setAttribute("viewBox", `0 0 ${wide} ${tall}`);
  const values = [...low, ...curves.flatMap(({ points }) => points.map(([, b]) => b))].filter(Number.isFinite);
  let [least, most] = values.length ? [Math.min(...values), Math.max(...values)] : [0, 1];
  const spare = 0.06 * (most - least) || 1e-3;
  [least, most] = square ? [from, to] : [least - spare, most + spare];
  const x = (a) => left + ((a - from) / (to - from || 1)) * (wide - left - right);
  const y = (b) => tall - bottom - ((b - least) / (most - least)) * (tall - top - bottom);
  const made = [...behind(x, y, top, tall - bottom)];
  for (const at of ticks(from, to, wide / 90)) {
    made.push(element("path", { class: "axis", d: `M${x(at)} ${tall - bottom}v4` }));
    made.push(element("text", { x: x(at), y: tall - bottom + 16, "text-anchor": "middle" }, short(at, 4)));
  }
  for (const at of ticks(least, most, tall / 45)) {
    made.push(element("path", { class: "axis", d: `M${left} ${y(at)}h-4` }));
    made.push(element("text", { x: left - 7, y: y(at) + 4, "text-anchor": "end" }, short(at, 4)));
  }
  made.push(element("path", { class: "axis", d: `M${left} ${top}V${tall - bottom}H${wide - right}` }));
  made.push(element("text", { x: wide - right, y: tall - 3, "text-anchor": "end" }, label));
  curves.forEach(({ points, colour, dashed }) =>
    made.push(element("path", { class: `curve ${colour} ${dashed ? "dashed" : ""}`, d: path(points, x, y) })));
  for (const { x: at, y: line, name, colour, dashed } of legend) {
    made.push(element("path", { class: `curve ${colour} ${dashed ? "dashed" : ""}`, d: `M${at} ${line - 4}h24` }));
    made.push(element("text", { x: at + 29, y: line }, name));
  }
  svg.replaceChildren(...made);
  svg.setAttribute("aria-label", `${svg.parentElement.querySelector("figcaption")?.textContent ?? ""}: ${curves
    .filter((curve) => curve.name).map((curve) => curve.name).join(", ")}`);
  return { x, y, top, bottom: tall - bottom };
}

const hopAt = (t) => (run.duration ? Math.min(sample(t, t, 1)[0].hop, Math.max(run.hops.length - 1, 0)) : 0);

function span() {
  if (state.window === "run" || !run.hops.length) return [0, run.duration];
  const hop = hopAt(state.time), { touchdown_time, duration } = run.hops[hop];
  return [Math.max(0, touchdown_time - 0.05), Math.min(run.duration, touchdown_time + duration + 0.05)];
}

const PLOTS = ["heights", "actuator", "forces", "energy"];
let cursors = [];

function drawPlots() {
  const [from, to] = span();
  if (!(to > from)) return PLOTS.forEach((name) => id(name).replaceChildren());
  const found = sample(from, to, SAMPLES), inside = run.events.filter(({ time }) => time >= from && time <= to);
  const bands = run.events.map((event, n) => ({ ...event, end: run.events[n + 1]?.time ?? run.duration }))
    .filter(({ time, end, side_2 }) => side_2 !== 2 && end > from && time < to);
  const behind = (x, y, top, bottom) => [
    ...bands.map(({ time, end, side_1, side_2 }) => element("rect", { x: x(Math.max(time, from)), y: top,
      width: Math.max(0, x(Math.min(end, to)) - x(Math.max(time, from))), height: bottom - top,
      class: side_1 && side_2 ? "stance" : "held" })),
    ...inside.map(({ time, kind }) => {
      const tick = element("path", { class: "tick", d: `M${x(time)} ${top}v7` });
      tick.append(element("title", {}, `${eventName(kind)} at ${short(time, 7)} s`));
      return tick;
    }),
  ];
  const curve = (name, key, colour, more = {}) =>
    ({ name, colour, points: found.map((row) => [row.t, row[key] * (more.scale ?? 1)]), ...more });
  const shared = { from, to, label: "time [s]", behind };
  const scales = [
    plot(id("heights"), { ...shared, curves: [curve("body x2", "x2", "first"), curve("foot", "foot", "second"),
      curve("ground", "ground", "third", { dashed: true })] }),
    plot(id("actuator"), { ...shared, curves: [curve("x1 [mm]", "x1", "first", { scale: 1000 }),
      curve("current [A]", "u", "second", { dashed: true })] }),
    plot(id("forces"), { ...shared, curves: [curve("spring", "spring", "first"),
      curve("motor, on the actuator", "motor", "second", { dashed: true })] }),
    plot(id("energy"), { ...shared, curves: [curve("kinetic + gravitational", "body", "third"),
      curve("body and spring (23)", "energy", "first"),
      curve("predicted by the AED", "predicted", "second", { dashed: true })] }),
  ];
  cursors = PLOTS.map((name, n) => {
    const line = element("path", { class: "cursor" });
    id(name).append(line);
    return { line, from, to, ...scales[n] };
  });
}

const eventName = (kind) => (kind === TOUCHDOWN ? "touchdown" : kind === TAKEOFF ? "takeoff"
  : word("EVENTS", kind).text || word("CURRENT_EVENTS", kind).text || "step");

function drawMap() {
  const map = run.status < 0 ? run : reach();
  if (map.status < 0) return id("map").replaceChildren();
  const { heights, currents } = map, count = currents.length;
  const colours = ["first", "second", "third", "fourth", "fifth"];
  const line = (column, good) => heights.map((height, row) => {
    const cell = row * count + column;
    return [height, Boolean(map.admissible[cell]) === good ? map.apex[cell] : NaN];
  });
  const behind = (x, y) => {
    const band = heights.map((height, n) => [height, map.lowest[n], map.highest[n]])
      .filter((row) => row.every(Number.isFinite));
    const points = [...band.map(([h, low]) => [h, low]), ...band.reverse().map(([h, , high]) => [h, high])];
    return [element("path", { class: "stance", d: `${path(points, x, y)}Z` })];
  };
  const to = heights.at(-1);
  const { x, y } = plot(id("map"), { from: 0, to, label: "drop height [m]", tall: 380, behind, low: map.highest,
    curves: [{ name: "same height", colour: "axis", dashed: true, points: [[0, 0], [to, to]] },
      ...currents.flatMap((u, n) => [{ name: `${short(u, 3)} A`, colour: colours[n], points: line(n, true) },
        { colour: colours[n], dashed: true, points: line(n, false) }])] });
  run.hops.forEach((hop, n) => {
    const before = (n ? run.hops[n - 1].apex : state.height) - hop.ground, after = hop.apex - hop.ground;
    if (!Number.isFinite(after)) return;
    const dot = element("circle", { class: "dot", cx: x(before), cy: y(after), r: 4.5 });
    dot.append(element("title", {}, `hop ${n}: ${short(before)} m to ${short(after)} m`));
    id("map").append(dot);
  });
}

// The hopper at a time; it moves along its ground so that each hop has its own place.
function drawScene() {
  const svg = id("scene"), wide = Math.max(320, svg.clientWidth || 800), tall = narrow.matches ? 220 : 300;
  svg.setAttribute("viewBox", `0 0 ${wide} ${tall}`);
  if (!run.duration) return svg.replaceChildren();
  const now = sample(state.time, state.time, 1)[0], heights = view("terrain", state.hops);
  const left = now.hop ? run.hops[now.hop - 1].touchdown_time + run.hops[now.hop - 1].duration : 0;
  const meets = run.hops[now.hop]?.touchdown_time ?? run.duration;
  const place = now.hop - (state.time < meets ? (meets - state.time) / (meets - left || 1) : 0);
  const scale = tall / (Math.max(state.height, state.h_des, ...run.hops.map((hop) => hop.apex || 0)) +
    state.parameters.L0 + 0.35), width = 150;
  const y = (b) => tall - 34 - b * scale, x = (n) => wide / 2 + (n - place) * width, middle = wide / 2;
  const foot = y(now.foot), plate = y(now.x2 - now.x1 - 0.12), body = y(now.x2);
  const coils = Array.from({ length: 15 }, (_, n) =>
    `${n ? "L" : "M"}${middle + (n === 0 || n === 14 ? 0 : n % 2 ? 12 : -12)} ${foot + ((plate - foot) * n) / 14}`);
  svg.replaceChildren(
    ...[heights[0], ...heights, heights.at(-1)].map((height, n) => element("rect", { class: "ground",
      x: x(n - 1) - width / 2 - (n ? 0 : wide), y: y(height), width: width + (n % (state.hops + 1) ? 0 : wide),
      height: tall })),
    element("rect", { class: "foot", x: middle - 20, y: foot - 6, width: 40, height: 6, rx: 3 }),
    element("path", { class: "spring", d: coils.join("") }),
    element("rect", { class: "plate", x: middle - 20, y: plate - 5, width: 40, height: 5 }),
    element("path", { class: "spring", d: `M${middle - 14} ${plate}V${body}M${middle + 14} ${plate}V${body}` }),
    element("rect", { class: "body", x: middle - 34, y: body - 26, width: 68, height: 26, rx: 4 }),
    element("text", { x: 8, y: 16 }, `t = ${now.t.toFixed(3)} s, u = ${short(now.u, 3)} A`),
  );
  for (const { line, x: at, from, to, top, bottom } of cursors)
    line.setAttribute("d", state.time >= from && state.time <= to ? `M${at(state.time)} ${top}V${bottom}` : "");
}

// ---- tables ----

function table(name, heads, body) {
  const cell = (tag, text, attributes = {}) => make(tag, { textContent: text, ...attributes });
  const row = (cells) => {
    const made = document.createElement("tr");
    made.append(...cells);
    return made;
  };
  id(name).tHead.replaceChildren(row(heads.map((head) => cell("th", head, { scope: "col" }))));
  id(name).tBodies[0].replaceChildren(...body.map((values) => row(values.map((value, n) => {
    const made = cell("td", typeof value === "number" ? short(value) : value);
    made.dataset.heading = heads[n];
    if (typeof value === "number") made.dataset.value = value;
    return made;
  }))));
}

function drawTables() {
  table("hops-table", ["hop", "ground [m]", "touchdown [s]", "v2 [m/s]", "u [A]", "command", "ending", "stance [s]",
    "apex [m]", "AED [J]", "events"], run.hops.map((hop, n) => [n, hop.ground, hop.touchdown_time, hop.v2, hop.u,
    word("COMMANDS", hop.command).text || "constant", word("ENDINGS", hop.ending).text, hop.duration, hop.apex, hop.aed,
    hop.events]));
}

let shown = -1;

function drawHop() {
  const hop = hopAt(state.time);
  if (hop === shown) return false;
  shown = hop;
  const begin = run.hops[hop]?.touchdown_time, end = begin + run.hops[hop]?.duration;
  table("events-table", ["time [s]", "event", "actuator", "body"], run.events
    .filter(({ time, side_2 }) => side_2 !== 2 && time >= begin && time <= end)
    .map(({ time, kind, side_1, side_2 }) => [time - begin, eventName(kind),
      ["retracts", "held", "extends"][side_1 + 1], ["slips down", "held", "slips up"][side_2 + 1]]));
  [...id("hops-table").tBodies[0].rows].forEach((row, n) => row.classList.toggle("here", n === hop));
  return true;
}

// ---- controls ----

function slider(box) {
  const { name, label, min, max, step, meaning } = box.dataset;
  const range = make("input", { type: "range", id: `${name}-range` });
  const text = make("input", { type: "text", inputMode: "decimal", id: name });
  const title = make("label", { htmlFor: name, textContent: label, title: meaning ?? "" });
  range.setAttribute("aria-label", `${label}, slider`);
  Object.assign(range, { min: min ?? 0, max: max ?? 1, step: step ?? "any" });
  box.append(title, range, text);
  const owner = name in START || name === "time" ? state : state.parameters;
  const change = (value) => {
    text.setAttribute("aria-invalid", Number.isNaN(value));
    if (Number.isNaN(value)) return;
    (owner === state ? state : state.parameters)[name] = value;
    box.show();
    if (name === "time") moved();
    else changed();
  };
  range.addEventListener("input", () => change(Number(Number(range.value).toPrecision(6))));
  text.addEventListener("change", () => change(number(text.value)));
  box.show = () => {
    const value = (owner === state ? state : state.parameters)[name];
    range.value = value;
    text.value = name === "time" ? value.toFixed(4) : short(value, 17);
    text.setAttribute("aria-invalid", false);
  };
}

function showControls() {
  const u = document.querySelector("[data-name=u] input"), limit = state.parameters.u_max;
  Object.assign(u, { min: Number.isFinite(limit) ? -limit : -10, max: Number.isFinite(limit) ? limit : 10 });
  document.querySelector("[data-name=time] input").max = run.duration;
  for (const name of CHOICES) id(name).value = state[name];
  for (const name of ["h_des", "wrong"])
    document.querySelector(`[data-name=${name}]`).hidden = state.mode !== "controller";
  document.querySelector("[data-name=u]").hidden = state.mode === "controller";
  document.querySelector("[data-name=size]").hidden = state.terrain === "flat";
  document.querySelector("[data-name=seed]").hidden = state.terrain !== "rough";
  for (const { name } of facts.fields) {
    const range = id(`${name}-range`), value = preset()[name];
    range.disabled = !(Number.isFinite(value) && value !== 0);
    const ends = [2.5 * value, value / 4];
    if (!range.disabled) Object.assign(range, { min: Math.min(...ends), max: Math.max(...ends) });
    range.style.visibility = range.disabled ? "hidden" : "";
  }
  document.querySelectorAll(".slider").forEach((box) => box.show());
}

function redraw() {
  shown = -1;
  drawTables();
  drawHop();
  drawPlots();
  drawMap();
  drawScene();
}

let waiting = false;
function changed() { // at most once per picture on the screen
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    solve();
    writeUrl();
    showControls();
    redraw();
  });
}

function moved() {
  if (drawHop() && state.window === "hop") drawPlots();
  drawScene();
}

let playing = false, last = 0;
function tick(now) {
  if (!playing) return;
  state.time += (state.speed * (now - last)) / 1000;
  if (state.time > run.duration) state.time = startOfPlayback();
  last = now;
  document.querySelector("[data-name=time]").show();
  moved();
  requestAnimationFrame(tick);
}

function play(on) {
  playing = on;
  id("play").textContent = on ? "Pause" : "Play";
  id("play").setAttribute("aria-pressed", on);
  last = performance.now();
  if (on) requestAnimationFrame(tick);
}

function begin() {
  const robots = Object.entries(facts.robots);
  id("robot").append(...robots.map(([name, { description }]) => new Option(`${name}: ${description}`, name)));
  id("parameters").append(...facts.fields.map(({ name, unit, meaning }) => {
    const box = make("div", { className: "slider" });
    Object.assign(box.dataset, { name, label: `${name} [${unit}]: ${meaning}` });
    return box;
  }));
  const fold = () => { id("drawer").open = id("details").open = !narrow.matches; };
  fold();
  narrow.addEventListener("change", fold);
  id("skip").addEventListener("click", (event) => { // the address holds what is simulated
    event.preventDefault();
    id("drawer").open = true;
    id("mode").focus();
  });
  readUrl();
  document.querySelectorAll(".slider").forEach(slider);
  for (const name of CHOICES.slice(1))
    id(name).addEventListener("change", () => {
      state[name] = id(name).value;
      if (name === "start") state.time = NaN;
      changed();
    });
  id("robot").addEventListener("change", () => {
    state.robot = id("robot").value;
    state.parameters = { ...preset() };
    changed();
  });
  id("play").addEventListener("click", () => play(!playing));
  id("controls").addEventListener("submit", (event) => event.preventDefault());
  id("load").addEventListener("change", async () => {
    const [file] = id("load").files;
    if (!file) return;
    try {
      state.parameters = readRobot(await file.arrayBuffer(), facts);
      changed();
    } catch (error) {
      id("status").textContent = `${file.name}, ${error.message}`;
      id("status").classList.add("error");
    }
    id("load").value = "";
  });
  id("save").addEventListener("click", () => {
    const link = make("a", { download: "mine.toml",
      href: URL.createObjectURL(new Blob([writeToml()], { type: "text/plain" })) });
    link.click();
    URL.revokeObjectURL(link.href);
  });
  addEventListener("hashchange", () => { readUrl(); changed(); });
  addEventListener("resize", changed);
  id("digests").tBodies[0].replaceChildren(...["f32", "f64"].map((precision) => {
    const here = (c[`play_digest_${precision}`]() >>> 0).toString(16).padStart(8, "0");
    const native = facts.digests[precision];
    const row = document.createElement("tr");
    row.append(...[precision, here, native, here === native ? "yes" : "no"].map((text) =>
      make("td", { textContent: text })));
    return row;
  }));
  solve();
  showControls();
  redraw();
  document.documentElement.dataset.ready = "yes";
  play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
}

begin();
