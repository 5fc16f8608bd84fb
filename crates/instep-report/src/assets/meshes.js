// Unit shapes. A vertex is x, y, z, cap, nx, ny, nz: the shader places it at xyz * size + (0, 0, cap * half), so that one
// capsule mesh serves all radii and lengths, and a sphere is a capsule of no length.
const meshes = {
  capsule(around = 40, rings = 14) {
    const vertices = [], indices = [];
    for (const cap of [1, -1])
      for (let i = 0; i <= rings; i++) {
        const polar = (Math.PI / 2) * (cap > 0 ? i / rings : 1 + i / rings);
        for (let j = 0; j <= around; j++) {
          const a = (2 * Math.PI * j) / around;
          const p = [Math.sin(polar) * Math.cos(a), Math.sin(polar) * Math.sin(a), Math.cos(polar)];
          vertices.push(...p, cap, ...p);
        }
      }
    const row = around + 1;
    for (let i = 0; i < 2 * rings + 1; i++)
      for (let j = 0; j < around; j++) {
        const k = i * row + j;
        indices.push(k, k + row, k + 1, k + 1, k + row, k + row + 1);
      }
    return { vertices, indices };
  },

  // A cylinder (top 1) or a cone (top 0) of radius 1 from z = -1 to z = 1.
  cylinder(top = 1, around = 40) {
    const vertices = [], indices = [];
    const nz = (1 - top) / 2, nr = 1;
    for (let j = 0; j <= around; j++) {
      const a = (2 * Math.PI * j) / around, c = Math.cos(a), s = Math.sin(a);
      vertices.push(c, s, -1, 0, c * nr, s * nr, nz, c * top, s * top, 1, 0, c * nr, s * nr, nz);
      if (j < around) indices.push(2 * j, 2 * j + 2, 2 * j + 1, 2 * j + 1, 2 * j + 2, 2 * j + 3);
    }
    for (const z of top ? [-1, 1] : [-1]) {
      const middle = vertices.length / 7;
      vertices.push(0, 0, z, 0, 0, 0, z);
      for (let j = 0; j <= around; j++) {
        const a = (2 * Math.PI * j) / around;
        vertices.push(Math.cos(a), Math.sin(a), z, 0, 0, 0, z);
        if (j < around) indices.push(middle, middle + 1 + (z > 0 ? j : j + 1), middle + 1 + (z > 0 ? j + 1 : j));
      }
    }
    return { vertices, indices };
  },

  box() {
    const vertices = [], indices = [];
    for (let axis = 0; axis < 3; axis++)
      for (const sign of [-1, 1]) {
        const start = vertices.length / 7;
        for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
          const p = [0, 0, 0], n = [0, 0, 0];
          p[axis] = n[axis] = sign;
          p[(axis + 1) % 3] = u;
          p[(axis + 2) % 3] = v;
          vertices.push(...p, 0, ...n);
        }
        const order = sign > 0 ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2];
        indices.push(...order.map(i => start + i));
      }
    return { vertices, indices };
  },

  // Two triangles over [-1, 1]^2 at z = 0.
  quad: () => ({
    vertices: [[-1, -1], [1, -1], [1, 1], [-1, 1]].flatMap(([x, y]) => [x, y, 0, 0, 0, 0, 1]),
    indices: [0, 1, 2, 0, 2, 3],
  }),
};
