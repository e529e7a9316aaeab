// The pages' modules, as far as they need no browser: node --test.
import assert from "node:assert/strict";
import {readFileSync, readdirSync} from "node:fs";
import test from "node:test";
import {deflateSync} from "node:zlib";

const kWeb = new URL("../../src/view/web/", import.meta.url);
const load = (name) => import(new URL(name, kWeb));
const [packing, geometry, series, chart, dom, anatomy, designs, {Flight}] = await Promise.all(
  ["packing.js", "geometry.js", "series.js", "chart.js", "dom.js", "anatomy.js", "designs.js", "flight.js"].map(load));

const near = (actual, expected, tolerance = 1e-9) => {
  const [a, b] = [[actual].flat(), [expected].flat()];
  assert.equal(a.length, b.length);
  a.forEach((value, i) => assert.ok(Math.abs(value - b[i]) <= tolerance, `${a} is not ${b}`));
};

/** Packs as src/view/packing.cpp does. */
class Packer {
  bytes = [];
  add(column, step) {
    const at = this.bytes.length;
    let before = 0;
    for (const x of column) {
      const now = Math.round(x / step);
      let left = BigInt(now - before);
      left = left < 0n ? -2n * left - 1n : 2n * left;
      for (; left > 0x7fn; left >>= 7n) this.bytes.push(Number(0x80n | (left & 0x7fn)));
      this.bytes.push(Number(left));
      before = now;
    }
    return {at, count: column.length, step};
  }
}

test("columns are read back as they were packed", async () => {
  const packer = new Packer(), columns = [[0, 0.1, 0.2, -5], [-1e9, 1e9, 3], [], [4e12, -4e12]];
  const packed = columns.map((column, k) => packer.add(column, [0.1, 1, 1, 0.5][k]));
  const bytes = await packing.inflatedBytes(`\n${deflateSync(Buffer.from(packer.bytes)).toString("base64")}\n`);
  packed.forEach((one, k) => near([...packing.unpackedColumn(bytes, one)], columns[k], 1e-9));
});

test("what C++ packs is what JavaScript reads", async () => {
  // the text of Packing.HasATextThatJavaScriptReads in packing_test.cpp
  const bytes = await packing.inflatedBytes("eJxjYGI6ztgxh+f/FgkAEVkDyA==");
  near([...packing.unpackedColumn(bytes, {at: 0, count: 3, step: 0.1})], [0, 0.1, 0.2]);
  near([...packing.unpackedColumn(bytes, {at: 3, count: 3, step: 0.01})], [-1, 1000, -1000]);
});

test("stroke and rotation move wings backward", () => {
  const side = {shoulder_m: [0, 0.014, 0.019], outline_m: [[0.07, 0]]};
  near(geometry.wingPoint(side, 1, 0, 0, 0.07, 0.02), [0, 0.084, -0.001]);
  near(geometry.wingPoint(side, 1, Math.PI / 2, 0, 0.07, 0), [-0.07, 0.014, 0.019]);
  near(geometry.wingPoint({...side, shoulder_m: [0, -0.014, 0.019]}, -1, Math.PI / 2, 0, 0.07, 0), [-0.07, -0.014, 0.019]);
  near(geometry.wingPoint(side, 1, 0, Math.PI / 2, 0, 0.02), [-0.02, 0.014, 0.019]);
});

test("attitudes turn vectors and become angles", () => {
  const yaw = [Math.cos(0.4), 0, 0, Math.sin(0.4)], pitch = [Math.cos(0.3), 0, Math.sin(0.3), 0], roll = [Math.cos(0.2), Math.sin(0.2), 0, 0];
  near(geometry.rotated(yaw, [1, 0, 0]), [Math.cos(0.8), Math.sin(0.8), 0]);
  near(geometry.anglesOf(yaw), [0, 0, 0.8]);
  near(geometry.anglesOf(pitch), [0, 0.6, 0]);
  near(geometry.anglesOf(roll), [0.4, 0, 0]);
  const minus = yaw.map((v) => -v);
  near(geometry.betweenAttitudes(yaw, minus, 0.5), yaw);
});

test("series are found, read between samples, and unwrapped", () => {
  const times = [0, 1, 2, 4], values = [0, 10, 20, 0];
  near([-1, 0, 0.5, 1, 3.9, 4, 9].map((t) => series.placeOf(times, t)), [0, 0, 0, 1, 2, 3, 3]);
  near([-1, 0.5, 3, 9].map((t) => series.valueAt(times, values, t)), [0, 5, 10, 0]);
  near([...series.unwrapped(Float64Array.of(3, -3, -2.9))], [3, -3 + 2 * Math.PI, -2.9 + 2 * Math.PI]);
  const sums = series.runningSums(values);
  near([series.meanBetween(times, sums, 0.5, 2), series.meanBetween(times, sums, -1, 1), series.meanBetween(times, sums, 2.2, 2.4)], [15, 5, 20]);
});

test("thinning loses no peak", () => {
  const count = 100000, times = Float64Array.from({length: count}, (_, i) => i / 1000);
  const values = times.map((t) => Math.sin(2 * Math.PI * 34 * t));
  values[77777] = 5;
  values[33333] = -5;
  const points = series.visiblePoints(times, values, 0, 100, 700);
  assert.ok(points.length <= 1400);
  assert.equal(Math.max(...points.map((p) => p.y)), 5);
  assert.equal(Math.min(...points.map((p) => p.y)), -5);
  assert.ok(points.every((p, i) => i === 0 || p.x > points[i - 1].x));
  const near_one = series.visiblePoints(times, values, 50, 50.1, 700);
  assert.ok(near_one[0].x <= 50 && near_one[near_one.length - 1].x >= 50.1 && near_one.length === 102, String(near_one.length));
});

test("a figure is drawn with the numbers that it has", () => {
  const axis = {title: "x (s)", log: false, low: null, high: 4};
  const figure = {id: "f", title: "t", note: "", x: axis, y: axis, categories: [], bar: 0.8, series: [
    {name: "line", draw: "line", colour: "#0072b2", dashed: true, x: [0, 1, 2], y: [1, null, 3]},
    {name: "band", draw: "band", colour: "#d55e00", dashed: false, x: [0, 1], low: [1, 2], high: [3, 4]}]};
  const {data: {datasets}, options} = chart.chartConfig(figure);
  assert.deepEqual(datasets[0].data, [{x: 0, y: 1}, {x: 1, y: null}, {x: 2, y: 3}]);
  assert.deepEqual([datasets[1].data, datasets[2].data], [[{x: 0, y: 1}, {x: 1, y: 2}], [{x: 0, y: 3}, {x: 1, y: 4}]]);
  assert.equal(datasets[2].fill, "-1");
  assert.equal(options.scales.x.title.text, "x (s)");
  assert.deepEqual(chart.figureRows(figure).rows[0], ["line", "1", "0", "–", "–"]);
  const keys = options.plugins.legend.labels.generateLabels({data: {datasets}, isDatasetVisible: () => true});
  assert.deepEqual(keys.map((key) => [key.text, key.datasetIndex, key.lineDash.length, key.lineWidth]), [["line", 0, 2, 3], ["band", 2, 0, 9]]);
  const bars = {...figure, categories: ["a", "b"], series: [{name: "", draw: "bars", colour: "#000000", dashed: false, x: [1, 2], y: [0, 1]}]};
  const long = {...axis, title: "share of drawn vehicles that escape (-)"};
  assert.deepEqual(chart.chartConfig({...figure, y: long}).options.scales.y.title.text, ["share of drawn vehicles", "that escape (-)"]);
  const written = [], pen = {save() {}, restore() {}, fillText(...told) { written.push([...told, this.textAlign]); }}, scaled = {getPixelForValue: (v) => 10 * v};
  chart.chartConfig(figure).plugins[0].afterDatasetsDraw({ctx: pen, scales: {x: scaled, y: scaled}, chartArea: {right: 60}, isDatasetVisible: () => true,
    data: {datasets: [{own: {labels: ["01", "02"], x: [1, 5], y: [2, 3]}}, {own: {x: [1], y: [1]}}]}});
  assert.deepEqual(written, [["01", 16, 18, "left"], ["02", 44, 28, "right"]]);
  assert.ok(chart.chartConfig({...bars, series: [{...bars.series[0], draw: "points"}]}).data.datasets[0].clip >= 4, "half a point at the end of an axis");
  const scale = chart.chartConfig(bars).options.scales.y;
  assert.deepEqual(scale.ticks.callback(1), ["b"]);
  assert.deepEqual([scale.min, scale.max, scale.reverse], [-0.5, 1.5, true]);
});

test("text is short, and strength grows with noise", () => {
  assert.deepEqual([0, 0.12345, -1234.5, 1e-5, 123456, NaN].map(dom.shortNumber), ["0", "0.123", "\u22121230", "1.00e\u22125", "1.23e+5", "–"]);
  assert.deepEqual(chart.wrapped("accelerometer misalignment and vibration rectification"),
    ["accelerometer misalignment", "and vibration rectification"]);
  near([0.5, 1, 10, 1000].map(anatomy.strengthOf), [0, 0, 1, 1]);
});

test("robots stand in a row that the camera sees, and a wing is its outline", () => {
  near(designs.placesOf(1, 0.2), [0]);
  near(designs.placesOf(4, 0.2), [-0.3, -0.1, 0.1, 0.3]);
  const half = Math.tan(5 * Math.PI / 180);
  near(designs.distanceTo(4, 1, 2, 10), 1 / half);  // as wide as the picture, half as high
  near(designs.distanceTo(1, 3, 2, 10), 1.5 / half);
  const side = {shoulder_m: [0, 0, 0], outline_m: [[0.01, 0.02], [0.06, 0.018], [0.07, 0]]};
  assert.equal(designs.outlinePath(side, 1000), "M10.0 0.0L70.0 0.0L70.0 0.0L60.0 18.0L10.0 20.0Z");
});

test("a flight is what its log has", () => {
  const packer = new Packer(), count = 201, t = Array.from({length: count}, (_, i) => 10 + i / 200);
  const same = (value) => t.map(() => value);
  const columns = (names) => Object.fromEntries(Object.entries(names).map(([name, values]) => [name, packer.add(values, 1e-6)]));
  const side = {shoulder_m: [0, 0, 0], outline_m: [[0.07, 0]]};
  const json = {name: "f", declared: "v", flapping_Hz: 34, gravity_m_s2: 9.81, wings: "recorded", notes: [], latency_s: {mocap: 0.03, imu: 0},
    vehicle: {name: "v", mass_kg: 0.012, left: side, right: side}, ambient: {ground_z_m: 0, ceiling_z_m: 9, walls: []},
    swapped: columns({begin_s: [10.25], end_s: [10.3]}), streams: {
      mocap: columns({t_s: t, x_m: t.map((s) => 0.5 * (s - 10)), y_m: same(0), z_m: same(1), qw: same(Math.SQRT1_2), qx: same(0), qy: same(0), qz: same(Math.SQRT1_2)}),
      imu: columns({t_s: t, gyro_x_rad_s: same(0), gyro_y_rad_s: same(0), gyro_z_rad_s: same(0), accel_x_m_s2: same(1), accel_y_m_s2: same(0), accel_z_m_s2: same(9.81)}),
      command: columns({t_s: t, left_voltage_V: same(9), right_voltage_V: same(8)}),
      wings: columns({t_s: t, left_stroke_rad: same(0.1), left_rotation_rad: same(0.2), right_stroke_rad: same(0.3), right_rotation_rad: same(0.4)})}};
  const flight = new Flight(json, Uint8Array.from(packer.bytes));
  near(flight.duration_s, 1, 1e-6);
  near(flight.positionAt(0.5), [0.25, 0, 1], 1e-5);
  near(flight.swapped.flat(), [0.25, 0.3], 1e-9);
  assert.deepEqual(flight.panels().filter((panel) => panel.left_out).map((panel) => panel.id), ["position", "attitude"]);
  near(flight.velocityAt(0.5), [0.5, 0, 0], 1e-3);
  near(flight.forceAt(0.5), [0, 0.012, 0.012 * 9.81], 1e-5);  // forward of B is y of W
  near(flight.wingsAt(0.5), [0.1, 0.2, 0.3, 0.4], 1e-5);
  near(flight.streams.imu.t_s[0], 0.03, 1e-6);  // poses are 30 ms old when they arrive
  assert.deepEqual(flight.panels().map((panel) => panel.id), ["position", "attitude", "rate", "force", "voltages", "strokes", "rotations"]);
  near(flight.panels()[1].lines.map((line) => line.values[3]), [0, 0, 90], 1e-3);
});

test("a flight of declared inputs has neither beat nor IMU", () => {
  const packer = new Packer(), t = Array.from({length: 201}, (_, i) => i / 100), same = (value) => t.map(() => value);
  const columns = (names) => Object.fromEntries(Object.entries(names).map(([name, values]) => [name, packer.add(values, 1e-6)]));
  const pose = columns({t_s: t, x_m: same(0), y_m: same(0), z_m: same(1), qw: same(Math.SQRT1_2), qx: same(0), qy: same(0), qz: same(Math.SQRT1_2)});
  const declared = columns({t_s: t, ...Object.fromEntries(Array.from({length: 8}, (_, k) => [`motor_${k + 1}`, same(k)]))});
  const path = columns({t_s: t, accel_x_m_s2: t.map((s) => s), accel_y_m_s2: same(0), accel_z_m_s2: same(9.81)});
  const json = {name: "f", declared: "v", flapping_Hz: 0, gravity_m_s2: 9.81, wings: "none", notes: [], latency_s: {mocap: 0},
    vehicle: {name: "v", mass_kg: 0.1, body_m: [0.05, 0.05, 0.01]}, ambient: {ground_z_m: 0, ceiling_z_m: 9, walls: []}, streams: {mocap: pose, declared, path}};
  const flight = new Flight(json, Uint8Array.from(packer.bytes));
  near(flight.beat_s, 0.1);
  near(flight.forceAt(1.5), [0, 0.1 * 1.5, 0.1 * 9.81], 1e-5);  // at the instant: the path has no beat to take the mean of
  near(flight.wingsAt(0.5), [0, 0, 0, 0]);
  const panels = flight.panels();
  assert.deepEqual(panels.map((panel) => panel.id), ["position", "attitude", "path", "declared_0", "declared_6"]);
  assert.deepEqual(panels[4].lines.map((line) => line.name), ["motor 7", "motor 8"]);
  assert.ok(panels.every((panel) => panel.lines.every((line) => line.colour !== undefined)));
  assert.equal(new Flight({...json, streams: {mocap: pose, declared}}, Uint8Array.from(packer.bytes)).forceAt(1), null);
});

test("modules join to one, and make no markup of text", () => {
  const names = new Map();
  for (const file of readdirSync(kWeb).filter((name) => name.endsWith(".js"))) {
    const text = readFileSync(new URL(file, kWeb), "utf8");
    for (const line of text.split("\n")) {
      if (/^\s*import\b/.test(line)) assert.match(line, /^import \{[\w, ]+\} from "\.\/\w+\.js";$/, file);
      if (/^export/.test(line)) assert.match(line, /^export (async )?(function|class|const) \w/, file);
      for (const name of line.match(/^(?:export )?(?:async )?(?:function|class|const|let) ([\w$]+)/)?.slice(1) ?? []) {
        assert.ok(!names.has(name), `${name} of ${file} is in ${names.get(name)}, too`);
        names.set(name, file);
      }
    }
    assert.doesNotMatch(text, /innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\b|new Function|https?:\/\/(?!www\.w3\.org\/2000\/svg)/, file);
  }
  assert.ok(names.size > 40);
});
