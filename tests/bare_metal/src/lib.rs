//! What firmware would link: the tick, and the kinematics of the Panda. Nothing here needs an
//! operating system, a heap or the standard library; `cargo xtask bare-metal` builds it and reads
//! the sizes of the objects below.
#![no_std]
#![no_main]

use core::mem::size_of;

use fitmac_core::{
    Controller,
    message::{Input, Output},
};
use kinematics::{Arm, panda::Panda};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}

/// As many bytes as a controller has on this processor.
#[unsafe(no_mangle)]
pub static FITMAC_CONTROLLER: [u8; size_of::<Controller>()] = [0; size_of::<Controller>()];

/// As many bytes as the answer of a tick has.
#[unsafe(no_mangle)]
pub static FITMAC_OUTPUT: [u8; size_of::<Output>()] = [0; size_of::<Output>()];

/// One tick.
#[unsafe(no_mangle)]
pub extern "C" fn fitmac_tick(
    controller: &mut Controller,
    now_ns: u64,
    input: &Input<'_>,
    output: &mut Output,
) {
    *output = controller.tick(now_ns, input);
}

/// The tip's position for joint angles in radians; false where they are no numbers.
#[unsafe(no_mangle)]
pub extern "C" fn panda_tip(q: &[f64; 7], position_m: &mut [f64; 3]) -> bool {
    match Panda.solve(q) {
        Ok(solution) => {
            *position_m = solution.tip.position;
            true
        }
        Err(_) => false,
    }
}
