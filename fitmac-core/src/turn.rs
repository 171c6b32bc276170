//! Whose turn it is: what the next policy step waits for.

/// What is awaited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Waiting {
    /// The policy's answer to this query, of which `horizon` actions may be
    /// executed.
    Chunk {
        /// `H_eff` of the query.
        horizon: u32,
    },
    /// The agents' answer to a rebind request; the arm stands still.
    Grounding {
        /// Since when.
        since_ns: u64,
    },
}

/// What the next policy step waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// So many steps of standing still before the first query.
    Settling(u32),
    /// The queue is empty: a query is due at the next step.
    Due,
    /// A query was decided and waits.
    Waiting(Waiting),
    /// The queue is played.
    Playing,
}
