// SPDX-License-Identifier: MIT
// Search, and the keys: / searches, n and p go on and back, a digit chooses a language, 0 all of them.
"use strict";

const search = document.getElementById("search");
const sought = search.querySelector("input");
const results = search.querySelector("ul");
const FOUND = 12; // at most

// the text of a place, its equations as they are seen
function textOf(place) {
  const copy = place.cloneNode(true);
  for (const equation of all(".katex-mathml", copy)) equation.remove();
  return copy.textContent.replace(/\u200b/g, "").replace(/\s+/g, " ").trim();
}

// what can be found: its words, and where it is; what is told or folded away under its heading has words of it too
const PLACES = "main h2, main h3:not(.changed h3), .row, .exercise > summary, [data-question] > summary, #sections li";
const TOLD = ".derivation-step, .closing > article, .exercise, [data-question]";
let places; // since the first search
const languages = codeButtons.map((button) => button.textContent.trim().toLowerCase());

function placeOf(place) {
  const statement = place.matches(".row");
  const shown = textOf(statement ? place.querySelector(".margin a") : place);
  const part = place.matches("li") ? "section of the lesson" : place.closest("section").querySelector("h2").textContent;
  const kind = statement ? `statement ${place.dataset.row}` : part;
  const told = place.closest(TOLD);
  const below = told ? all("p, dd, .because", told).map(textOf) : [];
  const symbols = all("[data-symbol]", told ?? place).map((symbol) => symbol.dataset.symbol);
  const own = [shown, kind, place.dataset.words].join(" ").toLowerCase();
  const words = [own, ...below, ...symbols].join(" ").toLowerCase();
  return { id: place.closest("[id]:not(h2, h3)")?.id ?? place.id, shown, kind, own, words };
}

// how near a place is to what is sought: its text begins with it, has it, or its words; or what is told there has it
function rank({ shown, own, words }, asked, phrase) {
  const at = shown.toLowerCase().search(new RegExp(`(?<!\\w)${phrase.replace(/[^\w\s]/g, "\\$&")}(?!\\w)`));
  return [at === 0, at > 0, asked.every((word) => own.includes(word)), words.includes(phrase), true].indexOf(true);
}

function find() {
  const typed = sought.value.toLowerCase().split(/\s+/).filter(Boolean);
  const said = typed.filter((word) => !languages.includes(word)); // "tuning function Java MATLAB" is of all languages
  const words = said.length > 0 ? said : typed;
  const phrase = words.join(" ");
  places ??= all(PLACES).map(placeOf);
  const found = places.filter((place) => words.every((word) => place.words.includes(word)))
    .sort((a, b) => rank(a, words, phrase) - rank(b, words, phrase));
  results.replaceChildren(...(words.length > 0 ? found.slice(0, FOUND) : []).map(({ id, shown, kind }) => {
    const link = Object.assign(document.createElement("a"), { href: `#${id}`, textContent: shown });
    link.append(" ", Object.assign(document.createElement("small"), { textContent: kind }));
    const entry = document.createElement("li");
    entry.append(link);
    return entry;
  }));
  search.querySelector("output").textContent = words.length > 0 && found.length === 0 ? "Nothing of that name." : "";
}

function openSearch() {
  search.showModal();
  sought.select();
}

sought.addEventListener("input", find);
search.addEventListener("click", (event) => {
  if (event.target === search || event.target.closest("a")) search.close();
});
search.querySelector("form").addEventListener("submit", (event) => {
  event.preventDefault();
  const first = results.querySelector("a");
  if (first) first.click();
});
search.addEventListener("keydown", (event) => {
  if (event.key === "Escape") { // which would empty the field first
    event.preventDefault();
    search.close();
  }
  const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
  if (step === undefined) return;
  event.preventDefault();
  const stops = [sought, ...all("a", results)];
  stops[(stops.indexOf(document.activeElement) + step + stops.length) % stops.length].focus();
});
document.getElementById("open-search").addEventListener("click", openSearch);

// an exercise that is sought is opened by its own script, as one that is linked to is
function goOn(step) {
  const stops = all("#derivation .derivation-step, .closing > article, #code .part, main > section");
  const tops = stops.map((stop) => stop.getBoundingClientRect().top - parseFloat(getComputedStyle(document.documentElement).scrollPaddingTop));
  const next = step > 0 ? tops.findIndex((top) => top > 4) : tops.findLastIndex((top) => top < -4);
  if (next >= 0) stops[next].scrollIntoView();
}

// a digit: in the code the program that it shows or leaves out, elsewhere the language of the derivation
function chooseLanguage(digit) {
  const { top, bottom } = codeSection.getBoundingClientRect();
  const buttons = top < innerHeight / 2 && bottom > innerHeight / 2 ? codeButtons : leadButtons;
  if (digit === 0) document.getElementById("all-languages").click();
  else buttons[digit - 1]?.click();
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented || search.open) return;
  if (event.target.closest("input, textarea, select, [contenteditable], .plot")) return;
  if (event.key === "/") {
    event.preventDefault();
    openSearch();
  } else if (event.key === "n") goOn(1);
  else if (event.key === "p") goOn(-1);
  else if (/^\d$/.test(event.key)) chooseLanguage(Number(event.key));
});
