//! `model.png`: the picture that tools show for a unit, drawn from its SVG.

use anyhow::{Context, Result};
use resvg::{tiny_skia::Pixmap, tiny_skia::Transform, usvg};

/// Width of the picture in pixels; tools scale it to the size of their blocks.
const WIDTH: u32 = 512;

/// An SVG without text as PNG.
pub fn png(svg: &str) -> Result<Vec<u8>> {
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default())?;
    let size = tree.size().to_int_size().scale_to_width(WIDTH).context("the picture is empty")?;
    let mut pixels =
        Pixmap::new(size.width(), size.height()).context("the picture is too large")?;
    let scale = size.width() as f32 / tree.size().width();
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixels.as_mut());
    Ok(pixels.encode_png()?)
}
