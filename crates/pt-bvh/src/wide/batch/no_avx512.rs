//! In place of `avx512.rs` on other processors.

use super::fan::Met;
use super::group::Group;
use super::packet::Packet;

/// There is none.
#[derive(Clone, Copy, Debug)]
pub(in crate::wide) enum Avx512 {}

impl Avx512 {
    pub(in crate::wide) fn detect() -> Option<Self> {
        None
    }

    pub(super) fn test_fan<const ANY: bool>(self, _: &mut Group, _: Packet<'_>, _: &Met) -> bool {
        match self {}
    }

    pub(super) fn test_triangles<const ANY: bool>(
        self,
        _: &mut Group,
        _: Packet<'_>,
        _: u32,
    ) -> bool {
        match self {}
    }
}
