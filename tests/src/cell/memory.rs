//! Keeps what the controller tells of its ticks.

use std::{
    io,
    sync::{Arc, Mutex},
};

use fitmac_rt::{frame::Tick, telemetry::Consume};

/// Every tick in order; a clone sees the same ones.
#[derive(Clone, Default)]
pub struct Memory(Arc<Mutex<Vec<Tick>>>);

impl Memory {
    /// What was told so far.
    ///
    /// # Panics
    /// If the recorder has panicked.
    #[must_use]
    pub fn ticks(&self) -> Vec<Tick> {
        self.0.lock().expect("no panic").clone()
    }
}

impl Consume for Memory {
    fn tick(&mut self, tick: &Tick) -> io::Result<()> {
        self.0.lock().expect("no panic").push(tick.clone());
        Ok(())
    }

    fn finish(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn name(&self) -> String {
        "memory".into()
    }
}
