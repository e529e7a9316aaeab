// Draws the report from the data in the page.
import {blockElement} from "./blocks.js";
import {element} from "./dom.js";
import {inflatedBytes} from "./packing.js";

/** @param {string} id @returns {string} */
function textOf(id) {
  return document.getElementById(id)?.textContent ?? "";
}

async function drawReport() {
  const report = JSON.parse(textOf("report"));
  const bytes = await inflatedBytes(textOf("packed"));
  /** @type {(() => void)[]} */
  const later = [];
  const sections = report.sections.map((/** @type {any} */ section, /** @type {number} */ k) =>
    element("article", {id: `section-${k}`, class: section.kind},
      element("header", {}, element("h1", {}, section.title), element("p", {class: "source"}, section.source)),
      ...section.blocks.map((/** @type {any} */ block) => blockElement(block, bytes, later))));
  const links = report.sections.map((/** @type {any} */ section, /** @type {number} */ k) => element("a", {href: `#section-${k}`}, section.title));
  const bar = element("nav", {"aria-label": "Sections"}, element("span", {class: "brand"}, "Flappy"), ...(links.length > 1 ? links : []));
  document.body.append(bar, element("main", {}, ...sections), element("footer", {}, `flappy-report at commit ${report.commit}`));
  for (const call of later) call();
  requestAnimationFrame(() => requestAnimationFrame(() => { document.documentElement.dataset.ready = performance.now().toFixed(0); }));
}

drawReport();
