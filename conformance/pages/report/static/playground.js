// SPDX-License-Identifier: MIT
// The playground: the closed loop under the sliders' constants, integrated and drawn as they move.
"use strict";

{
const POINTS = 1000; // of a run that is drawn
const STRIDE = 2; // steps in one while a slider is dragged: no eye would see the difference
const KEPT = 2; // runs that stay
const TRANSIENT = 0.2; // share of the horizon, in which rows stand closer
const LEFT = 0.97; // share of a run that fails, by which the axes are chosen
const LITTLE = 0.01; // share of V(0)
const NEAR = 0.01; // |z1| from which on the output has settled

const given = JSON.parse(document.getElementById("playground-data").textContent);
const playground = document.getElementById("playground");
const first = document.getElementById("first"); // with some of the charts and sliders
const form = playground.querySelector("form");
const forms = [form, first.querySelector("form")];
const sliders = forms.flatMap((one) => all("input[type=range]", one));
const camel = (name) => name.replace(/_(.)/g, (_, letter) => letter.toUpperCase());

// ---- What is set ----

const firstStart = Object.keys(given.starts)[0];
let setting = settingOf({});
let period = null; // of time, where the reader has chosen one

function settingOf({ start = firstStart, mistake = "", constants = {} }) {
  const { reference, constants: own } = given.starts[start];
  return { start, mistake: `${reference}/${mistake}` in programs ? mistake : "", constants: { ...own, ...constants } };
}

// whether anything but the first start is set
const isSet = () => setting.start !== firstStart || setting.mistake !== "" || changed(setting).length > 0;

// the constants that are not those of the start
function changed({ start, constants }) {
  return Object.entries(constants).filter(([name, value]) => value !== given.starts[start].constants[name]);
}

function programOf({ start, mistake, constants }) {
  const named = Object.entries(constants).map(([name, value]) => [camel(name), value]);
  return programs[`${given.starts[start].reference}/${mistake}`]({ ...Object.fromEntries(named), finalTime: given.horizon });
}

function labelOf(of) {
  const title = of.mistake && form.querySelector(`[value="${of.mistake}"]`).dataset.title;
  const constants = changed(of).map(([name, value]) => `${spoken(name)} = ${tidy(value)}`);
  return [given.starts[of.start].title, ...constants, title].filter(Boolean).join(", ");
}

const spoken = (name) => letters(name.replace(/_true$/, "")).replace(/_start$/, "(0)");
const letters = (name) => name.replace(/(\w+)_hat/, "$1\u0302").replace("theta", "θ").replace("gamma", "γ").replace("omega", "ω")
  .replace("amplitude", "A").replace(/\d/g, (digit) => "₀₁₂₃₄₅₆₇₈₉"[digit]);

// ---- Runs ----

// a run; one that fails ends early, and of longer steps is no run, since these may be why
function runOf(of, stride = 1) {
  const { simulate, signals, h } = programOf(of);
  const trajectory = simulate(stride * h);
  const end = trajectory.at(-1).t;
  const fails = end < given.horizon * (1 - 1e-9);
  if (fails && stride > 1) return runOf(of);
  return { of, label: labelOf(of), signals, trajectory, stride, end, fails, thinned: new Map() };
}

// its columns by signal, of every so many rows, and of more of them where the transient is; rows are those of single steps
function columnsOf(run, every) {
  if (!run.thinned.has(every)) run.thinned.set(every, thin(run, every));
  return run.thinned.get(every);
}

function thin({ of, signals, trajectory, stride }, every) {
  const transient = TRANSIENT * given.horizon / trajectory[1].t;
  const closer = Math.min(every, 2 * STRIDE * Math.max(1, Math.round(every / 12)));
  const rows = [];
  for (let row = 0; row < trajectory.length; row += (row < transient ? closer : every) / stride) rows.push(row);
  const rest = trajectory.length - 1 - rows.at(-1);
  if (rest > 0 && rest % 2 === 0) rows.push(trajectory.length - 1); // the end too, with a row in the middle before it
  const point = (row) => ({ row, sample: trajectory[row], t: trajectory[row].t, ...signals(trajectory[row]) });
  const at = rows.map(point);
  const between = rows.slice(1).map((row, i) => signals(trajectory[(row + rows[i]) / 2]).V_dot);
  const finite = (value) => (Number.isFinite(value) ? value : null);
  const names = ["t", "r", "u", "V", "ofParameters", "V_dot", ...given.states, ...given.estimates, ...given.states.map((_, i) => `z${i + 1}`)];
  const columns = Object.fromEntries(names.map((name) => [name, at.map((found) => finite(found[name]))]));
  columns.sum = simpson(at, between).map((lost, i) => finite(lost + at[i].V));
  for (const name of given.truth) columns[name] = at.map(() => of.constants[name]);
  if (given.truth.length) columns.tilde = columns[given.estimates[0]].map((value) => value - of.constants[given.truth[0]]);
  return { ...columns, at };
}

// so many rows that there are about POINTS of them, and a row in the middle between two
function spacing({ trajectory, stride }) {
  return 2 * STRIDE * Math.max(1, Math.ceil((trajectory.length - 1) * stride / POINTS / 2 / STRIDE));
}

const drawnRun = (run) => ({ ...run, every: spacing(run), ...columnsOf(run, spacing(run)) });

// what has been dissipated up to each row, by Simpson's rule
function simpson(at, between) {
  const sums = [0];
  between.forEach((middle, i) => sums.push(sums[i] - (at[i + 1].t - at[i].t) / 6 * (at[i].V_dot + 4 * middle + at[i + 1].V_dot)));
  return sums;
}

// V of the integration's own error, by comparison with steps of twice the length: below it V says nothing
function floorOf({ of, trajectory, at }) {
  const { simulate, signals } = programOf(of);
  const coarse = simulate(2 * trajectory[1].t);
  const n = given.states.length;
  return at.map(({ t, row, sample: { state }, ...fine }) => {
    const other = coarse[row / 2];
    if (other === undefined) return null;
    const off = state.map((value, j) => Math.abs(value - other.state[j]) / 15 + Number.EPSILON * Math.abs(value));
    const near = signals(other);
    const ofErrors = given.states.reduce((sum, _, j) => sum + (Math.abs(fine[`z${j + 1}`] - near[`z${j + 1}`]) / 15 + off[0]) ** 2 / 2, 0);
    const tilde = given.truth.map((name, j) => of.constants[name] + off[n + j]);
    const { ofParameters } = signals({ t, state: [...state.slice(0, n), ...tilde] });
    return Math.min(ofErrors + ofParameters, fine.V);
  });
}

// the figures of a run, of which the questions and the table speak
function figuresOf(found) {
  const run = columnsOf(found, 2);
  const { end, fails } = found;
  const largest = (name) => run[name].reduce((most, value) => Math.max(most, Math.abs(value ?? 0)), 0);
  const last = run.z1.findLastIndex((value) => Math.abs(value) > NEAR);
  const grows = run.V.findIndex((value, i) => i > 0 && value > run.V[i - 1] * (1 + 1e-9) + 1e-15);
  return {
    end, fails, V_end: run.V.at(-1), max_u: largest("u"),
    settled: last < run.t.length - 1 && !fails ? run.t[last + 1] : null,
    estimate: given.estimates.length ? run[given.estimates[0]].at(-1) : null,
    max_estimate: given.estimates.length ? largest(given.estimates[0]) : null,
    grows: grows > 0 ? run.t[grows - 1] : null,
  };
}

let now = null; // with its columns
let before = null;
let kept = [];

// what became of a run: text, and symbols as the page sets them; the right program fails by its step alone, says the theorem
function tell({ of, end, fails, z1, sum, trajectory, stride, ...run }) {
  const why = of.mistake ? ["the theorem’s ", typeset("V"), "′ is not this loop’s"]
    : [`the step of RK4, ${short(trajectory[1].t / stride)} s, is too long for these constants`];
  const balanced = Math.abs(sum.at(-1) - sum[0]) < 1e-3 * sum[0];
  const budget = [typeset("V"), ` and what is dissipated ${balanced ? "" : "do not "}add up to `, typeset("V"), "(0)", ...balanced ? [] : [": ", ...why], "."];
  if (fails) return [`The integration fails after ${end.toFixed(2)} s: the state is no longer finite. The curves go as far as it does. `, ...budget];
  const estimates = given.estimates.flatMap((name, i) =>
    [", ", typeset(name), ` = ${short(run[name].at(-1))}, `, typeset(given.truth[i].replace("_true", "")), ` = ${short(of.constants[given.truth[i]])}`]);
  return [`At ${end.toFixed(0)} s: `, typeset("z1"), ` = ${short(z1.at(-1))}`, ...estimates, ". ", ...budget];
}

// a symbol, from the list of all of them
const typeset = (name) => document.querySelector(`#symbols [data-means="${name}"] .katex`).cloneNode(true);

// ---- Charts ----

const panels = new Map(); // figure: chart, of those over time
const planes = all(".plane", playground);
const firstCharts = all(".chart", first); // pictures until something is set
const kindOf = (figure) => given.drawings[figure.dataset.drawing];
const colours = ["--accent", "--second", "--third", "--quiet"];
const keptColours = ["--kept-0", "--kept-1"];

// the other runs behind this one, at its times: [run, colour, dash]
function others() {
  const like = (run) => run && { ...run, ...columnsOf(run, now.every) };
  return [[like(before), "--ghost", []], ...keptColours.map((colour, i) => [like(kept[i]), colour, [6, 3]])];
}

// the times of the longest run, and values at all of them
const longest = () => [now, before, ...kept].filter(Boolean).map((run) => columnsOf(run, now.every).t).reduce((most, t) => (t.length > most.length ? t : most));
const padded = (values = []) => [...values, ...Array(longest().length - values.length).fill(null)];

// the lines of a chart, behind to front: what stands beside, other runs, this run
function linesOfDrawing({ kind, signals, beside }) {
  const above = (values) => (kind === "logarithm" ? values?.map((value) => (value > 0 ? value : null)) : values);
  const lines = beside.map((name) => ({ label: name, values: padded(now[name]), colour: css("--quiet"), dash: [4, 4], width: 1.25, quiet: true }));
  if (kind === "logarithm") {
    lines.push({ label: "floor", values: padded(above(now.floor)), colour: css("--quiet"), width: 0.75, quiet: true, fill: faint("--quiet", 25), fillTo: (u) => u.scales.y.min });
  }
  for (const [run, colour, dash] of others()) {
    for (const name of signals) lines.push({ label: `${name} of another run`, values: padded(above(run?.[name])), colour: css(colour), width: 1.25, dash, quiet: true });
  }
  if (kind === "budget") {
    lines.push({ label: "V(0)", values: padded(now.sum.map(() => now.sum[0])), colour: css("--quiet"), dash: [4, 4], width: 1, quiet: true });
    lines.push({ label: "with what is dissipated", values: padded(now.sum), colour: css("--quiet"), width: 0.75 });
    lines.push({ label: "V", values: padded(now.V), colour: css("--accent") });
    lines.push({ label: "of it θ̃", values: padded(now.ofParameters), colour: faint("--second", 75), width: 1, fill: css("--of-parameters") });
    return lines;
  }
  signals.forEach((name, i) => lines.push({ label: letters(name), values: padded(above(now[name])), colour: css(colours[i % colours.length]),
    ...(kind === "rate" ? { fill: faint("--quiet", 22), fillTo: 0, label: "V′" } : {}) }));
  return lines;
}

function bandsOf({ kind, beside }) {
  if (kind !== "budget") return [];
  const first = 1 + beside.length + others().length + 1; // of the sum; V and the share of the estimates follow
  return [{ series: [first, first + 1], fill: css("--lost") }, { series: [first + 1, first + 2], fill: css("--of-errors") }];
}

// least and largest value; of runs that fail, before their last moments
function reach(u, low, high) {
  if (!now.fails) return [low, high];
  const until = Math.max(2, now.t.findIndex((t) => t > LEFT * now.end));
  const values = u.data.slice(1).flatMap((column, i) => (u.series[i + 1].label === "floor" ? [] : column.slice(0, until))).filter((value) => value !== null && value !== undefined);
  return [Math.min(...values), Math.max(...values)];
}

// the time drawn: the reader's, or all; of the shares of V until there is little left
function periodNow(kind) {
  const whole = now.fails ? Math.min(given.horizon, 1.25 * now.end) : given.horizon;
  const little = now.V.findLastIndex((value) => value > LITTLE * now.V[0]) + 1;
  const worth = little < now.V.length ? Math.ceil(2 * now.t[little]) : given.horizon;
  return period ?? [0, kind === "budget" ? Math.min(whole, worth) : whole];
}

function drawPanel(figure) {
  if (now === null) update();
  const drawing = kindOf(figure);
  const chart = makeChart(figure, longest(), linesOfDrawing(drawing), {
    group: "playground", zoomed: zoomPlayground, logarithmic: drawing.kind === "logarithm", reach, bands: bandsOf(drawing),
  });
  panels.set(figure, chart);
  refresh(figure, chart);
}

function refresh(figure, chart) {
  const [min, max] = periodNow(kindOf(figure).kind);
  chart.batch(() => {
    chart.setData([longest(), ...linesOfDrawing(kindOf(figure)).map(({ values }) => values)], false);
    chart.setScale("x", { min, max });
  });
}

function zoomPlayground(from, to) {
  period = from <= 0 && to >= Math.min(given.horizon, longest().at(-1)) ? null : [from, to];
  address.set({ pt: period && period.map((t) => Number(t.toPrecision(4))).join("~") });
  panels.forEach((chart, figure) => refresh(figure, chart));
}

// ---- Planes ----

const svg = (name, attributes) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
};

// round values between two
function roundValues(low, high) {
  const power = 10 ** Math.floor(Math.log10((high - low) / 4));
  const step = [1, 2, 5, 10].map((of) => of * power).find((of) => (high - low) / of <= 5);
  return Array.from({ length: Math.floor(high / step) - Math.ceil(low / step) + 1 }, (_, i) => (Math.ceil(low / step) + i) * step);
}

// one signal against another, and the level set V = V(0), which no run of the right program leaves
function drawPlane(figure) {
  const { signals: [across, up], axes } = kindOf(figure);
  const plot = figure.querySelector(".plot");
  const [w, h, left, bottom, edge] = [plot.clientWidth, plot.clientHeight, 50, 34, 8];
  const until = now.fails ? LEFT * now.end : given.horizon;
  const shown = (run) => run[across].map((x, i) => [x, run[up][i]]).filter(([x, y], i) => x !== null && y !== null && (run.t[i] <= until || !now.fails && !run.fails));
  const curve = shown(now);
  const level = levelOf(up);
  const far = (i) => 1.12 * Math.max(level[i], ...curve.map((point) => Math.abs(point[i])));
  const [wide, high] = [far(0), far(1)];
  const place = ([x, y]) => `${(left + (w - left - edge) * (x + wide) / (2 * wide)).toFixed(1)} ${(edge + (h - bottom - edge) * (high - y) / (2 * high)).toFixed(1)}`;
  const path = (points, style) => svg("path", { class: "curve", style, d: points.length ? `M${points.map(place).join("L")}` : "" });
  const parts = [];
  for (const x of roundValues(-wide, wide)) {
    const [at] = place([x, 0]).split(" ");
    parts.push(svg("path", { class: "rule", d: `M${at} ${edge}V${h - bottom}` }));
    parts.push(Object.assign(svg("text", { x: at, y: h - bottom + 14, "text-anchor": "middle" }), { textContent: tidy(x) }));
  }
  for (const y of roundValues(-high, high)) {
    const at = Number(place([0, y]).split(" ")[1]);
    parts.push(svg("path", { class: "rule", d: `M${left} ${at}H${w - edge}` }));
    parts.push(Object.assign(svg("text", { x: left - 6, y: at + 4, "text-anchor": "end" }), { textContent: tidy(y) }));
  }
  const circle = Array.from({ length: 121 }, (_, i) => [level[0] * Math.cos(i * Math.PI / 60), level[1] * Math.sin(i * Math.PI / 60)]);
  parts.push(path(circle, "stroke:var(--quiet);stroke-width:1.25;stroke-dasharray:4 4"));
  for (const [run, colour, dash] of others()) {
    if (run) parts.push(path(shown(run), `stroke:var(${colour});stroke-width:1.25;stroke-dasharray:${dash.join(" ")}`));
  }
  parts.push(path(curve, "stroke:var(--accent);stroke-width:1.75"));
  const [cx, cy] = place(curve[0]).split(" ");
  parts.push(svg("circle", { cx, cy, r: 3.5, style: "fill:var(--accent)" }));
  parts.push(Object.assign(svg("text", { class: "name", x: w - edge, y: h - 4 }), { textContent: axes[0] }));
  const live = svg("svg", { class: "live", viewBox: `0 0 ${w} ${h}`, role: "img", "aria-label": plot.dataset.words });
  live.append(...parts);
  plot.querySelector(".live")?.remove();
  plot.append(live);
}

// half axes of the level set V = V(0) in the plane of z1 and another error
function levelOf(up) {
  const V = now.V[0];
  if (up !== "tilde") return [Math.sqrt(2 * V), Math.sqrt(2 * V)];
  return [Math.sqrt(2 * V), Math.sqrt(V / (now.ofParameters[0] / now.tilde[0] ** 2 || 1))];
}

// ---- Changes ----

// a change of the setting: the run before stays as a ghost; while a slider is dragged it is the one before the drag
let dragging = false;
const leave = () => { before = now ?? drawnRun(runOf(setting)); };
function change(to) {
  if (!dragging) leave();
  setting = to;
  update();
}

// first what is measured and drawn, then what is written: the other way round the page would be laid out twice
function update() {
  now = drawnRun(runOf(setting, dragging ? STRIDE : 1));
  if (!dragging) settle();
  const isDue = (figure) => !dragging || onScreen.has(figure);
  const seen = [...panels.keys(), ...planes].filter(isDue);
  if (isSet()) firstCharts.filter((figure) => !panels.has(figure) && isDue(figure)).forEach(drawPanel);
  for (const figure of seen) if (panels.has(figure)) refresh(figure, panels.get(figure));
  for (const figure of seen) if (!panels.has(figure)) drawPlane(figure);
  for (const place of all(".outcome")) place.replaceChildren(...tell(now));
  for (const slider of sliders.filter(({ name }) => !dragging || name === moved)) showSlider(slider);
  if (!dragging) showSetting();
}

// a chart that is not seen waits for the end of a drag; to ask each where it is would lay out the page before it changes
const onScreen = new Set();
const watching = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) onScreen[isIntersecting ? "add" : "delete"](target);
});
for (const figure of all("[data-drawing]")) watching.observe(figure);

function showSetting() {
  for (const part of all(".changed", playground)) {
    part.hidden = part.dataset.changed !== `${given.starts[setting.start].reference}/${setting.mistake}`;
  }
  for (const radio of all("[name=mistake]", form)) {
    radio.checked = radio.value === setting.mistake;
    radio.disabled = !(`${given.starts[setting.start].reference}/${radio.value}` in programs);
  }
  for (const button of forms.flatMap((one) => all(".start", one))) press(button, button.dataset.start === setting.start && changed(setting).length === 0);
}

// what takes longer, and is not asked for within a frame
function settle() {
  now.floor = floorOf(now);
  showRuns();
  const names = Object.keys(setting.constants);
  address.set({
    ...Object.fromEntries(names.map((name) => [name, null])),
    ...Object.fromEntries(changed(setting).map(([name, value]) => [name, Number(value.toPrecision(5))])),
    start: setting.start === firstStart ? null : setting.start,
    mistake: setting.mistake || null,
  });
}

function showSlider(slider) {
  const value = setting.constants[slider.name];
  slider.value = slider.dataset.logarithmic === undefined ? value : Math.log10(value);
  const text = tidy(value);
  slider.setAttribute("aria-valuetext", text);
  slider.parentElement.querySelector("output").textContent = text;
}

function showRuns() {
  const rows = [[now, "--accent", "this run"], [before, "--ghost", "the run before"], ...kept.map((run, i) => [run, keptColours[i], "kept"])];
  playground.querySelector(".runs tbody").replaceChildren(...rows.filter(([run]) => run).map(([run, colour, role]) => {
    const row = document.createElement("tr");
    const { settled, max_u: u, estimate, V_end: V, fails, end } = figuresOf(run);
    const figures = estimate === null ? [u, V] : [u, estimate, V];
    const texts = fails ? [`fails at ${end.toFixed(2)} s`, ...figures.map(() => "–")]
      : [settled === null ? "not yet" : `${settled.toFixed(2)} s`, ...figures.map(short)];
    const head = Object.assign(document.createElement("th"), { scope: "row" });
    const swatch = Object.assign(document.createElement("span"), { className: "swatch" });
    swatch.style.setProperty("--colour", `var(${colour})`);
    head.append(swatch, `${role}: ${run.label}`);
    if (role === "kept") {
      const button = Object.assign(document.createElement("button"), { type: "button", textContent: "Let go", onclick: () => { kept = kept.filter((other) => other !== run); update(); } });
      head.append(" ", button);
    }
    row.append(head, ...texts.map((text) => Object.assign(document.createElement("td"), { textContent: text })));
    return row;
  }));
  playground.querySelector(".keep").disabled = kept.length === KEPT || kept.some(({ label }) => label === now.label);
}

let waiting = false;
let moved = ""; // the constant
function move({ target }) {
  if (target.type === "radio") {
    change(settingOf({ ...setting, mistake: target.value }));
    return;
  }
  const value = target.dataset.logarithmic === undefined ? Number(target.value) : 10 ** Number(target.value);
  if (!dragging) leave();
  dragging = true;
  moved = target.name;
  setting = { ...setting, constants: { ...setting.constants, [target.name]: Number(value.toPrecision(3)) } };
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    update();
  });
}
function letGo({ target }) {
  if (target.type === "radio" || !dragging) return;
  dragging = false;
  requestAnimationFrame(update);
}
for (const one of forms) {
  one.addEventListener("input", move);
  one.addEventListener("change", letGo);
  one.addEventListener("submit", (event) => event.preventDefault());
  for (const button of all(".start", one)) button.addEventListener("click", () => change(settingOf({ start: button.dataset.start })));
}

// an open question sets what it speaks of, with the lesson's run behind
function ask(details) {
  if (!details.open) return;
  dragging = false;
  now = drawnRun(runOf(settingOf({})));
  change(settingOf(given.questions[details.dataset.question]));
}
const questions = all("[data-question]", playground);
for (const details of questions) details.addEventListener("toggle", () => ask(details));
playground.querySelector(".keep").addEventListener("click", () => {
  kept = [...kept, now].slice(-KEPT);
  update();
});
playground.querySelector(".whole").addEventListener("click", () => zoomPlayground(0, given.horizon));

// ---- From the address ----

const asked = Object.fromEntries(Object.keys(setting.constants).map((name) => [name, address.get(name)])
  .filter(([, value]) => value !== null && Number.isFinite(Number(value))).map(([name, value]) => [name, Number(value)]));
setting = settingOf({
  start: given.starts[address.get("start")] ? address.get("start") : firstStart, mistake: address.get("mistake") ?? "", constants: asked,
});
const askedPeriod = (address.get("pt") ?? "").split("~").map(Number);
if (askedPeriod.length === 2 && askedPeriod.every(Number.isFinite) && askedPeriod[0] < askedPeriod[1]) period = askedPeriod;

whenSeen(playground, all(".chart:not(.plane)", playground), drawPanel, panels);
whenNeeded(first, firstCharts, drawPanel, panels);
for (const slider of forms[1].elements) if (slider.name) showSlider(slider);
if (isSet()) update();
questions.forEach(ask); // one that the address leads to is open by now
new ResizeObserver(() => {
  if (now !== null) planes.forEach((figure) => drawPlane(figure));
}).observe(playground);
new IntersectionObserver((entries, observer) => {
  if (entries.some(({ isIntersecting }) => isIntersecting)) {
    observer.disconnect();
    if (now === null) update();
  }
}, { rootMargin: "300px" }).observe(playground);

// ---- For other parts, and for tests ----

globalThis.playground = {
  set: (to) => change(settingOf(to)),
  figures: () => figuresOf(now),
  csv() {
    const { simulate, toCsv } = programOf(setting);
    return toCsv(simulate());
  },
};
}
