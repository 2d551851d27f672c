// Labels in a plot that do not overlap.

/** The places that labels already take: [left, top, right, bottom] each. */
class Places {
  constructor() {
    this.taken = [];
  }

  /** The first of some places [left, top] where a label of this size overlaps no other, or null. */
  find(width, height, candidates) {
    for (const [left, top] of candidates) {
      const box = [left, top, left + width, top + height];
      const free = this.taken.every((it) => box[0] >= it[2] || it[0] >= box[2] || box[1] >= it[3] || it[1] >= box[3]);
      if (!free) continue;
      this.taken.push(box);
      return [left, top];
    }
    return null;
  }
}

/** Writes a text with an edge in the colour of the ground, so that lines below it do not hide it. */
function writeLabel(ctx, text, left, top, height, ink, edge) {
  ctx.setLineDash([]);
  ctx.lineJoin = "round";
  ctx.lineWidth = height * 0.3;
  ctx.strokeStyle = edge;
  ctx.fillStyle = ink;
  ctx.textAlign = "left";
  ctx.textBaseline = "middle";
  ctx.strokeText(text, left, top + height / 2);
  ctx.fillText(text, left, top + height / 2);
}
