//! Parts of films: rectangles that are taken out, get more samples elsewhere, and are put back.

use super::{ExactSum, Film, InvalidSamples, Region, SamplePlan, aov};

impl Film {
    /// Copies the samples of a rectangle inside of the region, and their part of the plan. Rejected
    /// samples, and luminance removed by clamping, remain with this film.
    ///
    /// # Panics
    /// If the rectangle is not inside of the region.
    pub fn part(&self, region: Region) -> Self {
        let Self { first, aovs, light_groups, .. } = self;
        let cut = Cut { whole: self.region, part: region };
        let (per_pixel, ids) = (aov::sums_per_pixel(aovs), aov::ids(aovs).count());
        let plan = self.plan.as_ref().map(|plan| SamplePlan {
            densities: plan.densities.as_ref().map(|all| cut.of_pixels(all)),
            vacant: cut.of_pixels(&plan.vacant),
            ..plan.clone()
        });
        Self {
            region,
            first: *first,
            counts: cut.of(&self.counts, 1),
            sums: cut.of(&self.sums, 1),
            aovs: aovs.clone(),
            aov_sums: cut.of(&self.aov_sums, per_pixel),
            ids: cut.of(&self.ids, ids),
            light_groups: light_groups.clone(),
            group_sums: cut.of(&self.group_sums, light_groups.len()),
            invalid_samples: InvalidSamples::default(),
            removed: ExactSum::default(),
            second: self.second.as_ref().map(|second| Box::new(second.part(region))),
            plan,
        }
    }

    /// Replaces the samples of the pixels of a part, which has got more of them elsewhere, and adds
    /// its rejected samples and the luminance removed from it. The plan is unchanged.
    ///
    /// # Panics
    /// If the part has other channels, or is not inside of the region.
    pub fn put_back(&mut self, part: &Self) {
        assert!(self.has_same_layout(part), "parts of a film keep the same");
        let cut = Cut { whole: self.region, part: part.region };
        let (per_pixel, ids) = (aov::sums_per_pixel(&self.aovs), aov::ids(&self.aovs).count());
        cut.put(&mut self.counts, &part.counts, 1);
        cut.put(&mut self.sums, &part.sums, 1);
        cut.put(&mut self.aov_sums, &part.aov_sums, per_pixel);
        cut.put(&mut self.ids, &part.ids, ids);
        cut.put(&mut self.group_sums, &part.group_sums, self.light_groups.len());
        self.invalid_samples.merge(&part.invalid_samples);
        self.removed.merge(part.removed);
        if let (Some(own), Some(second)) = (&mut self.second, &part.second) {
            own.put_back(second);
        }
    }

    /// Returns true if the samples of `next`, whose region lies inside of this one's, begin where
    /// those of this film end, in each of its pixels.
    pub fn is_continued_by(&self, next: &Self) -> bool {
        let end = |[x, y]: [u32; 2]| self.first + self.counts[self.index(x, y)];
        self.has_same_layout(next) && next.region.rows().all(|pixel| end(pixel) == next.first)
    }

    /// Returns true if `part`, whose region lies inside of this one's, has the samples of this film
    /// and others.
    pub fn is_extended_by(&self, part: &Self) -> bool {
        let pairs = |own: &Self, part: &Self| {
            let rows = part.region.rows().zip(part.counts.clone());
            rows.map(|([x, y], count)| count.cmp(&own.counts[own.index(x, y)])).collect()
        };
        let mut orders: Vec<_> = pairs(self, part);
        if let (Some(own), Some(second)) = (&self.second, &part.second) {
            orders.extend(pairs(own, second));
        }
        self.has_same_layout(part)
            && self.first == part.first
            && orders.iter().all(|order| order.is_ge())
            && orders.iter().any(|order| order.is_gt())
    }
}

/// A rectangle of a larger one.
struct Cut {
    whole: Region,
    part: Region,
}

impl Cut {
    /// First items of the rows of the part, in the larger rectangle.
    fn rows(&self, per_pixel: usize) -> impl Iterator<Item = usize> {
        let Self { whole, part } = *self;
        assert!(
            part.x >= whole.x
                && part.y >= whole.y
                && part.x - whole.x + part.width <= whole.width
                && part.y - whole.y + part.height <= whole.height,
            "a part is inside of the whole"
        );
        (part.y..part.y + part.height).map(move |y| {
            let pixels = (y - whole.y) as usize * whole.width as usize;
            (pixels + (part.x - whole.x) as usize) * per_pixel
        })
    }

    /// Items of the pixels of the part.
    fn of<T: Clone>(&self, all: &[T], per_pixel: usize) -> Vec<T> {
        let width = self.part.width as usize * per_pixel;
        let mut items = Vec::with_capacity(width * self.part.height as usize);
        self.rows(per_pixel).for_each(|row| items.extend_from_slice(&all[row..][..width]));
        items
    }

    /// One item for each pixel, or none if there are none.
    fn of_pixels<T: Clone>(&self, all: &[T]) -> Vec<T> {
        if all.is_empty() { Vec::new() } else { self.of(all, 1) }
    }

    /// Replaces the items of the pixels of the part.
    fn put<T: Clone>(&self, all: &mut [T], items: &[T], per_pixel: usize) {
        let width = self.part.width as usize * per_pixel;
        for (i, row) in self.rows(per_pixel).enumerate() {
            all[row..][..width].clone_from_slice(&items[i * width..][..width]);
        }
    }
}
