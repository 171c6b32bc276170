//! A plot of an episode: distances over time, phase and route as bands below.

use plotters::prelude::*;

use crate::error::SimError;
use crate::picture::use_embedded_font;
use crate::raster::Raster;

/// One instant of an episode.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Time since the start, s.
    pub time_s: f64,
    /// End effector to target, m; NaN if unknown.
    pub target_distance_m: f64,
    /// Object to destination, m; NaN if unknown.
    pub destination_distance_m: f64,
    /// Distance between the finger pads, m.
    pub gripper_width_m: f64,
    /// Name of the phase.
    pub phase: String,
    /// Name of the route.
    pub route: String,
}

/// Colours of the bands, given out in the order in which names first appear.
const BAND_COLOURS: [RGBColor; 8] = [
    RGBColor(189, 215, 238),
    RGBColor(248, 203, 173),
    RGBColor(198, 224, 180),
    RGBColor(255, 230, 153),
    RGBColor(217, 200, 230),
    RGBColor(180, 220, 215),
    RGBColor(240, 190, 200),
    RGBColor(210, 210, 210),
];

/// Draws an episode, `width` by `height` pixels.
///
/// # Errors
/// [`SimError::Picture`] if there are fewer than two samples or the drawing library fails.
pub fn episode(
    title: &str,
    samples: &[Sample],
    width: usize,
    height: usize,
) -> Result<Raster, SimError> {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return Err(failed("there is no sample"));
    };
    if last.time_s <= first.time_s {
        return Err(failed("the samples span no time"));
    }
    use_embedded_font();
    let mut raster = Raster {
        width,
        height,
        rgb: vec![255; 3 * width * height],
    };
    let size = (width as u32, height as u32);
    {
        let root = BitMapBackend::with_buffer(&mut raster.rgb, size).into_drawing_area();
        let (upper, lower) = root.split_vertically(height as i32 - 110);
        let span = first.time_s..last.time_s;
        lines(&upper, title, samples, span.clone()).map_err(|e| failed(&e.to_string()))?;
        bands(&lower, samples, span).map_err(|e| failed(&e.to_string()))?;
        root.present().map_err(|e| failed(&e.to_string()))?;
    }
    Ok(raster)
}

fn failed(problem: &str) -> SimError {
    SimError::Picture {
        what: "plot of an episode".to_owned(),
        problem: problem.to_owned(),
    }
}

type Area<'a> = DrawingArea<BitMapBackend<'a>, plotters::coord::Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;
type Series = (&'static str, RGBColor, fn(&Sample) -> f64);
type Band = (&'static str, f64, fn(&Sample) -> &str);

fn lines(area: &Area<'_>, title: &str, samples: &[Sample], span: std::ops::Range<f64>) -> Drawn {
    let values = |s: &Sample| {
        [
            s.target_distance_m,
            s.destination_distance_m,
            s.gripper_width_m,
        ]
    };
    let highest = samples
        .iter()
        .flat_map(values)
        .filter(|v| v.is_finite())
        .fold(0.1, f64::max);
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 16))
        .margin(8)
        .x_label_area_size(28)
        .y_label_area_size(58)
        .build_cartesian_2d(span, 0.0..1.3 * highest)?; // room for the legend
    chart
        .configure_mesh()
        .x_desc("time, s")
        .y_desc("distance, m")
        .label_style(("sans-serif", 12))
        .light_line_style(WHITE.mix(0.0))
        .draw()?;
    let series: [Series; 3] = [
        ("end effector to target", RGBColor(31, 119, 180), |s| {
            s.target_distance_m
        }),
        ("object to destination", RGBColor(214, 39, 40), |s| {
            s.destination_distance_m
        }),
        ("gripper opening", RGBColor(120, 120, 120), |s| {
            s.gripper_width_m
        }),
    ];
    for (name, colour, value) in series {
        // A gap in the data is a gap in the line.
        for run in samples.split(|s| !value(s).is_finite()) {
            let points = run.iter().map(|s| (s.time_s, value(s)));
            chart.draw_series(LineSeries::new(points, colour.stroke_width(2)))?;
        }
        chart
            .draw_series(LineSeries::new(std::iter::empty::<(f64, f64)>(), colour))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .label_font(("sans-serif", 12))
        .draw()?;
    Ok(())
}

fn bands(area: &Area<'_>, samples: &[Sample], span: std::ops::Range<f64>) -> Drawn {
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .x_label_area_size(0)
        .y_label_area_size(58)
        .build_cartesian_2d(span, 0.0..2.0)?;
    let rows: [Band; 2] = [("phase", 1.0, |s| &s.phase), ("route", 0.0, |s| &s.route)];
    for (row, bottom, name) in rows {
        let mut seen: Vec<&str> = Vec::new();
        let (left, middle) = (
            area.get_base_pixel().0 + 10,
            chart.backend_coord(&(0.0, bottom + 0.5)),
        );
        area.draw_text(
            row,
            &("sans-serif", 12).into_font().color(&BLACK),
            (left, middle.1 - area.get_base_pixel().1 - 6),
        )?;
        for run in samples.chunk_by(|a, b| name(a) == name(b)) {
            let (Some(first), Some(last)) = (run.first(), run.last()) else {
                continue;
            };
            let label = name(first);
            let known = seen.iter().position(|s| *s == label).unwrap_or_else(|| {
                seen.push(label);
                seen.len() - 1
            });
            let colour = BAND_COLOURS[known % BAND_COLOURS.len()];
            let end = samples
                .iter()
                .find(|s| s.time_s > last.time_s)
                .map_or(last.time_s, |next| next.time_s);
            let corners = [(first.time_s, bottom + 0.08), (end, bottom + 0.92)];
            chart.draw_series([Rectangle::new(corners, colour.filled())])?;
            let shown = chart.backend_coord(&corners[1]).0 - chart.backend_coord(&corners[0]).0;
            // A name is written only where it fits: about 7 px a letter.
            if shown > 7 * label.len() as i32 {
                let style = ("sans-serif", 11).into_font().color(&BLACK);
                let at = (first.time_s, bottom + 0.72);
                chart.draw_series([Text::new(label.to_owned(), at, style)])?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(i: usize) -> Sample {
        Sample {
            time_s: 0.05 * i as f64,
            target_distance_m: if i < 50 {
                0.4 - 0.005 * i as f64
            } else {
                f64::NAN
            },
            destination_distance_m: 0.5,
            gripper_width_m: 0.08,
            phase: if i < 50 { "approach" } else { "transport" }.to_owned(),
            route: "base".to_owned(),
        }
    }

    #[test]
    fn a_plot_shows_lines_and_bands() {
        let samples: Vec<Sample> = (0..100).map(sample).collect();
        let plot = episode("seed 7", &samples, 800, 420).unwrap();
        let has = |c: [u8; 3]| plot.rgb.chunks_exact(3).any(|p| p == c);
        assert!(has([31, 119, 180]), "no line of the target's distance");
        assert!(
            has([189, 215, 238]) && has([248, 203, 173]),
            "no two bands of phases"
        );
    }

    #[test]
    fn too_few_samples_are_refused() {
        assert!(episode("x", &[], 800, 420).is_err());
        assert!(episode("x", &[sample(0)], 800, 420).is_err());
    }
}
