//! Queries on their way through the tree over user primitives.

use pt_math::Ray;

use crate::node::Bvh2;
use crate::ray::Prepared;
use crate::traverse::Walk;

/// What is left of a query: the ray as far as it matters, what it has found, and where to go on.
#[derive(Debug)]
pub(super) struct Query<'a, B> {
    walk: Walk<'a>,
    widening: &'a [f32],
    ray: Ray,
    best: Option<B>,
}

impl<'a, B> Query<'a, B> {
    /// `None` for a ray that cannot hit anything.
    pub(super) fn new(tree: &'a Bvh2, widening: &'a [f32], ray: &Ray) -> Option<Self> {
        let prepared = Prepared::new(ray, &tree.bounds())?;
        let ray = Ray { t_min: prepared.t_min, ..*ray };
        Some(Self { walk: Walk::new(tree, prepared), widening, ray, best: None })
    }

    /// The next primitive that may be hit.
    #[inline]
    pub(super) fn next(&mut self) -> Option<u32> {
        let ids = self.walk.next(self.ray.t_max, |node| self.widening[node])?;
        Some(ids[0]) // each leaf has one
    }

    /// The ray, as far as hits matter.
    #[inline]
    pub(super) fn ray(&self) -> &Ray {
        &self.ray
    }

    /// What was found.
    pub(super) fn best(self) -> Option<B> {
        self.best
    }

    /// Ends the query.
    pub(super) fn finish(&mut self, best: B) {
        self.best = Some(best);
        self.walk.stop();
    }
}

impl<H> Query<'_, (u32, H)> {
    /// Takes the hit of a primitive if it is better than what there is: of two hits with equal t,
    /// the one with the lower number is.
    #[inline]
    pub(super) fn offer(&mut self, t: f32, id: u32, hit: H) {
        // The ray ends just beyond the best hit.
        let is_equal = t.next_up() == self.ray.t_max;
        let is_later = is_equal && self.best.as_ref().is_some_and(|(best, _)| *best < id);
        if t > self.ray.t_min && t < self.ray.t_max && !is_later {
            self.ray.t_max = t.next_up();
            self.best = Some((id, hit));
        }
    }
}

/// Brings all queries to their ends. Those that come to the same primitive at the same time `ask`
/// it together, and each will `take` its answer.
pub(super) fn advance<B, A>(
    queries: &mut [Query<'_, B>],
    mut ask: impl FnMut(u32, &[Ray], &mut Vec<A>),
    take: impl Fn(&mut Query<'_, B>, u32, A),
) {
    let (mut asking, mut rays, mut answers) = (Vec::new(), Vec::new(), Vec::new());
    loop {
        let next = queries.iter_mut().enumerate();
        asking.extend(next.filter_map(|(i, query)| Some((query.next()?, i))));
        if asking.is_empty() {
            return;
        }
        asking.sort_unstable();
        for same in asking.chunk_by(|a, b| a.0 == b.0) {
            let id = same[0].0;
            rays.clear();
            rays.extend(same.iter().map(|&(_, i)| queries[i].ray));
            ask(id, &rays, &mut answers);
            for (&(_, i), answer) in same.iter().zip(answers.drain(..)) {
                take(&mut queries[i], id, answer);
            }
        }
        asking.clear();
    }
}
