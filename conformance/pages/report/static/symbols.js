// SPDX-License-Identifier: MIT
// Linked symbols: pointing at one lights it up wherever it stands, and says what it means. Sections of the lesson, which
// small print and the comments of code cite: pointing at one says what it holds.
"use strict";

const meaning = document.getElementById("meaning");
const meanings = new Map(all("#symbols [data-means]").map((entry) => [entry.dataset.means, entry]));
const cited = (text) => text.match(/\(\d+\)/g) ?? [];
const sections = new Map(all("#sections li").flatMap((entry) => cited(entry.dataset.words).map((number) => [number, entry])));

function light(name) {
  for (const place of all("[data-symbol].lit")) place.classList.remove("lit");
  if (!meanings.has(name)) return;
  for (const place of all("var:not([data-symbol])")) place.dataset.symbol = symbolOf(place); // not before it is needed
  for (const place of all(`[data-symbol="${name}"]`)) place.classList.add("lit");
}

// what is said beside a place: a line for each entry
function tell(entries, at) {
  meaning.hidden = entries.length === 0;
  if (meaning.hidden) return;
  meaning.replaceChildren(...entries.map((entry) => {
    const line = document.createElement("div");
    line.append(...entry.cloneNode(true).childNodes);
    return line;
  }));
  const { left, bottom, top } = at.getBoundingClientRect();
  const { width, height } = meaning.getBoundingClientRect();
  meaning.style.left = `${Math.max(8, Math.min(left, innerWidth - width - 8))}px`;
  meaning.style.top = `${bottom + height + 12 > innerHeight ? top - height - 8 : bottom + 8}px`;
}

// the symbol at the pointer or the focus; at the upright axis of a chart the first of its caption
function symbolAt({ target }) {
  const figure = target.closest?.(".u-axis:last-child")?.closest("figure");
  return figure?.querySelector("figcaption [data-symbol]") ?? target.closest?.(SYMBOLS);
}

// what cites sections, at the pointer, or within the summary or the head of a row that has the focus of the keys
function citationAt({ type, target }) {
  if (type === "pointerover") return target.closest?.("small, .code b");
  return target.matches(":focus-visible") ? target.closest("summary, th")?.querySelector("small") : undefined;
}

function sectionsAt(place) {
  const found = cited(place?.textContent ?? "").map((number) => sections.get(number));
  return [...new Set(found)].filter(Boolean);
}

for (const event of ["pointerover", "focusin"]) {
  document.addEventListener(event, (happened) => {
    const symbol = symbolAt(happened);
    const name = symbol && symbolOf(symbol);
    const citation = symbol ? undefined : citationAt(happened);
    light(name);
    tell(meanings.has(name) ? [meanings.get(name)] : sectionsAt(citation), citation ?? happened.target);
  });
}
document.addEventListener("keydown", (event) => {
  if (!["Escape", "Enter", " "].includes(event.key)) return;
  light(undefined);
  tell([]);
});

oneStop(all("#symbols button"));
