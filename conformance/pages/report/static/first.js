// SPDX-License-Identifier: MIT
// The first screen is there at once; what is below it is laid out part by part while nothing else happens. Before the
// reader goes anywhere by a link, a key or a search, all of it is, so that he arrives where it stays; and so it is at once
// where he comes to a part by its address, or back to where he was.
"use strict";

if (location.hash === "" && performance.getEntriesByType("navigation")[0]?.type === "navigate") {
  const SOON = 100; // ms, after which the next part no longer waits for an idle moment
  const whenIdle = globalThis.requestIdleCallback ?? ((then) => setTimeout(then, SOON));
  const parts = () => document.querySelectorAll("main > section > *, .row");
  const layOut = (part) => { part.style.contentVisibility = "visible"; };
  const layOutOneByOne = ([part, ...others]) => {
    layOut(part);
    if (others.length > 0) whenIdle(() => layOutOneByOne(others), { timeout: SOON });
  };

  document.documentElement.setAttribute("data-unlaid", "");
  addEventListener("load", () => layOutOneByOne(parts()));
  for (const event of ["pointerdown", "click", "keydown", "hashchange", "beforeprint"]) {
    addEventListener(event, () => parts().forEach(layOut), { capture: true, once: true });
  }
}
