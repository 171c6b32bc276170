//! Pictures for people: PNG files, strips of captioned frames.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::OnceLock;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, register_font};

use crate::error::SimError;
use crate::raster::Raster;

/// Height of the caption under a frame, px.
const CAPTION_PX: usize = 44;
/// Space between frames, px.
const GAP_PX: usize = 6;
/// Most frames in a row of a strip.
const COLUMNS: usize = 4;

/// A frame of a strip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// What is seen.
    pub raster: Raster,
    /// A first line in bold, such as what happens.
    pub title: String,
    /// A second line, such as time, phase and route.
    pub detail: String,
}

/// Makes the embedded font known to the plotting library, so that no system font is needed.
pub(crate) fn use_embedded_font() {
    static REGISTERED: OnceLock<()> = OnceLock::new();
    REGISTERED.get_or_init(|| {
        for style in [FontStyle::Normal, FontStyle::Bold] {
            let font = epaint_default_fonts::HACK_REGULAR;
            // The font is part of the program: that it parses is shown by a test.
            let registered = register_font("sans-serif", style, font);
            debug_assert!(registered.is_ok(), "the embedded font does not parse");
        }
    });
}

/// Writes a picture as PNG.
///
/// # Errors
/// [`SimError::Io`] if the file can't be written.
pub fn write_png(path: &Path, raster: &Raster) -> Result<(), SimError> {
    let file = File::create(path).map_err(|e| SimError::io(path, e))?;
    encode(BufWriter::new(file), raster).map_err(|e| match e {
        png::EncodingError::IoError(e) => SimError::io(path, e),
        other => SimError::Picture {
            what: path.display().to_string(),
            problem: other.to_string(),
        },
    })
}

/// A picture as PNG in memory.
///
/// # Errors
/// [`SimError::Picture`] if the raster's size contradicts its pixels.
pub fn png_bytes(raster: &Raster) -> Result<Vec<u8>, SimError> {
    let mut bytes = Vec::new();
    encode(&mut bytes, raster).map_err(|e| SimError::Picture {
        what: "a picture in memory".to_owned(),
        problem: e.to_string(),
    })?;
    Ok(bytes)
}

fn encode(out: impl std::io::Write, raster: &Raster) -> Result<(), png::EncodingError> {
    let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let mut encoder = png::Encoder::new(out, size(raster.width), size(raster.height));
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&raster.rgb)?;
    writer.finish()
}

/// Puts frames side by side, each with its caption below, at most four in a row.
///
/// # Errors
/// [`SimError::Picture`] if there is no frame or the frames differ in size.
pub fn strip(frames: &[Frame]) -> Result<Raster, SimError> {
    let problem = |problem: &str| SimError::Picture {
        what: "strip of frames".to_owned(),
        problem: problem.to_owned(),
    };
    let first = &frames
        .first()
        .ok_or_else(|| problem("there is no frame"))?
        .raster;
    let (w, h) = (first.width, first.height);
    if frames
        .iter()
        .any(|f| (f.raster.width, f.raster.height) != (w, h))
    {
        return Err(problem("the frames differ in size"));
    }
    let columns = frames.len().min(COLUMNS);
    let rows = frames.len().div_ceil(COLUMNS);
    let width = columns * (w + GAP_PX) - GAP_PX;
    let height = rows * (h + CAPTION_PX);
    let mut canvas = Raster {
        width,
        height,
        rgb: vec![255; 3 * width * height],
    };
    for (i, frame) in frames.iter().enumerate() {
        let left = i % COLUMNS * (w + GAP_PX);
        let top = i / COLUMNS * (h + CAPTION_PX);
        for row in 0..h {
            let from = 3 * row * w;
            let to = 3 * ((top + row) * width + left);
            canvas.rgb[to..to + 3 * w].copy_from_slice(&frame.raster.rgb[from..from + 3 * w]);
        }
    }
    caption(&mut canvas, frames, w, h)?;
    Ok(canvas)
}

fn caption(canvas: &mut Raster, frames: &[Frame], w: usize, h: usize) -> Result<(), SimError> {
    use_embedded_font();
    let failed = |e: &dyn std::fmt::Display| SimError::Picture {
        what: "caption".to_owned(),
        problem: e.to_string(),
    };
    let size = (canvas.width as u32, canvas.height as u32);
    let area = BitMapBackend::with_buffer(&mut canvas.rgb, size).into_drawing_area();
    let anchor = Pos::new(HPos::Left, VPos::Top);
    let title = ("sans-serif", 15).into_font().color(&BLACK).pos(anchor);
    let detail = ("sans-serif", 12)
        .into_font()
        .color(&RGBColor(90, 90, 90))
        .pos(anchor);
    for (i, frame) in frames.iter().enumerate() {
        let x = (i % COLUMNS * (w + GAP_PX) + 4) as i32;
        let y = (i / COLUMNS * (h + CAPTION_PX) + h + 4) as i32;
        area.draw_text(&frame.title, &title, (x, y))
            .map_err(|e| failed(&e))?;
        area.draw_text(&frame.detail, &detail, (x, y + 20))
            .map_err(|e| failed(&e))?;
    }
    area.present().map_err(|e| failed(&e))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(width: usize, shade: u8) -> Frame {
        let raster = Raster {
            width,
            height: 30,
            rgb: vec![shade; 3 * width * 30],
        };
        Frame {
            raster,
            title: "before".to_owned(),
            detail: "0.0 s".to_owned(),
        }
    }

    #[test]
    fn a_strip_keeps_its_frames_and_writes_captions() {
        let strip = strip(&[frame(120, 10), frame(120, 200)]).unwrap();
        assert_eq!((strip.width, strip.height), (246, 30 + CAPTION_PX));
        assert_eq!(&strip.rgb[..3], &[10, 10, 10]);
        assert_eq!(&strip.rgb[3 * 126..3 * 127], &[200, 200, 200]);
        let below = &strip.rgb[3 * 246 * 30..];
        assert!(
            below.iter().any(|&c| c < 100),
            "the caption left no dark pixel"
        );
    }

    #[test]
    fn frames_of_different_sizes_are_refused() {
        let error = strip(&[frame(120, 0), frame(121, 0)])
            .unwrap_err()
            .to_string();
        assert!(error.contains("differ in size"), "{error}");
        assert!(strip(&[]).is_err());
    }

    #[test]
    fn a_folder_that_does_not_exist_is_named() {
        let path = Path::new("/nowhere/at/all.png");
        let error = write_png(path, &frame(10, 0).raster)
            .unwrap_err()
            .to_string();
        assert!(error.contains("/nowhere/at/all.png"), "{error}");
    }
}
