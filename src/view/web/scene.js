// Draws flights in 3D by three.js: robots, their trails, their surroundings, arrows.
import {rotated, spanOf} from "./geometry.js";

/**
 * @typedef {import("./geometry.js").Vehicle} Vehicle
 * @typedef {import("./geometry.js").Side} Side
 * @typedef {{position: number[], attitude: number[], wings: number[], velocity: number[], force: number[]}} Pose
 * @typedef {{ground_z_m: number, ceiling_z_m: number, walls: number[][], spheres?: number[][], boxes?: number[][], cylinders?: number[][]}} Place
 * @typedef {"chase" | "free" | "front" | "side" | "top"} View
 */

const kField_deg = 35;  // vertical field of the camera
const kHalfSpan_m = 0.084;
const kMomentColour = "#0072b2";
const kChase_m = 0.55;  // distance from which the camera follows a robot
const kFar_m = 50;  // surfaces farther away are not drawn
const kVelocityArrow_s = 0.12, kForceArrow_m = 0.09;  // length of the arrows at 1 m/s, and at the weight
const kWing_m = 0.07;  // wing length for which the sizes of beak and spar are given

/**
 * The ratio of a robot's size to that of the robot for which distances and arrows are made.
 * @param {Vehicle} vehicle
 * @returns {number}
 */
function sizeOf(vehicle) {
  return vehicle.body_m ? Math.max(...vehicle.body_m) / kHalfSpan_m : 1;
}

/** One robot, with the wings of the vehicle's file; for a beat-averaged vehicle, the ellipsoid of its mass and inertia. */
export class Robot {
  /**
   * @param {Vehicle} vehicle
   * @param {string} colour of its wings, or of the ellipsoid
   */
  constructor(vehicle, colour) {
    this.group = new THREE.Group();
    /** @type {{sign: number, stroke: any, rotation: any}[]} */
    this.wings = [];
    if (vehicle.body_m) this.addEllipsoid(vehicle.body_m, colour);
    else this.addFlapper(vehicle, colour);
  }

  /**
   * @param {number[]} semi_axes_m
   * @param {string} colour
   */
  addEllipsoid(semi_axes_m, colour) {
    const body = new THREE.Mesh(new THREE.SphereBufferGeometry(1, 40, 24),
      new THREE.MeshStandardMaterial({color: colour, roughness: 0.85, transparent: true, opacity: 0.4, depthWrite: false}));
    body.scale.set(...semi_axes_m);
    const size = Math.max(...semi_axes_m);
    const beak = new THREE.Mesh(new THREE.ConeBufferGeometry(0.06 * size, 0.3 * size, 16), new THREE.MeshStandardMaterial({color: 0x24292f}));
    beak.rotation.z = -Math.PI / 2;
    beak.position.set(semi_axes_m[0] + 0.15 * size, 0, 0);
    this.group.add(body, beak);
  }

  /**
   * @param {Vehicle} vehicle
   * @param {string} colour of its wings
   */
  addFlapper(vehicle, colour) {
    const left = /** @type {Side} */ (vehicle.left), right = /** @type {Side} */ (vehicle.right), size = spanOf(left) / kWing_m;
    const outline = /** @type {number[][]} */ (vehicle.profile_m).map(([height, radius]) => new THREE.Vector2(radius, height));
    const smooth = new THREE.SplineCurve(outline).getPoints(40);
    const body = new THREE.Mesh(new THREE.LatheBufferGeometry(smooth, 24), new THREE.MeshStandardMaterial({color: 0x8b98a5, roughness: 0.85}));
    body.rotation.x = Math.PI / 2;
    const beak = new THREE.Mesh(new THREE.ConeBufferGeometry(0.0018 * size, 0.024 * size, 10), new THREE.MeshStandardMaterial({color: 0x24292f}));
    beak.rotation.z = -Math.PI / 2;
    beak.position.set(0.017 * size, 0, 0.03 * size);
    this.group.add(body, beak);
    this.wings = [this.addWing(left, 1, colour), this.addWing(right, -1, colour)];
  }

  /**
   * @param {Side} side
   * @param {number} sign
   * @param {string} colour
   * @returns {{sign: number, stroke: any, rotation: any}}
   */
  addWing(side, sign, colour) {
    const outline = side.outline_m, span_m = spanOf(side), corners = [];
    for (let k = 1; k < outline.length; k++) {
      const [s0, c0] = outline[k - 1], [s1, c1] = outline[k];
      corners.push(0, sign * s0, 0, 0, sign * s1, 0, 0, sign * s1, -c1, 0, sign * s0, 0, 0, sign * s1, -c1, 0, sign * s0, -c0);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
    geometry.computeVertexNormals();
    const membrane = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({color: colour, side: THREE.DoubleSide, transparent: true, opacity: 0.55,
      depthWrite: false}));
    const rim = new THREE.BufferGeometry();
    rim.setAttribute("position", new THREE.Float32BufferAttribute(
      [...outline.map(([s, c]) => [0, sign * s, -c]).flat(), 0, sign * span_m, 0], 3));
    const edge = new THREE.Line(rim, new THREE.LineBasicMaterial({color: colour}));
    const spar = new THREE.Mesh(new THREE.CylinderBufferGeometry(0.0009, 0.0012, span_m, 8), new THREE.MeshBasicMaterial({color: 0x24292f}));
    spar.position.y = sign * span_m / 2;
    const rotation = new THREE.Group(), stroke = new THREE.Group();
    rotation.add(membrane, edge, spar);
    stroke.add(rotation);
    stroke.position.set(...side.shoulder_m);
    this.group.add(stroke);
    return {sign, stroke, rotation};
  }

  /** @param {Pose} pose */
  show(pose) {
    const [w, x, y, z] = pose.attitude;
    this.group.position.set(...pose.position);
    this.group.quaternion.set(x, y, z, w);
    this.wings.forEach(({sign, stroke, rotation}, k) => {
      stroke.rotation.z = sign * pose.wings[2 * k];
      rotation.rotation.y = pose.wings[2 * k + 1];
    });
  }
}

/** A path through points at equal steps of time. */
class Trail {
  /**
   * @param {number[][]} points
   * @param {string} colour
   * @param {number} radius_m
   */
  constructor(points, colour, radius_m) {
    const path = new THREE.Curve(), last = points.length - 1;
    path.getPoint = path.getPointAt = (/** @type {number} */ u) => {
      const at = Math.min(last, u * last), i = Math.min(last - 1, Math.floor(at)), share = at - i;
      return new THREE.Vector3(...points[i].map((value, k) => value + share * (points[i + 1][k] - value)));
    };
    path.getTangentAt = (/** @type {number} */ u) => {
      const step = 1 / last, a = path.getPoint(Math.max(0, u - step)), b = path.getPoint(Math.min(1, u + step)).sub(a);
      return b.lengthSq() > 1e-14 ? b.normalize() : new THREE.Vector3(1, 0, 0);
    };
    this.segments = last;
    const tube = new THREE.TubeBufferGeometry(path, last, radius_m, 5);
    this.ahead = new THREE.Mesh(tube, new THREE.MeshBasicMaterial({color: colour, transparent: true, opacity: 0.18}));
    const flown = tube.clone();
    this.flown = new THREE.Mesh(flown, new THREE.MeshBasicMaterial({color: colour, transparent: true, opacity: 0.8}));
    this.group = new THREE.Group();
    this.group.add(this.ahead, this.flown);
  }

  /** @param {number} share of the flight */
  show(share) {
    this.flown.geometry.setDrawRange(0, Math.round(share * this.segments) * 5 * 6);
  }
}

/**
 * A text next to an object, always of the same size.
 * @param {string} text
 * @param {string} colour
 * @returns {any}
 */
export function label(text, colour) {
  const canvas = document.createElement("canvas");
  canvas.width = 256;
  canvas.height = 64;
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.font = "600 36px system-ui, sans-serif";
  pen.fillStyle = colour;
  pen.textAlign = "center";
  pen.fillText(text, 128, 44);
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({map: new THREE.CanvasTexture(canvas), depthTest: false, sizeAttenuation: false}));
  sprite.scale.set(0.16, 0.04, 1);
  return sprite;
}

/**
 * A grid of squares in the x-y plane. Each side of a square is a separate line: software renderers of WebGL may drop a line that begins
 * behind the camera.
 * @param {number} size_m
 * @param {number} count number of squares along a side
 * @param {number} colour
 * @returns {any}
 */
function grid(size_m, count, colour) {
  const ends = [], step = size_m / count;
  for (let i = 0; i <= count; i++)
    for (let k = 0; k < count; k++) {
      const a = i * step - size_m / 2, b = k * step - size_m / 2;
      ends.push(a, b, 0, a, b + step, 0, b, a, 0, b + step, a, 0);
    }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(ends, 3));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({color: colour}));
}

/** @param {string} colour @returns {any} */
function arrow(colour) {
  const made = new THREE.Group();
  const material = new THREE.MeshBasicMaterial({color: colour});
  const shaft = new THREE.Mesh(new THREE.CylinderBufferGeometry(0.0013, 0.0013, 1, 8), material);
  const head = new THREE.Mesh(new THREE.ConeBufferGeometry(0.0042, 0.012, 12), material);
  made.add(shaft, head);
  made.show = (/** @type {number[]} */ from, /** @type {number[]} */ along) => {
    const vector = new THREE.Vector3(...along), length = vector.length();
    made.visible = length > 0.004;
    if (!made.visible) return;
    made.position.set(...from);
    made.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), vector.normalize());
    const stem = Math.max(1e-4, length - 0.012);
    shaft.scale.y = stem;
    shaft.position.y = stem / 2;
    head.position.y = stem + 0.006;
  };
  return made;
}

/**
 * Turns by the mouse, and zooms by its wheel, what an element shows.
 * @param {HTMLElement} view
 * @param {(azimuth_rad: number, elevation_rad: number, zoom?: number) => void} turn
 */
export function turnByMouse(view, turn) {
  view.addEventListener("pointerdown", (event) => {
    view.focus();
    view.setPointerCapture(event.pointerId);
  });
  view.addEventListener("pointermove", (event) => {
    if (event.buttons !== 0) turn(-0.008 * event.movementX, 0.008 * event.movementY);
  });
  view.addEventListener("wheel", (event) => {
    if (document.activeElement !== view) return;  // otherwise the wheel scrolls the page
    event.preventDefault();
    turn(0, 0, Math.exp(0.001 * event.deltaY));
  }, {passive: false});
}

/**
 * What keys do that turn and zoom.
 * @param {(azimuth_rad: number, elevation_rad: number, zoom?: number) => void} turn
 * @returns {Record<string, () => void>}
 */
export function turningKeys(turn) {
  const step = 0.1;
  return {a: () => turn(-step, 0), d: () => turn(step, 0), w: () => turn(0, step), s: () => turn(0, -step),
    "+": () => turn(0, 0, 0.85), "=": () => turn(0, 0, 0.85), "-": () => turn(0, 0, 1.18)};
}

/** A canvas, its light, and a camera that is turned around a point. */
export class Stage {
  /**
   * Throws where the browser has no WebGL.
   * @param {HTMLElement} frame that holds the canvas
   */
  constructor(frame) {
    this.renderer = new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true});
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.renderer.setClearColor(0xf6f8fa);
    frame.append(this.renderer.domElement);
    this.frame = frame;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(kField_deg, 1, 0.01, 200);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0xc8d0d8, 1.25));
    const sun = new THREE.DirectionalLight(0xffffff, 0.55);
    sun.position.set(-1, -2, 4);
    this.scene.add(sun);
    this.azimuth = this.elevation = 0;
    this.distance = 1;
    this.target = [0, 0, 0];
  }

  /** Adapts the canvas to the size of its frame. */
  resize() {
    const {clientWidth: width, clientHeight: height} = this.frame;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  /**
   * Turns the camera around the point that it looks at.
   * @param {number} azimuth_rad
   * @param {number} elevation_rad
   * @param {number} zoom factor of the distance
   */
  turn(azimuth_rad, elevation_rad, zoom = 1) {
    this.azimuth += azimuth_rad;
    this.elevation = Math.min(1.55, Math.max(-1.55, this.elevation + elevation_rad));
    this.distance = Math.min(100, Math.max(0.08, this.distance * zoom));
  }

  render() {
    const level = Math.cos(this.elevation);
    this.camera.position.set(this.target[0] + this.distance * level * Math.cos(this.azimuth),
      this.target[1] + this.distance * level * Math.sin(this.azimuth), this.target[2] + this.distance * Math.sin(this.elevation));
    this.camera.lookAt(...this.target);
    this.renderer.render(this.scene, this.camera);
  }
}

export class Scene extends Stage {
  /**
   * Throws where the browser has no WebGL.
   * @param {HTMLElement} frame that holds the canvas
   * @param {{vehicle: Vehicle, colour: string, path: number[][]}[]} robots the first is watched
   * @param {Place} place
   * @param {number[] | null} goal_m
   */
  constructor(frame, robots, place, goal_m) {
    super(frame);
    const all = robots.flatMap((robot) => robot.path);
    this.low = [0, 1, 2].map((k) => all.reduce((least, p) => Math.min(least, p[k]), Infinity));
    this.high = [0, 1, 2].map((k) => all.reduce((most, p) => Math.max(most, p[k]), -Infinity));
    this.middle = this.low.map((value, k) => (value + this.high[k]) / 2);
    this.extent = Math.max(0.25, ...this.low.map((value, k) => this.high[k] - value));
    this.trail_m = Math.min(0.003, 0.0005 + 0.0006 * this.extent);
    this.robots = robots.map(({vehicle, colour}) => new Robot(vehicle, colour));
    this.trails = robots.map(({path, colour}) => new Trail(path, colour, this.trail_m));
    this.robots.forEach((robot) => this.scene.add(robot.group));
    this.trails.forEach((trail) => this.scene.add(trail.group));
    this.watched_vehicle = robots[0].vehicle;
    /** @type {Robot[]} */
    this.moments = [];
    this.velocity = arrow("#009e73");
    this.force = arrow("#d55e00");
    this.scene.add(this.velocity, this.force);
    this.floor_m = 0;
    this.shadow = new THREE.Mesh(new THREE.CircleBufferGeometry(0.03, 24), new THREE.MeshBasicMaterial({color: 0x57606a, transparent: true, opacity: 0.35}));
    this.scene.add(this.shadow);
    this.weight_N = robots[0].vehicle.mass_kg * 9.81;
    this.size = sizeOf(robots[0].vehicle);
    this.top_m = robots[0].vehicle.body_m?.[2] ?? 0.019;
    this.shadow.scale.setScalar(this.size);
    this.addPlace(place, goal_m);

    /** @type {View} */
    this.view = "chase";
    this.azimuth = -2.3;
    this.elevation = 0.35;
    this.distance = kChase_m * this.size;
    this.target = [...this.middle];
    this.watched = [...this.middle];
    this.resize();
  }

  /**
   * Adds ground, ceiling and walls of the log that are near, and a grid of decimetres for scale.
   * @param {Place} place
   * @param {number[] | null} goal_m
   */
  addPlace(place, goal_m) {
    const ground = Math.abs(place.ground_z_m - this.low[2]) < kFar_m;
    this.floor_m = ground ? place.ground_z_m : this.low[2] - 0.12;
    const half = Math.ceil(5 * this.extent + 5) / 10 + 0.4;
    const [x, y] = [Math.round(10 * this.middle[0]) / 10, Math.round(10 * this.middle[1]) / 10];
    const count = Math.min(200, Math.round(20 * half));
    const lines = grid(2 * half, count, ground ? 0xc4ccd4 : 0xd8dee4);
    lines.position.set(x, y, this.floor_m);
    this.scene.add(lines);
    const plane = (/** @type {number} */ width, /** @type {number} */ height, /** @type {number} */ colour, /** @type {number} */ opacity) =>
      new THREE.Mesh(new THREE.PlaneBufferGeometry(width, height), new THREE.MeshBasicMaterial({color: colour, transparent: true, opacity,
        side: THREE.DoubleSide, depthWrite: false}));
    if (ground) {
      const floor = plane(2 * half, 2 * half, 0xeaeef2, 0.9);
      floor.position.set(x, y, this.floor_m - 0.001);
      this.scene.add(floor);
    }
    if (Math.abs(place.ceiling_z_m - this.high[2]) < kFar_m) {
      const ceiling = plane(2 * half, 2 * half, 0xafb8c1, 0.25);
      ceiling.position.set(x, y, place.ceiling_z_m);
      this.scene.add(ceiling);
    }
    for (const [wx, wy, nx, ny] of place.walls) {
      const away = (this.middle[0] - wx) * nx + (this.middle[1] - wy) * ny;
      if (Math.abs(away) > kFar_m) continue;
      const wall = plane(2 * half, this.high[2] - this.floor_m + 0.3, 0x8c959f, 0.3);
      wall.position.set(this.middle[0] - away * nx, this.middle[1] - away * ny, (this.high[2] + this.floor_m + 0.3) / 2);
      wall.up.set(0, 0, 1);
      wall.lookAt(wall.position.x + nx, wall.position.y + ny, wall.position.z);
      this.scene.add(wall);
    }
    this.addSolids(place);
    const corner = [x - half + 0.1, y - half + 0.1, this.floor_m];
    [["x", "#d55e00", [1, 0, 0]], ["y", "#009e73", [0, 1, 0]], ["z", "#0072b2", [0, 0, 1]]].forEach(([name, colour, along]) => {
      const axis = arrow(/** @type {string} */ (colour)), way = /** @type {number[]} */ (along);
      axis.show(corner, way.map((value) => 0.1 * value));
      const text = label(/** @type {string} */ (name), "#24292f");
      text.position.set(...corner.map((value, k) => value + 0.125 * way[k]));
      this.scene.add(axis, text);
    });
    if (goal_m) {
      const ring = new THREE.Mesh(new THREE.TorusBufferGeometry(0.03, 0.0016, 10, 48), new THREE.MeshBasicMaterial({color: 0xcc79a7}));
      const dot = new THREE.Mesh(new THREE.SphereBufferGeometry(0.004, 16, 12), new THREE.MeshBasicMaterial({color: 0xcc79a7}));
      const name = label("goal", "#8a3d66");
      ring.position.set(...goal_m);
      dot.position.set(...goal_m);
      name.position.set(goal_m[0], goal_m[1], goal_m[2] + 0.06);
      this.scene.add(ring, dot, name);
    }
  }

  /**
   * Adds the solids in the room, from the log's [ambient].
   * @param {Place} place
   */
  addSolids(place) {
    const add = (/** @type {any} */ geometry, /** @type {number[]} */ at) => {
      const solid = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({color: 0xa68a64, roughness: 0.9}));
      solid.position.set(...at);
      this.scene.add(solid);
      return solid;
    };
    for (const [x, y, z, radius] of place.spheres ?? []) add(new THREE.SphereBufferGeometry(radius, 40, 24), [x, y, z]);
    for (const [x, y, z, ex, ey, ez, qw, qx, qy, qz] of place.boxes ?? []) {
      add(new THREE.BoxBufferGeometry(ex, ey, ez), [x, y, z]).quaternion.set(qx, qy, qz, qw);
    }
    for (const [ax, ay, az, bx, by, bz, radius] of place.cylinders ?? []) {
      const axis = new THREE.Vector3(bx - ax, by - ay, bz - az), length = axis.length();
      add(new THREE.CylinderBufferGeometry(radius, radius, length, 40), [(ax + bx) / 2, (ay + by) / 2, (az + bz) / 2])
        .quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), axis.divideScalar(length));
    }
  }

  /**
   * Replaces the trail of a robot whose flight goes on.
   * @param {number} k of the robots
   * @param {number[][]} path
   * @param {string} colour
   */
  retrace(k, path, colour) {
    const old = this.trails[k].group;
    this.scene.remove(old);
    old.children.forEach((/** @type {any} */ mesh) => mesh.geometry.dispose());
    this.trails[k] = new Trail(path, colour, this.trail_m);
    this.scene.add(this.trails[k].group);
  }

  /** @param {View} view */
  look(view) {
    this.view = view;
    const wide = Math.max(0.5, 1.9 * this.extent);
    if (view === "chase") Object.assign(this, {azimuth: -2.3, elevation: 0.35, distance: kChase_m * this.size});
    else if (view === "free") Object.assign(this, {azimuth: -1.9, elevation: 0.4, distance: wide});
    else if (view === "front") Object.assign(this, {azimuth: 0, elevation: 0, distance: wide});
    else if (view === "side") Object.assign(this, {azimuth: -Math.PI / 2, elevation: 0, distance: wide});
    else Object.assign(this, {azimuth: -Math.PI / 2, elevation: 1.55, distance: wide});
  }

  /**
   * Shows the watched robot at several moments at once.
   * @param {Pose[]} poses empty: show none
   */
  showMoments(poses) {
    while (this.moments.length < poses.length) {
      const copy = new Robot(this.watched_vehicle, kMomentColour);
      this.moments.push(copy);
      this.scene.add(copy.group);
    }
    this.moments.forEach((copy, k) => {
      copy.group.visible = k < poses.length;
      if (k < poses.length) copy.show(poses[k]);
    });
  }

  /**
   * @param {(Pose | null)[]} poses one for each robot; null: hide it
   * @param {number[]} shares share of each flight that was flown
   * @param {{trail: boolean, arrows: boolean}} shown
   */
  draw(poses, shares, shown) {
    this.robots.forEach((robot, k) => {
      const pose = poses[k];
      robot.group.visible = pose !== null;
      this.trails[k].group.visible = pose !== null && shown.trail;
      if (pose) robot.show(pose);
      this.trails[k].show(shares[k]);
    });
    const pose = poses[0];
    this.velocity.visible = this.force.visible = false;
    if (pose) {
      this.watched = pose.position;
      if (shown.arrows) {
        const above = rotated(pose.attitude, [0, 0, this.top_m]).map((value, k) => value + pose.position[k]);
        this.velocity.show(pose.position, pose.velocity.map((value) => value * kVelocityArrow_s * this.size));
        this.force.show(above, pose.force.map((value) => value * kForceArrow_m * this.size / this.weight_N));
      }
      const height = pose.position[2] - this.floor_m;
      this.shadow.position.set(pose.position[0], pose.position[1], this.floor_m + 0.0005);
      this.shadow.material.opacity = 0.35 / (1 + 4 * Math.max(0, height));
    }
    this.target = this.view === "chase" ? this.watched : this.middle;
    this.render();
  }
}
