//! What can go wrong when a scene is read, built or run.

/// An error of the harness. Each names what is wrong and where.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    /// A data file does not have the shape it should have.
    #[error("{file}: {message}")]
    Data {
        /// The file, or the name of the embedded one.
        file: String,
        /// What is wrong, with line and key.
        message: String,
    },
    /// A value of a data file is out of range or contradicts another.
    #[error("{what}: {problem}")]
    Invalid {
        /// The thing that has the value, by name.
        what: String,
        /// What is wrong and what would be right.
        problem: String,
    },
    /// A name that the library or the suite does not have.
    #[error("unknown {what} `{name}`; known are: {known}")]
    Unknown {
        /// What was looked up.
        what: &'static str,
        /// The name that was not found.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// An error in one part of something larger.
    #[error("{place}: {cause}")]
    Within {
        /// The part: a file, a task, an object, a field.
        place: String,
        /// What is wrong there.
        cause: Box<SimError>,
    },
    /// Results of another version of the program.
    #[error(
        "{path}: its episodes were played by build {found}, this program is build {own}: they are not mixed; \
         evaluate into another folder, or, if you know that the two decide alike, add `--accept-build {found}`"
    )]
    OtherBuild {
        /// The file of results.
        path: String,
        /// The build that played them.
        found: String,
        /// The build of this program.
        own: String,
    },
    /// Another program writes the same results.
    #[error(
        "{path}: another evaluation writes there: wait for its end, or give this one another `--out` or `--shard`"
    )]
    Busy {
        /// The file that is locked.
        path: String,
    },
    /// MuJoCo refused the compiled scene.
    #[error("MuJoCo refused the scene: {0}")]
    Compile(String),
    /// The physics diverged.
    #[error("the physics diverged at {time_s:.3} s: {what}")]
    Diverged {
        /// Simulated time, s.
        time_s: f64,
        /// What was found.
        what: String,
    },
    /// The loaded MuJoCo library is not the one that this program was built for.
    #[error(
        "libmujoco is version {found}, this program needs {needed}; run `cargo xtask setup` and link against third_party/mujoco/lib"
    )]
    Version {
        /// Version found.
        found: String,
        /// Version needed.
        needed: String,
    },
    /// A file could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// The cause.
        source: std::io::Error,
    },
    /// A picture could not be drawn.
    #[error("cannot draw {what}: {problem}")]
    Picture {
        /// Which picture.
        what: String,
        /// The cause.
        problem: String,
    },
}

impl SimError {
    /// A value of a data file is wrong.
    pub(crate) fn invalid(what: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Invalid {
            what: what.into(),
            problem: problem.into(),
        }
    }

    /// A name is not in a list.
    pub(crate) fn unknown<'a>(
        what: &'static str,
        name: &str,
        known: impl IntoIterator<Item = &'a str>,
    ) -> Self {
        let known = known.into_iter().collect::<Vec<_>>().join(", ");
        Self::Unknown {
            what,
            name: name.to_owned(),
            known,
        }
    }

    /// The same error, with the part that it is in before it.
    pub(crate) fn within(self, place: impl Into<String>) -> Self {
        Self::Within {
            place: place.into(),
            cause: Box::new(self),
        }
    }

    /// Whether what was given is wrong, and not the machine: trying again gives the same.
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Data { .. }
            | Self::Invalid { .. }
            | Self::Unknown { .. }
            | Self::OtherBuild { .. } => true,
            Self::Within { cause, .. } => cause.is_bad_input(),
            Self::Compile(_)
            | Self::Diverged { .. }
            | Self::Version { .. }
            | Self::Io { .. }
            | Self::Busy { .. }
            | Self::Picture { .. } => false,
        }
    }

    /// A file could not be read or written.
    pub(crate) fn io(path: &std::path::Path, source: std::io::Error) -> Self {
        Self::Io {
            path: path.display().to_string(),
            source,
        }
    }
}
