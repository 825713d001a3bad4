// SPDX-License-Identifier: MIT
// What every part of the page uses.
"use strict";

const all = (selector, inside = document) => [...inside.querySelectorAll(selector)];
const pressed = (button) => button.getAttribute("aria-pressed") === "true";
const press = (button, on) => button.setAttribute("aria-pressed", on);

// what the reader has set, kept in the page's address: a link shows the page as it is
const address = {
  pending: {},
  timer: 0,
  get: (name) => new URLSearchParams(location.search).get(name),
  set(changes) { // null leaves a name out
    Object.assign(address.pending, changes);
    clearTimeout(address.timer);
    address.timer = setTimeout(() => {
      const found = new URLSearchParams(location.search);
      for (const [name, value] of Object.entries(address.pending)) value === null ? found.delete(name) : found.set(name, value);
      address.pending = {};
      const text = found.toString();
      history.replaceState(null, "", `${location.pathname}${text && `?${text}`}${location.hash}`);
    }, 150);
  },
};
