// SPDX-License-Identifier: MIT
// Charts: uPlot with the page's colours, one axis of time for all charts of a group, a readout at the pointer, the
// finger and the keys. A chart takes the place of the picture that came with the page; on paper the picture is back.
"use strict";

const HEIGHT = 230; // px, of a plot with its axes
const ROOM = 0.06; // share of the values' range above and below them

const data = JSON.parse(document.getElementById("data").textContent);

// a colour as it is now, light or dark, for what knows no names: a canvas
const inks = new Map();
const probe = document.body.appendChild(Object.assign(document.createElement("span"), { hidden: true }));
addEventListener("scheme", () => inks.clear());

function ink(colour) {
  if (!inks.has(colour)) {
    probe.style.color = colour;
    inks.set(colour, getComputedStyle(probe).color);
  }
  return inks.get(colour);
}

const css = (name) => ink(`var(${name})`);

// a colour of the page, mostly let through
const faint = (name, percent) => ink(`color-mix(in srgb, var(${name}) ${percent}%, transparent)`);

// base64 of single-precision numbers; NaN becomes a gap
function unpack(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return Array.from(new Float32Array(bytes.buffer), (value) => (Number.isNaN(value) ? null : value));
}

function short(value) {
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(2) : value.toPrecision(4);
  return text.replaceAll("-", "−");
}

function superscript(exponent) {
  return String(exponent).replace("-", "⁻").replace(/\d/g, (digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]);
}

// powers of ten between two values, not too many
function decades(u, axis, low, high) {
  const [first, last] = [Math.ceil(Math.log10(low)), Math.floor(Math.log10(high))];
  const every = Math.ceil((last - first + 1) / 6);
  const exponents = Array.from({ length: last - first + 1 }, (_, i) => first + i);
  return exponents.filter((exponent) => exponent % every === 0).map((exponent) => 10 ** exponent);
}

function powers(u, splits) {
  return splits.map((value) => `10${superscript(Math.round(Math.log10(value)))}`);
}

function axis(label, size, space) {
  const font = `12px ${getComputedStyle(document.body).fontFamily}`;
  const line = { stroke: css("--rule"), width: 1 };
  return { label, size, space, font, labelFont: font, labelSize: label ? 18 : 0, labelGap: 0, stroke: css("--quiet"),
           grid: line, ticks: { ...line, size: 4 } };
}

function logarithmicRange(low, high) {
  return low > 0 ? [10 ** Math.floor(Math.log10(low)), 10 ** Math.ceil(Math.log10(high))] : [1e-12, 1];
}

function linearRange(low, high) {
  const room = (high - low) * ROOM || 1;
  return low === null ? [0, 1] : [low - room, high + room];
}

// values of an axis, short
function tidy(value) {
  const size = Math.abs(value);
  const [digits, exponent] = size >= 1e4 || (size > 0 && size < 1e-3) ? value.toExponential(2).split("e") : [value.toPrecision(3)];
  return `${Number(digits)}${exponent ? `·10${superscript(Number(exponent))}` : ""}`.replace(/^-/, "−");
}

// lines: [{label, values, colour, width, dash, quiet, fill, fillTo}]; a quiet line is not read out
// group: charts that share a pointer; zoomed(from, to): the reader has changed the time drawn
// steps: each value holds to the next time, as the largest of that span; name: of the axis; reach(u, low, high): the least and largest value that the axis is to show; bands: uPlot's
function makeChart(figure, times, lines, { group, zoomed, logarithmic = false, steps = false, name = "", reach = (u, low, high) => [low, high], bands = [] }) {
  const host = figure.querySelector(".plot");
  const readout = figure.querySelector(".readout");
  const round = logarithmic ? logarithmicRange : linearRange;
  const chart = new uPlot({
    width: host.clientWidth,
    height: host.clientHeight || HEIGHT,
    legend: { show: false },
    cursor: { sync: { key: group }, y: false, points: { size: 5, show: !steps }, drag: { x: true, y: false, uni: 10 } },
    scales: { x: { time: false, range: (u, from, to) => [from, to] }, y: { distr: logarithmic ? 3 : 1, range: (u, low, high) => round(...reach(u, low, high)) } },
    axes: [axis("t (s)", 26, 60),
           { ...axis(name, 60, 34),
             ...(logarithmic ? { splits: decades, values: powers, filter: (u, splits) => splits } : { values: (u, splits) => splits.map(tidy) }) }],
    series: [{}, ...lines.map(({ label, colour, width = 1.75, dash = [], fill, fillTo }) =>
      ({ label, stroke: colour, width, dash, fill, fillTo, points: { show: false },
         ...(steps ? { paths: uPlot.paths.stepped({ align: 1 }) } : { pxAlign: 0 }) }))], // between pixels, or it has stairs
    bands,
    hooks: {
      setCursor: [(u) => {
        readout.textContent = readoutText(u, lines, steps);
        tellReader(host, u, readout.textContent);
      }],
      setSelect: [(u) => {
        if (u.select.width > 0) zoomed(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x"));
      }],
    },
  }, [times, ...lines.map(({ values }) => values)], host);
  byHand(chart, host, zoomed, steps);
  return chart;
}

// the time that is pointed at: of a point, or between the two ends of a step; null where there is none
function timeAt(u, steps = false) {
  const { idx, left } = u.cursor;
  if (idx === null || idx === undefined) return null;
  return steps ? u.posToVal(left, "x") : u.data[0][idx];
}

// the time and the values there; one value where all curves agree
function readoutText(u, lines, steps) {
  const t = timeAt(u, steps);
  if (t === null) return "";
  const at = steps ? Math.max(0, u.data[0].findLastIndex((from, i) => from <= t && i < u.data[0].length - 1)) : u.cursor.idx;
  const shown = lines.map((line, i) => ({ ...line, value: u.data[i + 1][at], on: u.series[i + 1].show }))
    .filter(({ on, quiet, value }) => on && !quiet && value !== null && value !== undefined);
  if (shown.length === 0) return "";
  const texts = shown.map(({ value }) => short(value));
  const values = new Set(texts).size === 1 ? texts[0] : shown.map(({ label }, i) => `${label} ${texts[i]}`).join(", ");
  const from = u.data[0][at].toFixed(2);
  return steps ? `t = ${from} to ${u.data[0][at + 1].toFixed(2)} s, at most: ${values}` : `t = ${from} s: ${values}`;
}

// ---- Fingers and keys ----

const strides = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 }; // hundredths of the time drawn
const zoomsBy = { "+": 0.5, "=": 0.5, "-": 2 };

// a chart as a slider over time: what it says is the readout
function tellReader(host, u, text) {
  host.setAttribute("aria-valuenow", timeAt(u) ?? u.scales.x.min);
  host.setAttribute("aria-valuetext", text || "no time chosen");
}

function byHand(chart, host, zoomed, steps) {
  const [first, last] = [chart.data[0][0], chart.data[0].at(-1)];
  const within = (from, to) => {
    const length = Math.min(to - from, last - first);
    const start = Math.min(Math.max(from, first), last - length);
    if (length > (last - first) / 1000) zoomed(start, start + length);
  };
  host.setAttribute("role", "slider");
  host.setAttribute("aria-label", `${host.querySelector(".still")?.getAttribute("aria-label") ?? "chart"}; left and right read it, up and down go to other charts, plus and minus zoom, 0 shows all`);
  host.setAttribute("aria-valuemin", first);
  host.setAttribute("aria-valuemax", last);
  tellReader(host, chart, "");
  host.onkeydown = (event) => {
    const { min, max } = chart.scales.x;
    const t = timeAt(chart, steps) ?? (min + max) / 2;
    if (event.key in strides) pointAt(chart, Math.min(max, Math.max(min, t + strides[event.key] * (max - min) / 100)));
    else if (event.key === "Home" || event.key === "End") pointAt(chart, event.key === "Home" ? min : max);
    else if (event.key in zoomsBy) within(t - (t - min) * zoomsBy[event.key], t + (max - t) * zoomsBy[event.key]);
    else if (event.key === "0" || event.key === "Escape") zoomed(first, last);
    else return;
    event.preventDefault();
  };
  const fingers = new Map(); // by pointer: {x, t}, where it is and the time it holds
  const place = (event) => event.clientX - chart.over.getBoundingClientRect().left;
  chart.over.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "touch") fingers.set(event.pointerId, { x: place(event), t: chart.posToVal(place(event), "x") });
  });
  chart.over.addEventListener("pointermove", (event) => {
    if (!fingers.has(event.pointerId)) return;
    fingers.get(event.pointerId).x = place(event);
    const [one, other] = fingers.values();
    if (other === undefined) {
      pointAt(chart, chart.posToVal(one.x, "x"));
    } else if (Math.abs(other.x - one.x) > 10) {
      const perPixel = (other.t - one.t) / (other.x - one.x);
      const from = one.t - one.x * perPixel;
      if (perPixel > 0) within(from, from + chart.over.clientWidth * perPixel);
    }
  });
  for (const kind of ["pointerup", "pointercancel"]) chart.over.addEventListener(kind, ({ pointerId }) => fingers.delete(pointerId));
  chart.over.addEventListener("dblclick", () => zoomed(first, last));
}

function pointAt(chart, t) {
  chart.setCursor({ left: chart.valToPos(t, "x"), top: 10 });
}

// ---- All charts of a part ----

// the charts of a part are one stop among the tabs
function chartsInOneStop(figures) {
  oneStop(figures.map((figure) => figure.querySelector(".plot")), { ArrowDown: 1, ArrowUp: -1 });
}

// draws each chart when it comes near the screen or is needed
function whenSeen(part, figures, draw, charts) {
  const seen = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      if (!isIntersecting) continue;
      seen.unobserve(target);
      if (!charts.has(target)) draw(target);
    }
  }, { rootMargin: "300px" });
  figures.forEach((figure) => seen.observe(figure));
  whenNeeded(part, figures, draw, charts);
}

// draws each chart when it is gone to, again in other colours, and as wide as there is room
function whenNeeded(part, figures, draw, charts) {
  const drawn = () => figures.filter((figure) => charts.has(figure)).map((figure) => [figure, charts.get(figure)]);
  chartsInOneStop(figures);
  part.addEventListener("focusin", ({ target }) => {
    const figure = target.closest(".chart");
    if (figures.includes(figure) && !charts.has(figure)) draw(figure);
  });
  new ResizeObserver(() => {
    for (const [figure, chart] of drawn()) {
      const host = figure.querySelector(".plot");
      chart.setSize({ width: host.clientWidth, height: host.clientHeight || HEIGHT });
    }
  }).observe(part);
  addEventListener("scheme", () => {
    for (const [figure, chart] of drawn()) {
      chart.destroy();
      draw(figure);
    }
  });
}
