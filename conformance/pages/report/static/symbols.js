// SPDX-License-Identifier: MIT
// Linked symbols: pointing at one lights it up wherever it stands, and says what it means.
"use strict";

const meaning = document.getElementById("meaning");
const meanings = new Map(all("#symbols [data-means]").map((entry) => [entry.dataset.means, entry]));

function light(name, at) {
  for (const place of all("[data-symbol].lit")) place.classList.remove("lit");
  const entry = meanings.get(name);
  meaning.hidden = entry === undefined;
  if (entry === undefined) return;
  for (const place of all("var:not([data-symbol])")) place.dataset.symbol = symbolOf(place); // not before it is needed
  for (const place of all(`[data-symbol="${name}"]`)) place.classList.add("lit");
  meaning.replaceChildren(...entry.cloneNode(true).childNodes);
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
for (const event of ["pointerover", "focusin"]) {
  document.addEventListener(event, (happened) => {
    const place = symbolAt(happened);
    light(place && symbolOf(place), happened.target);
  });
}
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") light(undefined);
});

oneStop(all("#symbols button"));
