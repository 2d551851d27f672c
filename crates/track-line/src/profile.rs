//! Angles along the line: polynomials by pieces.

use crate::description::{CantPiece, CantShape, Kind, Piece};

/// An angle over the length u from a piece's beginning: a + b·u + c·u² + d·u³.
pub(crate) type Cubic = [f64; 4];

/// An angle along the line, by pieces that follow each other from s = 0.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AngleProfile {
    /// Where each piece begins, m, and its polynomial. The last one continues for ever.
    pieces: Vec<(f64, Cubic)>,
}

impl AngleProfile {
    /// Heading or slope of checked pieces, with the curvature at each piece's end.
    pub fn of_pieces(pieces: &[Piece]) -> Self {
        let (mut at, mut angle, mut curvature) = (0.0, 0.0, 0.0);
        let mut list = Vec::new();
        for piece in pieces {
            let end = end_curvature(piece);
            let bend = match piece.kind {
                Kind::Clothoid => (end - curvature) / (2.0 * piece.length),
                Kind::Straight | Kind::Circle => 0.0,
            };
            let start = if piece.kind == Kind::Clothoid { curvature } else { end };
            list.push((at, [angle, start, bend, 0.0]));
            angle += piece.length * (start + bend * piece.length);
            at += piece.length;
            curvature = end;
        }
        list.push((at, [angle, 0.0, 0.0, 0.0]));
        Self { pieces: list }
    }

    /// Cant of checked pieces.
    pub fn of_cant(pieces: &[CantPiece]) -> Self {
        let (mut at, mut angle) = (0.0, 0.0);
        let mut list = Vec::new();
        for piece in pieces {
            let (rise, l) = (piece.to.unwrap_or(angle) - angle, piece.length);
            list.push((
                at,
                match piece.shape {
                    CantShape::Linear => [angle, rise / l, 0.0, 0.0],
                    CantShape::Smooth => {
                        [angle, 0.0, 3.0 * rise / (l * l), -2.0 * rise / (l * l * l)]
                    }
                },
            ));
            angle += rise;
            at += l;
        }
        list.push((at, [angle, 0.0, 0.0, 0.0]));
        Self { pieces: list }
    }

    /// Where pieces begin, m.
    pub fn knots(&self) -> impl Iterator<Item = f64> {
        self.pieces.iter().map(|(at, _)| *at)
    }

    /// The polynomial about s, which is inside a piece.
    pub fn about(&self, s: f64) -> Cubic {
        let k = self.pieces.partition_point(|(at, _)| *at <= s).saturating_sub(1);
        let Some((at, [a, b, c, d])) = self.pieces.get(k) else { return [0.0; 4] };
        let u = s - at;
        [a + u * (b + u * (c + u * d)), b + u * (2.0 * c + 3.0 * u * d), c + 3.0 * u * d, *d]
    }
}

/// Curvature at the end of a piece, 1/m.
pub(crate) fn end_curvature(piece: &Piece) -> f64 {
    let radius = match piece.kind {
        Kind::Straight => None,
        Kind::Circle => piece.radius,
        Kind::Clothoid => piece.to_radius,
    };
    radius.map_or(0.0, |radius| 1.0 / radius)
}
