//! Adaptive order in which packets of occlusion rays visit children: by hit probability and cost
//! (`occlusion_order.rs`), or near to far.
//!
//! If a wall is behind plants, the wall is hit sooner; if triangles are as small as pixels, the
//! nearest ones are hit. The better order is estimated from the work of preceding packets.

use super::packet::Work;

/// Mean work of packets in both orders.
#[derive(Clone, Copy, Default)]
pub(super) struct OcclusionOrders {
    /// Mean visits, times [`MEMORY`]: by occlusion order, near to far.
    visits: [u32; 2],
    packets: u32,
}

/// Approximate number of packets in the moving average.
const MEMORY: u32 = 8;
/// One of this many packets uses the order that seems worse.
const TRIAL: u32 = 16;

impl OcclusionOrders {
    /// Returns true if the next packet visits children near to far.
    pub(super) fn near_first(&mut self) -> bool {
        self.packets = self.packets.wrapping_add(1);
        let is_better = self.visits[1] < self.visits[0];
        is_better ^ self.packets.is_multiple_of(TRIAL)
    }

    /// Records the work of a packet that used this order.
    pub(super) fn learn(&mut self, near_first: bool, work: Work) {
        let visits = &mut self.visits[usize::from(near_first)];
        *visits = *visits - *visits / MEMORY + work.visits;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the number of packets of a hundred that visit near to far, given the visits in both
    /// orders.
    fn near_of_hundred(orders: &mut OcclusionOrders, visits: [u32; 2]) -> usize {
        let take = |_: &usize| {
            let near_first = orders.near_first();
            orders.learn(near_first, Work { visits: visits[usize::from(near_first)], tests: 0 });
            near_first
        };
        (0..100).filter(take).count()
    }

    #[test]
    fn most_packets_take_the_better_order_also_after_it_changed() {
        let mut orders = OcclusionOrders::default();
        for (visits, most) in [([30, 20], true), ([20, 30], false), ([1000, 3], true)] {
            near_of_hundred(&mut orders, visits);
            near_of_hundred(&mut orders, visits);
            let near = near_of_hundred(&mut orders, visits);
            assert!(if most { near > 90 } else { near < 10 }, "{near} of 100 for {visits:?}");
        }
    }
}
