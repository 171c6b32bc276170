//! The tip's frame and its Jacobian: ours, Pinocchio's and `k`'s.

use std::ffi::{CStr, CString, c_char, c_void};
use std::hint::black_box;
use std::path::Path;
use std::ptr::NonNull;

use anyhow::{Context, ensure};
use fitmac_benches::peers;
use kinematics::arm::Arm;
use kinematics::chain::Solution;
use kinematics::panda::{self, JOINTS, Panda};
use libloading::Library;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{Contest, Contestant};

const CALLS: usize = 256;
const ROUNDS: usize = 2000;
const TIP: &CStr = c"panda_hand_tcp";
/// Largest difference of a number between two solvers: metres, or none.
const AGREEMENT: f64 = 1e-12;

type Configuration = [f64; JOINTS];
/// Position, rotation row by row, Jacobian column by column.
type Numbers = [f64; 3 + 9 + 6 * JOINTS];

fn configurations() -> Vec<Configuration> {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut one = || panda::LIMITS.map(|limit| rng.random_range(limit.lower..limit.upper));
    (0..CALLS).map(|_| one()).collect()
}

fn numbers(solution: &Solution<JOINTS>) -> Numbers {
    let tip = &solution.tip;
    let rotation = tip.rotation.iter().flatten();
    let jacobian = solution.jacobian.columns.iter().flatten();
    let mut all = tip.position.iter().chain(rotation).chain(jacobian).copied();
    std::array::from_fn(|_| all.next().unwrap_or(f64::NAN))
}

/// Pinocchio behind `pinocchio.cpp`. The model lives as long as the process.
struct Pinocchio {
    model: NonNull<c_void>,
    solve: unsafe extern "C" fn(*mut c_void, *const f64, usize),
    result: unsafe extern "C" fn(*mut c_void, *const f64, *mut f64),
}

#[allow(unsafe_code)]
impl Pinocchio {
    fn open(library: &Path, urdf: &Path) -> anyhow::Result<Self> {
        type Open = unsafe extern "C" fn(*const c_char, *const c_char, usize) -> *mut c_void;
        let urdf = CString::new(urdf.as_os_str().as_encoded_bytes())?;
        // SAFETY: the library was built from our own source, whose functions have these types;
        // it is never unloaded. The strings live through the call.
        unsafe {
            let library = Box::leak(Box::new(Library::new(library)?));
            let open = library.get::<Open>(c"peer_open")?;
            let model = open(urdf.as_ptr(), TIP.as_ptr(), JOINTS);
            Ok(Self {
                model: NonNull::new(model).context("Pinocchio could not read the Panda")?,
                solve: *library.get(c"peer_solve")?,
                result: *library.get(c"peer_result")?,
            })
        }
    }

    fn solve(&self, q: &[Configuration]) {
        // SAFETY: `q` holds that many configurations of as many joints as the model was opened
        // with.
        unsafe { (self.solve)(self.model.as_ptr(), q.as_ptr().cast(), q.len()) }
    }

    fn result(&self, q: &Configuration) -> Numbers {
        let mut out = [f64::NAN; size_of::<Numbers>() / size_of::<f64>()];
        // SAFETY: as above; `out` has room for what is written.
        unsafe { (self.result)(self.model.as_ptr(), q.as_ptr(), out.as_mut_ptr()) }
        out
    }
}

/// The crate `k`.
struct K {
    arm: k::SerialChain<f64>,
}

impl K {
    fn open(urdf: &Path) -> anyhow::Result<Self> {
        let chain = k::Chain::from_urdf_file(urdf)?;
        let tip = TIP.to_str()?;
        let tip = chain.find_link(tip).context("k has not found the tip")?;
        Ok(Self {
            arm: k::SerialChain::from_end(tip),
        })
    }

    fn solve(&self, q: &Configuration) -> (k::Isometry3<f64>, k::nalgebra::DMatrix<f64>) {
        self.arm.set_joint_positions_unchecked(q);
        (self.arm.end_transform(), k::jacobian(&self.arm))
    }

    fn result(&self, q: &Configuration) -> Numbers {
        let (tip, jacobian) = self.solve(q);
        let rotation = tip.rotation.to_rotation_matrix();
        let rotation = rotation.matrix().transpose();
        let position = tip.translation.vector;
        let mut all = position.iter().chain(&rotation).chain(&jacobian).copied();
        std::array::from_fn(|_| all.next().unwrap_or(f64::NAN))
    }
}

fn check(who: &str, ours: &Numbers, theirs: &Numbers) -> anyhow::Result<()> {
    // A NaN is a difference too.
    let near = |(a, b): (&f64, &f64)| (a - b).abs() < AGREEMENT;
    let agree = ours.iter().zip(theirs).all(near);
    ensure!(
        agree,
        "{who} solves another problem: {theirs:?} instead of {ours:?}"
    );
    Ok(())
}

pub(crate) fn contest(library: &Path) -> anyhow::Result<Contest> {
    let urdf = peers::source("panda.urdf");
    let pinocchio = Pinocchio::open(library, &urdf)?;
    let k = K::open(&urdf)?;
    let chain = panda::chain()?;
    let q: &'static [Configuration] = Box::leak(configurations().into_boxed_slice());
    for q in q {
        let ours = numbers(&chain.solve(q)?);
        check("the Panda constant", &ours, &numbers(&Panda.solve(q)?))?;
        check("Pinocchio", &ours, &pinocchio.result(q))?;
        check("the crate k", &ours, &k.result(q))?;
    }
    let contestant = |key, what, at_most, batch| Contestant {
        key,
        what,
        at_most,
        batch,
    };
    Ok(Contest {
        title: "Panda: frame of the tip and Jacobian",
        calls: CALLS,
        rounds: ROUNDS,
        contestants: vec![
            contestant(
                "chain",
                "general chain",
                Some(0.25),
                Box::new(move || {
                    for q in q {
                        black_box(&black_box(&chain).solve(black_box(q)));
                    }
                }),
            ),
            contestant(
                "panda",
                "Panda constant",
                Some(0.18),
                Box::new(move || {
                    for q in q {
                        black_box(&Panda.solve(black_box(q)));
                    }
                }),
            ),
            contestant(
                "pinocchio",
                "Pinocchio 4.1.0 (C++)",
                None,
                Box::new(move || pinocchio.solve(black_box(q))),
            ),
            contestant(
                "k",
                "crate k 0.32.0",
                None,
                Box::new(move || {
                    for q in q {
                        black_box(&k.solve(black_box(q)));
                    }
                }),
            ),
        ],
    })
}
