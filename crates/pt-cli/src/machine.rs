//! What machine this is, for receipts.

use std::env::consts::{ARCH, OS};
use std::thread::available_parallelism;

/// The name of the processor, how many threads it takes at a time, and the system.
pub(crate) fn describe() -> String {
    let cores = available_parallelism().map_or(1, usize::from);
    format!("{}, {cores} threads, {OS} {ARCH}", processor())
}

#[cfg(target_arch = "x86_64")]
fn processor() -> String {
    let brand = raw_cpuid::CpuId::new().get_processor_brand_string();
    brand
        .map_or_else(|| "processor without a name".into(), |brand| brand.as_str().trim().to_owned())
}

#[cfg(not(target_arch = "x86_64"))]
fn processor() -> String {
    "processor".into()
}
