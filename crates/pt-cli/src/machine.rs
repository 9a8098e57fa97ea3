//! Description of the machine for provenance metadata.

use std::env::consts::{ARCH, OS};
use std::thread::available_parallelism;

/// Returns the name of the processor, its number of threads, and the operating system.
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
