//! No tick takes more instructions than in the committed baseline. Counts, not times: they are the
//! same on a busy machine.

use fitmac_benches::{
    baseline,
    ticks::{self, Ticks},
};

#[test]
fn inv_65_no_tick_takes_more_instructions_than_in_the_baseline() {
    let counted = ticks::count(Ticks::Known).expect("the harness builds and runs");
    let Some(costs) = counted else {
        println!("skipped: Valgrind is not installed (Debian, Ubuntu: `apt-get install valgrind`)");
        return;
    };
    let worse = baseline::worse(
        &baseline::read().expect("the baseline is read"),
        &baseline::table(&costs),
    );
    assert!(
        worse.is_empty(),
        "if that is meant, `cargo xtask bench core --renew` writes a new baseline:\n{}",
        worse.join("\n")
    );
}
