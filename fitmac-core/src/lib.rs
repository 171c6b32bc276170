//! The FIT-MAC decision core.
#![no_std]
#![forbid(unsafe_code)]
