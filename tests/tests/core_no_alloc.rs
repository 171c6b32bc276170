//! A tick allocates nothing: a counting allocator watches it.

mod meter;

use fitmac_core::Controller;
use fitmac_core_tests::swarm::Swarm;
use meter::calls;

#[test]
fn inv_64_a_tick_allocates_nothing() {
    let (mut queries, mut corrections) = (0, 0);
    for seed in 0..60 {
        let mut swarm = Swarm::new(seed);
        let mut controller = Controller::new(swarm.params);
        for n in 0..1500 {
            let told = swarm.tick();
            let input = told.input();
            let mut output = None;
            let allocated = calls(|| output = Some(controller.tick(told.now_ns, &input)));
            assert_eq!(allocated, 0, "seed {seed}, tick {n}");
            let output = output.expect("set above");
            queries += u32::from(output.trace.is_some());
            corrections += u32::from(output.command.sub_phase != 0);
            swarm.hear(&output);
        }
    }
    assert!(
        queries > 1000 && corrections > 1000,
        "{queries} {corrections}"
    );
}

#[test]
fn inv_64_a_snapshot_is_a_copy() {
    let mut swarm = Swarm::new(7);
    let mut controller = Controller::new(swarm.params);
    let told = swarm.tick();
    controller.tick(told.now_ns, &told.input());
    let mut copy = None;
    assert_eq!(calls(|| copy = Some(controller.state().clone())), 0);
    assert_eq!(copy.as_ref(), Some(controller.state()));
}
