//! Speed of the evaluation, by processor time of one thread: it doesn't depend on what else the
//! machine does, nor on the number of cores.
//!
//! `cargo xtask bench eval [--episodes N] [--json]`: about half a minute with the default of 1.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};
use sim_harness::evaluation::{Config, Grid, Preset, Vision, play};
use sim_harness::perturb::{Level, Perturbation};

/// LIBERO's own scripted episodes a core-hour: 40 to 85 policy steps a second, measured.
const LIBERO_EPISODES_AN_HOUR: [u32; 2] = [1_100, 1_600];

/// Tasks that are played: short and long ways, small and large scenes.
const TASKS: [&str; 4] = ["alphabet_soup", "milk", "table_center", "on_cabinet"];

fn cpu_time() -> Duration {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(
        u64::try_from(now.tv_sec).unwrap_or(0),
        u32::try_from(now.tv_nsec).unwrap_or(0),
    )
}

struct Row {
    name: &'static str,
    episodes: usize,
    simulated_s: f64,
    cpu_s: f64,
}

impl Row {
    fn speed(&self) -> f64 {
        self.simulated_s / self.cpu_s
    }

    fn episodes_an_hour(&self) -> f64 {
        self.episodes as f64 * 3600.0 / self.cpu_s
    }
}

fn row(
    name: &'static str,
    config: &str,
    vision: Vision,
    episodes: u32,
) -> Result<Row, sim_harness::SimError> {
    let grid = Grid {
        tasks: TASKS.map(str::to_owned).to_vec(),
        perturbations: vec![
            (Perturbation::None, Level::Standard),
            (Perturbation::Pos, Level::Standard),
        ],
        configs: vec![Config::parse(config)?],
        visions: vec![vision],
        episodes,
        ..Preset::Smoke.grid()?
    };
    let specs = grid.episodes()?;
    let start = cpu_time();
    let mut simulated_s = 0.0;
    for spec in &specs {
        simulated_s += play(spec)?.sim_seconds;
    }
    Ok(Row {
        name,
        episodes: specs.len(),
        simulated_s,
        cpu_s: (cpu_time() - start).as_secs_f64(),
    })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let after = |name: &str| arguments.iter().skip_while(|a| *a != name).nth(1);
    let episodes = after("--episodes").map_or(Ok(1), |text| text.parse())?;
    let rows = [
        row("policy alone", "base", Vision::Truth, episodes)?,
        row("with FIT-MAC, true poses", "full", Vision::Truth, episodes)?,
        row(
            "with FIT-MAC, modelled perception",
            "full",
            Vision::Modelled,
            episodes,
        )?,
    ];
    if arguments.iter().any(|a| a == "--json") {
        for row in &rows {
            println!(
                "{{\"name\":\"{}\",\"episodes\":{},\"simulated_s\":{:.1},\"core_s\":{:.2},\"simulated_s_per_core_s\":{:.1},\"episodes_per_core_hour\":{:.0}}}",
                row.name,
                row.episodes,
                row.simulated_s,
                row.cpu_s,
                row.speed(),
                row.episodes_an_hour()
            );
        }
        return Ok(());
    }
    println!(
        "{:36} {:>9} {:>17} {:>19}",
        "", "episodes", "simulated s / core s", "episodes / core-hour"
    );
    for row in &rows {
        println!(
            "{:36} {:>9} {:>20.1} {:>20.0}",
            row.name,
            row.episodes,
            row.speed(),
            row.episodes_an_hour()
        );
    }
    let [least, most] = LIBERO_EPISODES_AN_HOUR;
    println!("LIBERO's own environment, scripted: {least} to {most} episodes a core-hour");
    Ok(())
}
