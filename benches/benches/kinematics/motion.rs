//! Trajectories to a target state: ours and Ruckig's.

use std::ffi::{CString, c_void};
use std::hint::black_box;
use std::path::Path;
use std::ptr::NonNull;

use anyhow::{Context, ensure};
use kinematics::otg::{Input, Limits, State, Target, Trajectory};
use libloading::Library;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{Contest, Contestant};

const CALLS: usize = 128;
const ROUNDS: usize = 1000;
/// Difference of duration in seconds up to which two trajectories count as equal.
const EQUAL_S: f64 = 1e-6;

struct Problem<const N: usize> {
    start: State<N>,
    target_position: [f64; N],
    target_velocity: [f64; N],
    limits: Limits<N>,
}

impl<const N: usize> Problem<N> {
    /// Random limits, start and target. Three axes of ten start at rest, the others in a state
    /// from which the velocity limit can be kept; seven problems of ten end in motion.
    fn random(rng: &mut ChaCha8Rng) -> Self {
        let limits = Limits {
            velocity: std::array::from_fn(|_| rng.random_range(0.1..4.0)),
            acceleration: std::array::from_fn(|_| rng.random_range(0.1..8.0)),
            jerk: std::array::from_fn(|_| rng.random_range(0.2..40.0)),
        };
        let mut start = State::at_rest(std::array::from_fn(|_| rng.random_range(-2.0..2.0)));
        for axis in 0..N {
            if rng.random_bool(0.3) {
                continue;
            }
            let (v, a) = (limits.velocity[axis], limits.acceleration[axis]);
            let (velocity, acceleration) = loop {
                let (v0, a0): (f64, f64) = (rng.random_range(-v..v), rng.random_range(-a..a));
                if (v0 + a0 * a0.abs() / (2.0 * limits.jerk[axis])).abs() < v {
                    break (v0, a0);
                }
            };
            start.velocity[axis] = velocity;
            start.acceleration[axis] = acceleration;
        }
        let moving = if rng.random_bool(0.7) { 0.99 } else { 0.0 };
        Self {
            target_position: std::array::from_fn(|_| rng.random_range(-2.0..2.0)),
            target_velocity: limits
                .velocity
                .map(|v| moving * rng.random_range(-1.0..1.0) * v),
            start,
            limits,
        }
    }

    fn input(&self) -> Input<N> {
        Input {
            target: Target::Reach {
                position: self.target_position,
                velocity: self.target_velocity,
            },
            limits: self.limits,
        }
    }

    /// In the order that `ruckig.cpp` reads.
    fn numbers(&self) -> impl Iterator<Item = f64> {
        let rows = [
            self.start.position,
            self.start.velocity,
            self.start.acceleration,
            self.target_position,
            self.target_velocity,
            self.limits.velocity,
            self.limits.acceleration,
            self.limits.jerk,
        ];
        rows.into_iter().flatten()
    }
}

/// Ruckig behind `ruckig.cpp`. The problems live as long as the process.
struct Ruckig {
    problems: NonNull<c_void>,
    plan: unsafe extern "C" fn(*mut c_void),
    durations: unsafe extern "C" fn(*mut c_void, *mut f64),
}

#[allow(unsafe_code)]
impl Ruckig {
    fn open<const N: usize>(library: &Path, problems: &[Problem<N>]) -> anyhow::Result<Self> {
        type Open = unsafe extern "C" fn(*const f64, usize) -> *mut c_void;
        let numbers: Vec<f64> = problems.iter().flat_map(Problem::numbers).collect();
        let name = |what: &str| CString::new(format!("peer_{what}_{N}"));
        // SAFETY: the library was built from our own source, whose functions have these types,
        // and reads eight rows of N numbers a problem; it is never unloaded.
        unsafe {
            let library = Box::leak(Box::new(Library::new(library)?));
            let open = library.get::<Open>(name("open")?)?;
            let opened = open(numbers.as_ptr(), problems.len());
            Ok(Self {
                problems: NonNull::new(opened).context("Ruckig could not take the problems")?,
                plan: *library.get(name("plan")?)?,
                durations: *library.get(name("durations")?)?,
            })
        }
    }

    fn plan(&self) {
        // SAFETY: what `open` gave is never freed, and only this thread uses it.
        unsafe { (self.plan)(self.problems.as_ptr()) }
    }

    fn durations_s(&self, count: usize) -> Vec<f64> {
        let mut durations = vec![f64::NAN; count];
        // SAFETY: as above; one number a problem is written.
        unsafe { (self.durations)(self.problems.as_ptr(), durations.as_mut_ptr()) }
        durations
    }
}

/// Both have to solve the same problems: nearly all durations are equal, none of ours longer by
/// much. (Where Ruckig gives up, or finds a slower motion, they differ.)
fn check<const N: usize>(problems: &[Problem<N>], theirs: &[f64]) -> anyhow::Result<()> {
    let mut equal = 0;
    for (problem, theirs) in problems.iter().zip(theirs) {
        let ours = Trajectory::plan(&problem.start, &problem.input());
        let ours = ours.map_err(|refusal| anyhow::anyhow!("a problem is refused: {refusal:?}"))?;
        equal += usize::from((ours.duration_s() - theirs).abs() < EQUAL_S);
    }
    ensure!(
        equal * 100 >= problems.len() * 98,
        "Ruckig solves other problems: only {equal} of {} durations for {N} axes are equal",
        problems.len()
    );
    Ok(())
}

pub(crate) fn contest<const N: usize>(library: &Path) -> anyhow::Result<Contest> {
    let mut rng = ChaCha8Rng::seed_from_u64(N as u64);
    let problems: Vec<Problem<N>> = (0..CALLS).map(|_| Problem::random(&mut rng)).collect();
    let ruckig = Ruckig::open(library, &problems)?;
    check(&problems, &ruckig.durations_s(CALLS))?;
    let ours: Vec<_> = problems.iter().map(|p| (p.start, p.input())).collect();
    let three = N == 3;
    let name = |if_three, if_seven| if three { if_three } else { if_seven };
    Ok(Contest {
        title: name(
            "Motion generator: plan for 3 axes",
            "Motion generator: plan for 7 axes",
        ),
        calls: CALLS,
        rounds: ROUNDS,
        contestants: vec![
            Contestant {
                key: name("otg3", "otg7"),
                what: "jerk-limited planner",
                at_most: Some(1.0),
                batch: Box::new(move || {
                    for (start, input) in &ours {
                        // Written where Ruckig's is too; a refusal was ruled out above.
                        let _ = black_box(&Trajectory::plan(black_box(start), black_box(input)));
                    }
                }),
            },
            Contestant {
                key: name("ruckig3", "ruckig7"),
                what: "Ruckig 0.19.4 (C++)",
                at_most: None,
                batch: Box::new(move || ruckig.plan()),
            },
        ],
    })
}
