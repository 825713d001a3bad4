// SPDX-License-Identifier: MIT
// What every part of the page uses.
"use strict";

const all = (selector, inside = document) => [...inside.querySelectorAll(selector)];
const pressed = (button) => button.getAttribute("aria-pressed") === "true";
const press = (button, on) => button.setAttribute("aria-pressed", on);
