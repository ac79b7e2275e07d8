/** Where a ray meets a mesh. */

/**
 * How far along `towards` a ray from `origin` first meets a mesh {vertices, faces}, in lengths of `towards`; null
 * where it misses. Möller and Trumbore (1997), both sides of a face.
 *
 * @param {Mesh} mesh
 * @param {Vector} origin
 * @param {Vector} towards
 */
export function firstHit({ vertices, faces }, [ox, oy, oz], [dx, dy, dz]) {
  let nearest = Infinity;
  for (let i = 0; i < faces.length; i += 3) {
    const [a, b, c] = [3 * faces[i], 3 * faces[i + 1], 3 * faces[i + 2]];
    const [ax, ay, az] = [vertices[a], vertices[a + 1], vertices[a + 2]];
    const [ux, uy, uz] = [vertices[b] - ax, vertices[b + 1] - ay, vertices[b + 2] - az];
    const [vx, vy, vz] = [vertices[c] - ax, vertices[c + 1] - ay, vertices[c + 2] - az];
    const [px, py, pz] = [dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx];
    const determinant = ux * px + uy * py + uz * pz;
    if (determinant === 0) continue;
    const [tx, ty, tz] = [ox - ax, oy - ay, oz - az];
    const first = (tx * px + ty * py + tz * pz) / determinant;
    if (first < 0 || first > 1) continue;
    const [qx, qy, qz] = [ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux];
    const second = (dx * qx + dy * qy + dz * qz) / determinant;
    if (second < 0 || first + second > 1) continue;
    const far = (vx * qx + vy * qy + vz * qz) / determinant;
    if (far > 0 && far < nearest) nearest = far;
  }
  return nearest === Infinity ? null : nearest;
}
