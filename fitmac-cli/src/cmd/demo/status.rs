//! One refreshing line: phase, route, progress.

use std::io::{IsTerminal, Write};

use crate::crew::Progress;

/// Marks of the bar.
const BAR: usize = 24;

/// The line of a run. Without a terminal only its last state is written.
pub(super) struct StatusLine {
    title: &'static str,
    terminal: bool,
    text: String,
}

impl StatusLine {
    /// An empty line.
    pub(super) fn new(title: &'static str) -> Self {
        Self {
            title,
            terminal: std::io::stderr().is_terminal(),
            text: String::new(),
        }
    }

    /// Shows where the episode stands.
    pub(super) fn show(&mut self, progress: &Progress) {
        self.text = text(self.title, progress);
        if self.terminal {
            // Return, clear to the end of the line. A status that cannot be
            // written is no reason to stop the robot.
            let _ = write!(std::io::stderr(), "\r\x1b[K{}", self.text);
        }
    }

    /// Leaves the last state standing.
    pub(super) fn finish(self) {
        match (self.terminal, self.text.is_empty()) {
            (true, false) => eprintln!(),
            (false, false) => eprintln!("{}", self.text),
            (_, true) => {}
        }
    }
}

fn text(title: &str, progress: &Progress) -> String {
    let Progress {
        step,
        steps_max,
        phase,
        route,
        sub_phase,
        ..
    } = progress;
    let done = (*step).min(*steps_max) as usize * BAR / (*steps_max).max(1) as usize;
    let route = route.replace('_', " ");
    let doing = match sub_phase.as_str() {
        "idle" | "waiting" => route,
        recovery => format!("{route}: {}", recovery.replace('_', " ")),
    };
    format!(
        "{title:<13} [{}{}] step {step:>3}/{steps_max}  {phase:<10} {doing:<34} \
         to target {:>4.0} mm, to destination {:>4.0} mm",
        "#".repeat(done),
        ".".repeat(BAR - done),
        progress.target_distance_m * 1e3,
        progress.destination_distance_m * 1e3,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_tells_phase_route_and_progress() {
        let progress = Progress {
            step: 145,
            steps_max: 290,
            phase: "transport".into(),
            route: "pending_correction".into(),
            sub_phase: "move_above_destination".into(),
            target_distance_m: 0.012,
            destination_distance_m: 0.3456,
        };
        let line = text("with FIT-MAC", &progress);
        for part in [
            "with FIT-MAC",
            "[############............]",
            "145/290",
            "transport",
            "pending correction: move above destination",
            "12 mm",
            "346 mm",
        ] {
            assert!(line.contains(part), "{line:?} lacks {part:?}");
        }
    }

    #[test]
    fn more_steps_than_planned_fill_the_bar_and_no_more() {
        let progress = Progress {
            step: 500,
            steps_max: 290,
            phase: String::new(),
            route: String::new(),
            sub_phase: "idle".into(),
            target_distance_m: f64::NAN,
            destination_distance_m: 0.0,
        };
        assert!(text("", &progress).contains(&format!("[{}]", "#".repeat(BAR))));
    }
}
