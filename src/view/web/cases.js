// The table of cases of a blind benchmark; a click on a case opens what the diagnosis said about it.
import {element, shortNumber} from "./dom.js";

/**
 * @typedef {{number: string, part: string, truth: string, verdict: string, named: string, probability: number, right: boolean,
 *   details: [string, string][], rivals: [string, number][]}} Case
 */

/**
 * @param {string} name
 * @param {string[]} values
 * @param {() => void} change
 * @returns {{element: HTMLElement, value: () => string}}
 */
function filter(name, values, change) {
  const box = /** @type {HTMLSelectElement} */ (element("select", {}, element("option", {value: ""}, "all"), ...values.map((value) => element("option", {}, value))));
  box.addEventListener("change", change);
  return {element: element("label", {}, `${name} `, box), value: () => box.value};
}

/** @param {Case} one @returns {HTMLElement} */
function detailOf(one) {
  const rows = one.details.map(([name, value]) => element("tr", {}, element("th", {scope: "row"}, name), element("td", {}, value)));
  const rivals = one.rivals.map(([name, probability]) => element("tr", {}, element("th", {scope: "row"}, name), element("td", {}, shortNumber(probability))));
  return element("td", {colspan: "6"}, element("table", {}, element("tbody", {}, ...rows)),
    ...(rivals.length > 0 ? [element("h4", {}, "What was weighed"), element("table", {}, element("tbody", {}, ...rivals))] : []));
}

/**
 * @param {{cases: Case[]}} block
 * @returns {HTMLElement}
 */
export function casesElement(block) {
  const count = element("p", {class: "note", role: "status"});
  const pairs = block.cases.map((one) => {
    const open = element("button", {type: "button", class: "open", "aria-expanded": "false"}, one.number);
    const row = element("tr", {class: "case"}, element("td", {}, open), element("td", {}, one.part), element("td", {}, one.truth),
      element("td", {}, one.named ? `${one.verdict}: ${one.named}` : one.verdict), element("td", {class: "number"}, shortNumber(one.probability)),
      element("td", {class: one.right ? "right" : "wrong"}, one.right ? "✓ right" : "✗ wrong"));
    const detail = element("tr", {class: "detail", hidden: ""});
    row.addEventListener("click", () => {
      if (detail.childElementCount === 0) detail.append(detailOf(one));
      detail.hidden = !detail.hidden;
      open.setAttribute("aria-expanded", String(!detail.hidden));
    });
    return {one, row, detail};
  });
  const show = () => {
    let shown = 0;
    for (const {one, row, detail} of pairs) {
      const fits = (part.value() === "" || part.value() === one.part) && (right.value() === "" || (right.value() === "right") === one.right);
      row.hidden = !fits;
      if (!fits) detail.hidden = true;
      shown += fits ? 1 : 0;
    }
    count.textContent = `${shown} of ${pairs.length} cases`;
  };
  const part = filter("part", [...new Set(block.cases.map((one) => one.part))], show);
  const right = filter("verdict", ["right", "wrong"], show);
  show();
  const head = element("tr", {}, ...["case", "part", "truth", "verdict", "probability", ""].map((name) => element("th", {scope: "col"}, name)));
  return element("figure", {class: "cases wide"}, element("h3", {}, "Every case"),
    element("div", {class: "filters"}, part.element, right.element, count),
    element("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": "every case"}, element("table", {}, element("thead", {}, head),
      element("tbody", {}, ...pairs.flatMap(({row, detail}) => [row, detail])))));
}
