//! Replacement for `avx512.rs` on other processors.

use super::frustum_cull::Met;
use super::group::RayGroup;
use super::packet::RayPacket;
use super::{Queues, Stacks};
use crate::wide::WideNode;

/// Uninhabited: AVX-512 is not available.
#[derive(Clone, Copy, Debug)]
pub(in crate::wide) enum Avx512 {}

impl Avx512 {
    pub(in crate::wide) fn detect() -> Option<Self> {
        None
    }

    pub(super) fn test_fan<const ANY: bool>(
        self,
        _: &mut RayGroup,
        _: RayPacket<'_>,
        _: &Met,
    ) -> bool {
        match self {}
    }

    pub(super) fn test_triangles<const ANY: bool>(
        self,
        _: &mut RayGroup,
        _: RayPacket<'_>,
        _: u32,
    ) -> bool {
        match self {}
    }

    pub(super) fn enter<const ANY: bool>(
        self,
        _: &mut RayGroup,
        _: &mut Stacks,
        _: &mut Queues,
        _: &[WideNode],
        _: usize,
        _: u32,
    ) -> u32 {
        match self {}
    }
}
