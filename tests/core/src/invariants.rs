//! The invariants of the core: what each says, and which tests show it.
//!
//! A test names its number; `tests/core/tests/all/invariants/index.rs` fails if a
//! number is missing, if a test that is named here does not exist, or if one
//! that exists is not named.

/// One invariant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Invariant {
    /// Its number.
    pub number: u32,
    /// Its section.
    pub section: Section,
    /// What holds.
    pub statement: &'static str,
    /// Where it is tested: a file of the workspace.
    pub files: &'static [&'static str],
}

/// What an invariant is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    /// What leaves the core is safe.
    Output,
    /// One route a query.
    Routing,
    /// The gate.
    Gate,
    /// Monitor and diagnosis.
    Diagnosis,
    /// Phases and the steps of a recovery.
    Phases,
    /// Lock and grounding.
    Lock,
    /// Budgets.
    Budget,
    /// Determinism, totality, resources.
    Determinism,
}

impl Section {
    /// Its heading.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Output => "What leaves the core, in every tick",
            Self::Routing => "Routing (Algorithm 1)",
            Self::Gate => "The gate",
            Self::Diagnosis => "Monitor and diagnosis",
            Self::Phases => "Phases and the steps of a recovery",
            Self::Lock => "Lock and grounding",
            Self::Budget => "Budgets",
            Self::Determinism => "Determinism, totality, resources",
        }
    }
}

const LOOP_OUTPUT: &str = "tests/core/tests/all/invariants/output.rs";
const LOOP_ROUTING: &str = "tests/core/tests/all/invariants/routing.rs";
const LOOP_GATE: &str = "tests/core/tests/all/invariants/gate.rs";
const LOOP_MONITOR: &str = "tests/core/tests/all/invariants/monitor.rs";
const LOOP_PHASES: &str = "tests/core/tests/all/invariants/phases.rs";
const LOOP_LOCK: &str = "tests/core/tests/all/invariants/lock.rs";
const LOOP_BUDGET: &str = "tests/core/tests/all/invariants/budget.rs";
const LOOP_DETERMINISM: &str = "tests/core/tests/all/invariants/determinism.rs";
const CORE_GATE: &str = "fitmac-core/src/gate/tests.rs";
const CORE_DIAGNOSIS: &str = "fitmac-core/src/diagnosis/tests.rs";
const CORE_MONITOR: &str = "fitmac-core/src/monitor/tests.rs";

macro_rules! invariants {
    ($($number:literal $section:ident $statement:literal in $($file:expr),+;)+) => {
        /// All of them, by number.
        pub const INVARIANTS: &[Invariant] = &[$(Invariant {
            number: $number,
            section: Section::$section,
            statement: $statement,
            files: &[$($file,)+],
        },)+];
    };
}

invariants! {
    1 Output "Every number of a command is finite, whatever bits the input holds." in LOOP_OUTPUT;
    2 Output "A recovery's action lies in [-1, 1], its gripper is -1 or +1." in LOOP_OUTPUT;
    3 Output "A recovery's rotation is +0.0, bit for bit (equation 9). In the guarded profile it may differ from zero while the hand is levelled or turned above the target, and nowhere else." in LOOP_OUTPUT;
    4 Output "A recovery's translation is equation 8, to the bit." in LOOP_OUTPUT;
    5 Output "A waypoint or pose that is not finite gives no action; a NaN is never clipped." in LOOP_OUTPUT;
    6 Output "An accepted action of the base policy leaves bit for bit, negative zero and subnormal numbers included." in LOOP_OUTPUT;
    7 Output "Target correction never replaces an action." in LOOP_OUTPUT;
    8 Output "An action outside the box is clamped and flagged, or its chunk is refused; the flag stands if and only if it was clamped." in LOOP_OUTPUT;
    9 Output "A hold has no increment and keeps the gripper; no fault opens it." in LOOP_OUTPUT;
    10 Output "From tick to tick the setpoint keeps the limits on speed, acceleration and jerk against the last command, across every seam." in LOOP_OUTPUT;
    11 Output "Each tick gives exactly one command, numbered one higher than the last." in LOOP_OUTPUT;
    12 Routing "One route a query: pending before target, target before execution, execution before base." in LOOP_ROUTING;
    13 Routing "A pending, valid correction goes on whatever the gate says." in LOOP_ROUTING;
    14 Routing "Target correction is taken when it is allowed and no correction is pending." in LOOP_ROUTING;
    15 Routing "The route changes only at a query; a fault may override it, and then the mode says so." in LOOP_ROUTING;
    16 Routing "When a correction gives no action the base policy acts in the same query, and nothing stays pending." in LOOP_ROUTING;
    17 Routing "A refill takes min(H_eff, |A|) actions (equation 12), never none." in LOOP_ROUTING;
    18 Routing "A pending correction emits one action a query." in LOOP_ROUTING;
    19 Routing "No action that was queued before a correction is executed after it began." in LOOP_ROUTING;
    20 Routing "No action of an older grounding epoch is executed after a newer one was committed." in LOOP_ROUTING;
    21 Gate "Execution correction needs the failure streak and the confidence streak, or strong evidence." in CORE_GATE;
    22 Gate "Target correction needs the failure streak, or strong evidence." in CORE_GATE;
    23 Gate "A streak grows by one for a failure of the same kind, restarts at one for another kind, and is cleared by a query without a failure." in CORE_GATE, LOOP_GATE;
    24 Gate "Streaks saturate, they never wrap." in CORE_GATE, LOOP_GATE;
    25 Gate "A query without a failure authorises nothing new." in CORE_GATE;
    26 Gate "A diagnosis alone authorises nothing, and a closed gate names its reasons." in CORE_GATE;
    27 Gate "In an attempt younger than the rescue step, evidence from time alone counts for nothing." in CORE_GATE, CORE_DIAGNOSIS;
    28 Gate "Recognised progress keeps the gate closed unless the evidence is strong." in CORE_GATE;
    29 Gate "A target below the gate's confidence drives no waypoint." in CORE_GATE;
    30 Gate "A confidence that is no number in [0, 1] is zero; the critic alone moves nothing." in CORE_DIAGNOSIS, LOOP_GATE;
    31 Gate "One query opens one way at most." in CORE_GATE;
    32 Gate "A lower failure threshold opens the gate no later." in CORE_GATE, LOOP_GATE;
    33 Gate "Stronger evidence takes no authorisation away." in CORE_GATE, CORE_DIAGNOSIS;
    34 Diagnosis "One diagnosis, the target's before the execution's (equation 7)." in CORE_DIAGNOSIS;
    35 Diagnosis "A pick phase has no place failure, nor the reverse." in CORE_DIAGNOSIS;
    36 Diagnosis "A stall is W steps without progress in this phase, never earlier (equation 6)." in CORE_MONITOR;
    37 Diagnosis "A phase times out after its last allowed step, not at it." in CORE_MONITOR;
    38 Diagnosis "After a rebind no step of the old target enters a difference." in LOOP_LOCK;
    39 Diagnosis "A missing pose is neither progress nor a step of a stall." in CORE_MONITOR, LOOP_MONITOR;
    40 Diagnosis "A repeated input changes nothing; more control ticks change no decision." in LOOP_MONITOR;
    41 Diagnosis "Where the scene stands changes no decision." in LOOP_MONITOR;
    42 Diagnosis "The monitor reads and never commands." in LOOP_MONITOR;
    43 Phases "The phase changes along declared edges only." in LOOP_PHASES;
    44 Phases "A place phase begins only with carrying evidence." in LOOP_PHASES;
    45 Phases "A recovery opens the hand before the grasp, for another try, and at the release; never on the way." in LOOP_PHASES;
    46 Phases "It releases only above the destination region, and low." in LOOP_PHASES;
    47 Phases "Settling keeps the hand open, never lowers it, and ends." in LOOP_PHASES;
    48 Phases "Geometry places only at a direct destination." in LOOP_PHASES;
    49 Phases "Under constant input every correction ends within its budget." in LOOP_PHASES;
    50 Phases "A byte that names no member of its vocabulary is an error, and its message is refused." in LOOP_PHASES;
    51 Lock "The locked instance changes only in a target query, or with the subtask." in LOOP_LOCK;
    52 Lock "A pending correction keeps the lock." in LOOP_LOCK;
    53 Lock "A new subtask begins with nothing of the last." in LOOP_LOCK;
    54 Lock "Epochs rise, and a question carries the committed one." in LOOP_LOCK;
    55 Lock "The closest candidate is the arg-min of equation 4; ties go to the lowest id, a NaN is left out, an empty set gives none." in LOOP_LOCK;
    56 Lock "A choice outside the candidates, or too many of them, is refused." in LOOP_LOCK;
    57 Budget "Each query of a correction costs one, nothing gives it back, and the budget bounds the queries." in LOOP_BUDGET;
    58 Budget "With the budget spent, the base policy acts in the same query." in LOOP_BUDGET;
    59 Budget "A correction whose validity is lost ends in that query." in LOOP_BUDGET;
    60 Budget "Corrections of a subtask are limited in number, and a cool-down lies between them." in LOOP_BUDGET;
    61 Budget "After success no action of a recovery follows." in LOOP_BUDGET;
    62 Determinism "The same inputs give the same outputs and state, bit for bit, in every build profile." in LOOP_DETERMINISM, "tests/tests/core_replay.rs";
    63 Determinism "Any time and any input give a command; no panic can be reached." in LOOP_DETERMINISM, "tests/tests/no_panic.rs";
    64 Determinism "A tick allocates nothing." in "tests/tests/core_no_alloc.rs";
    65 Determinism "A tick's instructions are bounded, and counted." in "tests/tests/core_instructions.rs";
    66 Determinism "Messages have no padding and a fixed size; the state is small." in LOOP_DETERMINISM;
    67 Determinism "A restored snapshot goes on as if nothing had happened." in LOOP_DETERMINISM;
    68 Determinism "Parameters are checked once; each bound holds at its edge, and all violations are named at once." in LOOP_DETERMINISM;
    69 Determinism "A command carries reasons if and only if its mode or its route is not the plain one." in LOOP_DETERMINISM;
    70 Determinism "Who reads the trace changes nothing." in LOOP_DETERMINISM;
}
