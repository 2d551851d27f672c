// The line of the track in space: places and axes along it.

// Shared by the files of the 3D view. Everything else in them is in a block.
const scenes = {};

{
  const AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  // Longest piece of the track (m) drawn without a bend.
  const PIECE = 1;

  scenes.Course = class {
    // `line` has points of 12 numbers at equal distances, or is null for a straight track along x.
    constructor(line, get) {
      this.line = line && { ...line, points: get(line.points) };
      this.straight = !line;
    }

    // The line at a place: its position, and the axes along, left and up.
    at(s) {
      if (this.straight) return { origin: [s, 0, 0], axes: AXES };
      const { start, step, points } = this.line;
      const last = points.length / 12 - 1;
      const index = Math.min(Math.max(Math.floor((s - start) / step), 0), last - 1);
      const part = (s - start) / step - index;
      const number = (k, i) => points[12 * (index + k) + i];
      const beyond = part < 0 ? 0 : 1;
      if (part < 0 || part > 1) {
        // straight on from the end
        const axes = [0, 1, 2].map((a) => [0, 1, 2].map((i) => number(beyond, 3 + 3 * a + i)));
        const far = (part - beyond) * step;
        return { origin: [0, 1, 2].map((i) => number(beyond, i) + far * axes[0][i]), axes };
      }
      // position by the tangents at both ends, axes between
      const [a, b] = [part * part * (3 - 2 * part), part * part * (part - 1)];
      const origin = [0, 1, 2].map(
        (i) => number(0, i) * (1 - a) + number(1, i) * a + step * (part * (1 - part) ** 2 * number(0, 3 + i) + b * number(1, 3 + i)),
      );
      const axes = [0, 1, 2].map((axis) => {
        const sum = [0, 1, 2].map((i) => number(0, 3 + 3 * axis + i) * (1 - part) + number(1, 3 + 3 * axis + i) * part);
        const length = Math.hypot(...sum);
        return sum.map((it) => it / length);
      });
      return { origin, axes };
    }

    // The same with vertical up axis: heading only.
    level(s) {
      const { origin, axes } = this.at(s);
      const [x, y] = axes[0];
      const long = Math.hypot(x, y) || 1;
      return { origin, axes: [[x / long, y / long, 0], [-y / long, x / long, 0], AXES[2]] };
    }

    // Number of pieces that follow the line between two places.
    pieces(from, to, least) {
      return this.straight ? least : Math.max(least, Math.ceil((to - from) / PIECE));
    }

    // Position of a point across a frame, `y` to the left and `z` up.
    static point({ origin, axes }, y, z) {
      return origin.map((it, i) => it + y * axes[1][i] + z * axes[2][i]);
    }

    // A frame as a matrix, from coordinates along, left and up.
    static matrix(THREE, { origin, axes }) {
      const matrix = new THREE.Matrix4();
      const [along, left, up] = axes.map((axis) => new THREE.Vector3(...axis));
      return matrix.makeBasis(along, left, up).setPosition(...origin);
    }
  };
}
