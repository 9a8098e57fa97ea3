//! Check of the instruction sets that the program is compiled for.

/// Checks the value of `PATHTRACER_SIMD`, and that the processor has the instruction sets of the
/// x86-64 build: AVX, AVX2, FMA and BMI2.
///
/// # Errors
/// A message with the unknown value, or with the missing instruction sets.
#[cfg(target_arch = "x86_64")]
#[inline(never)]
pub(crate) fn check() -> Result<(), String> {
    match std::env::var_os("PATHTRACER_SIMD") {
        Some(simd) if simd != "avx2" && simd != "avx512" => {
            return Err(format!(
                "found PATHTRACER_SIMD={}, expected avx2 (without AVX-512) or avx512 (the default, \
                 where supported)",
                simd.display()
            ));
        }
        _ => {}
    }
    let cpuid = raw_cpuid::CpuId::new();
    let basic = cpuid.get_feature_info();
    let extended = cpuid.get_extended_feature_info();
    let has = |name, there: Option<bool>| (name, there.unwrap_or(false));
    let wanted = [
        has("AVX", basic.as_ref().map(raw_cpuid::FeatureInfo::has_avx)),
        has("FMA", basic.as_ref().map(raw_cpuid::FeatureInfo::has_fma)),
        has("AVX2", extended.as_ref().map(raw_cpuid::ExtendedFeatures::has_avx2)),
        has("BMI2", extended.as_ref().map(raw_cpuid::ExtendedFeatures::has_bmi2)),
    ];
    let missing: Vec<_> =
        wanted.iter().filter(|(_, there)| !there).map(|(name, _)| *name).collect();
    if missing.is_empty() {
        return Ok(());
    }
    Err(format!(
        "this build requires the x86-64-v3 level (2013 and later), but this processor does not \
         support {}. Build for this machine: RUSTFLAGS=\"-C target-cpu=native\" cargo build \
         --release",
        missing.join(", ")
    ))
}

/// Other architectures require no instruction sets beyond their baseline.
#[cfg(not(target_arch = "x86_64"))]
pub(crate) fn check() -> Result<(), String> {
    Ok(())
}
