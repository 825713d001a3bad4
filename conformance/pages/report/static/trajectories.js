// SPDX-License-Identifier: MIT
// The curves of the programs, and their errors.
"use strict";

const [grid, spans] = [unpack(data.grid), unpack(data.spans)];
const portButtons = all("[data-port].choice");
const drawn = new Map(); // figure: chart
const linesOn = new Map(); // figure: lines
let period = [0, data.horizon];

// a program's line, wide enough for the exact solution to be seen in it
const band = (key) => ({ width: 5, colour: ink(`color-mix(in srgb, ${key} 75%, transparent)`) });

// the curves of a figure, in drawing order: what stands beside, the programs, the exact solution
function linesOf({ signal, beside, logarithmic }) {
  const ofErrors = beside === "tolerance";
  const ports = portButtons.filter((button) => button.dataset.port in data.ports).map((button) => ({
    port: button.dataset.port,
    label: button.textContent.trim(),
    colour: ink(button.style.getPropertyValue("--colour")),
    key: button.style.getPropertyValue("--colour"),
  }));
  const quiet = { colour: css("--quiet"), dash: [4, 4], width: 1.25, quiet: true };
  const constant = (value) => (ofErrors ? spans : grid).map(() => value);
  const known = (values) => { // the last step goes on to the end
    const found = unpack(values);
    return positive(ofErrors ? [...found, found.at(-1)] : found, logarithmic);
  };
  const lines = [];
  if (beside === "reference") lines.push({ label: "r", values: unpack(data.exact.reference), ...quiet });
  if (beside in data.parameters) lines.push({ label: beside, values: constant(data.parameters[beside]), ...quiet });
  if (ofErrors) {
    const state = signal.replace("error_", "");
    lines.push(...ports.map(({ port, colour }) => ({ ...quiet, label: "tolerance", port, colour,
      values: constant(data.tolerance[port][state] ?? null) })).reverse()); // of those that are the same the first is seen
  }
  lines.push(...ports.map((one) =>
    ({ ...one, ...(ofErrors ? {} : band(one.key)), group: data.on[signal][one.port], values: known(data.ports[one.port][signal]) })));
  if (!ofErrors) lines.push({ label: "exact", values: known(data.exact[signal]), colour: css("--text"), key: "var(--text)", width: 1 });
  return lines;
}

// what a logarithmic axis can show
function positive(values, logarithmic) {
  return logarithmic === undefined ? values : values.map((value) => (value > 0 ? value : null));
}

function draw(figure) {
  const { axis: name, logarithmic, beside } = figure.dataset;
  const lines = linesOf(figure.dataset);
  const steps = beside === "tolerance";
  const chart = makeChart(figure, steps ? spans : grid, lines,
    { group: "trajectories", zoomed: setPeriod, name, logarithmic: logarithmic !== undefined, steps });
  drawn.set(figure, chart);
  linesOn.set(figure, lines);
  showPorts(figure);
  chart.setScale("x", { min: period[0], max: period[1] });
}

// of programs that lie on one another the first is drawn, and the legend says which they are
function showPorts(figure) {
  const [chart, lines] = [drawn.get(figure), linesOn.get(figure)];
  const shown = portButtons.filter(pressed).map((button) => button.dataset.port);
  const on = (line) => line.port === undefined || shown.includes(line.port);
  const programs = lines.filter((line) => line.group !== undefined && on(line));
  const leaders = programs.filter((line, i) => programs.findIndex(({ group }) => group === line.group) === i);
  chart.batch(() => lines.forEach((line, i) =>
    chart.setSeries(i + 1, { show: line.group === undefined ? on(line) : leaders.includes(line) })));
  const named = (line) => programs.filter(({ group }) => group === line.group).map(({ label }) => label);
  figure.querySelector(".keys").replaceChildren(...all(".key.beside", figure),
    ...lines.filter(({ label }) => label === "exact").map(({ label, key }) => keyOf(label, key)),
    ...leaders.map((leader) => keyOf(together(named(leader)), leader.key)));
}

function keyOf(name, colour) {
  const key = Object.assign(document.createElement("span"), { className: "key", textContent: name });
  key.style.setProperty("--colour", colour);
  return key;
}

function together(names) {
  if (names.length === 1) return names[0];
  return names.length > 3 ? `all ${names.length} on one line` : `${names.join(", ")} on one line`;
}

function setPeriod(from, to) {
  if (!(from >= 0 && to <= data.horizon && from < to)) return;
  period = [from, to];
  document.getElementById("from").value = Number(from.toPrecision(4));
  document.getElementById("to").value = Number(to.toPrecision(4));
  address.set({ t: from > 0 || to < data.horizon ? `${Number(from.toPrecision(4))}~${Number(to.toPrecision(4))}` : null });
  for (const chart of drawn.values()) chart.setScale("x", { min: from, max: to });
}

whenSeen(document.getElementById("trajectories"), all("#trajectories .chart"), draw, drawn);
if (address.get("t")) setPeriod(...address.get("t").split("~").map(Number));

for (const button of portButtons) {
  button.addEventListener("click", () => {
    press(button, !pressed(button));
    for (const figure of drawn.keys()) showPorts(figure);
  });
}
for (const id of ["from", "to"]) {
  document.getElementById(id).addEventListener("change", () =>
    setPeriod(document.getElementById("from").valueAsNumber, document.getElementById("to").valueAsNumber));
}
document.getElementById("whole").addEventListener("click", () => setPeriod(0, data.horizon));
