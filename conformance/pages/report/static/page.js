// SPDX-License-Identifier: MIT
// What every part of the page uses.
"use strict";

const all = (selector, inside = document) => [...inside.querySelectorAll(selector)];
const pressed = (button) => button.getAttribute("aria-pressed") === "true";
const press = (button, on) => button.setAttribute("aria-pressed", on);

// what is marked as a symbol; in code that spells it as the page does, the text says which
const SYMBOLS = "[data-symbol], var";
const symbolOf = (place) => place.dataset.symbol ?? place.textContent;

// one of several is in the order of tabs, the last that was gone to; keys move within
function oneStop(items, keys = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }) {
  const able = () => items.filter((item) => !item.disabled);
  const stop = (at) => items.forEach((item) => { item.tabIndex = item === at ? 0 : -1; });
  stop(able()[0]);
  for (const item of items) {
    item.addEventListener("focus", () => stop(item));
    item.addEventListener("keydown", (event) => {
      if (!(event.key in keys)) return;
      event.preventDefault();
      const among = able();
      among[(among.indexOf(item) + keys[event.key] + among.length) % among.length].focus();
    });
  }
}

for (const bar of all(".choices[aria-label], .copies")) {
  const items = all("button, a", bar);
  if (items.length < 3) continue;
  bar.setAttribute("role", "toolbar");
  oneStop(items);
}

// what the reader has set, kept in the page's address: a link shows the page as it is; what changes faster than
// browsers allow is written when it has settled
const address = {
  pending: {},
  setters: {},
  timer: 0,
  get: (name) => new URLSearchParams(location.search).get(name),
  set(changes) { // null leaves a name out
    Object.assign(address.pending, changes);
    if (address.timer) return;
    address.write();
    address.timer = setTimeout(() => {
      address.timer = 0;
      address.write();
    }, 150);
  },
  obey(name, setter) { // it sets what the address asks for, and what a link to another state of the page does
    address.setters[name] = setter;
    if (address.get(name) !== null) setter(address.get(name));
  },
  write() {
    const found = new URLSearchParams(location.search);
    for (const [name, value] of Object.entries(address.pending)) value === null ? found.delete(name) : found.set(name, value);
    address.pending = {};
    const text = found.toString().replaceAll("%2C", ",");
    history.replaceState(null, "", `${location.pathname}${text && `?${text}`}${location.hash}`);
  },
};

// a link that sets something and leads somewhere does both without loading the page again
document.addEventListener("click", (event) => {
  const link = event.target.closest("a[href^='?']");
  if (link === null || event.ctrlKey || event.metaKey || event.shiftKey) return;
  event.preventDefault();
  for (const [name, value] of new URLSearchParams(link.search)) address.setters[name]?.(value);
  if (location.hash !== link.hash) location.hash = link.hash;
  else dispatchEvent(new Event("hashchange")); // the reader has gone elsewhere since
});

// what the reader reads stays where it is while the page above it changes its height
function keepingPlace(change) {
  if (document.readyState === "loading") { // he is nowhere yet
    change();
    return;
  }
  const below = all(".row, .derivation-step, .whole, .exercise, figure, h2").find((place) => place.getBoundingClientRect().bottom > 140);
  const before = below?.getBoundingClientRect().top;
  const { style } = document.documentElement;
  style.overflowAnchor = "none"; // or some browsers would move the page a second time
  change();
  if (below !== undefined && scrollY > 0) scrollBy({ top: below.getBoundingClientRect().top - before, behavior: "instant" });
  requestAnimationFrame(() => requestAnimationFrame(() => { style.overflowAnchor = ""; }));
}

// the section that is read is marked in the navigation
const sectionLinks = new Map(all("nav a").map((link) => [link.hash.slice(1), link]));
const reading = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) sectionLinks.get(target.id)?.setAttribute("aria-current", isIntersecting);
}, { rootMargin: "-40% 0px -60%" });
for (const section of all("main > section")) reading.observe(section);
