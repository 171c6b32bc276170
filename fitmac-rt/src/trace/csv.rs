//! A trace as a table, for PlotJuggler and spreadsheets.

use std::io::{self, Write};

use fitmac_core::message::{Command, StateSample, TraceRecord};

use super::reader::Record;
use crate::diff::number;
use crate::layout::{Field, Kind, Layout, Payload, Shape};

/// Writes one row a tick: the time since the first tick in seconds, the
/// command, the newest state without its objects, the newest decision.
/// Columns are named like `command.action[0]`. Returns the rows written.
///
/// # Errors
/// If a row cannot be written.
pub fn write_csv(records: impl Iterator<Item = Record>, out: &mut impl Write) -> io::Result<u64> {
    let mut header = vec!["time_s".to_owned(), "tick".into(), "lateness_us".into()];
    columns("command", &Command::LAYOUT, &mut header);
    columns("state", &StateSample::LAYOUT, &mut header);
    columns("trace", &TraceRecord::LAYOUT, &mut header);
    writeln!(out, "{}", header.join(","))?;

    let mut state = StateSample::zeroed();
    let mut trace = TraceRecord::zeroed();
    let mut first_ns = None;
    let mut rows = 0;
    let mut row = String::new();
    for record in records {
        let Record::Tick(tick) = record else { continue };
        if let Some(newer) = tick.state.as_deref() {
            state = *newer;
        }
        if let Some(newer) = tick.output.trace {
            trace = newer;
        }
        let start_ns = *first_ns.get_or_insert(tick.head.now_ns);
        let time_s = tick.head.now_ns.wrapping_sub(start_ns) as f64 / 1e9;
        row.clear();
        row += &format!(
            "{time_s:.6},{},{:.3}",
            tick.head.tick,
            tick.head.lateness_ns as f64 / 1e3
        );
        cells(&Command::LAYOUT, tick.output.command.as_bytes(), &mut row);
        cells(&StateSample::LAYOUT, state.as_bytes(), &mut row);
        cells(&TraceRecord::LAYOUT, trace.as_bytes(), &mut row);
        writeln!(out, "{row}")?;
        rows += 1;
    }
    Ok(rows)
}

/// Fields that make sense in a table.
fn tabled(layout: &'static Layout) -> impl Iterator<Item = &'static Field> {
    layout.fields.iter().filter(|f| {
        !matches!(f.kind, Kind::Struct(_))
            && !matches!(f.shape, Shape::Matrix(..))
            && !f.name.starts_with("reserved")
    })
}

fn columns(prefix: &str, layout: &'static Layout, header: &mut Vec<String>) {
    for field in tabled(layout) {
        match field.shape {
            Shape::Scalar => header.push(format!("{prefix}.{}", field.name)),
            _ => header
                .extend((0..field.shape.count()).map(|i| format!("{prefix}.{}[{i}]", field.name))),
        }
    }
}

fn cells(layout: &'static Layout, bytes: &[u8], row: &mut String) {
    for field in tabled(layout) {
        for i in 0..field.shape.count() {
            let at = field.offset + i * field.kind.size();
            row.push(',');
            row.push_str(&number(field.kind, &bytes[at..at + field.kind.size()]));
        }
    }
}
