//! Every entry below is linked into a program whose panic handler calls a function that does not
//! exist. The linker drops what cannot be reached: the program links only if no panic can be. There
//! is no allocator either: what allocates does not link.
#![no_std]
#![no_main]

use kinematics::clearance::{self, Obstacle, PANDA_HAND};
use kinematics::diff_ik::{self, Tuning};
use kinematics::object::{Camera, Carried, Observed, SlipThresholds, TipAt};
use kinematics::otg::{Input, Otg};
use kinematics::panda::{self, LIMITS, Panda};
use kinematics::pose_ik::{self, Search};
use kinematics::{Arm, Chain, Pose};

unsafe extern "C" {
    /// Defined nowhere.
    fn a_panic_can_be_reached() -> !;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // SAFETY: never linked, so never called.
    unsafe { a_panic_can_be_reached() }
}

/// Makes the optimiser forget where a value comes from.
fn unknown<T>(value: T) -> T {
    core::hint::black_box(value)
}

#[unsafe(no_mangle)]
extern "C" fn check_arms(q: &[f64; 7], v: &[f64; 7], chain: &Chain<7>) {
    unknown(Panda.solve(q).ok());
    unknown(panda::chain().ok());
    unknown(chain.solve(q).ok());
    unknown(chain.links(q).ok());
    unknown(chain.jacobian_dot_velocity(q, v).ok());
    unknown(chain.solve(q).map(|s| s.jacobian.manipulability()).ok());
}

#[unsafe(no_mangle)]
extern "C" fn check_inverse(q: &[f64; 7], v: &[f64; 7], twist: &[f64; 6], target: &Pose) {
    if let Ok(at) = Panda.solve(q) {
        let tuning = Tuning::default();
        unknown(diff_ik::velocities(&at, q, &LIMITS, twist, v, &tuning).ok());
    }
    unknown(pose_ik::solve(&Panda, target, q, &Search::default()).ok());
}

#[unsafe(no_mangle)]
extern "C" fn check_motion(otg: &mut Otg<3>, input: &Input<3>, dt: f64) {
    unknown(otg.update(input, dt));
}

#[unsafe(no_mangle)]
extern "C" fn check_motion_of_seven(otg: &mut Otg<7>, input: &Input<7>, dt: f64) {
    unknown(otg.update(input, dt));
}

#[unsafe(no_mangle)]
extern "C" fn check_objects(camera: &Camera, seen: &Observed, tip: &TipAt) {
    unknown(camera.to_base(seen, tip, 0.01).ok());
    if let Ok(carried) = Carried::grasp(seen, tip) {
        unknown(carried.check(seen, tip, &SlipThresholds::default()).ok());
    }
}

#[unsafe(no_mangle)]
extern "C" fn check_clearance(path: &[Pose; 4], obstacles: &[Obstacle; 4]) {
    unknown(clearance::narrowest(&PANDA_HAND, path, obstacles).ok());
}

#[unsafe(no_mangle)]
extern "C" fn check_tick(
    controller: &mut fitmac_core::Controller,
    now_ns: u64,
    input: &fitmac_core::message::Input<'_>,
) {
    unknown(controller.tick(now_ns, input));
}

/// The control: an index out of range.
#[cfg(feature = "control")]
#[unsafe(no_mangle)]
extern "C" fn check_control(values: &[f64; 4], index: usize) -> f64 {
    values[index]
}
