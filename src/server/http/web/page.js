import {LiveView} from "./live.js";

const at = (id) => document.getElementById(id);
let jobs = [];
let chosen = null;

// Makes an element with a text node, so that a job's output is never interpreted as markup.
function element(name, text, kind) {
  const made = document.createElement(name);
  made.textContent = text;
  if (kind) made.className = kind;
  return made;
}

async function ask(path) {
  const response = await fetch(path);
  if (!response.ok) throw new Error(response.status);
  return response;
}

function time(seconds) {
  return seconds > 0 ? new Date(1000 * seconds).toLocaleString() : "";
}

function showJobs() {
  at("none").hidden = jobs.length > 0;
  at("jobs").replaceChildren(...jobs.map((job) => {
    const button = element("button", "", "job");
    button.setAttribute("aria-current", job.id === chosen);
    button.append(element("span", `${job.id}  ${job.kind} ${job.config}`), element("span", job.state, job.state));
    if (job.state === "running" || job.state === "paused") {
      const bar = element("progress", "");
      bar.value = job.progress;
      button.append(bar);
    }
    button.addEventListener("click", () => {
      chosen = job.id;
      showJobs();
      showChosen();
    });
    const row = element("li", "");
    row.append(button);
    return row;
  }));
}

const svg = (name, attributes, text) => {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
};

/**
 * @param {string} id of the figure
 * @param {number[]} updates
 * @param {(number | null)[]} values
 * @param {number[]} ticks of the values, ascending
 * @param {string} unit
 */
function drawCurve(id, updates, values, ticks, unit) {
  const points = updates.map((update, i) => [update, values[i]]).filter((p) => p[0] !== null && p[1] !== null);
  at(id).hidden = points.length === 0;
  if (points.length === 0) return;
  const [left, right, top, bottom] = [44, 632, 10, 212];
  const last = Math.max(1, points[points.length - 1][0]), [low, high] = [ticks[0], ticks[ticks.length - 1]];
  const x = (update) => left + (right - left) * update / last;
  const y = (value) => bottom - (bottom - top) * (value - low) / (high - low);
  const parts = [];
  for (const tick of ticks) {
    parts.push(svg("line", {class: "grid", x1: left, x2: right, y1: y(tick), y2: y(tick)}));
    parts.push(svg("text", {x: left - 6, y: y(tick) + 4, "text-anchor": "end"}, `${Number(tick.toPrecision(3))}${unit}`));
  }
  parts.push(svg("text", {x: left, y: bottom + 18}, "0"));
  parts.push(svg("text", {x: right, y: bottom + 18, "text-anchor": "end"}, last.toLocaleString()));
  parts.push(svg("polyline", {class: "curve", points: points.map((p) => `${x(p[0]).toFixed(1)},${y(p[1]).toFixed(1)}`).join(" ")}));
  at(id).querySelector("svg").replaceChildren(...parts);
}

function showCurve(curve) {
  drawCurve("curve", curve.update, curve.success_rate.map((rate) => rate === null ? null : 100 * rate), [0, 25, 50, 75, 100], " %");
  const returns = curve.return_mean.filter((value) => value !== null);
  const [low, high] = [Math.min(...returns), Math.max(...returns)], step = Math.max(1e-9, (high - low) / 4);
  drawCurve("return", curve.update, curve.return_mean, [0, 1, 2, 3, 4].map((k) => low + k * step), "");
}

async function showChosen() {
  const job = jobs.find((each) => each.id === chosen);
  at("job").hidden = !job;
  if (!job) return;
  at("job-title").textContent = `Job ${job.id}: ${job.kind} ${job.config}`;
  at("message").textContent = [job.state, `attempt ${job.attempts}`, ...job.overrides, job.message].filter(Boolean).join(" · ");
  const of = (what) => ask(`api/jobs/${job.id}/${what}`);
  const [log, history, curve, files] = await Promise.all([of("log").then((r) => r.text()),
    of("history").then((r) => r.json()), of("curve").then((r) => r.json()), of("files").then((r) => r.json())]);
  if (job.id !== chosen) return;
  const box = at("log");
  const following = box.scrollTop + box.clientHeight >= box.scrollHeight - 8;
  box.textContent = log;
  if (following) box.scrollTop = box.scrollHeight;
  at("history").replaceChildren(...history.map((step) =>
    element("li", `${time(step.time_s)}  ${step.state}${step.attempt > 0 ? `, attempt ${step.attempt}` : ""}: ${step.why}`)));
  at("files").replaceChildren(...files.map((file) => element("li", `${file.name}  ${file.bytes.toLocaleString("en")} bytes`)));
  showCurve(curve);
}

function showWatched(state) {
  at("watched").hidden = state === null;
  if (state === null) return;
  const numbers = (list) => list.map((value) => value.toFixed(3)).join("  ");
  live.show(state);
  const rows = [["source", state.source], ["time", `${state.t_s.toFixed(2)} s`], ["position", `${numbers(state.position_m)} m`],
    ["attitude", numbers(state.q_WB)], ["velocity", `${numbers(state.v_WB_W_m_s)} m/s`],
    ["body rate", `${numbers(state.w_WB_B_rad_s)} rad/s`]];
  if (state.battery_V !== null) rows.push(["battery", `${state.battery_V.toFixed(2)} V`]);
  at("state").replaceChildren(...rows.flatMap(([name, value]) => [element("dt", name), element("dd", value)]));
}

const live = new LiveView(at("view"));
window.live = live;  // for tests and for debugging in the browser
let busy = false;
let again = false;

// Refreshes once at a time; a change meanwhile causes one more refresh.
async function refresh() {
  if (busy) {
    again = true;
    return;
  }
  busy = true;
  try {
    jobs = await (await ask("api/jobs")).json();
    if (chosen === null && jobs.length > 0) chosen = (jobs.find((job) => job.state === "running") ?? jobs[0]).id;
    showJobs();
    await showChosen();
    if (events.readyState === EventSource.OPEN) at("link").textContent = "live";
  } catch {
    at("link").textContent = "no answer";
  }
  busy = false;
  if (again) {
    again = false;
    setTimeout(refresh, 500);
  }
}

const events = new EventSource("events");
events.addEventListener("open", () => { at("link").textContent = "live"; });
events.addEventListener("error", () => { at("link").textContent = "not live"; });
events.addEventListener("jobs", refresh);
events.addEventListener("watched", (event) => showWatched(JSON.parse(event.data)));
refresh();
setInterval(() => { if (events.readyState !== EventSource.OPEN) refresh(); }, 10000);
