//! A small image to draw on: boxes, lines, text, PNG.

use embedded_graphics::Pixel;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Point, Size};
use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::ascii::{FONT_6X10, FONT_9X15_BOLD};
use embedded_graphics::pixelcolor::{Rgb888, RgbColor};
use embedded_graphics::prelude::Drawable;
use embedded_graphics::primitives::{Line, Primitive, PrimitiveStyle, Rectangle};
use embedded_graphics::text::{Baseline, Text};

/// Red, green, blue, 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour(pub [u8; 3]);

impl Colour {
    /// White.
    pub const WHITE: Self = Self([255; 3]);
    /// Black.
    pub const BLACK: Self = Self([0; 3]);
    /// Grey.
    pub const GREY: Self = Self([150; 3]);
    /// Red: candidates.
    pub const RED: Self = Self([220, 30, 30]);
    /// Green: references.
    pub const GREEN: Self = Self([20, 150, 40]);
    /// Blue: context.
    pub const BLUE: Self = Self([70, 120, 220]);
}

impl From<Colour> for Rgb888 {
    fn from(Colour([red, green, blue]): Colour) -> Self {
        Self::new(red, green, blue)
    }
}

/// An RGB image, 8 bits a channel, row by row from the upper left corner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Canvas {
    width_px: u32,
    height_px: u32,
    pixels: Vec<u8>,
}

/// Bytes that don't make an image of the given size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an image of {width_px} x {height_px} px needs {expected} bytes, there are {given}")]
pub struct SizeMismatch {
    width_px: u32,
    height_px: u32,
    expected: usize,
    given: usize,
}

/// An image that can't be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// No PNG.
    #[error("isn't a PNG that can be read: {0}")]
    Png(#[from] png::DecodingError),
    /// Larger than what is read.
    #[error("is {width_px} x {height_px} px, at most {SIDE_CAP_PX} px a side are read")]
    TooLarge {
        /// Its width, px.
        width_px: u32,
        /// Its height, px.
        height_px: u32,
    },
    /// Samples of a kind that isn't read.
    #[error("has pixels of the kind {0:?}, 8 bits of grey, RGB or RGBA are read")]
    Kind(png::ColorType),
}

/// Largest side of an image that is read, px.
pub const SIDE_CAP_PX: u32 = 4096;

impl Canvas {
    /// Reads a PNG; transparency is dropped.
    ///
    /// # Errors
    /// [`ReadError`] says why it can't be used.
    pub fn from_png(bytes: &[u8]) -> Result<Self, ReadError> {
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let mut reader = decoder.read_info()?;
        let (width_px, height_px) = (reader.info().width, reader.info().height);
        if width_px > SIDE_CAP_PX || height_px > SIDE_CAP_PX {
            return Err(ReadError::TooLarge {
                width_px,
                height_px,
            });
        }
        let mut data = vec![0; reader.output_buffer_size().unwrap_or_default()];
        let frame = reader.next_frame(&mut data)?;
        let samples = frame.color_type.samples();
        let pixels = match frame.color_type {
            png::ColorType::Grayscale | png::ColorType::GrayscaleAlpha => data
                .chunks_exact(samples)
                .flat_map(|pixel| [pixel[0]; 3])
                .collect(),
            png::ColorType::Rgb | png::ColorType::Rgba => data
                .chunks_exact(samples)
                .flat_map(|pixel| [pixel[0], pixel[1], pixel[2]])
                .collect(),
            other @ png::ColorType::Indexed => return Err(ReadError::Kind(other)),
        };
        Ok(Self {
            width_px,
            height_px,
            pixels,
        })
    }

    /// An image of one colour.
    #[must_use]
    pub fn filled(width_px: u32, height_px: u32, Colour(colour): Colour) -> Self {
        let count = width_px as usize * height_px as usize;
        Self {
            width_px,
            height_px,
            pixels: colour.repeat(count),
        }
    }

    /// An image from its RGB bytes.
    ///
    /// # Errors
    /// [`SizeMismatch`] if there aren't `width_px * height_px * 3` bytes.
    pub fn from_rgb(width_px: u32, height_px: u32, pixels: Vec<u8>) -> Result<Self, SizeMismatch> {
        let expected = width_px as usize * height_px as usize * 3;
        if pixels.len() == expected {
            Ok(Self {
                width_px,
                height_px,
                pixels,
            })
        } else {
            Err(SizeMismatch {
                width_px,
                height_px,
                expected,
                given: pixels.len(),
            })
        }
    }

    /// Width and height, px.
    #[must_use]
    pub fn size_px(&self) -> [u32; 2] {
        [self.width_px, self.height_px]
    }

    /// The RGB bytes.
    #[must_use]
    pub fn rgb(&self) -> &[u8] {
        &self.pixels
    }

    /// A line from one point to another, px.
    pub fn line(&mut self, from_px: [i32; 2], to_px: [i32; 2], colour: Colour) {
        let style = PrimitiveStyle::with_stroke(Rgb888::from(colour), 1);
        let line = Line::new(Point::from(from_px), Point::from(to_px));
        let Ok(()) = line.into_styled(style).draw(self);
    }

    /// A filled box with its upper left corner at `at_px`.
    pub fn fill(&mut self, at_px: [i32; 2], size_px: [u32; 2], colour: Colour) {
        let style = PrimitiveStyle::with_fill(Rgb888::from(colour));
        let area = Rectangle::new(Point::from(at_px), Size::from(size_px));
        let Ok(()) = area.into_styled(style).draw(self);
    }

    /// A frame of 2 px.
    pub fn frame(&mut self, at_px: [i32; 2], size_px: [u32; 2], colour: Colour) {
        let style = PrimitiveStyle::with_stroke(Rgb888::from(colour), 2);
        let area = Rectangle::new(Point::from(at_px), Size::from(size_px));
        let Ok(()) = area.into_styled(style).draw(self);
    }

    /// A line of ASCII text in 6 x 10 px letters, its upper left corner at
    /// `at_px`.
    pub fn text(&mut self, text: &str, at_px: [i32; 2], colour: Colour) {
        let style = MonoTextStyle::new(&FONT_6X10, Rgb888::from(colour));
        let Ok(_) = Text::with_baseline(text, Point::from(at_px), style, Baseline::Top).draw(self);
    }

    /// White text in 9 x 15 px letters on a plate of the given colour.
    pub fn tag(&mut self, text: &str, at_px: [i32; 2], colour: Colour) {
        let width = 9 * text.chars().count() as u32 + 4;
        self.fill(at_px, [width, 17], colour);
        let style = MonoTextStyle::new(&FONT_9X15_BOLD, Rgb888::WHITE);
        let at = Point::new(at_px[0] + 2, at_px[1] + 1);
        let Ok(_) = Text::with_baseline(text, at, style, Baseline::Top).draw(self);
    }

    /// The image as a PNG file.
    ///
    /// # Errors
    /// If an image has no pixels.
    pub fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width_px, self.height_px);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()?;
        Ok(file)
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.width_px, self.height_px)
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = std::convert::Infallible;

    fn draw_iter<I>(&mut self, pixels: I) -> Result<(), Self::Error>
    where
        I: IntoIterator<Item = Pixel<Self::Color>>,
    {
        for Pixel(point, colour) in pixels {
            let (Ok(x), Ok(y)) = (u32::try_from(point.x), u32::try_from(point.y)) else {
                continue;
            };
            if x < self.width_px && y < self.height_px {
                let at = 3 * (y as usize * self.width_px as usize + x as usize);
                if let Some(pixel) = self.pixels.get_mut(at..at + 3) {
                    pixel.copy_from_slice(&[colour.r(), colour.g(), colour.b()]);
                }
            }
        }
        Ok(())
    }
}
