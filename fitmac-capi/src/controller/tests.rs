use std::{ptr::null_mut, sync::mpsc, thread};

use super::*;
use crate::{config::Config, fitmac_config_init};

fn made(memory: &mut Box<std::mem::MaybeUninit<Controller>>) -> *mut Controller {
    let mut config = Box::new(std::mem::MaybeUninit::<Config>::uninit());
    let (mut c, mut handle) = (null_mut(), null_mut());
    let place = config.as_mut_ptr().cast();
    // SAFETY: memory of the types' own size.
    let status = unsafe {
        assert_eq!(
            fitmac_config_init(place, size_of::<Config>(), core::ptr::null(), &mut c),
            Status::Ok
        );
        let memory = memory.as_mut_ptr().cast();
        fitmac_controller_init(
            memory,
            size_of::<Controller>(),
            FITMAC_ABI_VERSION,
            c,
            &mut handle,
        )
    };
    assert_eq!(status, Status::Ok);
    handle
}

#[test]
fn a_panic_becomes_a_status_and_stays_one_until_a_reset() {
    let mut memory = Box::new(std::mem::MaybeUninit::uninit());
    let handle = made(&mut memory);
    // SAFETY: a controller.
    unsafe {
        let failed = with::<()>(handle, |_| panic!("on purpose: a test of the border"));
        assert_eq!(failed, Err(Status::Panicked));
        assert_eq!(with(handle, |_| Ok(())), Err(Status::Panicked));
        assert_eq!(fitmac_reset(handle), Status::Ok);
        assert_eq!(with(handle, |_| Ok(())), Ok(()));
    }
}

#[test]
fn re_entry_is_refused_at_any_depth() {
    let mut memory = Box::new(std::mem::MaybeUninit::uninit());
    let handle = made(&mut memory);
    // SAFETY: a controller.
    unsafe {
        let inner = with(handle, |_| {
            Ok([fitmac_reset(handle), fitmac_controller_deinit(handle)])
        });
        assert_eq!(inner, Ok([Status::Busy; 2]));
        assert_eq!(fitmac_reset(handle), Status::Ok);
    }
}

#[test]
fn a_second_thread_is_refused_while_the_first_is_inside() {
    let mut memory = Box::new(std::mem::MaybeUninit::uninit());
    let handle = made(&mut memory);
    let address = handle.expose_provenance();
    let (inside, is_inside) = mpsc::channel();
    let (leave, may_leave) = mpsc::channel::<()>();
    let first = thread::spawn(move || {
        let handle = core::ptr::with_exposed_provenance_mut(address);
        let wait = |_: &mut Core| {
            inside.send(()).expect("the test listens");
            may_leave.recv().map_err(|_| Status::Panicked)
        };
        // SAFETY: a controller that outlives the thread.
        unsafe { with(handle, wait) }
    });
    is_inside.recv().expect("the thread gets in");
    // SAFETY: a controller.
    assert_eq!(unsafe { fitmac_reset(handle) }, Status::Busy);
    leave.send(()).expect("the thread listens");
    assert_eq!(first.join().expect("no panic"), Ok(()));
    // SAFETY: a controller.
    assert_eq!(unsafe { fitmac_reset(handle) }, Status::Ok);
}

#[test]
fn a_moved_controller_is_none() {
    let mut memory = Box::new(std::mem::MaybeUninit::uninit());
    let handle = made(&mut memory);
    let mut moved = Box::new(std::mem::MaybeUninit::<Controller>::uninit());
    // SAFETY: both have room for a controller.
    unsafe {
        moved.as_mut_ptr().copy_from_nonoverlapping(handle, 1);
        assert_eq!(fitmac_reset(moved.as_mut_ptr()), Status::NotInitialised);
        assert_eq!(fitmac_reset(handle), Status::Ok);
    }
}
