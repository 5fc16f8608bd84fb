// Vectors are arrays [x, y, z], quaternions [w, x, y, z], matrices 16 numbers column by column (as WebGL wants them).
const math = {
  add: (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]],
  sub: (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]],
  scale: (a, s) => [a[0] * s, a[1] * s, a[2] * s],
  dot: (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
  cross: (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
  length: a => Math.hypot(a[0], a[1], a[2]),
  unit: a => math.scale(a, 1 / (math.length(a) || 1)),
  clamp: (x, low, high) => Math.min(high, Math.max(low, x)),

  // Index i of the frame at or before t in rising times, and how far t is towards frame i + 1 (0 to 1).
  frameAt(times, t) {
    let low = 0, high = times.length - 1;
    if (high <= 0 || t <= times[0]) return [0, 0];
    if (t >= times[high]) return [high, 0];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t) low = middle; else high = middle;
    }
    return [low, (t - times[low]) / (times[high] - times[low])];
  },

  // The shorter way from a to b; fine for the small turns between frames.
  mixQuaternions(a, b, s) {
    const sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -1 : 1;
    const q = a.map((v, i) => v * (1 - s) + sign * b[i] * s);
    const n = Math.hypot(...q) || 1;
    return q.map(v => v / n);
  },

  // Turns +z to the unit vector v.
  quaternionFromZ(v) {
    const w = 1 + v[2];
    if (w < 1e-6) return [0, 1, 0, 0];
    const n = Math.hypot(w, v[0], v[1]);
    return [w / n, -v[1] / n, v[0] / n, 0];
  },

  multiply(a, b) {
    const out = new Float32Array(16);
    for (let c = 0; c < 4; c++)
      for (let r = 0; r < 4; r++)
        out[c * 4 + r] = a[r] * b[c * 4] + a[4 + r] * b[c * 4 + 1] + a[8 + r] * b[c * 4 + 2] + a[12 + r] * b[c * 4 + 3];
    return out;
  },

  perspective(fovY, aspect, near, far) {
    const f = 1 / Math.tan(fovY / 2), d = 1 / (near - far);
    return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) * d, -1, 0, 0, 2 * far * near * d, 0];
  },

  orthographic: (r, depth) => [1 / r, 0, 0, 0, 0, 1 / r, 0, 0, 0, 0, -1 / depth, 0, 0, 0, 0, 1],

  lookAt(eye, target, up) {
    const z = math.unit(math.sub(eye, target)), x = math.unit(math.cross(up, z)), y = math.cross(z, x);
    return [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -math.dot(x, eye), -math.dot(y, eye), -math.dot(z, eye), 1];
  },
};
