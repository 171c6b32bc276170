//! When to try to connect again.

/// Waits that double from `first_ns` to `max_ns`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Retry {
    first_ns: u64,
    max_ns: u64,
    wait_ns: u64,
}

impl Retry {
    pub(crate) const fn new(first_ns: u64, max_ns: u64) -> Self {
        Self {
            first_ns,
            max_ns,
            wait_ns: first_ns,
        }
    }

    /// The time of the next try after one that failed at `now_ns`.
    pub(crate) fn failed(&mut self, now_ns: u64) -> u64 {
        let at_ns = now_ns.saturating_add(self.wait_ns);
        self.wait_ns = self.wait_ns.saturating_mul(2).min(self.max_ns);
        at_ns
    }

    /// The server has answered: a later failure is a new one.
    pub(crate) const fn succeeded(&mut self) {
        self.wait_ns = self.first_ns;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_a_bound_and_start_anew() {
        let mut retry = Retry::new(1, 5);
        let waits = [(); 5].map(|()| retry.failed(100) - 100);
        assert_eq!(waits, [1, 2, 4, 5, 5]);
        retry.succeeded();
        assert_eq!(retry.failed(100), 101);
        assert_eq!(retry.failed(u64::MAX), u64::MAX);
    }
}
