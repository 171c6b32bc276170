//! Shared-memory services, the real-time loop, watchdogs and the recorder.
