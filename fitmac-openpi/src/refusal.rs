//! Why an answer of the server is not used.

/// Why an answer is refused as a whole. Nothing of it reaches the robot.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// The server sent the traceback of a failure instead of an answer.
    #[error("the server failed: {last_line}")]
    ServerFailed {
        /// The last line of the traceback, cleaned and cut.
        last_line: String,
    },
    /// The answer is larger than allowed.
    #[error("the answer is larger than {max_bytes} bytes")]
    Oversized {
        /// The bound.
        max_bytes: usize,
    },
    /// Something is not built as the protocol has it.
    #[error("`{field}` {problem}")]
    Malformed {
        /// The part of the answer.
        field: &'static str,
        /// What is wrong with it.
        problem: String,
    },
    /// Numbers of a kind that is not read.
    #[error("`{field}` holds numbers of dtype {dtype:?}; float32 and float64 are read")]
    Format {
        /// The part of the answer.
        field: &'static str,
        /// The dtype, as numpy names it.
        dtype: String,
    },
    /// An array of another shape.
    #[error("`{field}` has the shape {shape:?}, not [horizon, {columns}]")]
    Shape {
        /// The part of the answer.
        field: &'static str,
        /// The shape that came.
        shape: Vec<u64>,
        /// Columns that it should have.
        columns: usize,
    },
    /// A number of actions other than declared.
    #[error("the answer has {actions} actions, declared are {declared}")]
    Horizon {
        /// The number that came.
        actions: usize,
        /// The number that was declared.
        declared: usize,
    },
    /// A number that is NaN or infinite.
    #[error("action {row}, component {column} is {value}")]
    NotFinite {
        /// The action, from 0.
        row: usize,
        /// The component, from 0.
        column: usize,
        /// What it is.
        value: f64,
    },
    /// An increment that the declared action space does not have.
    #[error(
        "action {row}, component {column} is {value}: normalised increments lie in [-1, 1]; is \
         the declared action space right?"
    )]
    OutOfRange {
        /// The action, from 0.
        row: usize,
        /// The component, from 0.
        column: usize,
        /// What it is.
        value: f64,
    },
    /// A gripper number that the declared convention does not have.
    #[error(
        "action {row} has {value} for the gripper, declared is {declared}; is that the policy's \
         convention?"
    )]
    GripperConvention {
        /// The action, from 0.
        row: usize,
        /// What it is.
        value: f64,
        /// The declared convention.
        declared: &'static str,
    },
    /// A frame came that nothing was asked for.
    #[error("the server sent something that was not asked for")]
    Unsolicited,
}

impl Refusal {
    /// The name that counters and logs use.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::ServerFailed { .. } => "server_failed",
            Self::Oversized { .. } => "oversized",
            Self::Malformed { .. } => "malformed",
            Self::Format { .. } => "format",
            Self::Shape { .. } => "shape",
            Self::Horizon { .. } => "horizon",
            Self::NotFinite { .. } => "not_finite",
            Self::OutOfRange { .. } => "out_of_range",
            Self::GripperConvention { .. } => "gripper_convention",
            Self::Unsolicited => "unsolicited",
        }
    }

    pub(crate) fn malformed(field: &'static str, problem: &str) -> Self {
        Self::Malformed {
            field,
            problem: problem.to_owned(),
        }
    }

    /// A refusal for a server's traceback. The text is untrusted: only printable characters of
    /// its last line are kept.
    pub(crate) fn server_failed(traceback: &str) -> Self {
        const LINE_MAX: usize = 200;
        let line = traceback.lines().rev().find(|line| !line.trim().is_empty());
        let clean = line.unwrap_or("without a word").trim().chars();
        let last_line = clean
            .map(|c| if c.is_control() { '?' } else { c })
            .take(LINE_MAX)
            .collect();
        Self::ServerFailed { last_line }
    }
}
